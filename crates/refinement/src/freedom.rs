//! The motions that a refinement may make.

use nalgebra::{Matrix6, Unit, Vector3};

/// The motions that a refinement may make.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Freedom {
    /// All six.
    #[default]
    All,
    /// Rotations about this axis of the target frame, and translations.
    About(Unit<Vector3<f64>>),
}

impl Freedom {
    /// Returns how many of the six motions are not allowed.
    pub(crate) fn n_fixed(&self) -> usize {
        match self {
            Freedom::All => 0,
            Freedom::About(_) => 2,
        }
    }

    /// Returns the projection to the allowed part of a motion: rotation before translation, about any point.
    pub(crate) fn projection(&self) -> Matrix6<f64> {
        let mut projection = Matrix6::identity();
        if let Freedom::About(axis) = self {
            projection.fixed_view_mut::<3, 3>(0, 0).copy_from(&(axis.as_ref() * axis.transpose()));
        }
        projection
    }
}
