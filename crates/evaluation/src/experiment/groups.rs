//! What varies among the results of an experiment, and the results that agree in all of it but what is shown.

use super::{Axis, Count};

/// Returns the counts of each table or figure that shows `shown`: one for each combination of everything else that
/// varies, which is its name (empty if nothing else varies). In the order of first appearance.
#[must_use]
pub fn groups(counts: &[Count], shown: [Axis; 2]) -> Vec<(String, Vec<&Count>)> {
    let others = varying(counts, |axis| !shown.contains(&axis));
    let names = distinct(counts.iter().map(|count| named(count, &others)));
    let group = |name: String| {
        let inside = counts.iter().filter(|count| named(count, &others) == name).collect();
        (name, inside)
    };
    names.into_iter().map(group).collect()
}

/// Returns each value once, in the order of first appearance.
#[must_use]
pub fn distinct<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for value in values {
        if !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

/// Returns those of the permitted axes that have more than one value.
pub(super) fn varying(counts: &[Count], may: impl Fn(Axis) -> bool) -> Vec<Axis> {
    let varies = |axis: &Axis| counts.iter().any(|count| count.value(*axis) != counts[0].value(*axis));
    Axis::ALL.into_iter().filter(|axis| may(*axis)).filter(varies).collect()
}

/// Returns the values of a count on these axes, each after the name of the axis.
pub(super) fn named(count: &Count, axes: &[Axis]) -> String {
    axes.iter().map(|axis| format!("{} {}", axis.name(), count.value(*axis))).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::super::tally::tests::{plan, tally};
    use super::*;

    #[test]
    fn what_is_not_shown_and_varies_tells_groups_apart() {
        let counts = tally().counts(&plan());
        let of = |shown| groups(&counts, shown).into_iter().map(|(name, of)| (name, of.len())).collect::<Vec<_>>();
        let expected = [("estimator RANSAC".to_owned(), 4), ("estimator 2SAC-GC".to_owned(), 4)];
        assert_eq!(of([Axis::Metric, Axis::DRmse]), expected);
        assert_eq!(of([Axis::Metric, Axis::Dataset]).len(), 4);
        assert_eq!(of([Axis::Metric, Axis::Dataset])[1].0, "estimator RANSAC, d_rmse (pr) 2.5");
        assert!(groups(&[], [Axis::Metric, Axis::Dataset]).is_empty());
    }
}
