//! The choice among poses by how well the whole surfaces fit: correspondences propose, surfaces decide.

use crate::prior::Bounds;
use crate::{DenseConfig, Pair};
use congruent_geometry::{NearestField, RigidTransform, Surface, mean_displacement, narrow};
use congruent_metrics::{DenseAgreement, DenseRule, DenseSurface, DepthImage, Score, agreement};
use congruent_refinement::{PointToPlane, Schedule};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::sync::Arc;

/// Side of a cell of the grids in which closest points are looked up, and of a pixel of the depth images, in `pr`.
const NEAR_CELL: f64 = 2.0;
const FAR_CELL: f64 = 4.0;
const PIXEL: f64 = 4.0;
/// Search radius of the short refinement at first and at the end, in `pr`.
const REFINEMENT_RADII: [f64; 2] = [6.0, 2.5];
/// Poses whose points are farther apart than this on average, in `pr`, are substantially different; at most this many
/// of them are kept besides the answer.
const DIFFERENT: f64 = 10.0;
const MAX_OTHERS: usize = 5;
/// Every point whose position is a multiple of this is compared.
const PROBE_STRIDE: usize = 37;
/// Maximum number of points that a short refinement uses in a round.
const REFINEMENT_POINTS: usize = 1200;
/// Maximum number of poses that one thread examines at a time.
const POSES_AT_A_TIME: usize = 4;

/// Lookup of the closest points of a surface, near and far; independent of its normals.
pub(crate) struct Fields {
    near: NearestField,
    far: NearestField,
}

impl Fields {
    pub(crate) fn new(surface: &Surface, config: &DenseConfig, resolution: f64) -> Self {
        let near_reach = (2.0 * config.rough_distance.resolve(resolution)).max(REFINEMENT_RADII[0] * resolution);
        let far_reach = config.hover_to.resolve(resolution);
        let (near, far) = rayon::join(
            || NearestField::new(surface.points(), NEAR_CELL * resolution, near_reach),
            || NearestField::new(surface.points(), FAR_CELL * resolution, far_reach),
        );
        Fields { near, far }
    }
}

/// Both surfaces, prepared for measuring how well they fit each other.
pub(crate) struct Ranking<'a> {
    config: &'a DenseConfig,
    bounds: Bounds,
    resolution: f64,
    surfaces: Pair<DenseSurface<'a>>,
}

/// A pose, and how well the surfaces fit each other under it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ranked {
    pub(crate) target_from_source: RigidTransform,
    pub(crate) score: Score,
    pub(crate) agreement: DenseAgreement,
}

/// The poses of a pool sorted by their score before refinement, and the first of them refined, as many as were needed
/// so far.
#[derive(Clone)]
pub(crate) struct Order {
    promising: Vec<Ranked>,
    refined: Vec<Ranked>,
}

impl<'a> Ranking<'a> {
    /// Prepares the surfaces; `viewpoints` are the positions of the scanners, centred, if they are reliable.
    pub(crate) fn new(
        surfaces: &'a Pair<Surface>,
        fields: &'a Pair<Arc<Fields>>,
        viewpoints: &Pair<Option<Vector3<f64>>>,
        config: &'a DenseConfig,
        bounds: Bounds,
        resolution: f64,
    ) -> Self {
        let parts = surfaces.as_ref().zip(fields.as_ref()).zip(viewpoints.as_ref());
        let surfaces = parts.par_map(|((surface, fields), viewpoint)| {
            let image = |from: &Vector3<f64>| DepthImage::new(surface.points(), &narrow(from), PIXEL * resolution);
            DenseSurface { surface, near: &fields.near, far: &fields.far, depth: viewpoint.as_ref().map(image) }
        });
        Ranking { config, bounds, resolution, surfaces }
    }

    /// Scores all poses of a pool before refinement.
    pub(crate) fn order(&self, poses: &[RigidTransform]) -> Order {
        let rough = self.config.rough_rule(self.resolution);
        let mut promising: Vec<Ranked> =
            poses.par_iter().with_max_len(POSES_AT_A_TIME).map(|pose| self.judged(pose, &rough)).collect();
        sort(&mut promising);
        Order { promising, refined: Vec::new() }
    }

    /// Refines the most promising poses and scores them again; best first.
    pub(crate) fn best(&self, order: &mut Order) -> Vec<Ranked> {
        let wanted = self.config.refined.max(1).min(order.promising.len());
        let known = order.refined.len().min(wanted);
        order
            .refined
            .par_extend(order.promising[known..wanted].par_iter().with_max_len(1).map(|ranked| self.refined(ranked)));
        let mut best = order.refined[..wanted].to_vec();
        sort(&mut best);
        best
    }

    /// Returns poses that are substantially different from the answer and from each other, in the order of `ranked`.
    pub(crate) fn others(&self, answer: &Ranked, ranked: &[Ranked]) -> Vec<Ranked> {
        let mut others: Vec<Ranked> = Vec::new();
        for candidate in ranked {
            if others.len() < MAX_OTHERS
                && self.apart(candidate, answer)
                && others.iter().all(|other| self.apart(candidate, other))
            {
                others.push(*candidate);
            }
        }
        others
    }

    /// Returns whether two poses are substantially different.
    pub(crate) fn apart(&self, a: &Ranked, b: &Ranked) -> bool {
        let probes = self.surfaces.source.surface.points().iter().step_by(PROBE_STRIDE);
        let probes: Vec<_> = probes.copied().collect();
        mean_displacement(&probes, &a.target_from_source, &b.target_from_source) > DIFFERENT * self.resolution
    }

    /// Measures how well the surfaces fit each other, by the rule of the final score.
    pub(crate) fn judge(&self, pose: &RigidTransform) -> Ranked {
        self.judged(pose, &self.config.rule(self.resolution))
    }

    fn judged(&self, pose: &RigidTransform, rule: &DenseRule) -> Ranked {
        let agreement = agreement(&self.surfaces.source, &self.surfaces.target, pose, rule);
        Ranked { target_from_source: *pose, score: agreement.score(rule), agreement }
    }

    /// Refines a pose; the start is kept if the score falls or the result is out of bounds.
    fn refined(&self, start: &Ranked) -> Ranked {
        let radii = REFINEMENT_RADII.map(|radius| radius * self.resolution);
        let (rounds, max_points) = (self.config.rounds, REFINEMENT_POINTS);
        let rough = Schedule::rough(radii, self.resolution, self.bounds.freedom());
        let schedule = Schedule { rounds, max_points, ..rough };
        let Pair { source, target } = &self.surfaces;
        let start_pose = &start.target_from_source;
        let moved = PointToPlane { schedule }.descend(source.surface, target.surface, target.near, start_pose);
        let before = self.judge(start_pose);
        match self.bounds.admitted(&moved).map(|moved| self.judge(&moved)) {
            Some(after) if after.score >= before.score => after,
            _ => before,
        }
    }
}

/// Sorts best first; equal scores keep the order of the pool.
fn sort(ranked: &mut [Ranked]) {
    ranked.sort_by_key(|r| std::cmp::Reverse(r.score));
}
