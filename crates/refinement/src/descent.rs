//! The loop that all refiners share: pair, solve, move, with a shrinking search radius and robust weights.

use crate::equations::{Equations, applied};
use crate::pairing::{Every, Pairing};
use crate::touches::Touches;
use crate::uncertainty::uncertainty;
use crate::{Freedom, Nearest, Refinement};
use congruent_geometry::{LastSeen, RigidTransform, Surface, wide};
use nalgebra::Vector6;
use rayon::prelude::*;

/// Number of points whose sums one thread forms at a time; fixed, so that the order of additions is, too.
const CHUNK: usize = 1024;
/// Fraction of the rounds over which the radius shrinks.
const SHRINKING: f64 = 0.7;
/// Fraction of its initial value below which the robust support of a pose must not fall.
const MIN_SUPPORT: f64 = 0.999;

/// How far a refinement searches, and how long; lengths in data units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    /// Distance above which pairs are ignored at first …
    pub start_radius: f64,
    /// … and at the end.
    pub end_radius: f64,
    /// Distance to the tangent plane at which the weight of a pair is one half (Cauchy).
    pub scale: f64,
    /// Maximum number of rounds.
    pub rounds: usize,
    /// Maximum number of source points used in a round, spread evenly over the order of the source.
    pub max_points: usize,
    /// Minimum agreement of the normals (cosine).
    pub min_normal_cosine: f64,
    /// A step shorter than this many data units (at the rim of the surface) ends the refinement.
    pub tolerance: f64,
    /// The allowed motions.
    pub freedom: Freedom,
}

/// The contribution of touching pairs to the equations.
pub(crate) trait Distance: Sync {
    /// Factor by which the standard deviations derived from the distances are multiplied. Closest points and normals
    /// have errors that distances do not show; measured on simulated pairs, whose poses are known.
    const UNSEEN: f64;

    fn add(&self, equations: &mut Equations, touches: &Touches);
}

/// Two surfaces, and the search for closest points of the second.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub(crate) source: &'a Surface,
    pub(crate) target: &'a Surface,
    pub(crate) nearest: &'a dyn Nearest,
}

impl Schedule {
    /// Returns the schedule for a pose that is only roughly right, from one radius to another: pairs have half the
    /// weight at half the end radius, normals may differ by 60 degrees, and steps below a fiftieth of `resolution` end
    /// it. Lengths in data units.
    #[must_use]
    pub fn rough([start_radius, end_radius]: [f64; 2], resolution: f64, freedom: Freedom) -> Schedule {
        Schedule {
            start_radius,
            end_radius,
            scale: 0.5 * end_radius,
            rounds: 30,
            max_points: 4000,
            min_normal_cosine: 0.5,
            tolerance: 0.02 * resolution,
            freedom,
        }
    }

    /// Refines a pose and measures the result; the start is kept if the surfaces lose contact.
    pub(crate) fn refine<D: Distance>(&self, scene: Scene<'_>, distance: &D, start: &RigidTransform) -> Refinement {
        let at_the_end = |pose: &RigidTransform| self.pairing(scene, pose, self.end_radius);
        let mut subsets = self.subsets(scene);
        // What the first subset sees is remembered from the start, through the descent, to the end.
        let before = subsets[0].sums(&at_the_end(start), distance);
        let end = self.descent(scene, distance, start, &mut subsets);
        let after = subsets[0].sums(&at_the_end(&end), distance);
        let kept = after.weight > 0.0 && after.weight >= MIN_SUPPORT * before.weight;
        let (pose, equations) = if kept { (end, after) } else { (*start, before) };
        let known = uncertainty(&mut subsets[0], &at_the_end(&pose), &equations, self.freedom);
        Refinement { uncertainty: known.map(|known| known.widened(D::UNSEEN)), ..self.refinement(pose, &equations) }
    }

    /// Refines a pose without measuring the result.
    pub(crate) fn descend(&self, scene: Scene<'_>, distance: &impl Distance, start: &RigidTransform) -> RigidTransform {
        self.descent(scene, distance, start, &mut self.subsets(scene))
    }

