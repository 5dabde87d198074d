//! The pairs of data sets that a command works on.

use super::load;
use crate::args::DatasetArgs;
use crate::output;
use crate::progress::Bar;
use anyhow::{Result, bail};
use congruent_evaluation::GroundTruth;
use congruent_io::{Dataset, TruePair, read_dataset};
use congruent_pipeline::Pair;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Pairs of a data set.
pub(super) struct Selected {
    pub(super) name: String,
    pub(super) pairs: Vec<TruePair>,
    /// Number of pairs whose ground truth cannot be used.
    broken: usize,
    /// All its files: description, ground truth, and the scans of all pairs, also of those that were not asked for.
    files: BTreeSet<PathBuf>,
}

impl Selected {
    /// Returns whether the whole ground truth could be used.
    pub(super) fn is_whole(&self) -> bool {
        self.broken == 0
    }
}

/// Returns all files of data sets, over which no result may be written.
pub(super) fn files_of(selected: &[Selected]) -> Vec<&Path> {
    selected.iter().flat_map(|set| &set.files).map(PathBuf::as_path).collect()
}

/// Returns the names of data sets, for a title.
pub(super) fn names_of(selected: &[Selected]) -> String {
    selected.iter().map(|set| set.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// Refuses a data set with the name of another one, because rows are identified by these names.
pub(crate) fn named_once<'a>(path: &Path, name: &String, others: impl IntoIterator<Item = &'a String>) -> Result<()> {
    if others.into_iter().any(|other| other == name) {
        bail!("{}: another data set is also called `{name}`; change the name in dataset.toml", path.display());
    }
    Ok(())
}

/// Reads the lists of pairs and keeps those that were asked for.
pub(super) fn select(args: &DatasetArgs) -> Result<Vec<Selected>> {
    if !args.data.is_empty() && args.data.len() != args.datasets.len() {
        let (places, sets) = (args.data.len(), args.datasets.len());
        bail!("--data was given {places} times for {sets} data sets; give it once per data set, in the same order");
    }
    let mut selected: Vec<Selected> = Vec::new();
    for (number, path) in args.datasets.iter().enumerate() {
        let one = select_one(path, args.data.get(number).map(PathBuf::as_path), args)?;
        named_once(path, &one.name, selected.iter().map(|other| &other.name))?;
        selected.push(one);
    }
    if selected.iter().all(|set| set.pairs.is_empty() && set.is_whole()) {
        let way_out = match (args.pairs, args.min_overlap) {
            (Some(0), _) => "ask for more than 0 with --pairs",
            (_, Some(least)) if least > 0.0 => "lower --min-overlap",
            _ => "list some pairs, or lower the minimum overlap with --min-overlap",
        };
        bail!("{}: no pair is left; {way_out}", args.datasets[0].display());
    }
    Ok(selected)
}

fn select_one(path: &Path, data: Option<&Path>, args: &DatasetArgs) -> Result<Selected> {
    let Dataset { name, pairs, broken, read_from, .. } = listed_pairs(path, data, args.min_overlap)?;
    let scans = pairs.iter().flat_map(|pair| [&pair.source_file, &pair.target_file]);
    let files = read_from.iter().chain(scans).cloned().collect();
    Ok(Selected { name, pairs: spread(pairs, args.pairs), broken: broken.len(), files })
}

/// Returns a data set with the pairs that overlap enough: as much as it demands itself, unless another limit is given.
/// Reports anything unusual or broken in its ground truth.
pub(crate) fn listed_pairs(path: &Path, data: Option<&Path>, min_overlap: Option<f64>) -> Result<Dataset> {
    let mut dataset = read_dataset(path, data)?;
    dataset.warnings.iter().for_each(|warning| output::remark(&format!("warning: {warning}")));
    dataset.broken.iter().for_each(|error| output::complain(&format!("{error}; the pair is skipped")));
    let min_overlap = min_overlap.unwrap_or(dataset.min_overlap);
    if min_overlap > 0.0 {
        measure_overlaps(&mut dataset.pairs);
        // A pair that cannot be measured has a bad file. It is kept, so that this is reported.
        dataset.pairs.retain(|pair| pair.overlap.is_none_or(|overlap| overlap >= min_overlap));
    }
    Ok(dataset)
}

/// Measures the overlaps that the data set does not give.
fn measure_overlaps(pairs: &mut [TruePair]) {
    let unknown: Vec<&mut TruePair> = pairs.iter_mut().filter(|pair| pair.overlap.is_none()).collect();
    let bar = Bar::new(unknown.len() as u64);
    for (done, pair) in (1..).zip(unknown) {
        pair.overlap = measured(pair);
        bar.at(done, "overlaps");
    }
}

fn measured(pair: &TruePair) -> Option<f64> {
    let files = Pair { source: &pair.source_file, target: &pair.target_file };
    let scans = files.par_map(|file| load(file)).both().ok()?.map(|loaded| loaded.scan);
    Some(GroundTruth::of_scans(scans.as_ref(), &pair.target_from_source).overlap())
}

/// Returns at most this many items, evenly spread over the list.
fn spread<T>(all: Vec<T>, at_most: Option<usize>) -> Vec<T> {
    let (n, wanted) = (all.len(), at_most.unwrap_or(usize::MAX));
    if n <= wanted {
        return all;
    }
    let mut places = (0..wanted).map(|i| i * n / wanted).peekable();
    all.into_iter().enumerate().filter_map(|(i, pair)| places.next_if_eq(&i).map(|_| pair)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_taken_evenly() {
        assert_eq!(spread((0..10).collect(), Some(4)), [0, 2, 5, 7]);
        assert_eq!(spread((0..3).collect(), Some(4)), [0, 1, 2]);
        assert_eq!(spread((0..3).collect(), None), [0, 1, 2]);
    }
}
