//! Correspondences between points of the source and of the target.

/// A pair of surface points that a matcher takes for the same place. A set of them is ranked, best first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correspondence {
    /// Point of the source surface.
    pub source: u32,
    /// Point of the target surface.
    pub target: u32,
    /// Distance of the two descriptors (L2).
    pub distance: f32,
    /// Score by which the set is ranked, larger is better: `1 − d1/d2` (Lowe's ratio) if there is a second neighbour,
    /// else 0.
    pub score: f32,
}