    fn descent(
        &self,
        scene: Scene<'_>,
        distance: &impl Distance,
        start: &RigidTransform,
        subsets: &mut [Subset],
    ) -> RigidTransform {
        let reach = scene.source.points().iter().map(|p| wide(*p).norm_squared()).fold(0.0, f64::max).sqrt();
        let mut pose = *start;
        for round in 0..self.rounds {
            let progress = (round as f64 / (SHRINKING * self.rounds as f64)).min(1.0);
            let radius = self.start_radius * (self.end_radius / self.start_radius).powf(progress);
            // A different subset each time: together they are the whole surface.
            let pairing = self.pairing(scene, &pose, radius);
            let subset = &mut subsets[round % self.stride(scene)];
            let Some(step) = subset.sums(&pairing, distance).step(self.freedom) else { break };
            let moved = movement(&step, &pose, reach);
            pose = applied(&step, &pose);
            if progress >= 1.0 && moved < self.tolerance {
                break;
            }
        }
        pose
    }

    /// Measures what holds a pose as it is: the pairs within the end radius.
    pub(crate) fn measure(&self, scene: Scene<'_>, distance: &impl Distance, pose: &RigidTransform) -> Refinement {
        let pairing = self.pairing(scene, pose, self.end_radius);
        self.refinement(*pose, &Subset::new(scene, 0, self.stride(scene)).sums(&pairing, distance))
    }

    fn refinement(&self, pose: RigidTransform, equations: &Equations) -> Refinement {
        Refinement {
            target_from_source: pose,
            n_pairs: equations.n_pairs,
            residual: equations.residual(),
            support: equations.weight,
            information: equations.information(),
            hold: equations.hold(self.freedom).firm_where_fixed(self.freedom),
            uncertainty: None,
        }
    }

    /// Returns at most as many subsets as there are rounds, and at least one.
    fn subsets(&self, scene: Scene<'_>) -> Vec<Subset> {
        let stride = self.stride(scene);
        (0..stride.min(self.rounds).max(1)).map(|first| Subset::new(scene, first, stride)).collect()
    }

    fn stride(&self, scene: Scene<'_>) -> usize {
        scene.source.len().div_ceil(self.max_points.max(1)).max(1)
    }

    fn pairing<'a>(&self, scene: Scene<'a>, pose: &RigidTransform, radius: f64) -> Pairing<'a> {
        let Scene { source, target, nearest } = scene;
        Pairing::new((source, target, nearest), pose, radius, self.min_normal_cosine, self.scale)
    }
}

/// Some points of the source, and what each of them saw last, if the search remembers it.
pub(crate) struct Subset {
    points: Every,
    last: Vec<LastSeen>,
}

impl Subset {
    fn new(scene: Scene<'_>, first: usize, step: usize) -> Self {
        let points = Every::new(scene.source.len(), first, step);
        let remembered = if scene.nearest.remembers() { points.count } else { 0 };
        Subset { points, last: vec![LastSeen::default(); remembered] }
    }

    fn sums(&mut self, pairing: &Pairing<'_>, distance: &impl Distance) -> Equations {
        let parts = self.gathered(pairing, |equations, touches| distance.add(equations, touches));
        parts.into_iter().fold(Equations::default(), Equations::plus)
    }

    /// Gathers a value from the touching points, in parts that do not depend on threads.
    pub(crate) fn gathered<T: Default + Send>(
        &mut self,
        pairing: &Pairing<'_>,
        add: impl Fn(&mut T, &Touches) + Sync,
    ) -> Vec<T> {
        let one_chunk = |(points, last): (Every, &mut [LastSeen])| {
            let mut part = T::default();
            pairing.each_touch(points, last, |touches| add(&mut part, touches));
            part
        };
        if self.points.count <= CHUNK {
            return vec![one_chunk((self.points, &mut self.last))];
        }
        let mut last = self.last.chunks_mut(CHUNK);
        let chunks: Vec<_> =
            self.points.chunks(CHUNK).map(|points| (points, last.next().unwrap_or_default())).collect();
        chunks.into_par_iter().map(one_chunk).collect()
    }
}

/// Returns an upper bound of how far a step moves any point of a source with this reach.
fn movement(step: &Vector6<f64>, pose: &RigidTransform, reach: f64) -> f64 {
    let rotation = step.fixed_rows::<3>(0);
    let of_the_middle = rotation.cross(&pose.translation.vector) + step.fixed_rows::<3>(3);
    rotation.norm() * reach + of_the_middle.norm()
}
