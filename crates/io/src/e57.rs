//! E57 (ASTM E2807): scans of terrestrial scanners, each with its pose.
//!
//! All scans of a file become one, each moved by its pose. `e57` parses; two things that would let it take memory
//! without end are refused before.

use crate::content::Content;
use crate::gathered::{Gathered, Keep, Precision};
use congruent_geometry::RawScan;
use e57::{CartesianCoordinate, E57Reader, E57Writer, PointCloud, Record, RecordDataType, RecordValue, Transform};
use std::io::{Cursor, Read, Seek};

/// Where the header has told the length of the XML part, in its last eight bytes.
const XML_LENGTH_TOLD: u64 = 40;

pub(crate) fn is_e57(file: &[u8]) -> bool {
    file.starts_with(b"ASTM-E57")
}

pub(crate) fn read(mut file: Content, keep: Keep) -> Result<RawScan, String> {
    let mut head = Vec::new();
    file.by_ref().take(XML_LENGTH_TOLD).read_to_end(&mut head).map_err(|error| error.to_string())?;
    let xml_length = head.last_chunk().map(|bytes| u64::from_le_bytes(*bytes));
    if head.len() as u64 != XML_LENGTH_TOLD || xml_length.is_none_or(|length| length > file.length()) {
        return Err(format!(
            "its description is longer than its {} bytes; it is cut short, copy it again",
            file.length()
        ));
    }
    file.rewind().map_err(|error| error.to_string())?;
    let mut reader = E57Reader::new(file).map_err(|error| way_out("header", &error))?;
    let clouds = reader.pointclouds();
    let mut scan = Gathered::new(keep, Precision::Double);
    for (at, cloud) in (1..).zip(&clouds) {
        let place = format!("scan {at} of {}", clouds.len());
        check(cloud, &place)?;
        let points = reader.pointcloud_simple(cloud).map_err(|error| way_out(&place, &error))?;
        for point in points {
            let point = point.map_err(|error| way_out(&place, &error))?;
            let point = match point.cartesian {
                CartesianCoordinate::Valid { x, y, z } => [x, y, z],
                // Counted with those that are not finite.
                _ => [f64::NAN; 3],
            };
            scan.push(point, None);
        }
    }
    let viewpoint = match clouds.as_slice() {
        [only] => only.transform.as_ref().and_then(viewpoint),
        _ => None, // Several scans have no one place.
    };
    Ok(RawScan { viewpoint, ..scan.into_scan() })
}

fn way_out(place: &str, error: &e57::Error) -> String {
    let cause = std::error::Error::source(error).map_or(String::new(), |cause| format!(" ({cause})"));
    format!("{place}: {error}{cause}; the file is damaged or cut short, copy or export it again")
}

/// Points that take no bits could be any number.
fn check(cloud: &PointCloud, place: &str) -> Result<(), String> {
    let takes_bits = |record: &Record| match record.data_type {
        RecordDataType::Single { .. } | RecordDataType::Double { .. } => true,
        RecordDataType::ScaledInteger { min, max, .. } | RecordDataType::Integer { min, max } => min < max,
    };
    if cloud.records > 0 && !cloud.prototype.iter().any(takes_bits) {
        return Err(format!(
            "{place}: {} points without data; the file is damaged, copy or export it again",
            cloud.records
        ));
    }
    Ok(())
}

/// Where the scanner stood. A pose that moves nothing is what writers put who do not know.
fn viewpoint(pose: &Transform) -> Option<[f64; 3]> {
    let (place, turn) = (&pose.translation, &pose.rotation);
    let moves = [place.x, place.y, place.z, turn.x, turn.y, turn.z].iter().any(|v| *v != 0.0);
    moves.then_some([place.x, place.y, place.z])
}

/// One scan in double precision; a viewpoint becomes the translation of its pose.
pub(crate) fn encode(scan: &RawScan) -> Result<Vec<u8>, String> {
    let failed = |error: e57::Error| format!("{error}; write another format");
    let [x, y, z] = scan.viewpoint.unwrap_or_default();
    let mut file = Vec::new();
    let mut writer = E57Writer::new(Cursor::new(&mut file), &guid(scan, 0)).map_err(failed)?;
    let fields = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
    let mut cloud = writer.add_pointcloud(&guid(scan, 1), fields).map_err(failed)?;
    let translation = e57::Translation { x, y, z };
    cloud.set_transform(scan.viewpoint.map(|_| Transform { translation, ..Transform::default() }));
    for point in scan.points.iter() {
        let local = [point[0] - x, point[1] - y, point[2] - z];
        cloud.add_point(local.map(RecordValue::Double).to_vec()).map_err(failed)?;
    }
    cloud.finalize().map_err(failed)?;
    writer.finalize().map_err(failed)?;
    drop(writer);
    Ok(file)
}

/// A name that only the content decides (Fowler, Noll and Vo's hash): the same scan gives the same bytes.
fn guid(scan: &RawScan, salt: u64) -> String {
    let hash = |seed: u64| {
        let bits = scan.points.iter().flatten().map(f64::to_bits);
        bits.fold(0xCBF2_9CE4_8422_2325 ^ seed, |hash, bits| (hash ^ bits).wrapping_mul(0x0100_0000_01B3))
    };
    let (a, b) = (hash(2 * salt), hash(2 * salt + 1));
    let group = |value: u64, shift: u32| (value >> shift) & 0xFFFF;
    let node = b & 0xFFFF_FFFF_FFFF;
    format!("{{{:08x}-{:04x}-{:04x}-{:04x}-{node:012x}}}", a >> 32, group(a, 16), group(a, 0), group(b, 48))
}
