//! Registers many scans into one frame.
//!
//! Registered pairs, right and wrong, go in as [`Candidate`]s. Loops of three vote on them, a robust pose graph (Choi,
//! Zhou, Koltun 2015) solves for all poses and prunes what does not fit, remaining components are joined where several
//! doubtful pairs agree, and a joint refinement includes any two scans that touch. Scans that nothing holds together
//! stay in separate components. [`reconstruct`] consists of these steps.
//!
//! Nothing here opens a file or registers a pair; whatever needs the surfaces themselves is delegated to a [`Contact`].
//! All results are bit-identical on any number of threads, and do not depend on the order of scans or candidates except
//! for rounding.

mod bridges;
mod candidate;
mod edge;
mod forest;
mod joint;
mod reconstruct;
mod robust;
mod settings;
mod solve;
mod uncertainty;
mod votes;

#[cfg(test)]
mod tests;

pub use candidate::{Belief, Candidate, Fate, Touch};
pub use edge::Edge;
pub use joint::{Contact, NoContact};
pub use reconstruct::{Reconstruction, reconstruct};
pub use settings::Settings;
pub use solve::{Solution, solve};

use nalgebra::Vector3;

/// One scan as seen by the graph.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Points spread evenly over the scan, in its own frame. Two poses are compared by how far apart they put these.
    pub probes: Vec<Vector3<f64>>,
}
