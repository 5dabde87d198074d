//! Scans that contradict each other where a reconstruction puts them.
//!
//! Wrong poses may support each other: in a room whose ends are alike, half of the scans may be turned as a whole, and
//! every loop closes. What remains is that points float where another scan looked through.

use crate::Surfaces;
use congruent_geometry::Surface;
use congruent_multiway::Reconstruction;
use congruent_pipeline::stages::agreement;
use congruent_pipeline::{Agreement, DenseConfig, Pair};
use rayon::prelude::*;

/// Minimum fraction of the points that overlap; below it there is too little to compare.
const MIN_OVERLAP: f64 = 0.1;
/// Minimum fraction of the points that float, summed over both directions. Scans of five sensors that were placed
/// correctly have at most 0.08, measured with the default settings of the dense ranking, whatever the pairs were ranked
/// with.
const MIN_FLOATING: f64 = 0.1;

/// Two scans of a component that do not fit each other under their poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conflict {
    /// Positions of the scans, ascending.
    pub scans: [usize; 2],
    /// Fraction of their points that overlap, averaged over both directions.
    pub overlap: f64,
    /// Fraction of their points that float in front of the other scan, where its scanner saw empty space; summed over
    /// both directions.
    pub floating: f64,
}

impl Surfaces {
    /// Returns the scans that contradict each other under the poses of a reconstruction, the largest contradiction
    /// first.
    #[must_use]
    pub fn conflicts(&self, result: &Reconstruction) -> Vec<Conflict> {
        let pairs = |members: &Vec<usize>| -> Vec<[usize; 2]> {
            let later = |at: usize| members[at + 1..].iter().map(move |&other| [members[at], other]);
            (0..members.len()).flat_map(later).collect()
        };
        let pairs: Vec<[usize; 2]> = result.components.iter().flat_map(pairs).collect();
        let mut conflicts: Vec<Conflict> =
            pairs.par_iter().with_max_len(1).filter_map(|&scans| self.conflict(scans, result)).collect();
        conflicts.sort_by(|a, b| b.floating.total_cmp(&a.floating).then(a.scans.cmp(&b.scans)));
        conflicts
    }

    fn conflict(&self, scans: [usize; 2], result: &Reconstruction) -> Option<Conflict> {
        let [first, second] = scans;
        let pose = result.frame_from_scan[second].inverse() * result.frame_from_scan[first];
        if !self.are_near(first, second, &pose) {
            return None;
        }
        let config = DenseConfig::default();
        let measured = |source: &Surface, target: &Surface| {
            let surfaces = Pair { source: source.clone(), target: target.clone() };
            agreement(&surfaces, &pose, &config, self.pr())
        };
        // Where the side of the normals is uncertain, the one with the smaller contradiction counts.
        let mut least: Option<Conflict> = None;
        for source in self.sides(first) {
            for target in self.sides(second) {
                let Agreement { overlap, hover, .. } = measured(source, target);
                if overlap < MIN_OVERLAP {
                    continue;
                }
                if hover < MIN_FLOATING {
                    return None;
                }
                if least.is_none_or(|least| hover < least.floating) {
                    least = Some(Conflict { scans, overlap, floating: hover });
                }
            }
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::{RigidTransform, Scan};
    use congruent_pipeline::{Collection, PipelineConfig, ScanSummary, Variant};
    use congruent_simulation::pair::{PairOptions, figurine_pair};
    use nalgebra::Vector3;
    use std::sync::Arc;

    #[test]
    fn only_a_wrong_pose_makes_a_conflict() {
        let pair = figurine_pair(&PairOptions { pixels: 120, view_angle: 0.4, ..PairOptions::default() });
        let scans = [&pair.source, &pair.target].map(|raw| Scan::new(raw).unwrap());
        let config = PipelineConfig::default();
        let summaries = scans.each_ref().map(|scan| ScanSummary::new(scan, &config).unwrap());
        let collection = Collection::new(&summaries, &config).unwrap();
        let described = |at: usize| Some(Arc::new(collection.describe(&scans[at], Variant::default())));
        let surfaces = Surfaces::new(2, described, collection.resolution());
        let truth = surfaces.centred(0, 1, &pair.target_from_source);
        let conflicts = |second_from_first: &RigidTransform| {
            let result = Reconstruction {
                components: vec![vec![0, 1]],
                frame_from_scan: vec![RigidTransform::identity(), second_from_first.inverse()],
                uncertainty: vec![None; 2],
                fates: Vec::new(),
                edges: Vec::new(),
                refined: false,
            };
            surfaces.conflicts(&result)
        };
        assert_eq!(conflicts(&truth), []);
        // Far away nothing can be compared.
        assert_eq!(conflicts(&RigidTransform::translation(1e4, 0.0, 0.0)), []);
        // Turned about the centre of the target, step by step: where enough still touches, much floats.
        let turned = |degrees: f64| RigidTransform::rotation(Vector3::y() * degrees.to_radians()) * truth;
        let found: Vec<Conflict> = (1..12).flat_map(|step| conflicts(&turned(30.0 * f64::from(step)))).collect();
        assert!(!found.is_empty(), "no wrong pose was noticed");
        for conflict in found {
            assert!(conflict.scans == [0, 1] && conflict.overlap >= MIN_OVERLAP, "{conflict:?}");
            assert!(conflict.floating >= MIN_FLOATING, "{conflict:?}");
        }
    }
}
