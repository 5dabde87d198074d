//! OBJ, Wavefront's text format: `v`, `vn` and `f`; everything else is passed over.
//!
//! Read here and not by a crate, because scans are often points without faces, and renderers' readers drop those.

use crate::error::excerpt;
use crate::text;
use crate::window::Window;
use congruent_geometry::RawScan;
use std::fmt::Write;

/// First words of lines that make a file an OBJ file, when there is a `v` among them.
const WORDS: [&[u8]; 14] =
    [b"v", b"vn", b"vt", b"vp", b"f", b"l", b"p", b"o", b"g", b"s", b"mtllib", b"usemtl", b"usemap", b"cstype"];
/// How many lines may come before the first vertex.
const HEAD: usize = 1000;

/// Whether the first lines are an OBJ file's, with a vertex among them.
pub(crate) fn is_obj(file: &[u8]) -> bool {
    let lines = text::lines(file).map(|(_, line)| text::uncommented(line)).filter(|line| !line.is_empty());
    for line in lines.take(HEAD) {
        let mut words = text::words(line);
        match words.next() {
            Some(b"v") => return words.next().is_some_and(|word| text::number(word).is_some()),
            Some(word) if WORDS.contains(&word) => {}
            _ => return false,
        }
    }
    false
}

/// A vertex's normal is the one that its first corner in a face names; where no face names any and there are as many
/// normals as vertices, they belong together in order. A vertex without one gets zero.
pub(crate) fn read(file: Window) -> Result<RawScan, String> {
    let mut lines = text::Lines::of(file);
    let totals = Totals::of(&mut lines);
    lines.rewind().map_err(|error| error.to_string())?;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    let mut normals: Vec<[f32; 3]> = Vec::new();
    let mut normal_of: Vec<Option<u32>> = Vec::new();
    let mut corners = Vec::new();
    while let Some((at, line)) = lines.next_uncommented() {
        let mut words = text::words(line);
        match words.next() {
            Some(b"v") => points.push(text::three(&mut words, at)?),
            Some(b"vn") => normals.push(text::three(&mut words, at)?.map(|v| v as f32)),
            Some(b"f") => {
                corners.clear();
                for word in words {
                    let (vertex, normal) = corner(word, at, &totals, [points.len(), normals.len()])?;
                    corners.push(vertex);
                    if let Some(normal) = normal {
                        normal_of.resize(totals.vertices, None);
                        normal_of[vertex as usize].get_or_insert(normal);
                    }
                }
                triangles.extend(text::fan(&corners));
            }
            _ => {}
        }
    }
    let normals = if !normal_of.is_empty() {
        Some(normal_of.iter().map(|normal| normal.map_or([0.0; 3], |i| normals[i as usize])).collect())
    } else {
        (!normals.is_empty() && normals.len() == points.len()).then_some(normals)
    };
    Ok(RawScan { points: points.into(), normals, triangles, ..RawScan::default() })
}

/// How many of each the whole file holds: faces may come before their vertices.
#[derive(Default)]
struct Totals {
    vertices: usize,
    normals: usize,
}

impl Totals {
    fn of(lines: &mut text::Lines) -> Totals {
        let mut totals = Totals::default();
        while let Some((_, line)) = lines.next_uncommented() {
            match text::words(line).next() {
                Some(b"v") => totals.vertices += 1,
                Some(b"vn") => totals.normals += 1,
                _ => {}
            }
        }
        totals
    }
}

/// Positions of the vertex and the normal that a word like `7`, `7/1`, `7//3` or `-1/-1/-1` names.
fn corner(word: &[u8], at: usize, totals: &Totals, so_far: [usize; 2]) -> Result<(u32, Option<u32>), String> {
    let mut parts = word.split(|&b| b == b'/');
    let vertex = parts.next().unwrap_or_default();
    let normal = parts.nth(1).filter(|part| !part.is_empty());
    let vertex = position(vertex, "vertex", at, totals.vertices, so_far[0])?;
    let normal = normal.map(|part| position(part, "normal", at, totals.normals, so_far[1])).transpose()?;
    Ok((vertex, normal))
}

/// Counted from one, or backwards from the last one so far.
fn position(part: &[u8], what: &str, at: usize, total: usize, so_far: usize) -> Result<u32, String> {
    let index: Option<i64> = str::from_utf8(part).ok().and_then(|part| part.parse().ok());
    let place = index.and_then(|index| if index < 0 { index.checked_add(so_far as i64) } else { index.checked_sub(1) });
    let exists = place.filter(|&place| place >= 0 && (place as u64) < total as u64);
    exists.and_then(|place| u32::try_from(place).ok()).ok_or_else(|| {
        format!("line {at}: {what} index `{}`, valid: 1 to {total}; repair or export the file again", excerpt(part))
    })
}

/// Text with every digit; normals are those of the vertices.
pub(crate) fn encode(scan: &RawScan) -> Vec<u8> {
    let mut file = String::new();
    // Writing to a string cannot fail.
    for [x, y, z] in scan.points.iter() {
        let _ = writeln!(file, "v {x:?} {y:?} {z:?}");
    }
    for [x, y, z] in scan.normals.iter().flatten() {
        let _ = writeln!(file, "vn {x:?} {y:?} {z:?}");
    }
    for triangle in &scan.triangles {
        let [a, b, c] = triangle.map(|i| match scan.normals {
            Some(_) => format!("{0}//{0}", u64::from(i) + 1),
            None => format!("{}", u64::from(i) + 1),
        });
        let _ = writeln!(file, "f {a} {b} {c}");
    }
    file.into_bytes()
}
