//! Which scans form pairs.

use super::input::ScanFile;
use crate::fingerprint::{fingerprint, fnv};
use anyhow::{Result, bail};
use congruent_geometry::random::Stream;
use congruent_geometry::{RigidTransform, to_rows};
use std::collections::BTreeSet;

/// One pair to be registered.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Job {
    /// Unique within the run.
    pub(super) id: String,
    /// Positions among the scans.
    pub(super) source: usize,
    pub(super) target: usize,
    /// The true pose, for comparison.
    pub(super) truth: Option<RigidTransform>,
    /// A pose that may be near the right one; it competes with those that are found.
    pub(super) guess: Option<RigidTransform>,
}

impl Job {
    /// Returns the seed of this pair, which depends only on the global seed and the id. It is below 2^53, so that every
    /// reader of JSON preserves it.
    pub(super) fn seed(&self, global: u64) -> u64 {
        (Stream::new(global, fnv(self.id.as_bytes())).unit() * (1u64 << 53) as f64) as u64
    }

    /// Returns a hash of all that the input says about this pair: its id, the names of its scans, its poses.
    pub(super) fn fingerprint(&self, [source, target]: [&str; 2]) -> String {
        let pose = |pose: &Option<RigidTransform>| pose.as_ref().map_or(String::new(), |p| format!("{:?}", to_rows(p)));
        fingerprint(&[&self.id, source, target, &pose(&self.truth), &pose(&self.guess)])
    }
}

/// Returns the id of a pair that was given none.
pub(super) fn id_of(source: &str, target: &str) -> String {
    format!("{source}--{target}")
}

/// Makes a pair: the later scan is moved, the earlier one stays.
fn job(scans: &[ScanFile], earlier: usize, later: usize) -> Job {
    Job {
        id: id_of(&scans[later].name, &scans[earlier].name),
        source: later,
        target: earlier,
        truth: None,
        guess: None,
    }
}

/// Pairs each scan with every other one.
pub(super) fn all(scans: &[ScanFile]) -> Vec<Job> {
    (0..scans.len()).flat_map(|later| (0..later).map(move |earlier| job(scans, earlier, later))).collect()
}

/// Pairs each scan with the one before it.
pub(super) fn sequential(scans: &[ScanFile]) -> Vec<Job> {
    (1..scans.len()).map(|later| job(scans, later - 1, later)).collect()
}

/// Pairs each scan with the `k` scans whose signatures are nearest to its own. A scan without a signature (an empty
/// one) is paired with its neighbour in the order, so that its problem is reported in a row.
pub(super) fn alike(scans: &[ScanFile], signatures: &[Vec<f64>], k: usize) -> Vec<Job> {
    let distance_sq = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let mut chosen = BTreeSet::new();
    for (i, own) in signatures.iter().enumerate() {
        let mut others: Vec<(f64, usize)> = if own.is_empty() {
            [i.checked_sub(1), Some(i + 1)]
                .into_iter()
                .flatten()
                .filter(|j| *j < scans.len())
                .map(|j| (0.0, j))
                .take(1)
                .collect()
        } else {
            let with = signatures.iter().enumerate().filter(|(j, other)| *j != i && !other.is_empty());
            with.map(|(j, other)| (distance_sq(own, other), j)).collect()
        };
        others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        chosen.extend(others.iter().take(k).map(|&(_, j)| (i.min(j), i.max(j))));
    }
    reaching_all(signatures, &mut chosen, &distance_sq);
    chosen.into_iter().map(|(earlier, later)| job(scans, earlier, later)).collect()
}

/// If the pairs leave groups of scans unconnected, adds the most similar pairs that join them, so that a chain of pairs
/// leads from each scan with a signature to every other one.
fn reaching_all(
    signatures: &[Vec<f64>],
    chosen: &mut BTreeSet<(usize, usize)>,
    distance_sq: &dyn Fn(&[f64], &[f64]) -> f64,
) {
    let mut group: Vec<usize> = (0..signatures.len()).collect();
    let join = |group: &mut Vec<usize>, (i, j): (usize, usize)| {
        let (kept, gone) = (group[i].min(group[j]), group[i].max(group[j]));
        group.iter_mut().filter(|g| **g == gone).for_each(|g| *g = kept);
    };
    chosen.iter().for_each(|pair| join(&mut group, *pair));
    let usable: Vec<usize> = (0..signatures.len()).filter(|&i| !signatures[i].is_empty()).collect();
    let mut others: Vec<(f64, usize, usize)> = Vec::new();
    for (at, &i) in usable.iter().enumerate() {
        let apart = usable[at + 1..].iter().filter(|&&j| group[i] != group[j]);
        others.extend(apart.map(|&j| (distance_sq(&signatures[i], &signatures[j]), i, j)));
    }
    others.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    for (_, i, j) in others {
        if group[i] != group[j] {
            join(&mut group, (i, j));
            chosen.insert((i, j));
        }
    }
}

