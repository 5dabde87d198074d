//! The header: found and tidied here, parsed by `ply_rs`.
//!
//! Real files hold blank lines, comments in Latin-1, carriage returns and names like `scalar_Illuminance_(PCV)`, all
//! of which the parser refuses. So every line is rewritten before it sees them: comments are emptied and names are
//! replaced by `n0`, `n1`, …, and put back afterwards. This also keeps two properties of one name apart, which the
//! parser would merge, moving every record behind them. Each line stays one line, so line numbers stay true.

use super::PlyFault;
use crate::error::excerpt;
use crate::window::Window;
use ply_rs::parser::{Parser, Reader};
use ply_rs::ply::{DefaultElement, Encoding, PropertyType};

/// What the header says about the body.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    /// In the order of the body, each name once.
    pub(super) elements: Vec<Element>,
    /// Where the scanner stood, from comments `view_px 1.5` and so on.
    pub(super) viewpoint: Option<[f64; 3]>,
    /// How many lines it has, the last one included.
    pub(super) n_lines: usize,
}

/// A kind of record.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    /// How many records the header promises. Not to be trusted with memory.
    pub(super) count: usize,
    /// In the order of the record. A name may come twice.
    pub(super) properties: Vec<Property>,
}

/// A value of a record.
#[derive(Debug)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: PropertyType,
}

impl Header {
    /// Parses everything up to the line `end_header`, and passes over it.
    pub(super) fn parse(file: &mut Window) -> Result<Header, PlyFault> {
        let mut is_whole = false;
        while lines(file.bytes(), is_whole).is_none() {
            if is_whole {
                return Err(PlyFault::NoHeaderEnd);
            }
            is_whole = !file.more();
        }
        let (lines, length) = lines(file.bytes(), is_whole).ok_or(PlyFault::NoHeaderEnd)?;
        let header = Header::of(&lines)?;
        file.pass(length);
        Ok(header)
    }

    fn of(lines: &[&[u8]]) -> Result<Header, PlyFault> {
        let mut names = Vec::new();
        let tidy: String = lines.iter().map(|line| tidied(line, &mut names) + "\n").collect();
        let parsed = Parser::<DefaultElement>::new()
            .read_header(&mut Reader::new(tidy.as_bytes()))
            .map_err(|error| fault(lines, error.line()))?;
        if (parsed.version.major, parsed.version.minor) != (1, 0) {
            return Err(fault(lines, None));
        }
        // The aliases are numbered in the order of the lines, which is the order of the parsed header.
        let mut name = names.into_iter();
        let mut elements: Vec<Element> = Vec::new();
        for element in parsed.elements.into_values() {
            let element_name = name.next().unwrap_or_default();
            let property =
                |p: ply_rs::ply::PropertyDef| Property { name: name.next().unwrap_or_default(), kind: p.data_type };
            let properties = element.properties.into_values().map(property).collect();
            elements.push(Element { name: element_name, count: element.count, properties });
        }
        check_unique(&elements, lines)?;
        Ok(Header { encoding: parsed.encoding, elements, viewpoint: viewpoint(lines), n_lines: lines.len() })
    }
}

/// The lines up to and with `end_header`, and how many bytes they take; nothing where more has to be read first.
///
/// The first line decides how lines end. A lone carriage return must be the only end then: the body may start with a
/// byte that looks like a line feed.
fn lines(file: &[u8], is_whole: bool) -> Option<(Vec<&[u8]>, usize)> {
    let first_end = file.iter().position(|b| matches!(b, b'\r' | b'\n')).unwrap_or(0);
    let lone_return = file.get(first_end) == Some(&b'\r') && file.get(first_end + 1) != Some(&b'\n');
    let end = if lone_return { b'\r' } else { b'\n' };
    let mut lines = Vec::new();
    let mut length = 0;
    for line in file.split(|&b| b == end) {
        length += line.len() + 1;
        lines.push(line.trim_ascii());
        if line.trim_ascii() == b"end_header" {
            // The last line of an empty body may lack its end.
            return (length <= file.len() || is_whole).then(|| (lines, length.min(file.len())));
        }
    }
    None
}

/// A line as the parser takes it; a name it declares goes to `names`.
fn tidied(line: &[u8], names: &mut Vec<String>) -> String {
    let line = String::from_utf8_lossy(line);
    let words: Vec<&str> = line.split_whitespace().collect();
    let mut alias = |name: String| {
        names.push(name);
        format!("n{}", names.len() - 1)
    };
    match words.as_slice() {
        [] | ["comment" | "obj_info", ..] => "comment".into(),
        ["element", name, count] => format!("element {} {count}", alias((*name).into())),
        ["property", "list", length, item, name @ ..] if !name.is_empty() => {
            format!("property list {length} {item} {}", alias(name.join(" ")))
        }
        ["property", kind, name @ ..] if !name.is_empty() => format!("property {kind} {}", alias(name.join(" "))),
        _ => words.join(" "),
    }
}

/// The place that comments or `obj_info` lines tell, one coordinate a line.
fn viewpoint(lines: &[&[u8]]) -> Option<[f64; 3]> {
    let told = |name: &str| {
        lines.iter().find_map(|line| {
            let words: Vec<&str> = str::from_utf8(line).ok()?.split_whitespace().collect();
            let is_remark = matches!(words.first(), Some(&("comment" | "obj_info")));
            let at = words.iter().position(|word| word.trim_end_matches([':', '=']) == name)?;
            words.get(at + 1).filter(|_| is_remark)?.parse().ok()
        })
    };
    Some([told("view_px")?, told("view_py")?, told("view_pz")?])
}

/// What is wrong with the line that the parser names; with the format line, where it names none.
fn fault(lines: &[&[u8]], line: Option<usize>) -> PlyFault {
    let is_format = |line: &&[u8]| line.starts_with(b"format");
    let line = line.or_else(|| lines.iter().position(is_format).map(|at| at + 1)).unwrap_or(lines.len());
    let found = lines.get(line.saturating_sub(1)).copied().unwrap_or_default();
    let text = excerpt(found);
    let expected = match found.split(u8::is_ascii_whitespace).next() {
        Some(b"format") => return PlyFault::Encoding { line, text },
        Some(b"element") => "expected `element NAME COUNT`, the count a whole number that fits the machine",
        Some(b"property") => {
            "expected `property TYPE NAME` or `property list TYPE TYPE NAME` after an element, \
             the types from char, uchar, short, ushort, int, uint, float and double"
        }
        Some(b"end_header") => "expected a `format` line before it",
        _ => "expected format, element, property, comment, obj_info or end_header",
    };
    PlyFault::Header { line, text, expected }
}

fn check_unique(elements: &[Element], lines: &[&[u8]]) -> Result<(), PlyFault> {
    let declares = |line: &&[u8]| line.split(u8::is_ascii_whitespace).next() == Some(b"element");
    let element_lines = (1..).zip(lines).filter(|(_, line)| declares(line));
    let mut seen = std::collections::HashSet::new();
    for (element, (line, text)) in elements.iter().zip(element_lines) {
        if !seen.insert(&element.name) {
            let expected = "expected an element of another name, this one is declared above";
            return Err(PlyFault::Header { line, text: excerpt(text), expected });
        }
    }
    Ok(())
}
