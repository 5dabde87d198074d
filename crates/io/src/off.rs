//! OFF, the Object File Format of Geomview, as text: `OFF`, `NOFF` with normals, `COFF` with colours (passed over).

use crate::error::excerpt;
use crate::text;
use crate::window::Window;
use congruent_geometry::RawScan;
use std::fmt::Write;

/// Whether the first word is one of the format's.
pub(crate) fn is_off(file: &[u8]) -> bool {
    let first = text::lines(file).map(|(_, line)| text::uncommented(line)).find(|line| !line.is_empty());
    first.is_some_and(|line| keyword(line).is_some())
}

/// The word that the file begins with, up to and with `OFF`: the counts may follow without a space.
fn keyword(line: &[u8]) -> Option<&str> {
    let word = str::from_utf8(text::words(line).next()?).ok()?;
    let (prefix, rest) = word.split_once("OFF")?;
    let known = ["", "ST", "C", "N", "CN", "STC", "STN", "STCN", "4", "n", "4n", "C4", "N4", "CN4", "STCN4"];
    let whole = rest.is_empty() || rest.bytes().all(|b| b.is_ascii_digit());
    (whole && known.contains(&prefix)).then(|| &word[..prefix.len() + 3])
}

pub(crate) fn read(file: Window) -> Result<RawScan, String> {
    let mut lines = text::Lines::of(file);
    let (mut at, first) = lines.next_uncommented().ok_or("no line begins with OFF; export the file again")?;
    let keyword = keyword(first).ok_or("the first word is not OFF; export the file again")?.to_owned();
    if keyword.contains(['4', 'n']) {
        return Err(format!("`{keyword}` holds points that are not of three dimensions; export it as OFF"));
    }
    let has_normals = keyword.contains('N');
    let mut rest = &first[keyword.len()..];
    if rest.trim_ascii().is_empty() {
        let next = lines.next_uncommented();
        (at, rest) = next.ok_or("the counts are missing; the file is cut short, copy or export it again")?;
    }
    if rest.trim_ascii().starts_with(b"BINARY") {
        return Err("it is binary OFF, which is not supported; export it as text or as PLY".into());
    }
    let [n_vertices, n_faces] = counts(rest, at)?;

    let ends = |what: &str, promised: usize, held: usize| {
        format!(
            "the header promises {promised} {what}, the file ends after {held}; it is cut short, copy or export it again"
        )
    };
    let (mut points, mut triangles, mut normals) = (Vec::new(), Vec::new(), has_normals.then(Vec::new));
    for held in 0..n_vertices {
        let (at, line) = lines.next_uncommented().ok_or_else(|| ends("vertices", n_vertices, held))?;
        let mut words = text::words(line);
        points.push(text::three(&mut words, at)?);
        if let Some(normals) = &mut normals {
            normals.push(text::three(&mut words, at)?.map(|v| v as f32));
        }
    }
    for held in 0..n_faces {
        let (at, line) = lines.next_uncommented().ok_or_else(|| ends("faces", n_faces, held))?;
        triangles.extend(text::fan(&corners(line, at, n_vertices)?));
    }
    Ok(RawScan { points: points.into(), normals, triangles, ..RawScan::default() })
}

fn counts(line: &[u8], at: usize) -> Result<[usize; 2], String> {
    let mut words = text::words(line);
    let mut count = || str::from_utf8(words.next()?).ok()?.parse().ok();
    count().zip(count()).map(|(vertices, faces)| [vertices, faces]).ok_or_else(|| {
        format!("line {at}, `{}`: expected the numbers of vertices and faces; export the file again", excerpt(line))
    })
}

/// The corners of a face: how many, then which; what follows is a colour.
fn corners(line: &[u8], at: usize, n_vertices: usize) -> Result<Vec<u32>, String> {
    let whole = |word: &[u8]| {
        str::from_utf8(word).ok().and_then(|word| word.parse::<u32>().ok()).ok_or_else(|| {
            format!("line {at}: `{}` is not a whole number; correct it or export the file again", excerpt(word))
        })
    };
    let mut words = text::words(line);
    let n_corners = words.next().map_or(Ok(0), whole)? as usize;
    let corners: Vec<u32> = words.take(n_corners).map(whole).collect::<Result<_, _>>()?;
    if corners.len() < n_corners {
        return Err(format!("line {at}: expected {n_corners} corners, found {}; export the file again", corners.len()));
    }
    match corners.iter().find(|&&i| i as usize >= n_vertices) {
        Some(index) => Err(format!(
            "line {at}: vertex index {index}, valid: 0 to {n_vertices} exclusive; repair or export the file again"
        )),
        None => Ok(corners),
    }
}

/// Text with every digit.
pub(crate) fn encode(scan: &RawScan) -> Vec<u8> {
    let keyword = if scan.normals.is_some() { "NOFF" } else { "OFF" };
    let mut file = format!("{keyword}\n{} {} 0\n", scan.points.len(), scan.triangles.len());
    for (i, [x, y, z]) in scan.points.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(file, "{x:?} {y:?} {z:?}");
        if let Some([x, y, z]) = scan.normals.as_ref().map(|normals| normals[i]) {
            let _ = write!(file, " {x:?} {y:?} {z:?}");
        }
        file.push('\n');
    }
    for [a, b, c] in &scan.triangles {
        let _ = writeln!(file, "3 {a} {b} {c}");
    }
    file.into_bytes()
}
