//! Point-to-plane ICP (Chen and Medioni 1991).

use crate::descent::{Distance, Scene};
use crate::equations::Equations;
use crate::nearest::Exact;
use crate::touches::Touches;
use crate::{Freedom, Nearest, Refinement, Refiner, Schedule};
use congruent_geometry::{RigidTransform, Surface};

/// Moves points onto the target's tangent planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointToPlane {
    /// How far it searches, and how long.
    pub schedule: Schedule,
}

impl Refiner for PointToPlane {
    fn refine(&self, source: &Surface, target: &Surface, start: &RigidTransform) -> Refinement {
        let exact = Exact::of(target);
        self.schedule.refine(Scene { source, target, nearest: exact.search() }, &Planes, start)
    }
}

impl PointToPlane {
    /// Restricts the refiner to the allowed motions.
    #[must_use]
    pub fn within(mut self, freedom: Freedom) -> Self {
        self.schedule.freedom = freedom;
        self
    }

    /// Refines a pose without measuring the result, with closest points of the target from the given search.
    #[must_use]
    pub fn descend(
        &self,
        source: &Surface,
        target: &Surface,
        nearest: &dyn Nearest,
        start: &RigidTransform,
    ) -> RigidTransform {
        self.schedule.descend(Scene { source, target, nearest }, &Planes, start)
    }

    /// Measures what holds a pose as it is: the pairs within the end radius, from all points of the source up to the
    /// maximum.
    #[must_use]
    pub fn measure(&self, source: &Surface, target: &Surface, pose: &RigidTransform) -> Refinement {
        let exact = Exact::of(target);
        self.schedule.measure(Scene { source, target, nearest: exact.search() }, &Planes, pose)
    }
}

struct Planes;

impl Distance for Planes {
    const UNSEEN: f64 = 2.2;

    fn add(&self, equations: &mut Equations, touches: &Touches) {
        equations.add_planes(touches);
    }
}
