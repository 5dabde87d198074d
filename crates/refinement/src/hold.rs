//! How firmly touching surfaces hold a pose: the directions in which they slide along each other.

use crate::Freedom;
use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector3, Vector6};

/// The six independent motions of one surface on the other, and how much each would separate the surfaces.
///
/// Motions are measured about the centroid of the overlap, rotations in units of its radius, so that the numbers are
/// dimensionless: a motion that moves the points by one along their normals everywhere has stiffness one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// Mean squared separation of the surfaces for a unit motion, ascending; infinite for a motion that is not allowed.
    pub stiffness: [f64; 6],
    /// Stiffness that a perfect plane would appear to have because its normals are noisy.
    pub noise: f64,
    /// The motions: rotation (radians times the overlap's radius) before translation, target frame.
    pub motions: [Vector6<f64>; 6],
}

impl Hold {
    /// No direction is held.
    pub const NONE: Hold =
        Hold { stiffness: [0.0; 6], noise: 0.0, motions: [Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0); 6] };

    /// Computes the hold from normal equations about the origin, summed over pairs of this total weight around
    /// `middle`. Motions that are not allowed have no stiffness.
    pub(crate) fn new(
        freedom: Freedom,
        information: &Matrix6<f64>,
        weight: f64,
        middle: &Vector3<f64>,
        radius: f64,
    ) -> Hold {
        let mut about_middle = Matrix6::identity();
        about_middle.fixed_view_mut::<3, 3>(0, 3).copy_from(&-middle.cross_matrix());
        let mut scale = Matrix6::identity();
        scale.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() / radius.max(f64::MIN_POSITIVE)));
        let change = scale * about_middle;
        let allowed = freedom.projection();
        let scaled = allowed * (change * information * change.transpose() / weight) * allowed;
        if !scaled.iter().all(|v| v.is_finite()) {
            return Hold::NONE;
        }
        let eigen = SymmetricEigen::new(scaled);
        let mut order = [0, 1, 2, 3, 4, 5];
        order.sort_by(|&a: &usize, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        Hold {
            stiffness: order.map(|i| eigen.eigenvalues[i].max(0.0)),
            noise: 0.0,
            motions: order.map(|i| eigen.eigenvectors.column(i).into_owned()),
        }
    }

    /// Marks motions that are not allowed as held, whatever the surfaces do; they come last.
    pub(crate) fn firm_where_fixed(mut self, freedom: Freedom) -> Hold {
        let n_fixed = freedom.n_fixed();
        // They had no stiffness, so they came first.
        self.stiffness[..n_fixed].fill(f64::INFINITY);
        self.stiffness.rotate_left(n_fixed);
        self.motions.rotate_left(n_fixed);
        self
    }

    /// Sets the stiffness that the noise of the normals alone would give to a plane, from the mean squared sine between
    /// the normals of touching points: each of the two normals has independent errors in two directions.
    pub(crate) fn with_noise(mut self, disagreement: f64) -> Hold {
        self.noise = disagreement / 4.0;
        self
    }

    /// Returns how many of the motions are free: they separate the surfaces by less than `stiffness`, and by no more
    /// than noisy normals would give to a plane; or by next to nothing.
    #[must_use]
    pub fn n_free(&self, stiffness: f64) -> usize {
        let limit = (NOISE_MARGIN * self.noise).min(stiffness).max(stiffness * NEXT_TO_NOTHING);
        self.stiffness.iter().filter(|&&s| s < limit).count()
    }
}

/// Factor applied to the noise: between planes, spheres and cylinders (up to 1.03) and loose but right pairs of real
/// scans (from 1.17).
const NOISE_MARGIN: f64 = 1.1;
/// Fraction of the minimum stiffness below which the noise is irrelevant.
const NEXT_TO_NOTHING: f64 = 0.08;

#[cfg(test)]
mod tests {
    use super::*;

    /// The hold from the unweighted normal equations of points with normals.
    fn hold_of(freedom: Freedom, points: &[(Vector3<f64>, Vector3<f64>)], shift: &Vector3<f64>) -> Hold {
        let mut information = Matrix6::zeros();
        let (mut middle, mut square) = (Vector3::zeros(), 0.0);
        for (p, n) in points {
            let p = p + shift;
            let turning = p.cross(n);
            let row = Vector6::new(turning.x, turning.y, turning.z, n.x, n.y, n.z);
            information += row * row.transpose();
            middle += p;
            square += p.norm_squared();
        }
        let n = points.len() as f64;
        middle /= n;
        Hold::new(freedom, &information, n, &middle, (square / n - middle.norm_squared()).sqrt())
    }

    /// Points on a surface given by two parameters.
    fn surface(at: impl Fn(f64, f64) -> (Vector3<f64>, Vector3<f64>)) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        (0..900).map(|i| at(f64::from(i % 30) / 30.0, f64::from(i / 30) / 30.0)).collect()
    }

    /// Roughly half of a cylinder along z.
    fn tube() -> Vec<(Vector3<f64>, Vector3<f64>)> {
        surface(|u, v| {
            let d = Vector3::new((3.0 * u).cos(), (3.0 * u).sin(), 0.0);
            (d + Vector3::z() * 2.0 * v, d)
        })
    }

    #[test]
    fn a_motion_that_is_not_allowed_is_no_open_direction() {
        for (axis, free) in [(Vector3::x_axis(), 1), (Vector3::z_axis(), 2)] {
            let freedom = Freedom::About(axis);
            let hold = hold_of(freedom, &tube(), &Vector3::new(3.0, -40.0, 8.0)).firm_where_fixed(freedom);
            assert_eq!(hold.n_free(1e-6), free, "{:?}", hold.stiffness);
            assert_eq!(hold.stiffness[4..], [f64::INFINITY; 2]);
            assert!(hold.stiffness.is_sorted() && hold.stiffness[3].is_finite());
        }
    }

    #[test]
    fn planes_spheres_and_cylinders_slide_and_corners_hold() {
        let plane = surface(|u, v| (Vector3::new(u, v, 0.0), Vector3::z()));
        let cap = surface(|u, v| {
            let d = Vector3::new(u - 0.5, v - 0.5, 1.0).normalize();
            (d, d)
        });
        let tube = tube();
        let corner: Vec<_> = (0..3)
            .flat_map(|axis| {
                surface(move |u, v| {
                    let mut p = Vector3::new(u, v, 0.0);
                    p.swap_rows(2, axis);
                    (p, Vector3::ith(axis, 1.0))
                })
            })
            .collect();
        for (name, points, free) in
            [("plane", plane, 3), ("sphere", cap, 3), ("cylinder", tube, 2), ("corner", corner, 0)]
        {
            for shift in [Vector3::zeros(), Vector3::new(40.0, -7.0, 300.0)] {
                let hold = hold_of(Freedom::All, &points, &shift);
                assert_eq!(hold.n_free(1e-6), free, "{name}: {:?}", hold.stiffness);
            }
        }
    }
}
