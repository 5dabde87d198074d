//! Normal equations of a small rigid motion, summed over touching pairs.

use crate::pairing::Touch;
use crate::uncertainty::scaled;
use crate::{Freedom, Hold};
use congruent_geometry::RigidTransform;
use nalgebra::{Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};
use std::ops::SubAssign;

/// Fewer pairs than this hold no pose.
pub(crate) const MIN_PAIRS: usize = 20;
/// Added to the diagonal, as a share of the trace.
const DAMPING: f64 = 1e-9;
/// Stiffness from which a direction may be held, where the normals are noisy: see [`Hold::n_free`].
pub(crate) const MIN_STIFFNESS: f64 = 0.006;

/// `JᵀKJ` and `−JᵀKd` for motions rotation before translation, about the origin of the target frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Equations {
    /// Of the distances to the tangent planes alone: what really holds.
    planes: Symmetric6,
    /// Of other distances that the method looks at instead.
    metric: Option<Symmetric6>,
    gradient: Vector6<f64>,
    pub(crate) n_pairs: usize,
    pub(crate) weight: f64,
    weighted_sq: f64,
    place: Vector3<f64>,
    place_sq: f64,
    /// Squared sines between the normals of each pair.
    disagreement: f64,
}

/// A symmetric sum; only the lower triangle is added up.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Symmetric6([[f64; 6]; 6]);

impl Symmetric6 {
    /// Adds the row's square.
    #[inline]
    pub(crate) fn add(&mut self, row: &Vector6<f64>, weight: f64) {
        for i in 0..6 {
            let weighted = weight * row[i];
            for j in 0..=i {
                self.0[i][j] += weighted * row[j];
            }
        }
    }

    /// Rows of the upper left block, of the lower left one, and the lower right one.
    #[inline]
    fn add_blocks(&mut self, upper: &[Vector3<f64>; 3], across: &[Vector3<f64>; 3], lower: &Matrix3<f64>) {
        for i in 0..3 {
            for j in 0..=i {
                self.0[i][j] += upper[i][j];
                self.0[3 + i][3 + j] += lower[(i, j)];
            }
            self.0[3 + i].iter_mut().zip(&across[i]).for_each(|(sum, entry)| *sum += entry);
        }
    }

    pub(crate) fn plus(&mut self, other: &Symmetric6) {
        self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()).for_each(|(sum, more)| *sum += more);
    }

    pub(crate) fn matrix(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| self.0[i.max(j)][i.min(j)])
    }
}

/// A motion of a point: how its place and its distance along `direction` change.
pub(crate) fn row(place: &Vector3<f64>, direction: &Vector3<f64>) -> Vector6<f64> {
    let turning = place.cross(direction);
    Vector6::new(turning.x, turning.y, turning.z, direction.x, direction.y, direction.z)
}

impl Equations {
    /// A pair whose distances count along the normal only.
    pub(crate) fn add_plane(&mut self, touch: &Touch) {
        let row = row(&touch.moved, &touch.normal);
        self.planes.add(&row, touch.weight);
        self.gradient -= row * (touch.weight * touch.distance);
        self.count(touch);
    }

    /// A pair whose distances count by the metric `k`.
    pub(crate) fn add_metric(&mut self, touch: &Touch, k: &Matrix3<f64>) {
        self.planes.add(&row(&touch.moved, &touch.normal), touch.weight);
        // With the Jacobian (−[p]× | I) of the offset of a point p, whose columns turn into products with p.
        let (p, pull) = (&touch.moved, k * touch.weight);
        let turning = [0, 1, 2].map(|i| p.cross(&pull.column(i).into_owned()));
        let turned_twice = [0, 1, 2].map(|i| p.cross(&Vector3::new(turning[0][i], turning[1][i], turning[2][i])));
        self.metric.get_or_insert_default().add_blocks(&turned_twice, &turning, &pull);
        let force = pull * touch.offset;
        let torque = p.cross(&force);
        self.gradient -= Vector6::new(torque.x, torque.y, torque.z, force.x, force.y, force.z);
        self.count(touch);
    }

    fn count(&mut self, touch: &Touch) {
        self.n_pairs += 1;
        self.weight += touch.weight;
        self.weighted_sq += touch.weight * touch.distance * touch.distance;
        self.place += touch.moved * touch.weight;
        self.place_sq += touch.moved.norm_squared() * touch.weight;
        self.disagreement += touch.weight * (1.0 - touch.cosine * touch.cosine);
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

    /// Of the distances that the method looks at.
    pub(crate) fn information(&self) -> Matrix6<f64> {
        self.metric.as_ref().unwrap_or(&self.planes).matrix()
    }

    /// The middle of the pairs and their spread around it.
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

    /// The motion that lowers the distances most, of those that the surfaces hold; rotation vector and translation about
    /// the origin.
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

    /// Motions about the origin, a column each, well scaled; those that nothing holds are zero. After Zhang, Kaess and
    /// Singh (2016), who leave out of a step what the geometry does not determine.
    fn basis(&self, freedom: Freedom) -> Option<Matrix6<f64>> {
        let middle = self.middle().0;
        let mut basis = self.basis_about_middle(freedom)?;
        for mut motion in basis.column_iter_mut() {
            let shift = motion.fixed_rows::<3>(0).cross(&middle);
            motion.fixed_rows_mut::<3>(3).sub_assign(&shift);
        }
        Some(basis)
    }

    /// The same about the middle of the pairs.
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

/// The pose after a small motion about the origin of the target frame.
pub(crate) fn applied(step: &Vector6<f64>, pose: &RigidTransform) -> RigidTransform {
    let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
    let mut moved = RigidTransform::from_parts(Translation3::from(step.fixed_rows::<3>(3).into_owned()), turn) * pose;
    moved.rotation.renormalize();
    moved
}
