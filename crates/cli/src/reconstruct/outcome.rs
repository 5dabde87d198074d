//! The result, with scans named as their files are.

use super::words::{fate_name, fate_words, overview};
use crate::batch::Ended;
use congruent_geometry::{RigidTransform, to_rows};
use congruent_multiway::{Edge, Fate, Reconstruction, Touch};
use congruent_pipeline::Verdict;
use congruent_reconstruction::{Conflict, Judged, Registered, Solved, Surfaces};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;

/// What `reconstruct --json` prints. Lengths are in data units.
#[derive(Debug, Serialize)]
pub(crate) struct Outcome {
    version: &'static str,
    /// The length that `pr` stands for.
    pub(super) resolution: f64,
    /// The scans of each component that has at least two, largest component first.
    pub(super) components: Vec<Vec<String>>,
    pub(super) scans: Vec<ScanLine>,
    /// One line for each pose that a pair proposed.
    pub(super) pairs: Vec<PairLine>,
    /// Whether all scans that touch were refined together.
    pub(super) refined: bool,
    /// The contacts that the poses are based on.
    pub(super) contacts: Vec<ContactLine>,
    /// Scans of a component that contradict each other under their poses, the largest contradiction first.
    pub(super) conflicts: Vec<ConflictLine>,
    #[serde(skip)]
    pub(super) edges: Vec<(Edge, Touch)>,
}

#[derive(Debug, Serialize)]
pub(super) struct ScanLine {
    pub(super) scan: String,
    /// Counted from one; null for a scan that fits nowhere.
    pub(super) component: Option<usize>,
    /// Row by row; maps the file's coordinates into the frame of the component, which is that of its first scan.
    pub(super) frame_from_scan: Option<[[f64; 4]; 4]>,
    /// Error of its points relative to those of the component's first scan, from independent noise alone.
    pub(super) uncertainty: Option<f64>,
    /// Number of scans that it touches.
    pub(super) touches: usize,
    /// Largest fraction of its points that touch one of these.
    pub(super) overlap: f64,
    /// Why it could not be placed.
    pub(super) problem: Option<String>,
    #[serde(skip)]
    pub(super) frame_from_file: Option<RigidTransform>,
}

#[derive(Debug, Serialize)]
pub(super) struct PairLine {
    id: String,
    pub(super) source: String,
    pub(super) target: String,
    pub(super) verdict: Verdict,
    pub(super) confidence: f64,
    /// `kept`, `agrees`, `no-loop`, `outvoted`, `unsupported`, `contradicted`, `displaced`,
    /// `no-touch`.
    pub(super) fate: &'static str,
    pub(super) reason: String,
    #[serde(skip)]
    pub(super) ends: [usize; 2],
    /// Whether the poses are based on it, or could be.
    #[serde(skip)]
    pub(super) is_used: bool,
}

#[derive(Debug, Serialize)]
pub(super) struct ContactLine {
    pub(super) source: String,
    pub(super) target: String,
    /// Fraction of the source's points that touch the target.
    pub(super) overlap: f64,
    /// Root mean square distance of these points.
    pub(super) residual: f64,
    #[serde(skip)]
    pub(super) ends: [usize; 2],
}

#[derive(Debug, Serialize)]
pub(super) struct ConflictLine {
    pub(super) scans: [String; 2],
    /// Fraction of their points that overlap.
    pub(super) overlap: f64,
    /// Fraction of their points that float where the other scanner saw empty space, summed over both.
    pub(super) floating: f64,
    #[serde(skip)]
    pub(super) ends: [usize; 2],
}

/// The registered pairs.
pub(crate) struct Pairs<'a> {
    /// Ids of the rows.
    pub(crate) ids: &'a [String],
    pub(crate) registered: &'a [Registered],
}

