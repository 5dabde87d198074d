//! The complete path from candidates to poses.

use crate::robust::{Constraint, Settled, relaxed, settled};
use crate::{Belief, Candidate, Contact, Edge, Fate, Node, Settings, Touch};
use crate::{bridges, joint, uncertainty, votes};
use congruent_geometry::RigidTransform;
use std::collections::BTreeSet;

/// The poses of all scans.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    /// Connected scans, ascending; the largest component first, ties going to the one with the earliest scan. A scan
    /// that fits nowhere is a component of its own.
    pub components: Vec<Vec<usize>>,
    /// For each scan, the motion into the frame of its component, which is that of the component's first scan.
    pub frame_from_scan: Vec<RigidTransform>,
    /// For each scan, the error of its points relative to those of the component's first scan, root mean square, data
    /// units: what independent noise explains, and thus a lower bound. `None` if it is unknown.
    pub uncertainty: Vec<Option<f64>>,
    /// What became of each candidate.
    pub fates: Vec<Fate>,
    /// What the poses finally rest on: the contacts of the joint refinement or, without one, the kept candidates, each
    /// followed by the contact in the other direction, as far as the surfaces touch there, too.
    pub edges: Vec<(Edge, Touch)>,
    /// Whether the joint refinement moved the scans (and did not lose contact).
    pub refined: bool,
}

/// Finds the poses of all scans, as far as the candidates hold them together.
///
/// Without scans or candidates this is fine: every scan then stands alone.
///
/// # Panics
/// If a candidate refers to a scan that does not exist, or to the same one twice.
#[must_use]
pub fn reconstruct(
    nodes: &[Node],
    candidates: &[Candidate],
    contact: &dyn Contact,
    settings: &Settings,
) -> Reconstruction {
    let in_range = |c: &Candidate| c.source < nodes.len() && c.target < nodes.len() && c.source != c.target;
    assert!(candidates.iter().all(in_range), "a candidate joins two different scans of the list");
    let votes = votes::counted(nodes, candidates, settings);
    let elected = votes::elected(candidates, &votes);
    let strengths: Vec<f64> = candidates.iter().zip(&votes).map(|(c, v)| v.strength(c.confidence)).collect();
    let mut graph = Graph { nodes, candidates, strengths, settings, fates: elected };
    let solved = graph.joined(graph.solved());
    let refined = joint::refined(nodes, contact, &solved.components, &solved.poses, settings);
    graph.finished(&solved, refined, contact)
}

struct Graph<'a> {
    nodes: &'a [Node],
    candidates: &'a [Candidate],
    strengths: Vec<f64>,
    settings: &'a Settings,
    fates: Vec<Fate>,
}

