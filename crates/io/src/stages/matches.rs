//! Correspondences: places of the source with their places in the target, best first.

use super::{Place, digits};
use crate::IoError;
use crate::table::{Table, TableFault, csv};
use congruent_geometry::RawScan;
use std::path::Path;

const PLACES: [&str; 6] = ["sx", "sy", "sz", "tx", "ty", "tz"];
const ROWS: [&str; 4] = ["source_row", "target_row", "distance", "score"];
const NORMALS: [&str; 6] = ["snx", "sny", "snz", "tnx", "tny", "tnz"];
const INDICES: [&str; 2] = ["source_index", "target_index"];
const EXPECTED: &str = "sx,sy,sz,tx,ty,tz or source_index,target_index";

/// A line of a correspondence file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchRow {
    /// In the source scan.
    pub source: Place,
    /// In the target scan.
    pub target: Place,
    /// Row of the source's descriptors.
    pub source_row: u32,
    /// Row of the target's descriptors.
    pub target_row: u32,
    /// Between the two descriptors.
    pub distance: f32,
    /// What the file is ranked by; larger is better.
    pub score: f32,
}

/// Correspondences as CSV: `sx,sy,sz,tx,ty,tz,source_row,target_row,distance,score`, and the normals
/// `snx,sny,snz,tnx,tny,tnz` where all have them.
#[must_use]
pub fn matches_csv(matches: &[MatchRow]) -> String {
    let both = |m: &MatchRow| Some([m.source.normal?, m.target.normal?]);
    let with_normals = matches.iter().all(|m| both(m).is_some());
    let header: Vec<&str> =
        PLACES.iter().chain(&ROWS).chain(NORMALS.iter().filter(|_| with_normals)).copied().collect();
    let row = |m: &MatchRow| {
        let places = m.source.at.into_iter().chain(m.target.at).map(|v| digits(&v));
        let rows = [m.source_row.to_string(), m.target_row.to_string(), digits(&m.distance), digits(&m.score)];
        let normals = both(m).filter(|_| with_normals).into_iter().flatten().flatten().map(|v| digits(&v));
        places.chain(rows).chain(normals).collect::<Vec<_>>()
    };
    csv(&header, matches.iter().map(row))
}

/// Reads correspondences `[source, target]`, in the order of the file.
///
/// Understood are named columns `sx,sy,sz,tx,ty,tz` (with `snx` to `tnz`, if there are any; others are ignored), the
/// same six fields without a header, and pairs of point positions (named `source_index,target_index`, or two fields
/// without a header), counted from zero over all points of the `scans`, `[source, target]`.
///
/// # Errors
/// The file cannot be read, is no table of finite numbers, has none of these forms, or a position has no point.
pub fn read_matches(path: &Path, scans: Option<[&RawScan; 2]>) -> Result<Vec<[Place; 2]>, IoError> {
    Table::read(path)
        .and_then(|table| matches(&table, scans).map_err(|fault| IoError::Table { path: path.to_owned(), fault }))
}

fn matches(table: &Table, scans: Option<[&RawScan; 2]>) -> Result<Vec<[Place; 2]>, TableFault> {
    if table.is_named() {
        return match table.optional(INDICES) {
            Some(columns) => of_indices(table, columns, scans),
            None => Ok(of_places(table, table.columns(PLACES, EXPECTED)?)),
        };
    }
    match table.width() {
        (0 | 6, _) => Ok(of_places(table, [0, 1, 2, 3, 4, 5])),
        (2, _) => of_indices(table, [0, 1], scans),
        (found, line) => {
            let expected = "6 fields, sx sy sz tx ty tz, or 2 point indices";
            Err(TableFault::Form { line, found, expected })
        }
    }
}

fn of_places(table: &Table, columns: [usize; 6]) -> Vec<[Place; 2]> {
    let normals = table.optional(NORMALS);
    let pair = |row: &[f64]| {
        [0, 3].map(|first| Place {
            at: std::array::from_fn(|axis| row[columns[first + axis]]),
            normal: normals.map(|n| std::array::from_fn(|axis| row[n[first + axis]] as f32)),
        })
    };
    table.rows().map(|(_, row)| pair(row)).collect()
}

