//! The choice among poses by the whole surfaces: correspondences propose, surfaces decide.

use crate::prior::Bounds;
use crate::{DenseConfig, Pair};
use congruent_geometry::{NearestField, RigidTransform, Surface, mean_displacement, narrow};
use congruent_metrics::{DenseAgreement, DenseRule, DenseSurface, DepthImage, Score, agreement};
use congruent_refinement::{PointToPlane, Schedule};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::sync::Arc;

/// Sides of the grids in which closest points are looked up, and of the pixels of depth images, in `pr`.
const NEAR_CELL: f64 = 2.0;
const FAR_CELL: f64 = 4.0;
const PIXEL: f64 = 4.0;
/// How far the short refinement looks at first and at last, in `pr`.
const REFINEMENT_RADII: [f64; 2] = [6.0, 2.5];
/// Poses whose points lie farther apart than this, in `pr`, are really different; so many are kept beside the answer.
const DIFFERENT: f64 = 10.0;
const MAX_OTHERS: usize = 5;
/// Every so many points are compared.
const PROBE_STRIDE: usize = 37;
/// Points that one short refinement uses in a round.
const REFINEMENT_POINTS: usize = 1200;
/// Poses that one thread looks at at a time, at most.
const POSES_AT_A_TIME: usize = 4;

/// Where the closest points of a surface are looked up, however its normals point.
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

/// Both surfaces, ready to be laid on each other.
pub(crate) struct Ranking<'a> {
    config: &'a DenseConfig,
    bounds: &'a Bounds,
    resolution: f64,
    surfaces: Pair<DenseSurface<'a>>,
}

/// A pose and how well the surfaces lie on each other under it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ranked {
    pub(crate) target_from_source: RigidTransform,
    pub(crate) score: Score,
    pub(crate) agreement: DenseAgreement,
}

/// A pool in the order that the surfaces give it as it is, and the first of it refined, as far as anybody asked.
#[derive(Clone)]
pub(crate) struct Order {
    promising: Vec<Ranked>,
    refined: Vec<Ranked>,
}

impl<'a> Ranking<'a> {
    /// `viewpoints` are where the scans were taken from, where a single viewpoint can be trusted.
    pub(crate) fn new(
        surfaces: &'a Pair<Surface>,
        fields: &'a Pair<Arc<Fields>>,
        viewpoints: &Pair<Option<Vector3<f64>>>,
        config: &'a DenseConfig,
        bounds: &'a Bounds,
        resolution: f64,
    ) -> Self {
        let parts = surfaces.as_ref().zip(fields.as_ref()).zip(viewpoints.as_ref());
        let surfaces = parts.par_map(|((surface, fields), viewpoint)| {
            let image = |from: &Vector3<f64>| DepthImage::new(surface.points(), &narrow(from), PIXEL * resolution);
            DenseSurface { surface, near: &fields.near, far: &fields.far, depth: viewpoint.as_ref().map(image) }
        });
        Ranking { config, bounds, resolution, surfaces }
    }

    /// Looks at all poses of a pool as they are.
    pub(crate) fn order(&self, poses: &[RigidTransform]) -> Order {
        let rough = self.config.rough_rule(self.resolution);
        let mut promising: Vec<Ranked> =
            poses.par_iter().with_max_len(POSES_AT_A_TIME).map(|pose| self.judged(pose, &rough)).collect();
        sort(&mut promising);
        Order { promising, refined: Vec::new() }
    }

    /// The most promising poses, refined and looked at again; best first.
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

    /// Poses that are really different from the answer and from each other, best first.
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

    /// Whether two poses are really different.
    pub(crate) fn apart(&self, a: &Ranked, b: &Ranked) -> bool {
        let probes = self.surfaces.source.surface.points().iter().step_by(PROBE_STRIDE);
        let probes: Vec<_> = probes.copied().collect();
        mean_displacement(&probes, &a.target_from_source, &b.target_from_source) > DIFFERENT * self.resolution
    }

    /// How well the surfaces lie on each other, by the rule of the final score.
    pub(crate) fn judge(&self, pose: &RigidTransform) -> Ranked {
        self.judged(pose, &self.config.rule(self.resolution))
    }

    fn judged(&self, pose: &RigidTransform, rule: &DenseRule) -> Ranked {
        let agreement = agreement(&self.surfaces.source, &self.surfaces.target, pose, rule);
        Ranked { target_from_source: *pose, score: agreement.score(rule), agreement }
    }

    /// The start is kept where the score falls, or where refinement leads out of bounds.
    fn refined(&self, start: &Ranked) -> Ranked {
        let radii = REFINEMENT_RADII.map(|radius| radius * self.resolution);
        let (rounds, max_points) = (self.config.rounds, REFINEMENT_POINTS);
        let rough = Schedule::rough(radii, self.resolution, self.bounds.freedom());
        let schedule = Schedule { rounds, max_points, ..rough };
        let Pair { source, target } = &self.surfaces;
        let start_pose = &start.target_from_source;
        let moved = PointToPlane { schedule }.descend(source.surface, target.surface, target.near, start_pose);
        let before = self.judge(start_pose);
        match self.bounds.admitted(&moved, self.resolution).map(|moved| self.judge(&moved)) {
            Some(after) if after.score >= before.score => after,
            _ => before,
        }
    }
}

/// Best first; equal scores keep the order of the pool.
fn sort(ranked: &mut [Ranked]) {
    ranked.sort_by_key(|r| std::cmp::Reverse(r.score));
}