impl Graph<'_> {
    /// Returns the robust solution, and the candidates that are kept.
    fn solved(&self) -> (Settled, Vec<usize>) {
        let kept: Vec<usize> = (0..self.candidates.len()).filter(|&at| self.fates[at] == Fate::Kept).collect();
        (settled(self.nodes.len(), &self.constraints(&kept), self.settings), kept)
    }

    fn constraints(&self, which: &[usize]) -> Vec<Constraint> {
        which.iter().map(|&at| Constraint::of(&self.candidates[at], self.strengths[at], self.settings)).collect()
    }

    /// Joins components by what doubtful candidates agree on, until no more can be joined.
    fn joined(&mut self, (mut solved, kept): (Settled, Vec<usize>)) -> Settled {
        self.contradicted(&solved, &kept);
        loop {
            let (poses, components) = (&solved.poses, &solved.components);
            let bridge = bridges::strongest(self.nodes, self.candidates, &self.fates, poses, components, self.settings);
            if bridge.is_empty() {
                return solved;
            }
            let before = (self.fates.clone(), solved.components.len());
            bridge.iter().for_each(|&at| self.fates[at] = Fate::Kept);
            let (next, kept) = self.solved();
            if next.components.len() >= before.1 {
                // The graph rejected it.
                self.fates = before.0;
                return solved;
            }
            self.contradicted(&next, &kept);
            solved = next;
        }
    }

    /// Marks what the solution pruned.
    fn contradicted(&mut self, solved: &Settled, kept: &[usize]) {
        let constraints = self.constraints(kept);
        for ((constraint, line), &at) in constraints.iter().zip(&solved.lines).zip(kept) {
            if *line <= 0.0 {
                self.fates[at] = Fate::Contradicted { parting: constraint.parting_sq(&solved.poses).sqrt() };
            }
        }
    }

    fn finished(mut self, solved: &Settled, refined: joint::Refined, contact: &dyn Contact) -> Reconstruction {
        let (poses, settings) = (refined.poses, self.settings);
        let was_refined = !refined.constraints.is_empty();
        let (constraints, parting) = if was_refined {
            (refined.constraints, settings.refined_parting)
        } else {
            let kept: Vec<usize> = (0..self.candidates.len()).filter(|&at| self.fates[at] == Fate::Kept).collect();
            (self.constraints(&kept), settings.parting)
        };
        self.agreeing(&poses, &solved.components);
        let (_, lines) = relaxed(&poses, &solved.components, &constraints, parting);
        let uncertainty = uncertainty::uncertainties(self.nodes, &poses, &solved.components, &constraints, &lines);
        let constraints = if was_refined { constraints } else { both_ways(constraints, contact, settings) };
        Reconstruction {
            frame_from_scan: in_first_frames(&poses, &solved.components),
            components: largest_first(solved.components.clone()),
            uncertainty,
            fates: self.fates,
            edges: constraints.into_iter().map(|c| (c.edge, c.touch)).collect(),
            refined: was_refined,
        }
    }

    /// Distinguishes, among the candidates that are not kept, those that the poses support from those that they
    /// contradict.
    fn agreeing(&mut self, poses: &[RigidTransform], components: &[Vec<usize>]) {
        let mut component_of = vec![0; self.nodes.len()];
        for (number, members) in components.iter().enumerate() {
            members.iter().for_each(|&node| component_of[node] = number);
        }
        for (at, candidate) in self.candidates.iter().enumerate() {
            let together = component_of[candidate.source] == component_of[candidate.target];
            if !together || self.fates[at] == Fate::Kept {
                continue;
            }
            let relative = poses[candidate.target].inverse() * poses[candidate.source];
            let off = votes::displacement(&self.nodes[candidate.source], &relative, &candidate.target_from_source);
            if off <= self.settings.agreement {
                self.fates[at] = Fate::Agrees;
            } else if candidate.belief != Belief::Doubted && self.fates[at] == Fate::Unsupported {
                let parting = Constraint::of(candidate, 0.0, self.settings).parting_sq(poses).sqrt();
                self.fates[at] = if parting > self.settings.parting {
                    Fate::Contradicted { parting }
                } else {
                    Fate::Displaced { displacement: off }
                };
            }
        }
    }
}

/// Follows each constraint by one in the opposite direction, measured under the same pose; not where the list has that
/// direction already, or the surfaces hardly touch in it.
fn both_ways(constraints: Vec<Constraint>, contact: &dyn Contact, settings: &Settings) -> Vec<Constraint> {
    let mut present: BTreeSet<(usize, usize)> = constraints.iter().map(|c| (c.edge.source, c.edge.target)).collect();
    let mut all = Vec::new();
    for constraint in constraints {
        let Edge { source, target, target_from_source, .. } = constraint.edge;
        all.push(constraint);
        if present.insert((target, source)) {
            let source_from_target = target_from_source.inverse();
            let touch = contact.measure(target, source, &source_from_target);
            all.extend(touch.map(|touch| Constraint::measured([target, source], source_from_target, touch, settings)));
        }
    }
    all
}

/// Returns the poses of each component in the frame of its first scan.
fn in_first_frames(poses: &[RigidTransform], components: &[Vec<usize>]) -> Vec<RigidTransform> {
    let mut moved = poses.to_vec();
    for members in components {
        let first_from_frame = poses[members[0]].inverse();
        members.iter().for_each(|&node| moved[node] = first_from_frame * poses[node]);
        moved[members[0]] = RigidTransform::identity();
    }
    moved
}

fn largest_first(mut components: Vec<Vec<usize>>) -> Vec<Vec<usize>> {
    components.sort_by_key(|members| (std::cmp::Reverse(members.len()), members[0]));
    components
}
