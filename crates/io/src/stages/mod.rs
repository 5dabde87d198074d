//! The files between two stages of the chain; `docs/FILES.md` describes them for other programs.

mod matches;
mod places;
mod poses;

pub use matches::{MatchRow, matches_csv, read_matches};
pub use places::{KeypointRow, Place, keypoints_csv, places_csv, read_places};
pub use poses::{PoseRow, poses_csv};

/// A number as text, with every digit that is needed to read it back.
fn digits<T: std::fmt::Debug>(value: &T) -> String {
    format!("{value:?}")
}