fn of_indices(table: &Table, columns: [usize; 2], scans: Option<[&RawScan; 2]>) -> Result<Vec<[Place; 2]>, TableFault> {
    let [source, target] = scans.ok_or(TableFault::NoScans)?;
    let place = |line, value: f64, raw: &RawScan, scan| {
        // Negative numbers and fractions come back changed.
        let index = value as usize;
        let point = raw.points.get(index).filter(|_| index as f64 == value);
        let last = raw.points.len().saturating_sub(1);
        let at = point.ok_or(TableFault::Index { line, value, scan, last })?;
        let is_finite = at.iter().all(|v| v.is_finite());
        if is_finite { Ok(Place { at, normal: None }) } else { Err(TableFault::Broken { line, index, scan }) }
    };
    let pair = |(line, row): (usize, &[f64])| {
        Ok([place(line, row[columns[0]], source, "source")?, place(line, row[columns[1]], target, "target")?])
    };
    table.rows().map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, scans: Option<[&RawScan; 2]>) -> Result<Vec<[Place; 2]>, TableFault> {
        matches(&Table::parse(text.as_bytes())?, scans)
    }

    fn place(x: f64) -> Place {
        Place { at: [x, x / 3.0, 1e7 + x], normal: Some([0.0, 0.6, -0.8]) }
    }

    fn row(source: Place, target: Place) -> MatchRow {
        MatchRow { source, target, source_row: 4, target_row: 9, distance: 0.1, score: 0.75 }
    }

    #[test]
    fn correspondences_survive_the_round_trip_with_and_without_normals() {
        let rows = [row(place(0.1), place(-7.0)), row(place(2.0), place(1e-12))];
        let text = matches_csv(&rows);
        assert!(text.starts_with("sx,sy,sz,tx,ty,tz,source_row,target_row,distance,score,snx,sny,snz,tnx,tny,tnz\n"));
        assert_eq!(read(&text, None).unwrap(), rows.map(|r| [r.source, r.target]));

        let bare = |p: Place| Place { normal: None, ..p };
        let text = matches_csv(&[row(place(0.1), bare(place(3.0)))]);
        assert!(text.ends_with(",4,9,0.1,0.75\n"), "{text}");
        assert_eq!(read(&text, None).unwrap(), [[bare(place(0.1)), bare(place(3.0))]]);
    }

    #[test]
    fn six_fields_and_pairs_of_positions_are_read() {
        let scan = |x: f64| RawScan { points: vec![[x; 3], [f64::NAN; 3], [x + 1.0; 3]].into(), ..RawScan::default() };
        let (source, target) = (scan(0.0), scan(10.0));
        let at = |pairs: Vec<[Place; 2]>| pairs.iter().map(|pair| pair.map(|p| p.at)).collect::<Vec<_>>();
        assert_eq!(at(read("1 2 3 4 5 6\n", None).unwrap()), [[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]]);
        for text in ["2 0\n0 2\n", "target_index,source_index\n0,2\n2,0\n"] {
            let pairs = at(read(text, Some([&source, &target])).unwrap());
            assert_eq!(pairs, [[[1.0; 3], [10.0; 3]], [[0.0; 3], [11.0; 3]]]);
        }
        for (text, expected) in [
            ("0 3\n", "line 1: 3 is not a point index; the target scan's points are numbered 0 to 2"),
            ("0 0\n-1 0\n", "line 2: -1 is not a point index; the source"),
            ("0.5 0\n", "line 1: 0.5 is not a point index"),
            ("1e300 0\n", "line 1: 1000"),
            ("1 0\n", "line 1: point 1 of the source scan has a coordinate that is not finite"),
        ] {
            let message = read(text, Some([&source, &target])).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{message}");
        }
    }

    #[test]
    fn other_tables_are_refused_with_what_would_be_understood() {
        for (text, expected) in [
            ("0 1\n", "pairs of point indices; give their scans"),
            ("1 2 3\n", "3 fields and no header; write 6 fields"),
            ("sx,sy,sz,tx,ty\n1,2,3,4,5\n", "no column `tz` among `sx,sy,sz,tx,ty`"),
        ] {
            let message = read(text, None).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}
