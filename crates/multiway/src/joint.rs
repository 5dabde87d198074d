//! Joint refinement: any two scans that touch under the solved poses pull on each other, whether or not a registration
//! joined them, and the graph is solved for all of them at once; repeatedly, as in ICP.

use crate::robust::{Constraint, relaxed};
use crate::votes::displacement;
use crate::{Node, Settings, Touch};
use congruent_geometry::RigidTransform;
use rayon::prelude::*;

/// Fraction of its initial value below which the total support must not fall.
const MIN_SUPPORT: f64 = 0.999;

/// Access to the surfaces themselves, in both directions: source and target are not exchangeable.
pub trait Contact: Sync {
    /// Returns how the source touches the target under a pose; `None` if they hardly touch.
    fn measure(&self, source: usize, target: usize, target_from_source: &RigidTransform) -> Option<Touch>;

    /// Returns a better pose nearby, and how the surfaces touch there. `round` counts from zero: later rounds may
    /// search less far.
    fn align(
        &self,
        source: usize,
        target: usize,
        target_from_source: &RigidTransform,
        round: usize,
    ) -> Option<(RigidTransform, Touch)>;
}

/// A contact without surfaces: the poses are determined by the graph alone.
#[derive(Clone, Copy, Debug)]
pub struct NoContact;

impl Contact for NoContact {
    fn measure(&self, _: usize, _: usize, _: &RigidTransform) -> Option<Touch> {
        None
    }

    fn align(&self, _: usize, _: usize, _: &RigidTransform, _: usize) -> Option<(RigidTransform, Touch)> {
        None
    }
}

/// Poses after the joint refinement.
pub(crate) struct Refined {
    pub(crate) poses: Vec<RigidTransform>,
    /// The constraints of the last round; none if the start was kept.
    pub(crate) constraints: Vec<Constraint>,
}

/// Refines all components. The start is kept if the surfaces would lose contact.
pub(crate) fn refined(
    nodes: &[Node],
    contact: &dyn Contact,
    components: &[Vec<usize>],
    start: &[RigidTransform],
    settings: &Settings,
) -> Refined {
    let pairs: Vec<(usize, usize)> = components.iter().flat_map(|members| both_ways(members)).collect();
    let mut poses = start.to_vec();
    let mut constraints = Vec::new();
    for round in 0..settings.rounds {
        constraints = pulls(contact, &pairs, &poses, round, settings);
        if constraints.is_empty() {
            break;
        }
        let (next, _) = relaxed(&poses, components, &constraints, settings.refined_parting);
        let moved = nodes
            .iter()
            .zip(poses.iter().zip(&next))
            .map(|(node, (a, b))| displacement(node, a, b))
            .fold(0.0, f64::max);
        poses = next;
        if moved < settings.tolerance {
            break;
        }
    }
    if support(contact, &pairs, &poses) < MIN_SUPPORT * support(contact, &pairs, start) {
        return Refined { poses: start.to_vec(), constraints: Vec::new() };
    }
    Refined { poses, constraints }
}

/// Returns all ordered pairs of different scans of a component.
fn both_ways(members: &[usize]) -> impl Iterator<Item = (usize, usize)> + '_ {
    members.iter().flat_map(move |&a| members.iter().filter(move |&&b| b != a).map(move |&b| (a, b)))
}

/// Returns the constraints that align each touching scan with each other one.
fn pulls(
    contact: &dyn Contact,
    pairs: &[(usize, usize)],
    poses: &[RigidTransform],
    round: usize,
    settings: &Settings,
) -> Vec<Constraint> {
    let one = |&(source, target): &(usize, usize)| {
        let (target_from_source, touch) = contact.align(source, target, &relative(poses, source, target), round)?;
        Some(Constraint::measured([source, target], target_from_source, touch, settings))
    };
    pairs.par_iter().map(one).collect::<Vec<_>>().into_iter().flatten().collect()
}

fn relative(poses: &[RigidTransform], source: usize, target: usize) -> RigidTransform {
    poses[target].inverse() * poses[source]
}

fn support(contact: &dyn Contact, pairs: &[(usize, usize)], poses: &[RigidTransform]) -> f64 {
    let one = |&(source, target): &(usize, usize)| {
        contact.measure(source, target, &relative(poses, source, target)).map_or(0.0, |touch| touch.support)
    };
    pairs.par_iter().map(one).collect::<Vec<f64>>().iter().sum()
}
