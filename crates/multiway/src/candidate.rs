//! What pairwise registration proposes, and what becomes of it.

use congruent_geometry::RigidTransform;
use nalgebra::{Matrix6, Vector6};

/// Neighbouring points err together: so many touching pairs count as one independent measurement. A patch of five by five
/// samples is what one normal is estimated from.
const PATCH: f64 = 25.0;

/// How far a registration believed itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Belief {
    /// It did.
    Believed,
    /// It listed several poses; this is one of them.
    Uncertain,
    /// It did not.
    Doubted,
}

/// A pose that one pair of scans proposes. A pair may have several.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Position of the scan that is moved.
    pub source: usize,
    /// Position of the scan that it is moved onto; another one.
    pub target: usize,
    /// Maps the source's frame to the target's.
    pub target_from_source: RigidTransform,
    /// How the surfaces touch under it.
    pub touch: Touch,
    /// 0 to 1.
    pub confidence: f64,
    /// What its registration said.
    pub belief: Belief,
}

/// How two surfaces hold each other under a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// `Σ w GᵀG` over touching points: `G ξ` is the parting of a pair for the small motion `ξ` of the source in the
    /// target's frame, rotation (about the frame's origin) before translation.
    pub information: Matrix6<f64>,
    /// `Σ w`: how many points touch.
    pub support: f64,
    /// Root mean square distance of the touching points, data units.
    pub residual: f64,
}

impl Touch {
    /// Mean squared parting of the touching points for a small motion, data units squared. Zero where nothing touches.
    #[must_use]
    pub fn parting_sq(&self, motion: &Vector6<f64>) -> f64 {
        if self.support > 0.0 { (motion.dot(&(self.information * motion)) / self.support).max(0.0) } else { 0.0 }
    }

    /// Inverse covariance of the motion, were every patch of points an independent measurement with this touch's residual,
    /// or `floor` where that is smaller.
    #[must_use]
    pub fn precision(&self, floor: f64) -> Matrix6<f64> {
        self.information / (PATCH * self.residual.max(floor).max(f64::MIN_POSITIVE).powi(2))
    }
}

/// What became of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fate {
    /// The poses rest on it.
    Kept,
    /// It agrees with the poses, which do not need it.
    Agrees,
    /// No triangle that it is in closes.
    NoLoop {
        /// Triangles that it is in.
        triangles: usize,
    },
    /// Another pose of the same pair has more triangles that close.
    Outvoted,
    /// A doubtful pose that too few others bear out.
    Unsupported,
    /// The poses that all others agree on part its surfaces.
    Contradicted {
        /// Root mean square, data units.
        parting: f64,
    },
}
