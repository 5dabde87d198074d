//! The scans' surfaces: how they touch under a pose, and where refinement moves them.

use congruent_geometry::{RigidTransform, Surface, uncentred, wide};
use congruent_multiway::{Contact, Node, Reconstruction, Touch};
use congruent_pipeline::DescribedScan;
use congruent_refinement::{Freedom, PointToPlane, Refinement, Refiner, Schedule};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Points of a scan that are laid on others.
const MOVING_POINTS: usize = 4000;
/// Points that are looked at first, to leave scans alone that are nowhere near.
const SCOUTS: usize = 120;
/// Scouts that have to find something.
const MIN_FOUND: usize = 2;
/// Share of the moving points that have to touch, and how many at least.
const MIN_SHARE: f64 = 0.03;
const MIN_PAIRS: usize = 40;
/// Points that stand for a scan where poses are compared.
const PROBES: usize = 48;
/// Search radius at first, after each round, and at the end; `pr`.
const FIRST_REACH: f64 = 3.0;
const SHRINKING: f64 = 0.75;
const LAST_REACH: f64 = 1.5;

/// The sampled surfaces of all scans, in their order.
pub struct Surfaces {
    scans: Vec<Option<Dense>>,
    pr: f64,
}

struct Dense {
    surface: Surface,
    /// With the normals turned to the other side.
    turned: Surface,
    /// Whether the side of the normals is certain.
    sure: bool,
    /// What was subtracted from the coordinates of the file.
    origin: Vector3<f64>,
}

impl Surfaces {
    /// Takes `n` scans from `described`, which is asked for each position once and returns nothing for a scan that cannot be
    /// used. `pr` is the working length of the collection, data units.
    #[must_use]
    pub fn new<S: AsRef<DescribedScan>>(n: usize, described: impl Fn(usize) -> Option<S> + Sync, pr: f64) -> Surfaces {
        let dense = |at: usize| {
            let described = described(at)?;
            let described = described.as_ref();
            let surface = described.surface()?.clone();
            let turned = surface.clone().flipped();
            Some(Dense { surface, turned, sure: described.side_is_sure(), origin: *described.origin() })
        };
        Surfaces { scans: (0..n).into_par_iter().map(dense).collect(), pr }
    }

    /// The sampled surface of a scan, centred; nothing where it cannot be used.
    #[must_use]
    pub fn surface(&self, at: usize) -> Option<&Surface> {
        self.scans[at].as_ref().map(|dense| &dense.surface)
    }

    /// What leads from the centred coordinates of a scan to those of its file; zero where it cannot be used.
    #[must_use]
    pub fn origin(&self, at: usize) -> Vector3<f64> {
        self.scans[at].as_ref().map_or_else(Vector3::zeros, |dense| dense.origin)
    }

    /// The pose of a scan between files: from its own coordinates into those of its component's first scan.
    #[must_use]
    pub fn in_files(&self, result: &Reconstruction, at: usize, first: usize) -> RigidTransform {
        uncentred(&result.frame_from_scan[at], &self.origin(at), &self.origin(first))
    }

    /// The points that represent each scan where poses are compared.
    #[must_use]
    pub fn nodes(&self) -> Vec<Node> {
        let node = |scan: &Option<Dense>| {
            let points = scan.as_ref().map_or([].as_slice(), |dense| dense.surface.points());
            let step = points.len().div_ceil(PROBES).max(1);
            Node { probes: points.iter().step_by(step).map(|p| wide(*p)).collect() }
        };
        self.scans.iter().map(node).collect()
    }

    /// A pose between files as one between centred scans.
    pub(crate) fn centred(&self, source: usize, target: usize, pose: &RigidTransform) -> RigidTransform {
        uncentred(pose, &-self.origin(source), &-self.origin(target))
    }

    /// How two scans touch under a pose that may still be rough.
    pub(crate) fn touch(&self, source: usize, target: usize, pose: &RigidTransform) -> Option<Touch> {
        self.best(source, target, pose, FIRST_REACH, |icp, moving, fixed| icp.measure(moving, fixed, pose))
            .map(|refinement| touch_of(&refinement))
    }

    /// The share of the source's points that touch the target.
    #[must_use]
    pub fn overlap(&self, source: usize, touch: &Touch) -> f64 {
        let used = self.scans[source].as_ref().map_or(1, |dense| used(&dense.surface));
        (touch.support / used as f64).min(1.0)
    }

    /// The better one of the two sides that the normals may have; nothing where too little touches.
    fn best(
        &self,
        source: usize,
        target: usize,
        pose: &RigidTransform,
        reach: f64,
        look: impl Fn(&PointToPlane, &Surface, &Surface) -> Refinement,
    ) -> Option<Refinement> {
        let (moving, fixed) = (self.scans[source].as_ref()?, self.scans[target].as_ref()?);
        let reach = reach * self.pr;
        if !near(&moving.surface, &fixed.surface, pose, reach) {
            return None;
        }
        let rough = Schedule::rough([reach, reach], self.pr, Freedom::All);
        let schedule = Schedule { rounds: 1, max_points: MOVING_POINTS, ..rough };
        let icp = PointToPlane { schedule };
        let sides = [Some(&moving.surface), (!(moving.sure && fixed.sure)).then_some(&moving.turned)];
        let found = sides.into_iter().flatten().map(|surface| look(&icp, surface, &fixed.surface));
        let best = found.reduce(|a, b| if b.support > a.support { b } else { a })?;
        let enough = (MIN_SHARE * used(&moving.surface) as f64).max(MIN_PAIRS as f64);
        (best.n_pairs as f64 >= enough).then_some(best)
    }
}

/// Points of a surface that are laid on others.
fn used(surface: &Surface) -> usize {
    surface.len().div_ceil(surface.len().div_ceil(MOVING_POINTS).max(1))
}

/// Whether it is worth looking closer.
fn near(moving: &Surface, fixed: &Surface, pose: &RigidTransform, reach: f64) -> bool {
    let step = moving.len().div_ceil(SCOUTS).max(1);
    let scouts = moving.points().iter().step_by(step);
    let found = scouts.filter(|p| {
        let moved = (pose * nalgebra::Point3::from(wide(**p))).coords;
        let nearest = fixed.index().nearest(&congruent_geometry::narrow(&moved));
        nearest.is_some_and(|n| f64::from(n.distance_sq) <= reach * reach)
    });
    found.take(MIN_FOUND).count() >= MIN_FOUND
}

fn touch_of(refinement: &Refinement) -> Touch {
    Touch { information: refinement.information, support: refinement.support, residual: refinement.residual }
}

impl Contact for Surfaces {
    fn measure(&self, source: usize, target: usize, pose: &RigidTransform) -> Option<Touch> {
        let look = |icp: &PointToPlane, moving: &Surface, fixed: &Surface| icp.measure(moving, fixed, pose);
        self.best(source, target, pose, LAST_REACH, look).map(|refinement| touch_of(&refinement))
    }

    /// One step of point-to-plane ICP: all scans move together between two steps.
    fn align(
        &self,
        source: usize,
        target: usize,
        pose: &RigidTransform,
        round: usize,
    ) -> Option<(RigidTransform, Touch)> {
        let reach = (FIRST_REACH * SHRINKING.powf(round as f64)).max(LAST_REACH);
        let look = |icp: &PointToPlane, moving: &Surface, fixed: &Surface| icp.refine(moving, fixed, pose);
        let refinement = self.best(source, target, pose, reach, look)?;
        Some((refinement.target_from_source, touch_of(&refinement)))
    }
}
