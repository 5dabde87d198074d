//! Puts many scans into one frame: from the scans to their poses.
//!
//! [`reconstruct`] registers every pair with shared lengths, reconciles the poses by loops and a robust pose graph
//! (`congruent-multiway`), and refines all scans together. Programs that choose the pairs themselves, or keep
//! intermediate results, build the same from the parts: [`Surfaces`], [`proposals`] and [`Solved`].

mod conflicts;
mod proposals;
mod solved;
mod surfaces;
mod whole;

pub use conflicts::Conflict;
pub use proposals::{Proposal, Registered, proposals};
pub use solved::{Judged, Solved};
pub use surfaces::Surfaces;
pub use whole::{Model, reconstruct};
