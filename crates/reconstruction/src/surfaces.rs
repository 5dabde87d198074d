//! The surfaces of the scans: how they touch under a pose, and where refinement moves them.

use congruent_geometry::{RigidTransform, Surface, uncentred, wide};
use congruent_multiway::{Contact, Node, Reconstruction, Touch};
use congruent_pipeline::DescribedScan;
use congruent_refinement::{Freedom, PointToPlane, Refinement, Refiner, Schedule};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Maximum number of points of the moving scan that are compared with another scan.
const MOVING_POINTS: usize = 4000;
/// Maximum number of points that are checked first, to skip scans that are nowhere near each other.
const SCOUTS: usize = 120;
/// Minimum number of these that must have a neighbour.
const MIN_FOUND: usize = 2;
/// Minimum fraction of the moving points that must touch, and their minimum number.
const MIN_SHARE: f64 = 0.03;
const MIN_PAIRS: usize = 40;
/// Maximum number of points that represent a scan where poses are compared.
const PROBES: usize = 48;
/// Search radius in the first round, its factor from round to round, and its minimum; radii in `pr`.
const FIRST_REACH: f64 = 3.0;
const SHRINKING: f64 = 0.75;
const LAST_REACH: f64 = 1.5;

/// The sampled surfaces of all scans, in the order of the scans.
pub struct Surfaces {
    scans: Vec<Option<Dense>>,
    pr: f64,
}

struct Dense {
    surface: Surface,
    /// The surface with its normals flipped.
    turned: Surface,
    /// Whether the side of the normals is certain.
    sure: bool,
    /// The offset that was subtracted from the file's coordinates.
    origin: Vector3<f64>,
}

impl Surfaces {
    /// Takes `n` scans from `described`, which is called once for each position and returns `None` for a scan that
    /// cannot be used. `pr` is the working length of the collection, data units.
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

    /// Returns the sampled surface of a scan, centred; `None` if the scan cannot be used.
    #[must_use]
    pub fn surface(&self, at: usize) -> Option<&Surface> {
        self.scans[at].as_ref().map(|dense| &dense.surface)
    }

    /// Returns the offset from the centred coordinates of a scan to those of its file; zero if the scan cannot be used.
    #[must_use]
    pub fn origin(&self, at: usize) -> Vector3<f64> {
        self.scans[at].as_ref().map_or_else(Vector3::zeros, |dense| dense.origin)
    }

    /// Returns the pose of a scan between files: from its file's coordinates into those of the first scan of its
    /// component.
    #[must_use]
    pub fn in_files(&self, result: &Reconstruction, at: usize, first: usize) -> RigidTransform {
        uncentred(&result.frame_from_scan[at], &self.origin(at), &self.origin(first))
    }

    /// Returns the nodes of the pose graph: for each scan, the points by which poses are compared.
    #[must_use]
    pub fn nodes(&self) -> Vec<Node> {
        let node = |scan: &Option<Dense>| {
            let points = scan.as_ref().map_or([].as_slice(), |dense| dense.surface.points());
            let step = points.len().div_ceil(PROBES).max(1);
            Node { probes: points.iter().step_by(step).map(|p| wide(*p)).collect() }
        };
        self.scans.iter().map(node).collect()
    }

    /// Converts a pose between files into one between centred scans.
    pub(crate) fn centred(&self, source: usize, target: usize, pose: &RigidTransform) -> RigidTransform {
        uncentred(pose, &-self.origin(source), &-self.origin(target))
    }

    /// Returns how two scans touch under a pose that may still be rough; `None` if too little touches.
    pub(crate) fn touch(&self, source: usize, target: usize, pose: &RigidTransform) -> Option<Touch> {
        self.best(source, target, pose, FIRST_REACH, |icp, moving, fixed| icp.measure(moving, fixed, pose))
            .map(|refinement| touch_of(&refinement))
    }

    /// Returns the fraction of the source's points that touch the target.
    #[must_use]
    pub fn overlap(&self, source: usize, touch: &Touch) -> f64 {
        let used = self.scans[source].as_ref().map_or(1, |dense| used(&dense.surface));
        (touch.support / used as f64).min(1.0)
    }

    /// Returns the surface of a scan and, if the side of its normals is uncertain, the surface with its normals flipped;
    /// nothing if the scan cannot be used.
    pub(crate) fn sides(&self, at: usize) -> Vec<&Surface> {
        let Some(dense) = &self.scans[at] else { return Vec::new() };
        std::iter::once(&dense.surface).chain((!dense.sure).then_some(&dense.turned)).collect()
    }

    /// Returns the working length of the collection, data units.
    pub(crate) fn pr(&self) -> f64 {
        self.pr
    }

    /// Returns whether two scans may touch under a pose.
    pub(crate) fn are_near(&self, source: usize, target: usize, pose: &RigidTransform) -> bool {
        let both = self.scans[source].as_ref().zip(self.scans[target].as_ref());
        both.is_some_and(|(moving, fixed)| near(&moving.surface, &fixed.surface, pose, FIRST_REACH * self.pr))
    }

    /// Tries both sides of the normals unless they are certain, and returns the result with more support; `None` if too
    /// little touches.
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

/// Returns the number of points of a surface that are compared with another one.
fn used(surface: &Surface) -> usize {
    surface.len().div_ceil(surface.len().div_ceil(MOVING_POINTS).max(1))
}

/// Returns whether two surfaces are near enough for a closer look.
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

    /// Makes one step of point-to-plane ICP; between two steps, all scans move together.
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
