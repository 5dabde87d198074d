//! Point-to-plane ICP (Chen and Medioni 1991) with a shrinking search radius and robust weights.

use crate::{Hold, Nearest};
use congruent_geometry::{RigidTransform, Surface, narrow, wide};
use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};
use rayon::prelude::*;

/// Points whose sums one thread makes at a time; fixed, so that the order of additions is too.
const CHUNK: usize = 1024;
/// Share of the iterations over which the radius shrinks.
const SHRINKING: f64 = 0.7;
/// Fewer pairs than this hold no pose.
const MIN_PAIRS: usize = 20;
/// Added to the diagonal, as a share of the trace, so that directions the geometry leaves free stay where they are.
const DAMPING: f64 = 1e-9;

/// Settings; lengths in data units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointToPlane {
    /// Pairs farther apart are ignored at first …
    pub start_radius: f64,
    /// … and at the end. Half of it is the scale of the robust (Cauchy) weight.
    pub end_radius: f64,
    /// At most so many.
    pub iterations: usize,
    /// Points of the moving surface that are used, spread evenly over its order.
    pub max_points: usize,
    /// Normals must agree at least so well (cosine).
    pub min_normal_cosine: f64,
    /// A step below this many data units (at the rim of the surface) ends it.
    pub tolerance: f64,
}

/// A refined pose and what held it.
#[derive(Clone, Copy, Debug)]
pub struct Refinement {
    /// The start where nothing could be refined.
    pub target_from_source: RigidTransform,
    /// Pairs of the last iteration.
    pub n_pairs: usize,
    /// `JᵀWJ` of the last iteration; rotation (about the target frame's origin) before translation.
    pub information: Matrix6<f64>,
    /// Weighted root mean square of the point-to-plane distances, data units.
    pub residual: f64,
    /// Sum of the robust weights: how much of the surface touches, the closer the more.
    pub support: f64,
    /// How firmly the pairs hold the pose.
    pub hold: Hold,
}

impl PointToPlane {
    /// Moves `moving` onto `fixed`, whose closest points `nearest` finds, from a rough start.
    pub fn refine(
        &self,
        moving: &Surface,
        fixed: &Surface,
        nearest: &dyn Nearest,
        start: &RigidTransform,
    ) -> Refinement {
        let reach = moving.points().iter().map(|p| wide(*p).norm()).fold(0.0, f64::max);
        let stride = moving.len().div_ceil(self.max_points.max(1)).max(1);
        let mut pose = *start;
        let mut sums = Sums::default();
        for iteration in 0..self.iterations {
            let progress = (iteration as f64 / (SHRINKING * self.iterations as f64)).min(1.0);
            let radius = self.start_radius * (self.end_radius / self.start_radius).powf(progress);
            // Another subset every time: together they are the whole surface.
            sums = self.sums(moving, fixed, nearest, &pose, radius, iteration % stride, stride);
            let Some(step) = sums.step() else { break };
            pose = applied(&step, &pose);
            let moved = step.fixed_rows::<3>(0).norm() * reach + step.fixed_rows::<3>(3).norm();
            if progress >= 1.0 && moved < self.tolerance {
                break;
            }
        }
        pose.rotation.renormalize();
        sums.refinement(pose)
    }

    /// What holds a pose as it is: the pairs within the end radius, all points of the moving surface up to the maximum.
    pub fn measure(
        &self,
        moving: &Surface,
        fixed: &Surface,
        nearest: &dyn Nearest,
        pose: &RigidTransform,
    ) -> Refinement {
        let stride = moving.len().div_ceil(self.max_points.max(1)).max(1);
        let sums = self.sums(moving, fixed, nearest, pose, self.end_radius, 0, stride);
        sums.refinement(*pose)
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one iteration, named at the only place of call")]
    fn sums(
        &self,
        moving: &Surface,
        fixed: &Surface,
        nearest: &dyn Nearest,
        pose: &RigidTransform,
        radius: f64,
        offset: usize,
        stride: usize,
    ) -> Sums {
        let chosen: Vec<usize> = (offset..moving.len()).step_by(stride).collect();
        let rotation = *pose.rotation.to_rotation_matrix().matrix();
        let shift = pose.translation.vector;
        let scale_sq = (0.5 * self.end_radius).powi(2);
        let one_chunk = |indices: &[usize]| {
            let mut sums = Sums::default();
            for &i in indices {
                let moved: Vector3<f64> = rotation * wide(moving.points()[i]) + shift;
                let Some(found) = nearest.nearest(&narrow(&moved)) else { continue };
                let offset = moved - wide(fixed.points()[found as usize]);
                let normal = wide(fixed.normals()[found as usize]);
                let cosine = (rotation * wide(moving.normals()[i])).dot(&normal);
                if offset.norm_squared() > radius * radius || cosine < self.min_normal_cosine {
                    continue;
                }
                let distance = offset.dot(&normal);
                let weight = 1.0 / (1.0 + distance * distance / scale_sq);
                sums.add(&moved, &normal, distance, weight);
                sums.disagreement += weight * (1.0 - cosine * cosine);
            }
            sums
        };
        if chosen.len() <= CHUNK {
            return one_chunk(&chosen);
        }
        let parts: Vec<Sums> = chosen.par_chunks(CHUNK).map(one_chunk).collect();
        parts.into_iter().fold(Sums::default(), Sums::plus)
    }
}

/// Sums of the normal equations.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    information: Matrix6<f64>,
    gradient: Vector6<f64>,
    n_pairs: usize,
    weight: f64,
    weighted_sq: f64,
    place: Vector3<f64>,
    place_sq: f64,
    /// Squared sines between the normals of each pair.
    disagreement: f64,
}

