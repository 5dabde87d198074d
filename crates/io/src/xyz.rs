//! Points as lines of numbers: XYZ, TXT, CSV, ASC, PTS.
//!
//! The columns are parted by semicolons, commas, tabs or spaces, whichever the first line of points has, in this order.
//! Lines that are blank or begin with `#` or `//` do not count; a first line that is no numbers is a header, and a lone
//! whole number on the first line is the number of points, which is not needed. Where the header has the columns x, y and
//! z, these are the coordinates, and nx, ny and nz the normals; else columns 1 to 3 and 4 to 6. Normals are taken where
//! they have length one (or zero) in every line; other columns are passed over.

use crate::error::excerpt;
use crate::gathered::{Gathered, Keep, Precision};
use crate::text;
use crate::window::Window;
use congruent_geometry::RawScan;

/// How far from one the length of a normal may be: what two printed digits can lose.
const LENGTH_TOLERANCE: f64 = 0.02;

/// Whether the first lines are points, behind one header line and one count at most; or a header that names coordinates.
pub(crate) fn is_xyz(file: &[u8]) -> bool {
    let mut data = data_lines(file).map(|(_, line)| line).skip_while(|line| is_count(line));
    let Some(first) = data.next() else { return false };
    if !is_header(first) {
        return is_point(first, &Columns::IN_ORDER);
    }
    let named = Columns::named(first);
    let columns = named.as_ref().unwrap_or(&Columns::IN_ORDER);
    data.find(|line| !is_count(line)).map_or(named.is_some(), |line| is_point(line, columns))
}

fn is_point(line: &[u8], columns: &Columns) -> bool {
    let words = Delimiter::of(line).columns(line);
    columns.point(&words).is_some_and(|point| point.iter().all(|word| text::number(word).is_some()))
}

/// The points, and the normals if there are any.
pub(crate) fn read(file: Window, keep: Keep) -> Result<RawScan, String> {
    let mut lines = text::Lines::of(file);
    let mut delimiter = None;
    let mut scan = Gathered::with_normals(keep, Precision::Double);
    let mut is_begun = false;
    let mut header: Option<Columns> = None;
    while let Some((line, content)) = lines.next() {
        if !is_data(content) {
            continue;
        }
        if !is_begun && is_count(content) {
            continue;
        }
        if !is_begun && header.is_none() && is_header(content) {
            header = Some(Columns::named(content).unwrap_or(Columns::IN_ORDER));
            continue;
        }
        let columns = header.as_ref().unwrap_or(&Columns::IN_ORDER);
        let words = delimiter.get_or_insert_with(|| Delimiter::of(content)).columns(content);
        let Some(point) = columns.point(&words) else {
            return Err(format!(
                "line {line}, `{}`: expected {} columns or more, found {}; correct it or export the file again",
                excerpt(content),
                columns.fewest(),
                words.len()
            ));
        };
        is_begun = true;
        scan.push(text::three(&mut point.into_iter(), line)?, columns.normal(&words));
    }
    let scan = scan.into_scan();
    let normals = scan.normals.filter(|normals| normals.iter().any(|n| *n != [0.0; 3]));
    Ok(RawScan { normals, ..scan })
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

/// Where in a line what stands, counted from zero.
struct Columns {
    point: [usize; 3],
    /// Normals, if there are any.
    normal: Option<[usize; 3]>,
}

impl Columns {
    const IN_ORDER: Columns = Columns { point: [0, 1, 2], normal: Some([3, 4, 5]) };

    /// As a header names them; nothing where it does not name the coordinates.
    fn named(header: &[u8]) -> Option<Columns> {
        let words = Delimiter::of(header).columns(header);
        let place = |name: &str| words.iter().position(|word| word.eq_ignore_ascii_case(name.as_bytes()));
        let places = |[x, y, z]: [&str; 3]| Some([place(x)?, place(y)?, place(z)?]);
        Some(Columns { point: places(["x", "y", "z"])?, normal: places(["nx", "ny", "nz"]) })
    }

    /// How many a line must have.
    fn fewest(&self) -> usize {
        1 + self.point.into_iter().max().unwrap_or(0)
    }

    fn point<'w>(&self, words: &[&'w [u8]]) -> Option<[&'w [u8]; 3]> {
        three_of(words, self.point)
    }

    fn normal(&self, words: &[&[u8]]) -> Option<[f32; 3]> {
        let [x, y, z] = three_of(words, self.normal?)?;
        let v = [text::number(x)?, text::number(y)?, text::number(z)?];
        let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        (length == 0.0 || (length - 1.0).abs() <= LENGTH_TOLERANCE).then(|| v.map(|v| v as f32))
    }
}

fn three_of<'w>(words: &[&'w [u8]], places: [usize; 3]) -> Option<[&'w [u8]; 3]> {
    let [x, y, z] = places.map(|place| words.get(place).copied());
    Some([x?, y?, z?])
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
