//! How accurate a refined pose is: its covariance, from the remaining distances.
//!
//! `σ² (JᵀWJ)⁻¹` holds for independent distances. Those of neighbouring points are not: they share target points and
//! normals. So the scatter of the forces on the pose is taken between patches of the surface instead of points, within
//! which they may depend on each other arbitrarily: `H⁻¹ (Σ g gᵀ) H⁻¹` with *g* the sum of `w d J` over a patch and *H*
//! its derivative (White 1980; Liang and Zeger 1986).

use crate::Freedom;
use crate::descent::Subset;
use crate::equations::{Equations, MIN_STIFFNESS, Symmetric6, rows};
use crate::pairing::Pairing;
use crate::touches::{BLOCK, Touches};
use nalgebra::{Matrix6, SymmetricEigen, Vector3, Vector6};
use rustc_hash::FxHashMap;

/// Side of a patch, in units of the overlap's radius …
const PATCH: f64 = 0.25;
/// … but at least this multiple of the last search radius, within which normals and points are shared.
const MIN_PATCH: f64 = 5.0;
/// Minimum number of patches that allow a statement on six unknowns.
const MIN_PATCHES: usize = 12;
/// Fraction of a free motion that must be allowed for it to count.
const ALLOWED: f64 = 0.5;
/// Number of unknowns of a pose.
const UNKNOWNS: usize = 6;

/// The covariance of a pose: the true pose is the result followed by a small motion with mean zero and this covariance.
///
/// A motion is a rotation vector (radians) before a translation (data units), along the axes of the target frame, about
/// the point [`Uncertainty::about`]: `x ↦ about + exp(rotation) (x − about) + translation`.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertainty {
    /// Covariance of the motion; zero along the free directions.
    pub covariance: Matrix6<f64>,
    /// Centroid of the overlap, target frame.
    pub about: Vector3<f64>,
    /// Unit motions that the surfaces do not hold, loosest first: along them the pose is as it was before refinement.
    /// The rotation, which is in units of the overlap's radius in a [`Hold`](crate::Hold), is divided by that radius
    /// here: radians per data unit.
    pub free_directions: Vec<Vector6<f64>>,
}

impl Uncertainty {
    /// Returns the standard deviation of the rotation about its least certain axis, radians.
    #[must_use]
    pub fn rotation(&self) -> f64 {
        self.worst(0)
    }

    /// Returns the standard deviation of the centroid of the overlap along its least certain direction, data units.
    #[must_use]
    pub fn translation(&self) -> f64 {
        self.worst(3)
    }

    /// Multiplies the standard deviations by a factor.
    pub(crate) fn widened(mut self, factor: f64) -> Self {
        self.covariance *= factor * factor;
        self
    }

    fn worst(&self, from: usize) -> f64 {
        let block = self.covariance.fixed_view::<3, 3>(from, from).into_owned();
        SymmetricEigen::new(block).eigenvalues.max().max(0.0).sqrt()
    }
}

/// Computes the uncertainty from the pairs under a refined pose and their equations; `None` if too little touches to
/// tell.
pub(crate) fn uncertainty(
    subset: &mut Subset,
    pairing: &Pairing<'_>,
    equations: &Equations,
    freedom: Freedom,
) -> Option<Uncertainty> {
    let basis = equations.basis_about_middle(freedom)?;
    let (middle, spread) = equations.middle();
    let patch = (PATCH * spread).max(MIN_PATCH * pairing.radius());
    let parts = subset.gathered(pairing, |forces: &mut Forces, touches| forces.add(touches, &middle, patch));
    let (stiffness, pulls) = summed(parts);
    let pulls: Vec<Vector6<f64>> = pulls.iter().map(|pull| basis.transpose() * pull).collect();
    if pulls.len() < MIN_PATCHES {
        return None;
    }
    let few = pulls.len() as f64 / (pulls.len() - UNKNOWNS) as f64;
    let scatter = pulls.iter().map(|pull| pull * pull.transpose()).sum::<Matrix6<f64>>() * few;
    let hold = equations.hold(freedom);
    let n_free = hold.n_free(MIN_STIFFNESS);
    let mut stiffness = basis.transpose() * stiffness * basis;
    (0..n_free).for_each(|i| stiffness[(i, i)] = 1.0);
    let inverse = basis * stiffness.cholesky()?.inverse();
    // If a start was kept that is not a minimum, the step that was not made is uncertain, too.
    let missing = inverse * pulls.iter().sum::<Vector6<f64>>();
    let covariance = inverse * scatter * inverse.transpose() + missing * missing.transpose();
    // Motions that are not allowed are not free directions.
    let allowed = hold.motions.iter().take(n_free).map(|motion| freedom.projection() * motion);
    let free_directions =
        allowed.filter(|motion| motion.norm() > ALLOWED).map(|motion| scaled(&motion, spread).normalize()).collect();
    covariance.iter().all(|v| v.is_finite()).then_some(Uncertainty { covariance, about: middle, free_directions })
}

/// Returns a motion with its rotation in radians.
pub(crate) fn scaled(motion: &Vector6<f64>, spread: f64) -> Vector6<f64> {
    let mut motion = *motion;
    motion.fixed_rows_mut::<3>(0).scale_mut(1.0 / spread.max(f64::MIN_POSITIVE));
    motion
}

/// The forces of some of the touching points on the pose.
#[derive(Default)]
struct Forces {
    /// How the forces change along the motions: with the derivative `w (2w − 1)` of Cauchy's `w d`, not with the weight
    /// itself, because a robust weight falls as its distance grows.
    stiffness: Symmetric6,
    /// The force of each patch along each motion. A patch that is left and entered again occurs again.
    pulls: Vec<(Patch, Vector6<f64>)>,
}

type Patch = [i64; 3];

impl Forces {
    fn add(&mut self, touches: &Touches, middle: &Vector3<f64>, patch: f64) {
        let Touches { moved, normal, weight, distance, is_touch, .. } = touches;
        let rows = rows(&[0, 1, 2].map(|axis| moved[axis].map(|v| v - middle[axis])), normal);
        self.stiffness.add(&rows, &weight.map(|weight| weight * (2.0 * weight - 1.0)));
        for k in (0..BLOCK).filter(|&k| is_touch[k] > 0.0) {
            let pull = Vector6::from_fn(|i, _| rows[i][k]) * (weight[k] * distance[k]);
            let patch = [0, 1, 2].map(|axis| (moved[axis][k] / patch).floor() as i64);
            match self.pulls.last_mut() {
                Some((last, sum)) if *last == patch => *sum += pull,
                _ => self.pulls.push((patch, pull)),
            }
        }
    }
}

/// Returns the total stiffness, and the force of each patch, in the order in which patches were first entered.
fn summed(parts: Vec<Forces>) -> (Matrix6<f64>, Vec<Vector6<f64>>) {
    let (mut stiffness, mut pulls, mut numbers) = (Symmetric6::default(), Vec::new(), FxHashMap::default());
    for part in parts {
        stiffness.plus(&part.stiffness);
        for (patch, pull) in part.pulls {
            let number = *numbers.entry(patch).or_insert(pulls.len());
            if number == pulls.len() {
                pulls.push(Vector6::zeros());
            }
            pulls[number] += pull;
        }
    }
    (stiffness.matrix(), pulls)
}
