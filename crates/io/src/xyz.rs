//! Points as lines of numbers: XYZ, TXT, CSV, ASC, PTS.
//!
//! The columns are parted by semicolons, commas, tabs or spaces, whichever the first line of points has, in this order.
//! Columns 1 to 3 are x, y and z. Columns 4 to 6 are normals where they have length one (or zero) in every line; other
//! columns are passed over. Lines that are blank or begin with `#` or `//` do not count; a first line that is no numbers
//! is a header, and a lone whole number on the first line is the number of points, which is not needed.

use crate::error::excerpt;
use crate::text;
use crate::window::Window;
use congruent_geometry::RawScan;

/// How far from one the length of a normal may be: what two printed digits can lose.
const LENGTH_TOLERANCE: f64 = 0.02;

/// Whether the first lines are points, behind one header line and one count at most.
pub(crate) fn is_xyz(file: &[u8]) -> bool {
    let mut data = data_lines(file).skip_while(|(_, line)| is_count(line));
    let is_point = |(_, line): (usize, &[u8])| {
        let columns = Delimiter::of(line).columns(line);
        columns.len() >= 3 && columns[..3].iter().all(|word| text::number(word).is_some())
    };
    let first = data.next();
    first.is_some_and(is_point) || first.is_some() && data.find(|(_, line)| !is_count(line)).is_some_and(is_point)
}

/// The points, and the normals if there are any.
pub(crate) fn read(file: Window) -> Result<RawScan, String> {
    let mut lines = text::Lines::of(file);
    let mut delimiter = None;
    let mut scan = RawScan::default();
    let mut normals = Some(Vec::new());
    let mut has_header = false;
    while let Some((line, content)) = lines.next() {
        if !is_data(content) {
            continue;
        }
        if scan.points.is_empty() && is_count(content) {
            continue;
        }
        if scan.points.is_empty() && !has_header && is_header(content) {
            has_header = true;
            continue;
        }
        let columns = delimiter.get_or_insert_with(|| Delimiter::of(content)).columns(content);
        if columns.len() < 3 {
            return Err(format!(
                "line {line}, `{}`: expected 3 columns or more, found {}; correct it or export the file again",
                excerpt(content),
                columns.len()
            ));
        }
        scan.points.push(text::three(&mut columns[..3].iter().copied(), line)?);
        match (&mut normals, normal(&columns[3..])) {
            (Some(normals), Some(normal)) => normals.push(normal),
            _ => normals = None,
        }
    }
    scan.normals = normals.filter(|normals| normals.iter().any(|n| *n != [0.0; 3]));
    Ok(scan)
}

/// One line a point; every digit is kept.
pub(crate) fn encode(scan: &RawScan, delimiter: char) -> Vec<u8> {
    let mut file = String::new();
    for (i, point) in scan.points.iter().enumerate() {
        let mut columns: Vec<String> = point.iter().map(|v| format!("{v:?}")).collect();
        columns.extend(scan.normals.iter().flat_map(|normals| normals[i]).map(|v| format!("{v:?}")));
        file += &columns.join(&delimiter.to_string());
        file.push('\n');
    }
    file.into_bytes()
}

/// What stands between the columns.
#[derive(Clone, Copy)]
enum Delimiter {
    Byte(u8),
    WhiteSpace,
}

impl Delimiter {
    fn of(line: &[u8]) -> Delimiter {
        let found = [b';', b','].into_iter().find(|byte| line.contains(byte));
        found.map_or(Delimiter::WhiteSpace, Delimiter::Byte)
    }

    /// The words of a line; quotes around them are left out, and so is what follows a delimiter at the end.
    fn columns(self, line: &[u8]) -> Vec<&[u8]> {
        let Delimiter::Byte(delimiter) = self else { return text::words(line).collect() };
        let line = line.strip_suffix(&[delimiter]).unwrap_or(line);
        line.split(|&b| b == delimiter).map(|word| unquoted(word.trim_ascii())).collect()
    }
}

fn unquoted(word: &[u8]) -> &[u8] {
    match word {
        [b'"', inner @ .., b'"'] => inner,
        all => all,
    }
}

fn data_lines(file: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    text::lines(file).filter(|(_, line)| is_data(line))
}

fn is_data(line: &[u8]) -> bool {
    !line.is_empty() && !line.starts_with(b"#") && !line.starts_with(b"//")
}

fn is_count(line: &[u8]) -> bool {
    line.iter().all(u8::is_ascii_digit)
}

fn is_header(line: &[u8]) -> bool {
    let columns = Delimiter::of(line).columns(line);
    columns.iter().take(3).any(|word| text::number(word).is_none())
}

/// Columns 4 to 6 as a normal.
fn normal(columns: &[&[u8]]) -> Option<[f32; 3]> {
    let [x, y, z, ..] = columns else { return None };
    let v = [text::number(x)?, text::number(y)?, text::number(z)?];
    let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    (length == 0.0 || (length - 1.0).abs() <= LENGTH_TOLERANCE).then(|| v.map(|v| v as f32))
}
