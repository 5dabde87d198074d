//! A point of the source that may be the same place as a point of the target.

/// A pair of surface points that a matcher thinks to be the same place. A set of them is ranked, best first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correspondence {
    /// Point of the source surface.
    pub source: u32,
    /// Point of the target surface.
    pub target: u32,
    /// Distance of the two descriptors (L2).
    pub distance: f32,
    /// What the set is ranked by, larger is better: `1 − d1/d2` (Lowe's ratio) where a second neighbour exists, else 0.
    pub score: f32,
}
