//! STL, the format of stereolithography: loose triangles in single precision, as text or binary.
//!
//! Corners at the same place become one point. `stl_io` parses; what its parser does not know is tidied before.

use congruent_geometry::RawScan;
use std::collections::HashMap;
use std::io::Cursor;

/// Bytes before the first triangle of a binary file: a free text and the number of triangles.
const HEADER: usize = 84;
/// Bytes of a binary triangle.
const RECORD: usize = 50;

/// Whether the size is exactly what the count of triangles asks for, or the text begins `solid` and has a facet.
pub(crate) fn is_stl(head: &[u8], length: u64) -> bool {
    is_binary(head, length) || is_text(head)
}

fn is_binary(head: &[u8], length: u64) -> bool {
    n_promised(head).is_some_and(|n| length == (HEADER + RECORD * n) as u64)
}

fn is_text(file: &[u8]) -> bool {
    /// Names of solids are short.
    const HEAD: usize = 4096;
    let head = file[..file.len().min(HEAD)].to_ascii_lowercase();
    let has = |word: &[u8]| head.windows(word.len()).any(|window| window == word);
    head.trim_ascii_start().starts_with(b"solid") && (has(b"facet") || has(b"endsolid"))
}

fn n_promised(file: &[u8]) -> Option<usize> {
    let count: [u8; 4] = file.get(HEADER - 4..HEADER)?.try_into().ok()?;
    usize::try_from(u32::from_le_bytes(count)).ok()
}

pub(crate) fn read(file: &[u8]) -> Result<RawScan, String> {
    if is_binary(file, file.len() as u64) || !is_text(file) { read_binary(file) } else { read_text(file) }
}

fn read_binary(file: &[u8]) -> Result<RawScan, String> {
    let promised = n_promised(file).ok_or_else(|| {
        format!("{} bytes are shorter than the header of {HEADER}; copy or export it again", file.len())
    })?;
    let held = (file.len() - HEADER) / RECORD;
    if promised > held {
        return Err(format!(
            "the header promises {promised} triangles, the file holds {held}; it is cut short, copy or export it again"
        ));
    }
    // A free text that begins with `solid` would be taken for a text file.
    let mut tidy = file.to_vec();
    tidy[..HEADER - 4].fill(0);
    collect(tidy)
}

/// Several solids become one; upper case, and a first line without a name, are made what the parser knows.
fn read_text(file: &[u8]) -> Result<RawScan, String> {
    let lower = file.to_ascii_lowercase();
    let mut tidy = b"solid scan\n".to_vec();
    let mut n_ends = 0;
    for (_, line) in crate::text::lines(&lower) {
        if line.starts_with(b"endsolid") {
            n_ends += 1;
        } else if !line.starts_with(b"solid") {
            // The parser wants UTF-8, which only names may break.
            tidy.extend(String::from_utf8_lossy(line).as_bytes());
            tidy.push(b'\n');
        }
    }
    if n_ends == 0 {
        return Err("no line begins with `endsolid`; the file is cut short, copy or export it again".into());
    }
    tidy.extend(b"endsolid scan\n");
    collect(tidy)
}

/// Merges corners of equal coordinates.
fn collect(tidy: Vec<u8>) -> Result<RawScan, String> {
    let mut cursor = Cursor::new(tidy);
    let fault = |facet: usize, error: &dyn std::fmt::Display| {
        format!("facet {facet}: {error}; repair the file or export it again")
    };
    let facets = stl_io::create_stl_reader(&mut cursor).map_err(|error| fault(1, &error))?;
    let mut scan = RawScan::default();
    let mut index_of: HashMap<[u32; 3], u32> = HashMap::new();
    for (at, facet) in (1..).zip(facets) {
        let facet = facet.map_err(|error| fault(at, &error))?;
        let triangle = facet.vertices.map(|corner| {
            // Adding zero turns -0 into +0, so that equal numbers have equal bits.
            let corner = corner.0.map(|v| v + 0.0);
            *index_of.entry(corner.map(f32::to_bits)).or_insert_with(|| {
                scan.points.push(corner.map(f64::from));
                (scan.points.len() - 1) as u32
            })
        });
        scan.triangles.push(triangle);
    }
    Ok(scan)
}

/// Binary, with facet normals from the corners.
pub(crate) fn encode(scan: &RawScan) -> Vec<u8> {
    let facets = scan.triangles.iter().map(|triangle| {
        let corners = triangle.map(|i| scan.points[i as usize]);
        let [a, b, c] = corners.map(nalgebra::Vector3::from);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(nalgebra::Vector3::zeros);
        stl_io::Triangle {
            normal: stl_io::Normal::new(congruent_geometry::narrow(&normal)),
            vertices: corners.map(|corner| stl_io::Vertex::new(corner.map(|v| v as f32))),
        }
    });
    let mut file = Vec::new();
    stl_io::write_stl(&mut file, facets).expect("a vector takes any number of bytes");
    file
}