impl Sums {
    fn add(&mut self, moved: &Vector3<f64>, normal: &Vector3<f64>, distance: f64, weight: f64) {
        let turning = moved.cross(normal);
        let row = Vector6::new(turning.x, turning.y, turning.z, normal.x, normal.y, normal.z);
        self.information += row * row.transpose() * weight;
        self.gradient -= row * (weight * distance);
        self.n_pairs += 1;
        self.weight += weight;
        self.weighted_sq += weight * distance * distance;
        self.place += moved * weight;
        self.place_sq += moved.norm_squared() * weight;
    }

    fn plus(mut self, other: Sums) -> Sums {
        self.information += other.information;
        self.gradient += other.gradient;
        self.n_pairs += other.n_pairs;
        self.weight += other.weight;
        self.weighted_sq += other.weighted_sq;
        self.place += other.place;
        self.place_sq += other.place_sq;
        self.disagreement += other.disagreement;
        self
    }

    /// Rotation vector and translation that lower the distances most.
    fn step(&self) -> Option<Vector6<f64>> {
        if self.n_pairs < MIN_PAIRS {
            return None;
        }
        let damped = self.information + Matrix6::identity() * (DAMPING * self.information.trace());
        damped.cholesky().map(|factor| factor.solve(&self.gradient)).filter(|step| step.iter().all(|v| v.is_finite()))
    }

    fn refinement(&self, pose: RigidTransform) -> Refinement {
        let residual = if self.weight > 0.0 { (self.weighted_sq / self.weight).sqrt() } else { 0.0 };
        let middle = self.place / self.weight;
        let spread = (self.place_sq / self.weight - middle.norm_squared()).max(0.0).sqrt();
        let hold = if self.n_pairs < MIN_PAIRS {
            Hold::NONE
        } else {
            Hold::new(&self.information, self.weight, &middle, spread).with_noise(self.disagreement / self.weight)
        };
        Refinement {
            target_from_source: pose,
            n_pairs: self.n_pairs,
            information: self.information,
            residual,
            support: self.weight,
            hold,
        }
    }
}

fn applied(step: &Vector6<f64>, pose: &RigidTransform) -> RigidTransform {
    let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
    RigidTransform::from_parts(Translation3::from(step.fixed_rows::<3>(3).into_owned()), turn) * pose
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::{
        NearestField, NeighborIndex, Neighborhood, Orientation, Point, estimate_normals, mean_displacement, orient,
    };

    /// A bumpy sheet, 60 by 60, one unit between neighbours.
    fn sheet() -> Surface {
        let height = |x: f64, y: f64| 6.0 * (x / 9.0).sin() * (y / 7.0).cos() + 3.0 * ((x + 2.0 * y) / 11.0).sin();
        let points: Vec<Point> = (0..3600)
            .map(|i| {
                let (x, y) = (f64::from(i % 60) - 30.0, f64::from(i / 60) - 30.0);
                narrow(&Vector3::new(x, y, height(x, y)))
            })
            .collect();
        let index = NeighborIndex::new(&points);
        let mut normals: Vec<Point> =
            estimate_normals(&points, &index, Neighborhood::Nearest(12)).iter().map(|n| n.normal).collect();
        orient(Orientation::Viewpoint { at: [0.0, 0.0, 1e4] }, &points, &Vector3::zeros(), &index, 1.0, &mut normals);
        Surface::new(points, normals, index, 1.0)
    }

    fn settings() -> PointToPlane {
        PointToPlane {
            start_radius: 6.0,
            end_radius: 1.5,
            iterations: 40,
            max_points: 2000,
            min_normal_cosine: 0.5,
            tolerance: 1e-4,
        }
    }

    fn start() -> RigidTransform {
        RigidTransform::new(Vector3::new(1.0, -1.5, 0.8), Vector3::new(0.05, -0.04, 0.06))
    }

    #[test]
    fn a_shifted_surface_slides_back() {
        let surface = sheet();
        let field = NearestField::new(surface.points(), 0.5, 6.0);
        for nearest in [surface.index() as &dyn Nearest, &field] {
            let refined = settings().refine(&surface, &surface, nearest, &start());
            let error = mean_displacement(surface.points(), &refined.target_from_source, &RigidTransform::identity());
            assert!(error < 0.05, "{error}");
            assert!(refined.residual < 0.05 && refined.n_pairs > 1500);
        }
    }

    #[test]
    fn what_touches_nothing_stays() {
        let surface = sheet();
        let far = RigidTransform::translation(1e4, 0.0, 0.0);
        let refined = settings().refine(&surface, &surface, surface.index(), &far);
        assert!(
            refined.n_pairs == 0
                && (refined.target_from_source.translation.vector - far.translation.vector).norm() < 1e-9
        );
    }

    #[test]
    fn threads_do_not_matter() {
        let surface = sheet();
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| settings().refine(&surface, &surface, surface.index(), &start()).target_from_source)
        };
        assert_eq!(run(1), run(4));
    }
}
