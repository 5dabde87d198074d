//! Our own list of pairs.

use super::lines::at_line;
use super::pair_table::{MATRIX, PairEntry, pair_table};
use super::{DatasetFault, Listed, Truth};
use crate::csv::csv_line;
use congruent_geometry::{RigidTransform, to_rows};

/// What a line of `pairs.csv` says.
#[derive(Clone, Debug, PartialEq)]
pub struct PairLine {
    /// File in `scans/`.
    pub source: String,
    /// File in `scans/`.
    pub target: String,
    /// Share of points that both have.
    pub overlap: f64,
    /// The truth.
    pub target_from_source: RigidTransform,
}

/// The text of a `pairs.csv`, every digit kept.
#[must_use]
pub fn pairs_csv(pairs: &[PairLine]) -> String {
    let mut text = format!("source,target,overlap,{}\n", MATRIX.join(","));
    for pair in pairs {
        let rows = to_rows(&pair.target_from_source);
        let numbers = rows[..3].iter().flatten().map(|v| format!("{v:?}"));
        let fields = [pair.source.clone(), pair.target.clone(), format!("{:.4}", pair.overlap)];
        text += &(csv_line(fields.into_iter().chain(numbers)) + "\n");
    }
    text
}

/// Pairs without a true pose are faults.
pub(super) fn parse(text: &str) -> Result<Listed, DatasetFault> {
    Ok(pair_table(text)?.into_iter().map(|entry| truth(entry?)).collect())
}

fn truth(PairEntry { line, id, source, target, overlap, truth, .. }: PairEntry) -> Result<Truth, DatasetFault> {
    let motion = truth.ok_or(DatasetFault::NoTruth { line })?;
    Ok(Truth { id, source, target, place: at_line(line), overlap, motion })
}

#[cfg(test)]
mod tests {
    use super::super::tests::whole;
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let pose = RigidTransform::new(nalgebra::Vector3::new(0.1, -1e7, 3.3), nalgebra::Vector3::new(0.3, 1.0, -0.2));
        let line =
            PairLine { source: "b, \"1\".ply".into(), target: "a.ply".into(), overlap: 0.25, target_from_source: pose };
        let read = whole(parse(&pairs_csv(&[line.clone(), line])).unwrap());
        assert_eq!(read.len(), 2);
        assert_eq!((read[1].source.as_str(), read[1].overlap), ("b, \"1\".ply", Some(0.25)));
        assert!((read[1].motion.pose.to_homogeneous() - pose.to_homogeneous()).norm() < 1e-14);
    }

    #[test]
    fn a_pair_without_a_truth_is_no_pair_of_a_data_set() {
        let text = format!(
            "id,source,target,{}\np1,b,a{}\np2,b,a,1,0,0,4,0,1,0,0,0,0,1,0\n",
            MATRIX.join(","),
            ",".repeat(12)
        );
        let read = parse(&text).unwrap();
        assert_eq!(read[0], Err(DatasetFault::NoTruth { line: 2 }));
        let second = read[1].as_ref().unwrap();
        assert_eq!((second.id.as_deref(), second.motion.pose.translation.vector.x), (Some("p2"), 4.0));
        assert_eq!(parse("source,target\nb,a\n").unwrap(), [Err(DatasetFault::NoTruth { line: 2 })]);
    }
}
