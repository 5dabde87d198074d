//! LAS and LAZ, the formats of airborne laser scanning (ASPRS): whole numbers with a scale and an offset.
//!
//! `las` parses. It trusts counts and lengths with memory, so they are held against the size of the file before it
//! sees them, and extended records, which say nothing about the points, are hidden from it. A damaged LAZ stream cannot be
//! told from a whole one but by decoding it, and the decoder may stop at a broken promise: there, and only there, a panic
//! is caught and becomes an error.

use crate::blanked::Blanked;
use crate::content::Content;
use crate::gathered::{Gathered, Keep, Precision};
use congruent_geometry::RawScan;
use std::io::{self, BufReader, Cursor, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A LAZ file with more points in a byte is refused: real ones need a byte or more a point, and a damaged count must
/// not decide how much memory is taken.
const MOST_POINTS_PER_BYTE: u64 = 8;
/// Points decoded at a time.
const BLOCK: u64 = 1 << 14;
/// Steps that the longest side of a cloud is cut into when it is written: less than `i32` counts, with room.
const STEPS: f64 = 4e9;

/// Offsets of numbers in the header, and the first version that has extended records.
const MINOR_VERSION: u64 = 25;
const OFFSET_TO_POINTS: u64 = 96;
const N_EXTENDED: std::ops::Range<u64> = 243..247;
const FIRST_WITH_EXTENDED: u8 = 4;

pub(crate) fn is_las(file: &[u8]) -> bool {
    file.starts_with(b"LASF")
}

pub(crate) fn read(file: Content, keep: Keep) -> Result<RawScan, String> {
    let mut file = BufReader::new(without_extended(file).map_err(|error| way_out("header", &error))?);
    check_counts(&mut file)?;
    let header = las::Header::new(rewound(&mut file)?).map_err(|error| way_out("header", &error))?;
    if header.point_format().is_compressed {
        check_compression(&header, &mut file)?;
    }
    let (promised, is_compressed) = (header.number_of_points(), header.point_format().is_compressed);
    rewound(&mut file)?;
    let mut reader = las::Reader::new(file).map_err(|error| way_out("header", &error))?;
    let mut scan = Gathered::new(keep, Precision::Double);
    let mut held = 0;
    loop {
        let place = || format!("points {} to {}", held + 1, (held as u64 + BLOCK).min(promised));
        let block = if is_compressed { decoded(&mut reader) } else { reader.read_points(BLOCK).map_err(text_of) };
        let block = block.map_err(|reason| way_out(&place(), &reason))?;
        if block.is_empty() {
            return Ok(scan.into_scan());
        }
        held += block.len();
        scan.extend(block.x().zip(block.y()).zip(block.z()).map(|((x, y), z)| [x, y, z]));
    }
}

fn rewound(file: &mut BufReader<Blanked>) -> Result<&mut BufReader<Blanked>, String> {
    file.rewind().map_err(|error| way_out("header", &error))?;
    Ok(file)
}

/// A file that says it has no extended records.
fn without_extended(mut file: Content) -> io::Result<Blanked> {
    file.seek(SeekFrom::Start(MINOR_VERSION))?;
    let mut minor = [0];
    let is_told = file.read(&mut minor)? > 0;
    let zeros = if is_told && minor[0] >= FIRST_WITH_EXTENDED { N_EXTENDED } else { 0..0 };
    file.rewind()?;
    Ok(Blanked::new(file, zeros))
}

/// The next block of a LAZ file.
fn decoded(reader: &mut las::Reader) -> Result<las::PointData, String> {
    // The reader is not used again after a panic.
    let block = catch_unwind(AssertUnwindSafe(|| reader.read_points(BLOCK)));
    block.map_or_else(|_| Err("the compressed data are invalid".into()), |block| block.map_err(text_of))
}

#[expect(clippy::needless_pass_by_value, reason = "it is handed to map_err")]
fn text_of(error: las::Error) -> String {
    error.to_string()
}

fn way_out(place: &str, error: &dyn std::fmt::Display) -> String {
    format!("{place}: {error}; the file is damaged or cut short, copy or export it again")
}

/// Refuses more points than the file can hold; the same numbers as the parser will take.
fn check_counts(file: &mut BufReader<Blanked>) -> Result<(), String> {
    let length = file.get_ref().length();
    let raw = las::raw::Header::read_from(rewound(file)?).map_err(|error| way_out("header", &error))?;
    let legacy = u64::from(raw.number_of_point_records);
    let promised = if legacy > 0 { legacy } else { raw.large_file.map_or(0, |large| large.number_of_point_records) };
    let is_compressed = raw.point_data_record_format & 0xC0 != 0;
    let body = length.saturating_sub(u64::from(raw.offset_to_point_data));
    let fits = if is_compressed {
        promised <= body.saturating_mul(MOST_POINTS_PER_BYTE)
    } else {
        promised.checked_mul(u64::from(raw.point_data_record_length)).is_some_and(|needed| needed <= body)
    };
    if fits {
        return Ok(());
    }
    Err(format!(
        "the header promises {promised} points, the file holds {body} bytes of them; it is cut short, copy or export it \
         again"
    ))
}

/// Refuses a compressed file whose own tables do not fit it.
fn check_compression(header: &las::Header, file: &mut BufReader<Blanked>) -> Result<(), String> {
    let vlr = header.laz_vlr().map_err(|error| way_out("LAZ record", &error))?;
    let record = u64::from(header.point_format().len());
    if vlr.items().is_empty() || vlr.items_size() != record {
        return Err(format!(
            "LAZ record: {} items of {} bytes make a point of {record}; the file is damaged, copy or export it again",
            vlr.items().len(),
            vlr.items_size()
        ));
    }
    let length = file.get_ref().length();
    let mut number = |at: u64, n: usize| {
        let mut bytes = [0; 8];
        file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut bytes[..n])).ok()?;
        Some(u64::from_le_bytes(bytes))
    };
    // The table's place is written before the points, or at the very end where the writer could not go back.
    let told = number(OFFSET_TO_POINTS, 4).and_then(|points| number(points, 8));
    let told = if told == Some(u64::MAX) { length.checked_sub(8).and_then(|at| number(at, 8)) } else { told };
    let n_chunks = told.and_then(|at| number(at.checked_add(4)?, 4));
    match n_chunks {
        Some(n_chunks) if n_chunks <= length => Ok(()),
        _ => {
            Err("the chunk table is missing or does not match the file; it is cut short, copy or export it again"
                .into())
        }
    }
}

