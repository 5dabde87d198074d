//! STL, the format of stereolithography: loose triangles in single precision, as text or binary.
//!
//! Corners at the same place become one point. `stl_io` parses; what its parser does not know is tidied before.

use crate::blanked::Blanked;
use crate::text;
use crate::window::Window;
use congruent_geometry::RawScan;
use std::collections::HashMap;
use std::io::{self, Cursor, Read, Seek, SeekFrom};

/// Where a binary file has a free text.
const NAME: std::ops::Range<u64> = 0..80;
/// Bytes before the first triangle of a binary file: a free text and the number of triangles.
const HEADER: usize = 84;
/// Bytes of a binary triangle.
const RECORD: usize = 50;
/// The first line of a text file as the parser knows it.
const FIRST_LINE: &[u8] = b"solid scan\n";

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

pub(crate) fn read(file: Window) -> Result<RawScan, String> {
    if is_binary(file.bytes(), file.length()) || !is_text(file.bytes()) { read_binary(file) } else { read_text(file) }
}

fn read_binary(file: Window) -> Result<RawScan, String> {
    let promised = n_promised(file.bytes()).ok_or_else(|| {
        format!("{} bytes are shorter than the header of {HEADER}; copy or export it again", file.length())
    })?;
    let held = file.length().saturating_sub(HEADER as u64) / RECORD as u64;
    if promised as u64 > held {
        return Err(format!(
            "the header promises {promised} triangles, the file holds {held}; it is cut short, copy or export it again"
        ));
    }
    // A free text that begins with `solid` would be taken for a text file.
    collect(&mut Blanked::new(file.rewound()?, NAME))
}

fn read_text(file: Window) -> Result<RawScan, String> {
    let mut solid = OneSolid::of(text::Lines::of(file));
    let scan = collect(&mut solid);
    // Where the parser gave up, the end may still come.
    io::copy(&mut solid, &mut io::sink()).map_err(|error| error.to_string())?;
    if solid.n_ends == 0 {
        return Err("no line begins with `endsolid`; the file is cut short, copy or export it again".into());
    }
    scan
}

/// A text file as the parser knows it: one solid with a name instead of several, in small letters.
struct OneSolid {
    lines: text::Lines,
    /// What is left of the present line.
    line: Cursor<Vec<u8>>,
    n_ends: usize,
    is_over: bool,
}

impl OneSolid {
    fn of(lines: text::Lines) -> Self {
        OneSolid { lines, line: Cursor::new(FIRST_LINE.to_vec()), n_ends: 0, is_over: false }
    }

    /// The next line; at the end one that ends the solid, then an empty one.
    fn next_line(&mut self) -> Vec<u8> {
        while let Some((_, line)) = self.lines.next() {
            let line = line.to_ascii_lowercase();
            if line.starts_with(b"endsolid") {
                self.n_ends += 1;
            } else if !line.starts_with(b"solid") {
                // The parser wants UTF-8, which only names may break.
                return format!("{}\n", String::from_utf8_lossy(&line)).into_bytes();
            }
        }
        if std::mem::replace(&mut self.is_over, true) { Vec::new() } else { b"endsolid scan\n".to_vec() }
    }
}

impl Read for OneSolid {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.line.position() == self.line.get_ref().len() as u64 {
            self.line = Cursor::new(self.next_line());
        }
        self.line.read(into)
    }
}

impl Seek for OneSolid {
    /// To the beginning, whatever is asked for: the parser wants nothing else.
    fn seek(&mut self, _: SeekFrom) -> io::Result<u64> {
        self.lines.rewind()?;
        (self.line, self.n_ends, self.is_over) = (Cursor::new(FIRST_LINE.to_vec()), 0, false);
        Ok(0)
    }
}

/// Merges corners of equal coordinates.
fn collect(file: &mut (impl Read + Seek)) -> Result<RawScan, String> {
    let fault = |facet: usize, error: &dyn std::fmt::Display| {
        format!("facet {facet}: {error}; repair the file or export it again")
    };
    let facets = stl_io::create_stl_reader(file).map_err(|error| fault(1, &error))?;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    let mut index_of: HashMap<[u32; 3], u32> = HashMap::new();
    for (at, facet) in (1..).zip(facets) {
        let facet = facet.map_err(|error| fault(at, &error))?;
        let triangle = facet.vertices.map(|corner| {
            // Adding zero turns -0 into +0, so that equal numbers have equal bits.
            let corner = corner.0.map(|v| v + 0.0);
            *index_of.entry(corner.map(f32::to_bits)).or_insert_with(|| {
                points.push(corner);
                (points.len() - 1) as u32
            })
        });
        triangles.push(triangle);
    }
    Ok(RawScan { points: points.into(), triangles, ..RawScan::default() })
}

/// Binary, with facet normals from the corners.
pub(crate) fn encode(scan: &RawScan) -> Vec<u8> {
    let facets = scan.triangles.iter().map(|triangle| {
        let corners = triangle.map(|i| scan.points.at(i as usize));
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