impl Outcome {
    pub(crate) fn new(
        ended: &Ended<'_>,
        Solved { proposals, result, conflicts }: &Solved,
        pairs: &Pairs<'_>,
        surfaces: &Surfaces,
        pr: f64,
    ) -> Outcome {
        let name = |at: usize| ended.input.scans[at].name.clone();
        let contacts: Vec<ContactLine> = result
            .edges
            .iter()
            .map(|(edge, touch)| ContactLine {
                source: name(edge.source),
                target: name(edge.target),
                overlap: surfaces.overlap(edge.source, touch),
                residual: touch.residual,
                ends: [edge.source, edge.target],
            })
            .collect();
        let conflict = |&Conflict { scans, overlap, floating }: &Conflict| ConflictLine {
            scans: scans.map(name),
            overlap,
            floating,
            ends: scans,
        };
        let pair = |Judged { proposal, fate }: &Judged| {
            let fate = fate.as_ref();
            let Registered { source, target, verdict, .. } = pairs.registered[proposal.pair];
            PairLine {
                source: name(source),
                target: name(target),
                fate: fate_name(fate),
                is_used: matches!(fate, Some(Fate::Kept | Fate::Agrees)),
                reason: fate_words(fate, pr),
                ends: [source, target],
                id: pairs.ids[proposal.pair].clone(),
                verdict,
                confidence: proposal.confidence,
            }
        };
        let touching = touching(&contacts);
        let components: Vec<&Vec<usize>> = result.components.iter().filter(|members| members.len() > 1).collect();
        let scans = (0..ended.input.scans.len())
            .map(|at| {
                let component = components.iter().position(|members| members.contains(&at));
                let placed = component.map(|number| surfaces.in_files(result, at, components[number][0]));
                let own = contacts.iter().filter(|contact| contact.ends[0] == at);
                ScanLine {
                    scan: name(at),
                    component: component.map(|number| number + 1),
                    frame_from_scan: placed.as_ref().map(to_rows),
                    uncertainty: result.uncertainty[at],
                    touches: touching.iter().filter(|ends| ends.contains(&at)).count(),
                    overlap: own.map(|contact| contact.overlap).fold(0.0, f64::max),
                    problem: component.is_none().then(|| problem(ended, result, surfaces, at)),
                    frame_from_file: placed,
                }
            })
            .collect();
        Outcome {
            version: env!("CARGO_PKG_VERSION"),
            resolution: pr,
            components: components.iter().map(|members| members.iter().map(|&at| name(at)).collect()).collect(),
            scans,
            pairs: proposals.iter().map(pair).collect(),
            refined: result.refined,
            contacts,
            conflicts: conflicts.iter().map(conflict).collect(),
            edges: result.edges.clone(),
        }
    }

    /// Returns whether all scans are in one frame.
    pub(crate) fn is_complete(&self) -> bool {
        self.scans.iter().all(|scan| scan.component == Some(1))
    }

    /// Returns whether no two scans contradict each other under their poses.
    pub(crate) fn is_consistent(&self) -> bool {
        self.conflicts.is_empty()
    }

    /// Returns the pairs of scans that touch, each once.
    pub(super) fn touching(&self) -> BTreeSet<[usize; 2]> {
        touching(&self.contacts)
    }

    pub(crate) fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers, strings and lists can be written as JSON")
    }

    pub(crate) fn text(&self, folder: &Path) -> String {
        format!("{}\nwrote {}", overview(self).join("\n"), folder.display())
    }
}

/// Returns the scans that touch in either direction, each pair once, the earlier one first.
fn touching(contacts: &[ContactLine]) -> BTreeSet<[usize; 2]> {
    let ordered = |ends: [usize; 2]| [ends[0].min(ends[1]), ends[0].max(ends[1])];
    contacts.iter().map(|contact| ordered(contact.ends)).collect()
}

fn problem(ended: &Ended<'_>, result: &Reconstruction, surfaces: &Surfaces, at: usize) -> String {
    if let Err(message) = &ended.survey.scans[at] {
        return message.clone();
    }
    if surfaces.surface(at).is_none() {
        return "sampling leaves too few of its points; choose smaller cells in [sampling]".to_owned();
    }
    debug_assert!(result.components.iter().any(|members| members == &[at]));
    "none of its poses was accepted or confirmed by others; it may show something else, or overlap too little"
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scans_touch_whichever_of_them_was_moved_onto_the_other() {
        let contact = |ends: [usize; 2]| ContactLine {
            source: ends[0].to_string(),
            target: ends[1].to_string(),
            overlap: 0.5,
            residual: 0.1,
            ends,
        };
        let found = touching(&[[2, 0], [1, 0], [0, 1], [2, 1], [2, 1]].map(contact));
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [[0, 1], [0, 2], [1, 2]]);
    }
}
