//! Turns the rows of a batch into registered pairs.

use crate::batch::{Ended, Row};
use congruent_geometry::from_rows;
use congruent_reconstruction::Registered;
use std::collections::HashMap;

/// Small, because rows are written with all digits.
const TOLERANCE: f64 = 1e-6;

/// Returns the pairs that have a verdict, each with the id of its row, in the order of the rows.
pub(crate) fn registered(ended: &Ended<'_>) -> (Vec<String>, Vec<Registered>) {
    let place: HashMap<&str, usize> =
        ended.input.scans.iter().enumerate().map(|(at, scan)| (scan.name.as_str(), at)).collect();
    let pair = |row: &Row| {
        let (&source, &target) = place.get(row.source.as_str()).zip(place.get(row.target.as_str()))?;
        let poses = row.target_from_source.iter().chain(&row.alternatives);
        let poses = poses.filter_map(|rows| from_rows(rows, TOLERANCE)).collect();
        let (verdict, confidence) = (row.verdict?, row.confidence.unwrap_or_default());
        Some((row.id.clone(), Registered { source, target, verdict, confidence, poses }))
    };
    ended.rows.iter().filter_map(pair).unzip()
}
