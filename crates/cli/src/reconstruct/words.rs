//! The result in words.

use super::outcome::Outcome;
use congruent_multiway::Fate;
use std::collections::BTreeMap;

/// Maximum number of names that are listed; the rest are counted.
const LISTED: usize = 8;

pub(super) fn fate_name(fate: Option<&Fate>) -> &'static str {
    match fate {
        None => "no-touch",
        Some(Fate::Kept) => "kept",
        Some(Fate::Agrees) => "agrees",
        Some(Fate::NoLoop { .. }) => "no-loop",
        Some(Fate::Outvoted) => "outvoted",
        Some(Fate::Unsupported) => "unsupported",
        Some(Fate::Contradicted { .. }) => "contradicted",
        Some(Fate::Displaced { .. }) => "displaced",
    }
}

/// Explains what became of a pose; `pr` in data units.
pub(super) fn fate_words(fate: Option<&Fate>, pr: f64) -> String {
    match fate {
        None => "with this pose, the surfaces hardly touch".to_owned(),
        Some(Fate::Kept) => "the result is based on it".to_owned(),
        Some(Fate::Agrees) => "not needed; agrees with the result".to_owned(),
        Some(Fate::NoLoop { triangles }) => format!("closes none of the {triangles} triangles that it is part of"),
        Some(Fate::Outvoted) => "another pose of the pair closes more triangles".to_owned(),
        Some(Fate::Unsupported) => "not accepted, and too few others confirm it".to_owned(),
        Some(Fate::Contradicted { parting }) => {
            format!("the poses that the others agree on pull its surfaces apart by {:.1} pr", parting / pr)
        }
        Some(Fate::Displaced { displacement }) => {
            format!(
                "the poses that the others agree on slide its surfaces along each other by {:.1} pr",
                displacement / pr
            )
        }
    }
}

/// Returns the lines of the summary.
pub(super) fn overview(outcome: &Outcome) -> Vec<String> {
    let placed = outcome.scans.iter().filter(|scan| scan.component.is_some()).count();
    let mut lines = vec![match outcome.components.as_slice() {
        [] => format!("none of the {} scans fits another", outcome.scans.len()),
        [one] => format!("{placed} of {} scans in one frame, that of {}", outcome.scans.len(), one[0]),
        several => {
            format!("{placed} of {} scans in {} separate components", outcome.scans.len(), several.len())
        }
    }];
    if outcome.components.len() > 1 {
        let component = |(i, members): (usize, &Vec<String>)| {
            format!("  {}: {} scans in the frame of {}: {}", i + 1, members.len(), members[0], listed(members))
        };
        lines.extend(outcome.components.iter().enumerate().map(component));
    }
    let without = outcome.scans.iter().filter_map(|scan| Some((&scan.scan, scan.problem.as_ref()?)));
    lines.extend(without.map(|(scan, problem)| format!("  not placed: {scan}: {problem}")));
    let mut fates: BTreeMap<&str, usize> = BTreeMap::new();
    outcome.pairs.iter().for_each(|pair| *fates.entry(pair.fate).or_default() += 1);
    let counted: Vec<String> = fates.iter().map(|(fate, n)| format!("{n} {fate}")).collect();
    if !counted.is_empty() {
        lines.push(format!("poses of pairs: {}", counted.join(", ")));
    }
    if outcome.refined {
        lines.push(format!("refined together over {} pairs of scans that touch", outcome.touching().len()));
    }
    if let Some(worst) = outcome.conflicts.first() {
        let ([one, other], percent) = (&worst.scans, 100.0 * worst.floating);
        let pairs = match outcome.conflicts.len() {
            1 => "two scans contradict each other".to_owned(),
            n => format!("{n} pairs of scans contradict each other"),
        };
        lines.push(format!(
            "{pairs}, so the poses may be wrong; most of all {one} and {other}: {percent:.0} % of their points float where \
             the other scanner saw empty space"
        ));
    }
    lines
}

fn listed(names: &[String]) -> String {
    let rest = names.len().saturating_sub(LISTED);
    let shown = names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
    if rest > 0 { format!("{shown} and {rest} more") } else { shown }
}
