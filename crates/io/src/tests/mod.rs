//! Every format through the public door: written, read, recognised, cut and damaged.

mod bad_files;
mod round_trips;
mod texts;

use crate::content::Content;
use crate::format::Format;
use crate::gathered::Keep;
use crate::read::scan_from;
use crate::window::Window;
use congruent_geometry::RawScan;
use std::path::Path;

/// Extensions of all formats.
const EXTENSIONS: [&str; 10] = ["ply", "obj", "stl", "off", "pcd", "xyz", "csv", "las", "laz", "e57"];

/// What a file's format is told by is in its first bytes; here as few as suffice.
const BLOCK: usize = 100;

/// A bent sheet of 6 × 5 points far from the origin, with normals, faces and a scanner.
fn sheet() -> RawScan {
    let at = |row: u32, column: u32| {
        let (x, y) = (f64::from(column), f64::from(row));
        [1000.1 + 0.37 * x, -2000.2 + 0.41 * y, 30.3 + 0.05 * (x * y).sin()]
    };
    let cells = (0..4).flat_map(|row| (0..5).map(move |column| 6 * row + column));
    RawScan {
        points: (0..5).flat_map(|row| (0..6).map(move |column| at(row, column))).collect(),
        normals: Some((0..30).map(|i: u8| [0.6, 0.8 * f32::from(i % 2), 0.8 * f32::from(1 - i % 2)]).collect()),
        triangles: cells.flat_map(|i: u32| [[i, i + 1, i + 7], [i, i + 7, i + 6]]).collect(),
        viewpoint: Some([1000.5, -1999.5, 50.25]),
        unread: Vec::new(),
    }
}

/// The sheet as a file.
fn file_of(extension: &str) -> Vec<u8> {
    let format = Format::of_name(&Path::new("scan").with_extension(extension)).unwrap();
    format.encode(&sheet()).unwrap()
}

/// A scan, or the message why there is none, however many bytes are read at a time. The name tells nothing.
fn scan(file: &[u8]) -> Result<RawScan, String> {
    let path = Path::new("scan.dat");
    let scan = scan_from(path, file).map_err(|error| error.to_string());
    let content = || Content::of(file.to_vec());
    if let Ok(format) = Format::recognise(path, &Window::new(content())) {
        let mut window = Window::of_blocks(content(), BLOCK);
        window.reach(BLOCK);
        let in_parts = format.read(path, window, Keep::All).map_err(|error| error.to_string());
        // Written out, a NaN is like another.
        assert_eq!(format!("{in_parts:?}"), format!("{scan:?}"));
    }
    scan
}
