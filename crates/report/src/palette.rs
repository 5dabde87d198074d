//! Colours that people with any kind of colour vision can distinguish (Okabe and Ito, 2008, darkened where the original
//! is too light for points on white).

/// The scan that is moved: orange.
pub const SOURCE: &str = "#d9730d";
/// The scan that stays: blue.
pub const TARGET: &str = "#1f6fb4";
/// Colours for many scans or curves, in this order; source and target come first.
pub const SCANS: [&str; 8] = [SOURCE, TARGET, "#1b8a5a", "#a3338a", "#8a6d00", "#0f8fa8", "#c0392b", "#555555"];

/// Returns the colour of the `i`-th of many; they repeat after eight.
#[must_use]
pub fn scan_colour(i: usize) -> &'static str {
    SCANS[i % SCANS.len()]
}
/// Colour of true correspondences, or inliers.
pub(crate) const INLIER: &str = "#1b8a5a";
/// Colour of all other correspondences.
pub(crate) const OUTLIER: &str = "#a3338a";
