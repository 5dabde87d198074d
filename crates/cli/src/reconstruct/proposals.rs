//! From the rows of a batch to the candidates of the graph.

use super::Surfaces;
use crate::batch::{Ended, Row};
use congruent_geometry::{RigidTransform, from_rows};
use congruent_multiway::{Belief, Candidate};
use congruent_pipeline::VerdictKind;
use rayon::prelude::*;
use std::collections::HashMap;

/// Rows were written with all their digits.
const TOLERANCE: f64 = 1e-6;

/// A pose that a row proposes.
#[derive(Clone, Debug)]
pub(crate) struct Proposal {
    /// Of the pair.
    pub(crate) id: String,
    pub(crate) source: usize,
    pub(crate) target: usize,
    pub(crate) verdict: VerdictKind,
    pub(crate) confidence: f64,
    /// For the graph; nothing where the surfaces do not touch under the pose.
    pub(crate) candidate: Option<Candidate>,
}

/// All poses of all rows, in the order of the rows; of an ambiguous pair its alternatives too.
pub(crate) fn proposals(ended: &Ended<'_>, surfaces: &Surfaces) -> Vec<Proposal> {
    let place: HashMap<&str, usize> =
        ended.input.scans.iter().enumerate().map(|(at, scan)| (scan.name.as_str(), at)).collect();
    let poses = |row: &'_ Row| -> Vec<(RigidTransform, usize)> {
        let all = row.target_from_source.iter().chain(&row.alternatives);
        all.filter_map(|rows| from_rows(rows, TOLERANCE)).enumerate().map(|(rank, pose)| (pose, rank)).collect()
    };
    let proposed = |row: &Row| -> Vec<Proposal> {
        let ends = place.get(row.source.as_str()).zip(place.get(row.target.as_str()));
        let Some(((&source, &target), verdict)) = ends.zip(row.verdict) else { return Vec::new() };
        let belief = belief(verdict);
        let one = |(pose, rank): (RigidTransform, usize)| {
            // Later ones are a little less likely.
            let confidence = row.confidence.unwrap_or_default() / (1.0 + rank as f64);
            let pose = surfaces.centred(source, target, &pose);
            let touch = surfaces.touch(source, target, &pose);
            let candidate =
                touch.map(|touch| Candidate { source, target, target_from_source: pose, touch, confidence, belief });
            Proposal { id: row.id.clone(), source, target, verdict, confidence, candidate }
        };
        poses(row).into_iter().map(one).collect()
    };
    ended.rows.par_iter().map(proposed).collect::<Vec<_>>().into_iter().flatten().collect()
}

fn belief(verdict: VerdictKind) -> Belief {
    match verdict {
        VerdictKind::Ok => Belief::Believed,
        VerdictKind::Ambiguous => Belief::Uncertain,
        VerdictKind::Failed => Belief::Doubted,
    }
}
