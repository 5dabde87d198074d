//! Why a pair could not be registered, and what to try.

use crate::Pair;

/// A reason that a user can act on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// Sampling was too coarse for the scan.
    #[error("sampling left {left} of the {of} points of a scan, too few to go by; choose smaller cells in [sampling]")]
    FewPoints {
        /// Points left.
        left: usize,
        /// Points of the scan.
        of: usize,
    },
    /// At the resolution of both together hardly anything is left of the smaller one.
    #[error(
        "the source spans {:.4e} data units and the target {:.4e}: are both in one unit (metres, millimetres)? If so, cut the larger one down to the size of the other; if not, rescale one of them",
        .extents.source, .extents.target
    )]
    OtherUnits {
        /// Longest sides of the bounding boxes, data units.
        extents: Pair<f64>,
    },
    /// A scan without enough keypoints.
    #[error(
        "{} keypoints were found and described on the source and {} on the target, at least 3 are needed on both; use a denser detector such as [detector.uniform], or larger scans",
        .found.source, .found.target
    )]
    FewKeypoints {
        /// Keypoints with a valid descriptor.
        found: Pair<usize>,
    },
    /// Too few matches to make a pose.
    #[error(
        "matching kept {kept} correspondences, at least 3 are needed; let [matcher] keep more, or take scans that share more"
    )]
    FewMatches {
        /// Correspondences kept.
        kept: usize,
    },
    /// Every sample was degenerate.
    #[error(
        "no three correspondences span a triangle in both scans: the matches are too few or lie on a line; more overlap or another detector may help"
    )]
    NoHypothesis,
    /// What was found on few points is not what more of them show.
    #[error(
        "a pose found on a coarse sample is contradicted by the full scans, which fit better in another pose; more overlap or a rough pose to start from may help"
    )]
    Contradicted,
    /// What fits on few points does not on many.
    #[error(
        "coarse samples of the scans fit, but the full scans lie {times:.1} times as far apart as the surfaces are rough: the shapes are alike, not the same; if they should be the same, check whether one scan is mirrored (two axes swapped, or one reversed)"
    )]
    OnlyAlike {
        /// Mean distance of touching points over the mean roughness of the surfaces.
        times: f64,
    },
    /// The best pose is no better than chance.
    #[error(
        "the best pose has {inliers} inliers of {matches} correspondences, no more than chance explains ({expected:.1} expected, {log10_false_alarms:+.1} powers of ten false alarms); more overlap, more iterations or another preset may help"
    )]
    NotSignificant {
        /// Inliers of the best pose.
        inliers: usize,
        /// All correspondences.
        matches: usize,
        /// Inliers expected if matches were random.
        expected: f64,
        /// Decimal logarithm of the expected number of random poses this good.
        log10_false_alarms: f64,
    },
    /// No pose that the prior leaves is to be believed.
    #[error(
        "no pose within the bounds is to be believed, and none beyond them was looked for: {within}; wider bounds, or none, may help"
    )]
    OutOfBounds {
        /// What is wrong with the best pose within.
        within: Box<Failure>,
    },
    /// The surfaces do not lie on each other well enough.
    #[error(
        "the best pose found has a confidence of {:.0} %; {:.0} % is needed: the scans overlap by {:.0} %, {residual:.2} pr apart where they do, {:.1} % of the points contradict, {inliers} correspondences agree; more overlap, a viewpoint or a rough pose to start from may help",
        100.0 * .confidence, 100.0 * .needed, 100.0 * .overlap, 100.0 * .contradictions
    )]
    PoorFit {
        /// Of the answer.
        confidence: f64,
        /// From which it is believed.
        needed: f64,
        /// Share of overlapping points.
        overlap: f64,
        /// Mean distance of overlapping points, `pr`.
        residual: f64,
        /// Share of points that hover or occlude.
        contradictions: f64,
        /// Correspondences that agree with the pose.
        inliers: usize,
    },
    /// What touches are planes, which fit each other in many poses.
    #[error(
        "where the surfaces touch, {:.0} % of them face only three directions, as walls and boxes do, and fit in many poses; the correspondences exclude chance by {powers:.1} powers of ten, {needed} are needed; more overlap, a viewpoint or a rough pose to start from may help",
        100.0 * .flatness
    )]
    OnlyPlanes {
        /// Fraction of the touching surface that faces three directions.
        flatness: f64,
        /// Powers of ten by which random poses are excluded.
        powers: f64,
        /// From which planes are no doubt.
        needed: f64,
    },
    /// The pose can be changed without parting the surfaces.
    #[error(
        "the geometry leaves {n_free} of 6 directions open: the surfaces slide on each other, as planes, spheres or cylinders do (stiffness {stiffness:.4}, {needed} is needed); scans that show more of the shape are needed"
    )]
    Sliding {
        /// Directions that nothing holds.
        n_free: usize,
        /// Of the loosest direction: mean squared parting of the surfaces for a unit motion.
        stiffness: f64,
        /// From which a direction counts as held.
        needed: f64,
    },
}

/// Scans whose extents differ by more than this factor are rarely in one unit.
const SAME_UNIT: f64 = 100.0;

impl Failure {
    /// What is behind it, for scans of these extents.
    pub(crate) fn explained(self, extents: Pair<f64>) -> Failure {
        let ratio = extents.source / extents.target;
        match self {
            Failure::FewPoints { .. } | Failure::FewKeypoints { .. } if ratio.max(1.0 / ratio) > SAME_UNIT => {
                Failure::OtherUnits { extents }
            }
            other => other,
        }
    }
}
