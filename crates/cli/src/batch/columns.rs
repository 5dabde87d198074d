//! The columns of the tables that are written at the end of a run; docs/FILES.md explains them.

use super::row::Row;
use congruent_io::csv_line;
use congruent_pipeline::{Counts, Pair, Verdict};

/// A field of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell<'a> {
    Text(Option<&'a str>),
    Number(Option<f64>),
    Count(Option<u64>),
}

/// Returns the fields of a row with the names of their columns; all empty without a row.
pub(super) fn cells(row: Option<&Row>) -> Vec<(String, Cell<'_>)> {
    let mut cells = words(row);
    let pose = row.and_then(|row| row.target_from_source);
    cells.extend((0..16).map(|at| number(&format!("m{}{}", at / 4, at % 4), pose.map(|rows| rows[at / 4][at % 4]))));
    cells.extend(counts(row.and_then(|row| row.counts.as_ref())));
    cells.push(number("resolution", row.and_then(|row| row.resolution)));
    cells.push(("seed".to_owned(), Cell::Count(row.map(|row| row.seed))));
    cells.push(text("configuration", row.map(|row| row.configuration.as_str())));
    cells.push(text("version", row.map(|row| row.version.as_str())));
    cells.push(number("seconds", row.and_then(|row| row.timings.get("total").copied())));
    cells
}

fn words(row: Option<&Row>) -> Vec<(String, Cell<'_>)> {
    vec![
        text("id", row.map(|row| row.id.as_str())),
        text("source", row.map(|row| row.source.as_str())),
        text("target", row.map(|row| row.target.as_str())),
        text("status", row.map(|row| row.status.name())),
        text("verdict", row.and_then(|row| row.verdict.map(Verdict::name))),
        text("reason", row.and_then(|row| row.reason.as_deref())),
        text("error", row.and_then(|row| row.error.as_deref())),
        number("confidence", row.and_then(|row| row.confidence)),
        number("overlap", row.and_then(|row| row.overlap)),
        number("rotation_error_deg", row.and_then(|row| row.rotation_error_deg)),
        number("centre_error", row.and_then(|row| row.centre_error)),
    ]
}

/// A count for each of the two scans.
type Two = fn(&Counts) -> Pair<usize>;

fn counts(counts: Option<&Counts>) -> Vec<(String, Cell<'static>)> {
    let count = |name: &str, of: &dyn Fn(&Counts) -> u64| (name.to_owned(), Cell::Count(counts.map(of)));
    let mut cells = Vec::new();
    let twos: [(&str, Two); 5] = [
        ("points", |c| c.points),
        ("strays", |c| c.strays),
        ("sampled", |c| c.sampled),
        ("keypoints", |c| c.keypoints),
        ("described", |c| c.described),
    ];
    for (name, of) in twos {
        cells.push(count(&format!("{name}_source"), &|c| of(c).source as u64));
        cells.push(count(&format!("{name}_target"), &|c| of(c).target as u64));
    }
    cells.push(count("correspondences", &|c| c.correspondences as u64));
    cells.push(count("trials", &|c| c.trials));
    cells.push(count("poses", &|c| c.poses as u64));
    cells.push(count("inliers", &|c| c.inliers as u64));
    cells
}

fn text<'a>(name: &str, value: Option<&'a str>) -> (String, Cell<'a>) {
    (name.to_owned(), Cell::Text(value))
}

fn number(name: &str, value: Option<f64>) -> (String, Cell<'static>) {
    (name.to_owned(), Cell::Number(value))
}

/// Returns all rows as a CSV table with a header; fields without a value are empty.
pub(super) fn csv(rows: &[Row]) -> String {
    let header: Vec<String> = cells(None).into_iter().map(|(name, _)| name).collect();
    let mut text = csv_line(header) + "\n";
    for row in rows {
        text += &(csv_line(cells(Some(row)).iter().map(|(_, cell)| field(cell))) + "\n");
    }
    text
}

fn field(cell: &Cell<'_>) -> String {
    match cell {
        Cell::Text(value) => value.unwrap_or_default().to_owned(),
        Cell::Number(value) => value.map_or(String::new(), |v| format!("{v:?}")),
        Cell::Count(value) => value.map_or(String::new(), |v| v.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::row::tests::broken;
    use super::*;

    #[test]
    fn a_row_has_a_field_for_each_column() {
        let text = csv(&[broken("#a--b")]);
        let mut lines = text.lines().map(congruent_io::csv_fields);
        let (names, values) = (lines.next().unwrap(), lines.next().unwrap());
        assert_eq!((names.len(), lines.next()), (values.len(), None));
        let value = |name: &str| values[names.iter().position(|n| n == name).unwrap()].as_str();
        assert_eq!((value("id"), value("target"), value("status")), ("#a--b", "b,c.ply", "error"));
        assert_eq!((value("seed"), value("m00"), value("inliers")), ("7", "", ""));
        assert_eq!((value("error"), value("seconds")), ("a.ply: line 3, \"x\" is no number", "1.5"));
        assert!(text.lines().nth(1).unwrap().starts_with("\"#a--b\""));
    }
}
