//! Why a pair could not be registered, and what to try.

use crate::Pair;

/// A reason that the user can act on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// Sampling left too few points of a scan.
    #[error("sampling left {left} of the {of} points of a scan, which is too few; choose smaller cells in [sampling]")]
    FewPoints {
        /// Number of points left.
        left: usize,
        /// Number of points of the scan.
        of: usize,
    },
    /// Too few points or keypoints are left of the smaller scan, and the extents differ so much that the units probably
    /// do, too.
    #[error(
        "the source spans {:.4e} data units and the target {:.4e}: are both in one unit (metres, millimetres)? If so, cut \
         the larger one down to the size of the other; if not, rescale one of them",
        .extents.source, .extents.target
    )]
    OtherUnits {
        /// Longest sides of the bounding boxes, data units.
        extents: Pair<f64>,
    },
    /// A scan has fewer than three described keypoints.
    #[error(
        "{} keypoints were found and described on the source and {} on the target, but at least 3 are needed on both; use \
         a denser detector such as [detector.uniform], or larger scans",
        .found.source, .found.target
    )]
    FewKeypoints {
        /// Number of keypoints with a valid descriptor.
        found: Pair<usize>,
    },
    /// There are too few matches to determine a pose.
    #[error(
        "matching kept {kept} correspondences, but at least 3 are needed; let [matcher] keep more, or use scans that \
         overlap more"
    )]
    FewMatches {
        /// Number of correspondences kept.
        kept: usize,
    },
    /// Every sample was degenerate; inside [`Failure::OutOfBounds`] also: no pose proposed is within the bounds.
    #[error(
        "no three correspondences span a triangle in both scans: the matches are too few or lie on a line; more overlap \
         or another detector may help"
    )]
    NoHypothesis,
    /// The full scans fit better in another pose than in the one found on a coarse sample.
    #[error(
        "a pose found on a coarse sample is contradicted by the full scans, which fit better in another pose; more \
         overlap or a rough pose to start from may help"
    )]
    Contradicted,
    /// The pose fits a coarse sample of the scans but not the full scans.
    #[error(
        "coarse samples of the scans fit, but the distance between the full scans is {times:.1} times the roughness of \
         the surfaces: the shapes are similar, not the same; if they should be the same, check whether one scan is \
         mirrored (two axes swapped, or one reversed)"
    )]
    OnlyAlike {
        /// Mean distance of touching points, divided by the mean roughness of the surfaces.
        times: f64,
    },
    /// The pose fits a coarse sample of the scans, but details that only the full scans show contradict it.
    #[error(
        "a pose found on a coarse sample is contradicted by details of the full scans: {:.1} % of their points float where \
         the other scanner saw empty space or would have hidden what it saw, {:.1} % of those of the sample; more overlap \
         or a rough pose to start from may help",
        100.0 * many,
        100.0 * few
    )]
    FloatingDetails {
        /// Fraction of the points of the coarse sample that hover or occlude, summed over both directions.
        few: f64,
        /// The same of the full scans.
        many: f64,
    },
    /// The best pose has no more inliers than chance explains.
    #[error(
        "the best pose has {inliers} inliers of {matches} correspondences, no more than chance explains ({expected:.1} \
         expected, 10^{log10_false_alarms:.1} false alarms); more overlap, more iterations or another preset may help"
    )]
    NotSignificant {
        /// Number of inliers of the best pose.
        inliers: usize,
        /// Number of all correspondences.
        matches: usize,
        /// Number of inliers expected if the matches were random.
        expected: f64,
        /// Decimal logarithm of the expected number of random poses this good.
        log10_false_alarms: f64,
    },
    /// No pose that the prior admits is accepted.
    #[error(
        "no pose within the bounds is trustworthy, and none outside them was searched for: {within}; wider bounds, or \
         none, may help"
    )]
    OutOfBounds {
        /// What is wrong with the best pose within the bounds.
        within: Box<Failure>,
    },
    /// The surfaces do not fit each other well enough.
    #[error(
        "the best pose found has a confidence of {:.0} %, but {:.0} % is needed: the scans overlap by {:.0} %, \
         {residual:.2} pr apart where they do, {:.1} % of the points contradict the pose, {inliers} correspondences agree; \
         more overlap, a viewpoint or a rough pose to start from may help",
        100.0 * .confidence, 100.0 * .needed, 100.0 * .overlap, 100.0 * .contradictions
    )]
    PoorFit {
        /// Confidence in the answer, 0 to 1.
        confidence: f64,
        /// Minimum confidence of an accepted answer.
        needed: f64,
        /// Fraction of the points that overlap.
        overlap: f64,
        /// Mean distance of overlapping points to the other surface, `pr`.
        residual: f64,
        /// Fraction of the points that hover, plus the fraction that occlude, each summed over both directions.
        contradictions: f64,
        /// Number of correspondences that are inliers of the pose.
        inliers: usize,
    },
    /// The touching surfaces are mostly planes, which fit each other in many poses.
    #[error(
        "where the surfaces touch, {:.0} % of them face only three directions, as walls and boxes do, and fit in many \
         poses; the correspondences exclude chance by {powers:.1} powers of ten, but {needed} are needed; more overlap, a \
         viewpoint or a rough pose to start from may help",
        100.0 * .flatness
    )]
    OnlyPlanes {
        /// Fraction of the source, or of the part of it that touches if that is less, that faces three directions.
        flatness: f64,
        /// Powers of ten by which random poses are excluded.
        powers: f64,
        /// Powers of ten from which planes are no reason for doubt.
        needed: f64,
    },
    /// The pose can be changed without separating the surfaces.
    #[error(
        "the geometry does not constrain {n_free} of 6 directions: the surfaces can slide along each other, as planes, \
         spheres or cylinders do (stiffness {stiffness:.4}, but {needed} is needed); use scans that show more of the shape"
    )]
    Sliding {
        /// Number of directions that the surfaces do not hold.
        n_free: usize,
        /// Stiffness of the loosest direction: mean squared separation of the surfaces for a unit motion.
        stiffness: f64,
        /// Stiffness from which a direction counts as held even if the normals are noisy.
        needed: f64,
    },
}

/// Scans whose extents differ by more than this factor rarely have the same unit.
const SAME_UNIT: f64 = 100.0;

impl Failure {
    /// Replaces the failure by its probable cause, for scans of these extents.
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
