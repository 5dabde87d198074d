//! What pairwise registration proposes, and the outcome for it.

use congruent_geometry::RigidTransform;
use nalgebra::{Matrix6, Vector6};

/// Errors of neighbouring points are correlated: this many touching pairs count as one independent measurement. A patch
/// of five by five samples is what one normal is estimated from.
const PATCH: f64 = 25.0;

/// How far a registration believed its own pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Belief {
    /// It believed the pose.
    Believed,
    /// It listed several poses; this is one of them.
    Uncertain,
    /// It did not believe the pose.
    Doubted,
}

/// A pose proposed by one pair of scans. A pair may have several.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Position of the scan that is moved.
    pub source: usize,
    /// Position of the scan that it is moved onto; a different one.
    pub target: usize,
    /// Maps the source's frame to the target's.
    pub target_from_source: RigidTransform,
    /// How the surfaces touch under the pose.
    pub touch: Touch,
    /// Confidence, 0 to 1.
    pub confidence: f64,
    /// What the registration believed.
    pub belief: Belief,
}

/// How two surfaces hold each other under a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// `Σ w GᵀG` over touching points: `G ξ` is the separation of a pair for the small motion `ξ` of the source in the
    /// target's frame, rotation (about the frame's origin) before translation.
    pub information: Matrix6<f64>,
    /// `Σ w`: how many points touch.
    pub support: f64,
    /// Root mean square distance of the touching points, data units.
    pub residual: f64,
}

impl Touch {
    /// Returns the mean squared separation of the touching points for a small motion, data units squared; zero if
    /// nothing touches.
    #[must_use]
    pub fn parting_sq(&self, motion: &Vector6<f64>) -> f64 {
        if self.support > 0.0 { (motion.dot(&(self.information * motion)) / self.support).max(0.0) } else { 0.0 }
    }

    /// Returns the inverse covariance of the motion if every patch of points were an independent measurement with this
    /// touch's residual, or with `floor` if that is larger.
    #[must_use]
    pub fn precision(&self, floor: f64) -> Matrix6<f64> {
        self.information / (PATCH * self.residual.max(floor).max(f64::MIN_POSITIVE).powi(2))
    }
}

/// What became of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fate {
    /// The poses are based on it.
    Kept,
    /// It agrees with the poses, which do not need it.
    Agrees,
    /// None of its triangles closes.
    NoLoop {
        /// Number of triangles that contain it.
        triangles: usize,
    },
    /// Another pose of the same pair has more triangles that close.
    Outvoted,
    /// A doubtful pose supported by too few others.
    Unsupported,
    /// The poses on which all others agree separate its surfaces.
    Contradicted {
        /// Root mean square separation, data units; more than [`Settings::parting`](crate::Settings::parting).
        parting: f64,
    },
    /// Under the poses on which all others agree, its surfaces still touch but have slid along each other.
    Displaced {
        /// Mean displacement of the source's points, data units; more than
        /// [`Settings::agreement`](crate::Settings::agreement).
        displacement: f64,
    },
}
