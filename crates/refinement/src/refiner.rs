//! The interface of all refiners.

use crate::{Hold, Uncertainty};
use congruent_geometry::{RigidTransform, Surface};
use nalgebra::Matrix6;

/// Refines a rough pose.
pub trait Refiner: Send + Sync {
    /// Moves `source` onto `target` from a rough start.
    ///
    /// Keeps the start if nothing touches, or if the surfaces touch less at the end. Directions in which the surfaces
    /// slide along each other stay as they were. The same bits on any number of threads.
    fn refine(&self, source: &Surface, target: &Surface, start: &RigidTransform) -> Refinement;
}

/// A refined pose and what holds it.
#[derive(Clone, Debug)]
pub struct Refinement {
    /// The refined pose, or the start if nothing could be refined.
    pub target_from_source: RigidTransform,
    /// Number of pairs of points that touch at the end.
    pub n_pairs: usize,
    /// Weighted root mean square of their distances to the target's tangent planes, data units; zero without pairs.
    pub residual: f64,
    /// Sum of the robust weights: how much of the surface touches, closer points counting more.
    pub support: f64,
    /// `JᵀWJ` of the pairs; rotation (about the target frame's origin) before translation.
    pub information: Matrix6<f64>,
    /// How firmly the pairs hold the pose.
    pub hold: Hold,
    /// How accurate the pose is, if it was refined.
    pub uncertainty: Option<Uncertainty>,
}

/// Leaves the pose as it is.
#[derive(Clone, Copy, Debug)]
pub struct NoRefinement;

impl Refiner for NoRefinement {
    fn refine(&self, _source: &Surface, _target: &Surface, start: &RigidTransform) -> Refinement {
        Refinement {
            target_from_source: *start,
            n_pairs: 0,
            residual: 0.0,
            support: 0.0,
            information: Matrix6::zeros(),
            hold: Hold::NONE,
            uncertainty: None,
        }
    }
}
