//! From a rough pose to an exact one: iterative closest points.

mod hold;
mod nearest;
mod point_to_plane;

pub use hold::Hold;
pub use nearest::Nearest;
pub use point_to_plane::{PointToPlane, Refinement};