/// What the whole numbers of a file mean: a step and a place for zero on each axis.
struct Grid {
    step: f64,
    origin: [f64; 3],
}

impl Grid {
    /// A round place near the middle of the finite points, and the power of ten that just reaches all of them.
    fn of(points: &[[f64; 3]]) -> Grid {
        let bounds = |axis: usize| {
            let values = points.iter().map(|p| p[axis]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        };
        let bounds = [bounds(0), bounds(1), bounds(2)];
        let extent = bounds.iter().map(|(low, high)| high - low).fold(0.0, f64::max);
        let step = if extent > 0.0 { 10f64.powf((extent / STEPS).log10().ceil()) } else { 1e-9 };
        // So near the middle that whole numbers reach both ends.
        let round = step * STEPS / 400.0;
        let middle = |(low, high): (f64, f64)| ((0.5 * low + 0.5 * high) / round).round() * round;
        Grid { step, origin: bounds.map(|(low, high)| if low <= high { middle((low, high)) } else { 0.0 }) }
    }
}

/// The step to which coordinates are rounded when written, data units.
pub(crate) fn step(scan: &RawScan) -> f64 {
    Grid::of(&finite(scan)).step
}

fn finite(scan: &RawScan) -> Vec<[f64; 3]> {
    scan.points.iter().filter(|p| p.iter().all(|v| v.is_finite())).collect()
}

/// Finite points only, with the offset near them; nothing else.
pub(crate) fn encode(scan: &RawScan, is_compressed: bool) -> Result<Vec<u8>, String> {
    let points = finite(scan);
    let grid = Grid::of(&points);
    let mut builder = las::Builder::from((1, 2));
    builder.date = None; // The same scan gives the same bytes on any day.
    builder.point_format.is_compressed = is_compressed;
    let [x, y, z] = grid.origin.map(|offset| las::Transform { scale: grid.step, offset });
    builder.transforms = las::Vector { x, y, z };
    let failed = |error: las::Error| format!("{error}; write another format");
    let header = builder.into_header().map_err(failed)?;
    let mut writer = las::Writer::new(Cursor::new(Vec::new()), header).map_err(failed)?;
    for [x, y, z] in points {
        writer.write_point(las::Point { x, y, z, ..las::Point::default() }).map_err(failed)?;
    }
    writer.close().map_err(failed)?;
    Ok(writer.into_inner().map_err(failed)?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners of a box around a place.
    fn corners(middle: f64, extent: f64) -> RawScan {
        let ends = [middle - extent / 2.0, middle + extent / 2.0];
        RawScan { points: ends.map(|v| [v, -v, 3.0]).to_vec().into(), ..RawScan::default() }
    }

    #[test]
    fn points_of_any_extent_anywhere_survive_the_round_trip() {
        for exponent in -6..=6 {
            for (share, place) in [(0.35, 0.9), (3.9, 2.4), (1.0, -512_345.6), (7.3, 1e7 / 3.0)] {
                let scan = corners(place, share * 10f64.powi(exponent));
                let bytes = encode(&scan, false).unwrap();
                let block = las::Reader::new(Cursor::new(bytes)).unwrap().read_points(BLOCK).unwrap();
                let read: Vec<_> = block.x().zip(block.y()).zip(block.z()).map(|((x, y), z)| [x, y, z]).collect();
                // Half a step, and what an f64 so far from zero rounds.
                let tolerance = 0.51 * step(&scan) + 4.0 * f64::EPSILON * place.abs();
                let is_near = |(a, b): ([f64; 3], &[f64; 3])| a.iter().zip(b).all(|(a, b)| (a - b).abs() < tolerance);
                assert!(scan.points.iter().zip(&read).all(is_near), "{:?} became {read:?}", scan.points);
            }
        }
    }
}
