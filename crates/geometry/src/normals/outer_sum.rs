//! Sums of outer products of vectors with themselves.

use nalgebra::{Matrix3, Vector3};

/// `Σ w v vᵀ`, stored as the six distinct numbers of a symmetric matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OuterSum([f64; 6]);

impl OuterSum {
    /// Creates the sum from its entries `xx`, `xy`, `xz`, `yy`, `yz` and `zz`.
    pub(crate) fn of(sums: [f64; 6]) -> Self {
        OuterSum(sums)
    }

    /// Adds `w v vᵀ`.
    #[inline]
    pub fn add(&mut self, v: &Vector3<f64>, weight: f64) {
        let w = v * weight;
        let products = [w.x * v.x, w.x * v.y, w.x * v.z, w.y * v.y, w.y * v.z, w.z * v.z];
        self.0.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
    }

    /// Returns the sum.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f64> {
        let [xx, xy, xz, yy, yz, zz] = self.0;
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_is_that_of_the_products() {
        let (a, b) = (Vector3::new(1.0, -2.0, 3.0), Vector3::new(0.5, 4.0, -1.0));
        let mut sum = OuterSum::default();
        sum.add(&a, 2.0);
        sum.add(&b, -0.5);
        assert_eq!(sum.matrix(), a * a.transpose() * 2.0 - b * b.transpose() * 0.5);
    }
}
