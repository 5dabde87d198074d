//! What many points say against a pose that was found on few.

use crate::{Failure, Pair};
use congruent_geometry::{Surface, roughness};
use congruent_metrics::DenseAgreement;

/// Maximum distance between two dense samples of one surface, as a multiple of their roughness: 1.0 to 1.7 for scans
/// under noise and for rooms, 2.2 to 9 for scans and their mirror images.
const FAR_APART: f64 = 2.5;
/// Minimum fraction of the many points that contradict a pose because of details that the few do not show. Noise and edges
/// contradict less the more points there are, furniture that was put against the wrong wall more: of six right poses 0.3
/// to 0.7 times as many of the many points as of the few contradict, of nine wrong ones in rooms 1.3 to 5.5 times as many,
/// 0.09 to 0.14 of them.
const MIN_FLOATING: f64 = 0.05;
/// Minimum overlap of the many points, as a fraction of that of the few, if both show the same surface: 0.77 to 0.97 in
/// rooms, 0.37 to 0.6 for sweeps of spinning scanners with few rings.
const SAME_SURFACE: f64 = 0.7;

/// Returns the doubt if the many points contradict the pose, and more of them than of the few. `None` if they do not show
/// the same surface in more detail: if much less of them overlaps (rings with gaps in between, normals on the wrong side),
/// or if more of their normals disagree (noise, which the few average out).
pub(crate) fn floating_details(few: &DenseAgreement, many: &DenseAgreement) -> Option<Failure> {
    let [few_floating, many_floating] = [few, many].map(DenseAgreement::contradictions);
    let is_more = many_floating > few_floating && many_floating > MIN_FLOATING;
    let is_detailed = many.overlap > SAME_SURFACE * few.overlap && many.disagreeing <= few.disagreeing;
    (is_more && is_detailed).then_some(Failure::FloatingDetails { few: few_floating, many: many_floating })
}

/// Returns the distance between the surfaces where they touch as a multiple of their roughness, if it is too large.
/// `None` if more of the points touch with normals that disagree than with normals that agree: the normals are then on
/// the wrong side, and the rest tells nothing.
pub(crate) fn times_too_far_apart(touch: &DenseAgreement, surfaces: &Pair<Surface>) -> Option<f64> {
    let rough = surfaces.as_ref().par_map(roughness);
    let times = touch.residual / (0.5 * (rough.source? + rough.target?));
    (times > FAR_APART && touch.overlap > touch.disagreeing).then_some(times)
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;
    use congruent_geometry::{NeighborIndex, Point};

    /// Two sheets of 40 × 40 points with noise of standard deviation 0.1.
    fn sheets() -> Pair<Surface> {
        let sheet = |seed: u64| {
            let mut stream = Stream::new(seed, 0);
            let points: Vec<Point> =
                (0..1600u16).map(|i| [f32::from(i % 40), f32::from(i / 40), (0.1 * stream.normal()) as f32]).collect();
            let index = NeighborIndex::new(&points);
            Surface::new(points, vec![[0.0, 0.0, 1.0]; 1600], index, 1.0)
        };
        Pair { source: sheet(1), target: sheet(2) }
    }

    #[test]
    fn details_that_float_only_among_many_points_refute_a_pose() {
        let floating = |overlap: f64, floating: f64| DenseAgreement {
            hover: 0.01,
            occlusion: floating - 0.01,
            ..touch(0.1, overlap, 0.0)
        };
        let refutes = |few: f64, many: f64| floating_details(&floating(0.6, few), &floating(0.5, many));
        assert!(matches!(refutes(0.02, 0.12), Some(Failure::FloatingDetails { .. })));
        assert!(refutes(0.15, 0.12).is_none() && refutes(0.01, 0.04).is_none() && refutes(0.01, 0.01).is_none());
        // Of rings, or with normals on the wrong side, much less overlaps; under noise more normals disagree.
        assert!(floating_details(&floating(0.8, 0.02), &floating(0.4, 0.12)).is_none());
        let noisy = DenseAgreement { disagreeing: 0.1, ..floating(0.5, 0.12) };
        assert!(floating_details(&floating(0.6, 0.02), &noisy).is_none());
    }

    fn touch(residual: f64, overlap: f64, disagreeing: f64) -> DenseAgreement {
        DenseAgreement {
            soft_overlap: 0.5,
            overlap,
            residual,
            hover: 0.0,
            occlusion: 0.0,
            disagreeing,
            normal_angle: 0.1,
        }
    }

    #[test]
    fn surfaces_farther_apart_than_they_are_rough_are_only_alike() {
        let both = sheets();
        // Their roughness is about 0.08.
        assert_eq!(times_too_far_apart(&touch(0.1, 0.6, 0.0), &both), None);
        let times = times_too_far_apart(&touch(0.4, 0.6, 0.0), &both).unwrap();
        assert!((4.0..6.0).contains(&times), "{times}");
        // If normals are on the wrong side, or nothing touches, no statement is possible.
        assert_eq!(times_too_far_apart(&touch(0.4, 0.01, 0.4), &both), None);
        assert_eq!(times_too_far_apart(&touch(f64::INFINITY, 0.0, 0.0), &both), None);
    }
}
