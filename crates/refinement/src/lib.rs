//! From a rough pose to an exact one: iterative closest points, and how accurate the pose then is.

mod config;
mod descent;
mod equations;
mod freedom;
mod gicp;
mod hold;
mod nearest;
mod pairing;
mod point_to_plane;
mod refiner;
mod touches;
mod uncertainty;

pub use config::{GicpConfig, PointToPlaneConfig, RefinementConfig};
pub use descent::Schedule;
pub use equations::MIN_STIFFNESS;
pub use freedom::Freedom;
pub use gicp::Gicp;
pub use hold::Hold;
pub use nearest::Nearest;
pub use point_to_plane::PointToPlane;
pub use refiner::{NoRefinement, Refinement, Refiner};
pub use uncertainty::Uncertainty;
