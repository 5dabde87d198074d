//! The page of a reconstruction: the model, the graph, and which scans touch each other.

use super::model::colour;
use super::outcome::{Outcome, PairLine};
use super::words::overview;
use congruent_geometry::{RigidTransform, wide};
use congruent_reconstruction::Surfaces;
use congruent_report::{Block, Cell, Layer, Lines, Page, Points, Scene, State, Table, Tone, digits};
use nalgebra::Point3;

/// Maximum number of points of all scans together in one view.
const MAX_POINTS: usize = 300_000;
const KEPT: &str = "#1b8a5a";
const REJECTED: &str = "#c0392b";
const CONTACT: &str = "#999999";
const CONFLICT: &str = "#d98e04";

/// Builds the whole page.
pub(super) fn page(outcome: &Outcome, surfaces: &Surfaces) -> Page {
    let mut blocks = vec![verdict(outcome)];
    for number in 1..=outcome.components.len() {
        let members = &outcome.components[number - 1];
        blocks.push(Block::Section(format!(
            "Component {number}: {} scans in the frame of {}",
            members.len(),
            members[0]
        )));
        blocks.push(Block::Views(vec![(
            "Each scan has its own colour. The graph connects the centres of the scans: green poses are used, red ones \
             rejected; grey lines connect scans that touch, orange ones scans that contradict each other."
                .to_owned(),
            scene(outcome, surfaces, number),
        )]));
    }
    if !outcome.is_consistent() {
        blocks.push(Block::Section("Scans that contradict each other".to_owned()));
        blocks.push(Block::Table(conflicts(outcome)));
    }
    blocks.push(Block::Section("Scans".to_owned()));
    blocks.push(Block::Table(scans(outcome)));
    blocks.push(Block::Section("Poses of pairs".to_owned()));
    blocks.push(Block::Table(pairs(outcome)));
    blocks.push(Block::Section("Scans that touch".to_owned()));
    blocks.push(Block::Table(contacts(outcome)));
    Page {
        title: "Reconstruction".to_owned(),
        subtitle: format!("pr = {} data units", digits(outcome.resolution, 4)),
        blocks,
    }
}

fn verdict(outcome: &Outcome) -> Block {
    let (tone, word) = if !outcome.is_consistent() {
        (Tone::Doubtful, "scans contradict each other")
    } else if outcome.is_complete() {
        (Tone::Good, "complete")
    } else if outcome.components.is_empty() {
        (Tone::Bad, "no scans fit")
    } else {
        (Tone::Doubtful, "incomplete")
    };
    let lines: Vec<String> = overview(outcome).iter().map(|line| line.trim().to_owned()).collect();
    Block::Verdict(tone, word.to_owned(), lines.join(". ") + ".")
}

/// Shows the scans of a component, as scanned and as placed, and the graph over them.
fn scene(outcome: &Outcome, surfaces: &Surfaces, number: usize) -> Scene {
    let members: Vec<usize> =
        (0..outcome.scans.len()).filter(|&at| outcome.scans[at].component == Some(number)).collect();
    let pose = |at: usize| outcome.scans[at].frame_from_file.unwrap_or_else(RigidTransform::identity);
    let all: Vec<RigidTransform> = (0..outcome.scans.len()).map(pose).collect();
    let mut layers: Vec<Layer> =
        members.iter().map(|&at| Layer::Points(cloud(outcome, surfaces, at, MAX_POINTS / members.len()))).collect();
    let inside = |ends: &[usize; 2]| ends.iter().all(|at| members.contains(at));
    let graph = |name: &str, colour: &str, shown: bool, ends: Vec<[usize; 2]>| {
        let middle = |at: usize| pose(at) * Point3::from(surfaces.origin(at));
        let segments = ends.iter().map(|ends| ends.map(middle)).collect();
        // The body after the last scan does not move in the frame that is shown.
        let rest = outcome.scans.len();
        Layer::Lines(Lines { name: name.to_owned(), bodies: [rest, rest], segments, colour: colour.to_owned(), shown })
    };
    let of = |used: bool| -> Vec<[usize; 2]> {
        outcome.pairs.iter().filter(|p| p.is_used == used).map(|p| p.ends).filter(inside).collect()
    };
    let touching = outcome.touching().into_iter().filter(inside).collect();
    layers.push(graph("scans that touch", CONTACT, false, touching));
    let contradicting: Vec<[usize; 2]> = outcome.conflicts.iter().map(|c| c.ends).filter(inside).collect();
    if !contradicting.is_empty() {
        layers.push(graph("scans that contradict each other", CONFLICT, true, contradicting));
    }
    layers.push(graph("poses used", KEPT, true, of(true)));
    layers.push(graph("poses rejected", REJECTED, false, of(false)));
    Scene {
        states: vec![
            State { name: "as scanned".to_owned(), frame_from_body: Vec::new() },
            State { name: "in one frame".to_owned(), frame_from_body: all },
        ],
        layers,
        ..Scene::default()
    }
}

