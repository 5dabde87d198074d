//! Normal equations of a small rigid motion, summed over touching pairs.

use crate::touches::{BLOCK, Column, Touches, Vectors, cross, dot, sum, times};
use crate::uncertainty::scaled;
use crate::{Freedom, Hold};
use congruent_geometry::RigidTransform;
use multiversion::multiversion;
use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};
use std::ops::SubAssign;

/// Minimum number of pairs that hold a pose.
pub(crate) const MIN_PAIRS: usize = 20;
/// Added to the diagonal, as a fraction of the trace.
const DAMPING: f64 = 1e-9;
/// Stiffness from which a direction may be held if the normals are noisy: between noisy planes, spheres and cylinders
/// (up to 0.005) and the loosest right pairs of real scans (from 0.01). See [`Hold::n_free`].
pub const MIN_STIFFNESS: f64 = 0.006;

/// `JᵀKJ` and `−JᵀKd` for motions, rotation before translation, about the origin of the target frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Equations {
    /// From the distances to the tangent planes alone, which are what really holds the pose.
    planes: Symmetric6,
    /// From the other distances that the method uses instead, if any.
    metric: Option<Symmetric6>,
    gradient: Vector6<f64>,
    pub(crate) n_pairs: usize,
    pub(crate) weight: f64,
    weighted_sq: f64,
    place: Vector3<f64>,
    place_sq: f64,
    /// Sum of the squared sines between the normals of each pair.
    disagreement: f64,
}

/// A symmetric sum, of which only the lower triangle is accumulated.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Symmetric6([[f64; 6]; 6]);

impl Symmetric6 {
    /// Adds the weighted squares of some rows.
    pub(crate) fn add(&mut self, rows: &Rows, weights: &Column) {
        add_squares(rows, weights, &mut self.0);
    }

    pub(crate) fn plus(&mut self, other: &Symmetric6) {
        self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()).for_each(|(sum, more)| *sum += more);
    }

    pub(crate) fn matrix(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.0[i.max(j)][i.min(j)])
    }
}

/// How the position of a point of each pair, and thus its distance along a direction, changes with each of six motions.
pub(crate) type Rows = [Column; 6];

/// Returns the rows of the points at these positions.
#[inline(always)]
pub(crate) fn rows(places: &Vectors, directions: &Vectors) -> Rows {
    let [a, b, c] = cross(places.each_ref(), directions.each_ref());
    let [x, y, z] = *directions;
    [a, b, c, x, y, z]
}

impl Equations {
    /// Adds pairs whose distances count only along the normal.
    pub(crate) fn add_planes(&mut self, touches: &Touches) {
        add_planes(self, touches);
    }

    /// Adds pairs whose distances count by a metric `k`, given for each pair by its rows up to the diagonal.
    pub(crate) fn add_metric(&mut self, touches: &Touches, k: &[Column; 6]) {
        add_metric(self, touches, k);
    }

    pub(crate) fn plus(mut self, other: Equations) -> Equations {
        self.planes.plus(&other.planes);
        if let Some(metric) = &other.metric {
            self.metric.get_or_insert_default().plus(metric);
        }
        self.gradient += other.gradient;
        self.n_pairs += other.n_pairs;
        self.weight += other.weight;
        self.weighted_sq += other.weighted_sq;
        self.place += other.place;
        self.place_sq += other.place_sq;
        self.disagreement += other.disagreement;
        self
    }

    /// Returns the information of the distances that the method uses.
    pub(crate) fn information(&self) -> Matrix6<f64> {
        self.metric.as_ref().unwrap_or(&self.planes).matrix()
    }

    /// Returns the centroid of the pairs and their spread around it.
    pub(crate) fn middle(&self) -> (Vector3<f64>, f64) {
        let middle = self.place / self.weight;
        (middle, (self.place_sq / self.weight - middle.norm_squared()).max(0.0).sqrt())
    }

    pub(crate) fn residual(&self) -> f64 {
        if self.weight > 0.0 { (self.weighted_sq / self.weight).sqrt() } else { 0.0 }
    }

    pub(crate) fn hold(&self, freedom: Freedom) -> Hold {
        if self.n_pairs < MIN_PAIRS {
            return Hold::NONE;
        }
        let (middle, spread) = self.middle();
        Hold::new(freedom, &self.planes.matrix(), self.weight, &middle, spread)
            .with_noise(self.disagreement / self.weight)
    }

    /// Returns the motion that reduces the distances most, among those that the surfaces hold; rotation vector and
    /// translation about the origin.
    pub(crate) fn step(&self, freedom: Freedom) -> Option<Vector6<f64>> {
        if self.n_pairs < MIN_PAIRS {
            return None;
        }
        let basis = self.basis(freedom)?;
        let information = basis.transpose() * self.information() * basis;
        let information = information + Matrix6::identity() * (DAMPING * information.trace().max(f64::MIN_POSITIVE));
        let step = basis * information.cholesky()?.solve(&(basis.transpose() * self.gradient));
        step.iter().all(|v| v.is_finite()).then_some(step)
    }

