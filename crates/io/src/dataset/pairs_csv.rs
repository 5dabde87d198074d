//! Our own list of pairs.

use super::lines::{at_line, lines, motion, number};
use super::{DatasetFault, Listed, Truth};
use crate::csv::{csv_fields, csv_line};
use congruent_geometry::{RigidTransform, to_rows};

const COLUMNS: [&str; 15] =
    ["source", "target", "overlap", "r00", "r01", "r02", "tx", "r10", "r11", "r12", "ty", "r20", "r21", "r22", "tz"];

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
    let mut text = COLUMNS.join(",") + "\n";
    for pair in pairs {
        let rows = to_rows(&pair.target_from_source);
        let numbers = rows[..3].iter().flatten().map(|v| format!("{v:?}"));
        let fields = [pair.source.clone(), pair.target.clone(), format!("{:.4}", pair.overlap)];
        text += &(csv_line(fields.into_iter().chain(numbers)) + "\n");
    }
    text
}

/// An empty overlap is one that is not known.
pub(super) fn parse(text: &str) -> Result<Listed, DatasetFault> {
    let mut lines = lines(text);
    let header: Vec<String> = csv_fields(lines.next().map_or("", |(_, line)| line));
    let mut places = [0; COLUMNS.len()];
    for (place, missing) in places.iter_mut().zip(COLUMNS) {
        *place = header
            .iter()
            .position(|name| name.eq_ignore_ascii_case(missing))
            .ok_or(DatasetFault::Column { missing })?;
    }
    Ok(lines.map(|(line, content)| pair(line, content, header.len(), &places)).collect())
}

fn pair(line: usize, content: &str, width: usize, places: &[usize; COLUMNS.len()]) -> Result<Truth, DatasetFault> {
    let fields = csv_fields(content);
    if fields.len() != width {
        let expected = "as many are needed as the header has";
        return Err(DatasetFault::Width { line, found: fields.len(), expected });
    }
    let at = |column: usize| fields[places[column]].as_str();
    let overlap = if at(2).is_empty() { None } else { Some(number(at(2), line)?) };
    let matrix = (3..COLUMNS.len()).map(|column| number(at(column), line)).chain([0.0, 0.0, 0.0, 1.0].map(Ok));
    let matrix: Vec<f64> = matrix.collect::<Result<_, _>>()?;
    Ok(Truth {
        source: at(0).to_owned(),
        target: at(1).to_owned(),
        place: at_line(line),
        overlap,
        motion: motion(&matrix, line)?,
    })
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
    fn columns_are_found_by_name() {
        let mut names = COLUMNS.to_vec();
        names.reverse();
        names.push("note");
        let text = format!("{}\n3,1,0,0,2,0,1,0,1,0,0,1,,t.ply,s.ply,hello\n", names.join(",").to_uppercase());
        let read = whole(parse(&text).unwrap());
        assert_eq!((read[0].source.as_str(), read[0].target.as_str(), read[0].overlap), ("s.ply", "t.ply", None));
        assert_eq!(read[0].motion.pose.translation.vector, nalgebra::Vector3::new(1.0, 2.0, 3.0));
    }
}
