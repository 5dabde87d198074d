//! The pairs that a batch works on.

use super::load;
use crate::args::DatasetArgs;
use crate::output;
use anyhow::Result;
use congruent_evaluation::GroundTruth;
use congruent_io::{TruePair, read_dataset};
use congruent_pipeline::Pair;

/// Pairs of a data set.
pub(super) struct Selected {
    pub(super) name: String,
    pub(super) pairs: Vec<TruePair>,
}

/// Reads the list of pairs and keeps those that are asked for.
pub(super) fn select(args: &DatasetArgs) -> Result<Selected> {
    let dataset = read_dataset(&args.dataset, args.data.as_deref())?;
    dataset.warnings.iter().for_each(|warning| output::remark(&format!("warning: {warning}")));
    let mut pairs = dataset.pairs;
    if args.min_overlap > 0.0 {
        pairs.iter_mut().filter(|pair| pair.overlap.is_none()).for_each(|pair| pair.overlap = measured(pair));
        // What cannot be measured has a bad file, and stays to say so.
        pairs.retain(|pair| pair.overlap.is_none_or(|overlap| overlap >= args.min_overlap));
    }
    Ok(Selected { name: dataset.name, pairs: spread(pairs, args.pairs) })
}

fn measured(pair: &TruePair) -> Option<f64> {
    let files = Pair { source: &pair.source_file, target: &pair.target_file };
    let scans = files.map(|file| load(file)).both().ok()?.into_map(|loaded| loaded.scan);
    Some(GroundTruth::of_scans(scans.as_ref(), &pair.target_from_source).overlap())
}

/// At most so many, evenly from all over the list.
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