    /// Returns motions about the origin, one per column, well scaled; those that nothing holds are zero. After Zhang,
    /// Kaess and Singh (2016), who leave out of a step what the geometry does not determine.
    fn basis(&self, freedom: Freedom) -> Option<Matrix6<f64>> {
        let middle = self.middle().0;
        let mut basis = self.basis_about_middle(freedom)?;
        for mut motion in basis.column_iter_mut() {
            let shift = motion.fixed_rows::<3>(0).cross(&middle);
            motion.fixed_rows_mut::<3>(3).sub_assign(&shift);
        }
        Some(basis)
    }

    /// Returns the same motions about the centroid of the pairs.
    pub(crate) fn basis_about_middle(&self, freedom: Freedom) -> Option<Matrix6<f64>> {
        let (hold, (_, spread)) = (self.hold(freedom), self.middle());
        let n_free = hold.n_free(MIN_STIFFNESS);
        let mut basis = Matrix6::zeros();
        for (i, motion) in hold.motions.iter().enumerate().skip(n_free) {
            basis.set_column(i, &scaled(motion, spread));
        }
        (n_free < 6).then_some(basis)
    }
}

/// Adds squares as [`Symmetric6::add`] does. This function and those below are compiled for several instruction sets
/// and chosen at run time; the bits are the same on all of them.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn add_squares(rows: &Rows, weights: &Column, sums: &mut [[f64; 6]; 6]) {
    squares(rows, weights, sums);
}

#[inline(always)]
fn squares(rows: &Rows, weights: &Column, sums: &mut [[f64; 6]; 6]) {
    for i in 0..6 {
        let weighted = times(weights, &rows[i]);
        for j in 0..=i {
            sums[i][j] += dot(&weighted, &rows[j]);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn add_planes(equations: &mut Equations, touches: &Touches) {
    let rows = rows(&touches.moved, &touches.normal);
    squares(&rows, &touches.weight, &mut equations.planes.0);
    let pull = times(&touches.weight, &touches.distance);
    for (gradient, row) in equations.gradient.iter_mut().zip(&rows) {
        *gradient -= dot(row, &pull);
    }
    count(equations, touches);
}

/// Uses the Jacobian (−[p]× | I) of the offset of a point p, whose columns turn into products with p.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn add_metric(equations: &mut Equations, touches: &Touches, metric: &[Column; 6]) {
    squares(&rows(&touches.moved, &touches.normal), &touches.weight, &mut equations.planes.0);
    let place = touches.moved.each_ref();
    let [xx, xy, yy, xz, yz, zz] = metric.each_ref().map(|entry| times(entry, &touches.weight));
    let pull = [[&xx, &xy, &xz], [&xy, &yy, &yz], [&xz, &yz, &zz]];
    let turning = pull.map(|column| cross(place, column));
    let Symmetric6(sums) = equations.metric.get_or_insert_default();
    for i in 0..3 {
        let turned_twice = cross(place, [&turning[0][i], &turning[1][i], &turning[2][i]]);
        for j in 0..=i {
            sums[i][j] += sum(&turned_twice[j]);
            sums[3 + i][3 + j] += sum(pull[i][j]);
        }
        for j in 0..3 {
            sums[3 + i][j] += sum(&turning[i][j]);
        }
    }
    let mut force = [[0.0; BLOCK]; 3];
    for i in 0..3 {
        for k in 0..BLOCK {
            force[i][k] = pull[i][0][k] * touches.offset[0][k]
                + pull[i][1][k] * touches.offset[1][k]
                + pull[i][2][k] * touches.offset[2][k];
        }
    }
    let torque = cross(place, force.each_ref());
    for i in 0..3 {
        equations.gradient[i] -= sum(&torque[i]);
        equations.gradient[3 + i] -= sum(&force[i]);
    }
    count(equations, touches);
}

#[inline(always)]
fn count(equations: &mut Equations, touches: &Touches) {
    let Touches { weight, distance, moved, cosine, .. } = touches;
    let (mut far_sq, mut sine_sq) = ([0.0; BLOCK], [0.0; BLOCK]);
    for k in 0..BLOCK {
        far_sq[k] = moved[0][k] * moved[0][k] + moved[1][k] * moved[1][k] + moved[2][k] * moved[2][k];
        sine_sq[k] = 1.0 - cosine[k] * cosine[k];
    }
    equations.n_pairs += sum(&touches.is_touch) as usize;
    equations.weight += sum(weight);
    equations.weighted_sq += dot(&times(weight, distance), distance);
    for (place, moved) in equations.place.iter_mut().zip(moved) {
        *place += dot(weight, moved);
    }
    equations.place_sq += dot(weight, &far_sq);
    equations.disagreement += dot(weight, &sine_sq);
}

/// Returns the pose after a small motion about the origin of the target frame.
pub(crate) fn applied(step: &Vector6<f64>, pose: &RigidTransform) -> RigidTransform {
    let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
    let mut moved = RigidTransform::from_parts(Translation3::from(step.fixed_rows::<3>(3).into_owned()), turn) * pose;
    moved.rotation.renormalize();
    moved
}