/// Sorts pairs by id; an id may occur only once.
pub(super) fn sorted(mut jobs: Vec<Job>) -> Result<Vec<Job>> {
    jobs.sort_by(|a, b| a.id.cmp(&b.id));
    if let Some(two) = jobs.windows(2).find(|two| two[0].id == two[1].id) {
        bail!("two pairs have the id `{}`; remove one, or give each its own in the column id of a table", two[0].id);
    }
    Ok(jobs)
}

/// Returns a key that sorts `scan2` before `scan10`: text and numbers in turn.
pub(super) fn natural(name: &str) -> Vec<(String, u64)> {
    let mut parts = vec![(String::new(), 0u64)];
    let mut in_number = false;
    // Without the extension, so that `scan` comes before `scan1`.
    for c in name.rsplit_once('.').map_or(name, |(stem, _)| stem).chars() {
        let last = parts.last_mut().expect("there is always a part");
        if let Some(digit) = c.to_digit(10) {
            last.1 = last.1.saturating_mul(10).saturating_add(u64::from(digit));
            in_number = true;
        } else if in_number {
            parts.push((c.to_string(), 0));
            in_number = false;
        } else {
            last.0.push(c);
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scans(names: &[&str]) -> Vec<ScanFile> {
        names.iter().map(|name| ScanFile { name: (*name).to_owned(), path: name.into() }).collect()
    }

    fn ids(jobs: &[Job]) -> Vec<&str> {
        jobs.iter().map(|job| job.id.as_str()).collect()
    }

    #[test]
    fn pairs_are_chosen() {
        let four = scans(&["a", "b", "c", "d"]);
        assert_eq!(ids(&all(&four)), ["b--a", "c--a", "c--b", "d--a", "d--b", "d--c"]);
        assert_eq!(ids(&sequential(&four)), ["b--a", "c--b", "d--c"]);
        assert!(all(&four[..1]).is_empty() && sequential(&[]).is_empty());
    }

    #[test]
    fn the_most_alike_are_paired_and_the_broken_one_once() {
        let five = scans(&["a", "b", "c", "d", "broken"]);
        let signatures = [vec![0.0, 0.0], vec![5.0, 0.0], vec![0.1, 0.0], vec![5.1, 0.0], vec![]];
        // `c` and `b` are the most similar scans of the two groups that would otherwise be unconnected.
        assert_eq!(ids(&alike(&five, &signatures, 1)), ["c--a", "c--b", "d--b", "broken--d"]);
        assert_eq!(alike(&five[..4], &signatures[..4], 8), {
            let mut all = all(&five[..4]);
            all.sort_by_key(|job| (job.target, job.source));
            all
        });
    }

    #[test]
    fn file_order_counts_numbers() {
        let mut names = ["s10.ply", "s9.ply", "s.ply", "s9b.ply", "r11.ply"];
        names.sort_by_key(|name| natural(name));
        assert_eq!(names, ["r11.ply", "s.ply", "s9.ply", "s9b.ply", "s10.ply"]);
    }

    #[test]
    fn an_id_twice_is_refused() {
        let two = scans(&["a", "b"]);
        assert!(sorted([all(&two), all(&two)].concat()).unwrap_err().to_string().contains("`b--a`"));
    }

    #[test]
    fn a_seed_depends_on_the_id_and_the_global_one() {
        let jobs = all(&scans(&["a", "b", "c"]));
        assert_ne!(jobs[0].seed(0), jobs[1].seed(0));
        assert_ne!(jobs[0].seed(0), jobs[0].seed(1));
        assert!(jobs.iter().all(|job| job.seed(7) < 1 << 53));
    }

    #[test]
    fn a_fingerprint_depends_on_all_that_the_input_says() {
        let plain = Job { id: "p".to_owned(), source: 0, target: 1, truth: None, guess: None };
        let moved = |x: f64| Some(RigidTransform::translation(x, 0.0, 0.0));
        let all = [
            plain.fingerprint(["a", "b"]),
            plain.fingerprint(["a", "c"]),
            plain.fingerprint(["c", "b"]),
            Job { id: "q".to_owned(), ..plain.clone() }.fingerprint(["a", "b"]),
            Job { truth: moved(1.0), ..plain.clone() }.fingerprint(["a", "b"]),
            Job { guess: moved(1.0), ..plain.clone() }.fingerprint(["a", "b"]),
            Job { guess: moved(2.0), ..plain.clone() }.fingerprint(["a", "b"]),
        ];
        assert_eq!(BTreeSet::from(all.clone()).len(), all.len(), "{all:?}");
        // Where the scans are in the input does not matter.
        assert_eq!(Job { source: 5, target: 3, ..plain }.fingerprint(["a", "b"]), all[0]);
    }
}
