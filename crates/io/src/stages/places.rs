//! Points of a scan: keypoints, and the places of descriptor rows.

use super::digits;
use crate::IoError;
use crate::table::{Table, TableFault, csv};
use congruent_geometry::Point;
use std::path::Path;

const EXPECTED: &str = "x,y,z";

/// A point of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// File coordinates.
    pub at: [f64; 3],
    /// Unit normal; zero where the surface has none, nothing where nobody said.
    pub normal: Option<Point>,
}

/// A line of a keypoint file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeypointRow {
    /// File coordinates.
    pub at: [f64; 3],
    /// How much it stands out.
    pub response: f64,
    /// Position among the sampled points.
    pub index: u32,
}

/// Keypoints as CSV: `x,y,z,response,index`.
#[must_use]
pub fn keypoints_csv(keypoints: &[KeypointRow]) -> String {
    let row = |k: &KeypointRow| {
        let at = k.at.iter().map(digits);
        at.chain([digits(&k.response), k.index.to_string()]).collect::<Vec<_>>()
    };
    csv(&["x", "y", "z", "response", "index"], keypoints.iter().map(row))
}

/// Places as CSV: `x,y,z`, and `nx,ny,nz` where all have a normal.
#[must_use]
pub fn places_csv(places: &[Place]) -> String {
    let with_normals = places.iter().all(|place| place.normal.is_some());
    let header = ["x", "y", "z", "nx", "ny", "nz"];
    let row = |place: &Place| {
        let normal = place.normal.filter(|_| with_normals);
        let normal = normal.into_iter().flatten().map(|v| digits(&v));
        place.at.iter().map(digits).chain(normal).collect::<Vec<_>>()
    };
    csv(&header[..if with_normals { 6 } else { 3 }], places.iter().map(row))
}

/// Reads places, each with its line: the columns `x,y,z` and, where there are any, `nx,ny,nz`; others are ignored.
/// Without a header, three fields a line.
///
/// # Errors
/// The file cannot be read, is no table of finite numbers, or lacks the coordinates.
pub fn read_places(path: &Path) -> Result<Vec<(usize, Place)>, IoError> {
    Table::read(path).and_then(|table| places(&table).map_err(|fault| IoError::Table { path: path.to_owned(), fault }))
}

fn places(table: &Table) -> Result<Vec<(usize, Place)>, TableFault> {
    let at = match (table.is_named(), table.width()) {
        (true, _) => table.columns(["x", "y", "z"], EXPECTED)?,
        (false, (0 | 3, _)) => [0, 1, 2],
        (false, (found, line)) => return Err(TableFault::Form { line, found, expected: "3 fields, x y z" }),
    };
    let normal = table.optional(["nx", "ny", "nz"]);
    let place = |row: &[f64]| Place { at: at.map(|i| row[i]), normal: normal.map(|n| n.map(|i| row[i] as f32)) };
    Ok(table.rows().map(|(line, row)| (line, place(row))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<(usize, Place)>, TableFault> {
        places(&Table::parse(text.as_bytes())?)
    }

    #[test]
    fn places_survive_the_round_trip_bit_for_bit() {
        let at = [[0.1 + 0.2, -1e-7, 4.5e6 + 1.0 / 3.0], [0.0, 1.0, 2.0]];
        let bare = at.map(|at| Place { at, normal: None });
        let turned = at.map(|at| Place { at, normal: Some([0.1, -0.7, 1e-9]) });
        for written in [bare, turned] {
            let back: Vec<Place> = read(&places_csv(&written)).unwrap().into_iter().map(|(_, place)| place).collect();
            assert_eq!(back, written);
        }
        let keypoints = at.map(|at| KeypointRow { at, response: 0.25, index: 7 });
        let text = keypoints_csv(&keypoints);
        assert_eq!(read(&text).unwrap().iter().map(|(_, place)| place.at).collect::<Vec<_>>(), at);
        assert!(text.starts_with("x,y,z,response,index\n") && text.ends_with("0.0,1.0,2.0,0.25,7\n"), "{text}");
    }

    #[test]
    fn bare_coordinates_and_other_columns_are_read() {
        assert_eq!(read("1 2 3\n").unwrap()[0].1.at, [1.0, 2.0, 3.0]);
        assert_eq!(read("# mine\nid,z,y,x\n9,3,2,1\n").unwrap(), [(3, Place { at: [1.0, 2.0, 3.0], normal: None })]);
        assert!(read("x,y,z\n").unwrap().is_empty());
    }

    #[test]
    fn tables_without_coordinates_are_refused() {
        for (text, expected) in [
            ("x,y,w\n1,2,3\n", "line 1: there is no column `z` among `x,y,w`; name the columns x,y,z"),
            ("\n1,2,3,4\n", "line 2: 4 fields and no header; write 3 fields, x y z"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{message}");
        }
    }
}