fn cloud(outcome: &Outcome, surfaces: &Surfaces, at: usize, limit: usize) -> Points {
    let [red, green, blue] = colour(at);
    let points = surfaces.surface(at).map_or(&[][..], |surface| surface.points());
    let step = points.len().div_ceil(limit.max(1)).max(1);
    let points = points.iter().step_by(step).map(|p| Point3::from(wide(*p) + surfaces.origin(at))).collect();
    Points {
        name: outcome.scans[at].scan.clone(),
        body: at,
        points,
        colour: format!("#{red:02x}{green:02x}{blue:02x}"),
        errors: Vec::new(),
    }
}

fn table(columns: &[&str], rows: Vec<Vec<Cell>>) -> Table {
    Table { columns: columns.iter().map(|name| (*name).to_owned()).collect(), rows, sortable: true }
}

fn scans(outcome: &Outcome) -> Table {
    let row = |scan: &super::outcome::ScanLine| -> Vec<Cell> {
        let in_pr = |length: f64| format!("{:.3}", length / outcome.resolution);
        vec![
            scan.scan.clone().into(),
            scan.component.map_or_else(|| "none".to_owned(), |number| number.to_string()).into(),
            scan.touches.to_string().into(),
            format!("{:.0}", 100.0 * scan.overlap).into(),
            scan.uncertainty.filter(|_| scan.component.is_some()).map_or_else(String::new, in_pr).into(),
            scan.problem.clone().unwrap_or_default().into(),
        ]
    };
    let columns = ["scan", "component", "touches", "largest overlap, %", "uncertainty, pr", "problem"];
    table(&columns, outcome.scans.iter().map(row).collect())
}

fn pairs(outcome: &Outcome) -> Table {
    let row = |pair: &PairLine| -> Vec<Cell> {
        vec![
            pair.source.clone().into(),
            pair.target.clone().into(),
            pair.verdict.to_string().into(),
            format!("{:.3}", pair.confidence).into(),
            pair.fate.into(),
            pair.reason.clone().into(),
        ]
    };
    let columns = ["source", "target", "verdict", "confidence", "fate", "reason"];
    table(&columns, outcome.pairs.iter().map(row).collect())
}

fn contacts(outcome: &Outcome) -> Table {
    let row = |contact: &super::outcome::ContactLine| -> Vec<Cell> {
        vec![
            contact.source.clone().into(),
            contact.target.clone().into(),
            format!("{:.0}", 100.0 * contact.overlap).into(),
            format!("{:.2}", contact.residual / outcome.resolution).into(),
        ]
    };
    let columns = ["scan", "touches", "touching points, %", "distance, pr"];
    table(&columns, outcome.contacts.iter().map(row).collect())
}

fn conflicts(outcome: &Outcome) -> Table {
    let row = |conflict: &super::outcome::ConflictLine| -> Vec<Cell> {
        let [one, other] = conflict.scans.clone();
        let percent = |share: f64| format!("{:.0}", 100.0 * share);
        vec![one.into(), other.into(), percent(conflict.overlap).into(), percent(conflict.floating).into()]
    };
    let columns = ["scan", "contradicts", "overlap, %", "points that float, %"];
    table(&columns, outcome.conflicts.iter().map(row).collect())
}
