//! The robust pose graph: each constraint has a line process that may switch it off (Choi, Zhou, Koltun 2015).
//!
//! Minimises `Σ l f + μ (√l − 1)²` over poses and `l`, with `f = ξᵀΛξ`; for given poses the best is
//! `l = (μ / (μ + f))²`. `μ` is the value of `f` if the constraint's surfaces were separated by a fixed length, so that
//! one length determines for all constraints, strong or weak, where half of the influence is lost.

use crate::edge::Edge;
use crate::forest::{components, spanned};
use crate::solve::solve;
use crate::{Candidate, Settings, Touch};
use congruent_geometry::RigidTransform;

/// Maximum number of alternations between poses and line processes.
const MAX_ROUNDS: usize = 60;
/// Change of every line process below which the alternations end.
const SETTLED: f64 = 1e-4;
/// Line process below which a constraint is pruned: its surfaces are then separated by more than the length.
const MIN_LINE: f64 = 0.25;

/// An edge with the contact from which it was measured.
#[derive(Clone, Debug)]
pub(crate) struct Constraint {
    pub(crate) edge: Edge,
    pub(crate) touch: Touch,
    /// How far it is trusted before the graph is solved.
    pub(crate) strength: f64,
}

impl Constraint {
    pub(crate) fn of(candidate: &Candidate, strength: f64, settings: &Settings) -> Constraint {
        let edge = Edge {
            source: candidate.source,
            target: candidate.target,
            target_from_source: candidate.target_from_source,
            information: candidate.touch.precision(settings.noise_floor),
        };
        Constraint { edge, touch: candidate.touch, strength }
    }

    /// Returns the constraint of a contact that was just measured; `ends` are its source and its target.
    pub(crate) fn measured(
        [source, target]: [usize; 2],
        target_from_source: RigidTransform,
        touch: Touch,
        settings: &Settings,
    ) -> Constraint {
        let information = touch.precision(settings.noise_floor);
        Constraint { edge: Edge { source, target, target_from_source, information }, touch, strength: 1.0 }
    }

    /// Returns the squared separation of its surfaces under the poses.
    pub(crate) fn parting_sq(&self, poses: &[RigidTransform]) -> f64 {
        self.touch.parting_sq(&self.edge.error(poses))
    }

    /// Returns the best line process under the poses.
    fn line(&self, poses: &[RigidTransform], parting: f64) -> f64 {
        (1.0 + self.parting_sq(poses) / (parting * parting)).powi(-2)
    }
}

/// The poses to which a graph converged.
pub(crate) struct Settled {
    /// Each in the frame of its component, whose first scan has the identity or its starting pose.
    pub(crate) poses: Vec<RigidTransform>,
    pub(crate) components: Vec<Vec<usize>>,
    /// The line process of each constraint; zero for those that were pruned.
    pub(crate) lines: Vec<f64>,
}

/// Solves from the maximum spanning trees, prunes, and solves again until nothing needs to be pruned.
pub(crate) fn settled(n: usize, constraints: &[Constraint], settings: &Settings) -> Settled {
    let mut alive = vec![true; constraints.len()];
    let mut poses: Option<Vec<RigidTransform>> = None;
    loop {
        let kept: Vec<Constraint> =
            constraints.iter().zip(&alive).filter(|(_, alive)| **alive).map(|(c, _)| c.clone()).collect();
        let components = components(n, kept.iter().map(|c| (c.edge.source, c.edge.target)));
        let start = poses.unwrap_or_else(|| first_poses(n, &components, &kept));
        let (solved, lines) = relaxed(&start, &components, &kept, settings.parting);
        let mut of_kept = lines.into_iter();
        let lines: Vec<f64> =
            alive.iter().map(|alive| if *alive { of_kept.next().unwrap_or_default() } else { 0.0 }).collect();
        let pruned = alive.iter_mut().zip(&lines).filter(|(alive, line)| **alive && **line < MIN_LINE);
        if pruned.map(|(alive, _)| *alive = false).count() == 0 {
            return Settled { poses: solved, components, lines };
        }
        poses = Some(solved);
    }
}

/// Alternates between poses and line processes, component by component.
pub(crate) fn relaxed(
    start: &[RigidTransform],
    components: &[Vec<usize>],
    constraints: &[Constraint],
    parting: f64,
) -> (Vec<RigidTransform>, Vec<f64>) {
    let mut poses = start.to_vec();
    let mut lines = vec![1.0; constraints.len()];
    for part in components.iter().map(|members| Part::of(members, start.len(), constraints)) {
        let mut own: Vec<RigidTransform> = part.members.iter().map(|&node| start[node]).collect();
        let line = |poses: &[RigidTransform]| -> Vec<f64> { part.own.iter().map(|c| c.line(poses, parting)).collect() };
        let mut own_lines = line(&own);
        for _ in 0..MAX_ROUNDS {
            own = solve(&own, &part.edges, &own_lines, 0).poses;
            let next = line(&own);
            let change = next.iter().zip(&own_lines).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            own_lines = next;
            if change < SETTLED {
                break;
            }
        }
        part.members.iter().zip(own).for_each(|(&node, pose)| poses[node] = pose);
        part.positions.iter().zip(own_lines).for_each(|(&at, line)| lines[at] = line);
    }
    (poses, lines)
}

/// One component with its scans numbered from zero.
pub(crate) struct Part<'a> {
    pub(crate) members: &'a [usize],
    pub(crate) edges: Vec<Edge>,
    own: Vec<Constraint>,
    /// Positions of its constraints among all.
    pub(crate) positions: Vec<usize>,
}

impl<'a> Part<'a> {
    pub(crate) fn of(members: &'a [usize], n: usize, constraints: &[Constraint]) -> Part<'a> {
        let mut place = vec![None; n];
        members.iter().enumerate().for_each(|(at, &node)| place[node] = Some(at));
        let mut part = Part { members, edges: Vec::new(), own: Vec::new(), positions: Vec::new() };
        for (position, constraint) in constraints.iter().enumerate() {
            let (Some(source), Some(target)) = (place[constraint.edge.source], place[constraint.edge.target]) else {
                continue;
            };
            let edge = Edge { source, target, ..constraint.edge.clone() };
            part.edges.push(edge.clone());
            part.own.push(Constraint { edge, ..constraint.clone() });
            part.positions.push(position);
        }
        part
    }
}

/// Returns the initial poses, along the strongest edges.
fn first_poses(n: usize, components: &[Vec<usize>], constraints: &[Constraint]) -> Vec<RigidTransform> {
    let mut poses = vec![RigidTransform::identity(); n];
    for members in components {
        let part = Part::of(members, n, constraints);
        let strengths: Vec<f64> = part.own.iter().map(|c| c.strength).collect();
        let own = spanned(members.len(), &part.edges, &strengths, 0);
        members.iter().zip(own).for_each(|(&node, pose)| poses[node] = pose);
    }
    poses
}
