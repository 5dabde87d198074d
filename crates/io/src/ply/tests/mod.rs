//! Files made value by value, in every encoding.

mod bad_files;
mod good_files;
mod headers;

use crate::IoError;
use crate::content::Content;
use crate::gathered::Keep;
use crate::read::scan_from;
use crate::window::Window;
use congruent_geometry::RawScan;
use std::path::Path;

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// An element of a test file.
#[derive(Clone)]
struct Records {
    name: &'static str,
    /// As in the header, without the word `property`.
    properties: Vec<String>,
    /// Record, property, values; a list's length is put before its values by [`encoded`].
    records: Vec<Vec<Vec<f64>>>,
}

impl Records {
    fn new(name: &'static str, properties: &[&str], records: &[&[&[f64]]]) -> Self {
        let records = records.iter().map(|r| r.iter().map(|values| values.to_vec()).collect()).collect();
        Records { name, properties: properties.iter().map(|p| (*p).to_owned()).collect(), records }
    }
}

fn header(encoding: &str, elements: &[Records]) -> String {
    let mut text = format!("ply\nformat {encoding} 1.0\n");
    for element in elements {
        text += &format!("element {} {}\n", element.name, element.records.len());
        element.properties.iter().for_each(|p| text += &format!("property {p}\n"));
    }
    text + "end_header\n"
}

fn body(encoding: &str, elements: &[Records]) -> Vec<u8> {
    let mut file = Vec::new();
    for element in elements {
        for record in &element.records {
            for (property, values) in element.properties.iter().zip(record) {
                let words: Vec<&str> = property.split(' ').collect();
                if words[0] == "list" {
                    push(&mut file, encoding, words[1], values.len() as f64);
                    values.iter().for_each(|&v| push(&mut file, encoding, words[2], v));
                } else {
                    push(&mut file, encoding, words[0], values[0]);
                }
            }
            if encoding == "ascii" {
                file.push(b'\n');
            }
        }
    }
    file
}

fn encoded(encoding: &str, elements: &[Records]) -> Vec<u8> {
    [header(encoding, elements).into_bytes(), body(encoding, elements)].concat()
}

fn push(file: &mut Vec<u8>, encoding: &str, kind: &str, v: f64) {
    if encoding == "ascii" {
        return file.extend(format!("{v} ").bytes());
    }
    let mut bytes = match kind {
        "char" | "int8" => (v as i8).to_le_bytes().to_vec(),
        "uchar" | "uint8" => (v as u8).to_le_bytes().to_vec(),
        "short" | "int16" => (v as i16).to_le_bytes().to_vec(),
        "ushort" | "uint16" => (v as u16).to_le_bytes().to_vec(),
        "int" | "int32" => (v as i32).to_le_bytes().to_vec(),
        "uint" | "uint32" => (v as u32).to_le_bytes().to_vec(),
        "float" | "float32" => (v as f32).to_le_bytes().to_vec(),
        "double" | "float64" => v.to_le_bytes().to_vec(),
        _ => panic!("no PLY type: {kind}"),
    };
    if encoding == "binary_big_endian" {
        bytes.reverse();
    }
    file.extend(bytes);
}

/// The same whether the file is there at once or a few bytes at a time.
fn scan(file: &[u8]) -> Result<RawScan, IoError> {
    let scan = scan_from(Path::new("scan.ply"), file);
    let expected = match &scan {
        Ok(scan) => format!("{scan:?}"),
        Err(IoError::Ply { fault, .. }) => format!("{fault:?}"),
        Err(_) => return scan, // No PLY file at all.
    };
    for block in [1, 7, 100] {
        let in_parts = crate::ply::read(&mut Window::of_blocks(Content::of(file.to_vec()), block), Keep::All);
        let in_parts = in_parts.map_or_else(|fault| format!("{fault:?}"), |scan| format!("{scan:?}"));
        assert_eq!(in_parts, expected, "{block} bytes at a time");
    }
    scan
}

/// Four vertices and a quadrilateral, with something to pass over everywhere.
fn busy_square() -> Vec<Records> {
    vec![
        Records::new(
            "camera",
            &["double focus", "list ushort char flags"],
            &[&[&[0.5], &[1.0, -1.0, 2.0]], &[&[1.0], &[]]],
        ),
        Records::new(
            "vertex",
            &["uchar red", "float x", "list uchar short scalar_Neighbours_(n)", "double y", "float z", "short x"],
            &[
                &[&[1.0], &[0.0], &[], &[0.25], &[7.0], &[9.0]],
                &[&[2.0], &[1.0], &[3.0, -4.0], &[0.25], &[7.0], &[9.0]],
                &[&[3.0], &[1.0], &[5.0], &[1.25], &[7.0], &[9.0]],
                &[&[4.0], &[0.0], &[], &[1.25], &[7.0], &[9.0]],
            ],
        ),
        Records::new(
            "face",
            &["list uchar float texcoord", "list uchar int vertex_indices", "int group"],
            &[&[&[0.5, 0.5], &[0.0, 1.0, 2.0, 3.0], &[-1.0]]],
        ),
        Records::new("edge", &["int vertex1", "int vertex2"], &[&[&[0.0], &[1.0]]]),
    ]
}

fn busy_square_scan() -> RawScan {
    RawScan {
        points: vec![[0.0, 0.25, 7.0], [1.0, 0.25, 7.0], [1.0, 1.25, 7.0], [0.0, 1.25, 7.0]].into(),
        normals: None,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        viewpoint: None,
        unread: ["red", "scalar_Neighbours_(n)"].map(str::to_owned).to_vec(),
    }
}
