//! PCD, the Point Cloud Library's format: text, binary, or binary compressed (LZF).
//!
//! `pcd_rs` parses; it trusts the header's numbers with memory and with positions, so they are held against the size of
//! the file before it sees a point.

use crate::content::Content;
use crate::gathered::{Gathered, Keep, Precision};
use congruent_geometry::RawScan;
use pcd_rs::{DataKind, DynReader, DynRecord, DynWriter, Field, PcdMeta, ValueKind, ViewPoint, WriterInit};
use std::io::{BufReader, Cursor, Read, Seek};

/// LZF writes at most 264 bytes for three.
const MOST_EXPANSION: usize = 88;

/// Whether the comment of every PCD writer stands first, or the header's first entries do.
pub(crate) fn is_pcd(file: &[u8]) -> bool {
    let mut entries = crate::text::lines(file).map(|(_, line)| line).filter(|line| !line.is_empty());
    match entries.next() {
        Some(line) if line.starts_with(b"# .PCD") => true,
        Some(line) if line.starts_with(b"VERSION") => {
            entries.next().is_some_and(|line| line.starts_with(b"FIELDS") || line.starts_with(b"COLUMNS"))
        }
        Some(line) if line.starts_with(b"#") => {
            let entry = entries.find(|line| !line.starts_with(b"#"));
            entry.is_some_and(|line| line.starts_with(b"VERSION") || line.starts_with(b"FIELDS"))
        }
        _ => false,
    }
}

pub(crate) fn read(file: Content, keep: Keep) -> Result<RawScan, String> {
    let length = file.length();
    let refused = |error: std::io::Error| error.to_string();
    let mut file = BufReader::new(file);
    let meta = PcdMeta::from_reader(&mut file).map_err(|error| format!("header: {}", way_out(&error)))?;
    let start = file.stream_position().map_err(refused)?;
    let mut sizes = Vec::new();
    file.by_ref().take(8).read_to_end(&mut sizes).map_err(refused)?;
    check_size(&meta, usize::try_from(length.saturating_sub(start)).unwrap_or(usize::MAX), &sizes)?;
    let columns = Columns::of(&meta)?;

    let mut scan = match columns.normal {
        None => Gathered::new(keep, columns.precision(&meta)),
        Some(_) => Gathered::with_normals(keep, columns.precision(&meta)),
    };
    file.rewind().map_err(refused)?;
    let records = DynReader::from_reader(file).map_err(|error| way_out(&error))?;
    for (at, record) in (1..).zip(records) {
        let record = record.map_err(|error| format!("point {at} of {}: {}", meta.num_points, way_out(&error)))?;
        let number = |column: usize| first(&record.0[column]);
        scan.push(columns.point.map(number), columns.normal.map(|columns| columns.map(|column| number(column) as f32)));
    }
    Ok(RawScan { viewpoint: viewpoint(&meta.viewpoint), unread: columns.unread, ..scan.into_scan() })
}

fn way_out(error: &pcd_rs::Error) -> String {
    format!("{error}; correct it, copy or export the file again")
}

/// Refuses a header that promises more than the body can hold.
///
/// `length` is the body's; `sizes` are its first bytes, where a compressed one says how long it is.
fn check_size(meta: &PcdMeta, length: usize, sizes: &[u8]) -> Result<(), String> {
    let too_much = || {
        format!(
            "the header promises {} points, the file holds {} bytes after it; it is cut short, copy or export it again",
            meta.num_points, length
        )
    };
    let field_size = |count: u64, size: usize| usize::try_from(count).ok()?.checked_mul(size);
    let record = meta.field_defs.iter().try_fold((0usize, 0usize), |(bytes, words), field| {
        let more = field_size(field.count, field.kind.byte_size())?;
        Some((bytes.checked_add(more)?, words.checked_add(field_size(field.count, 1)?)?))
    });
    let needed = |per_point: usize| usize::try_from(meta.num_points).ok()?.checked_mul(per_point);
    let (bytes, words) = record.ok_or_else(too_much)?;
    match meta.data {
        // Each word is a character and a space or an end of line; the last one needs none.
        DataKind::Ascii if needed(words).is_some_and(|n| n <= length.div_ceil(2)) => Ok(()),
        DataKind::Binary if needed(bytes).is_some_and(|n| n <= length) => Ok(()),
        DataKind::BinaryCompressed => {
            let size = |at: usize| {
                let bytes = sizes.get(at..at + 4).and_then(|bytes| bytes.try_into().ok());
                bytes.map(|bytes| u32::from_le_bytes(bytes) as usize).ok_or_else(too_much)
            };
            let (compressed, uncompressed) = (size(0)?, size(4)?);
            let possible =
                compressed <= length.saturating_sub(8) && uncompressed <= compressed.saturating_mul(MOST_EXPANSION);
            if needed(bytes) == Some(uncompressed) && possible { Ok(()) } else { Err(too_much()) }
        }
        _ => Err(too_much()),
    }
}

/// Places in a record; padding is not in it.
struct Columns {
    point: [usize; 3],
    normal: Option<[usize; 3]>,
    /// Names of the others.
    unread: Vec<String>,
}

impl Columns {
    fn of(meta: &PcdMeta) -> Result<Columns, String> {
        let names: Vec<&str> = meta.field_defs.iter().map(|f| f.name.as_str()).filter(|name| *name != "_").collect();
        let position = |name: &str| names.iter().position(|n| *n == name);
        let coordinate = |name: &str| {
            position(name).ok_or_else(|| {
                let found = crate::error::excerpt(names.join(", ").as_bytes());
                format!("the header has no field `{name}` (found: {found}); export the file with x, y and z")
            })
        };
        let point = [coordinate("x")?, coordinate("y")?, coordinate("z")?];
        let normal = match ["normal_x", "normal_y", "normal_z"].map(position) {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
        let is_read = |at: &usize| point.contains(at) || normal.is_some_and(|normal| normal.contains(at));
        let unread = (0..names.len()).filter(|at| !is_read(at)).map(|at| names[at].to_owned()).collect();
        Ok(Columns { point, normal, unread })
    }

    /// What the coordinates need; a text may have more digits than the type of its numbers.
    fn precision(&self, meta: &PcdMeta) -> Precision {
        let is_single = |&column: &usize| meta.field_defs[column].kind == ValueKind::F32;
        let is_text = matches!(meta.data, DataKind::Ascii);
        if !is_text && self.point.iter().all(is_single) { Precision::Single } else { Precision::Double }
    }
}

/// The first value of a field as a number.
fn first(field: &Field) -> f64 {
    let value = match field {
        Field::I8(v) => v.first().map(|&v| f64::from(v)),
        Field::I16(v) => v.first().map(|&v| f64::from(v)),
        Field::I32(v) => v.first().map(|&v| f64::from(v)),
        Field::I64(v) => v.first().map(|&v| v as f64),
        Field::U8(v) => v.first().map(|&v| f64::from(v)),
        Field::U16(v) => v.first().map(|&v| f64::from(v)),
        Field::U32(v) => v.first().map(|&v| f64::from(v)),
        Field::U64(v) => v.first().map(|&v| v as f64),
        Field::F32(v) => v.first().map(|&v| f64::from(v)),
        Field::F64(v) => v.first().copied(),
    };
    value.unwrap_or(f64::NAN)
}

/// Where the scanner stood. The default is what writers put who do not know.
fn viewpoint(told: &ViewPoint) -> Option<[f64; 3]> {
    (*told != ViewPoint::default()).then_some([told.tx, told.ty, told.tz])
}

/// Coordinates as `float` where that loses nothing, else as `double`; normals as `float`.
pub(crate) fn encode(scan: &RawScan, data_kind: DataKind) -> Vec<u8> {
    let as_float = crate::write::fits_float(&scan.points);
    let kind = if as_float { ValueKind::F32 } else { ValueKind::F64 };
    let mut schema = vec![("x", kind, 1), ("y", kind, 1), ("z", kind, 1)];
    if scan.normals.is_some() {
        schema.extend(["normal_x", "normal_y", "normal_z"].map(|name| (name, ValueKind::F32, 1)));
    }
    let [tx, ty, tz] = scan.viewpoint.unwrap_or_default();
    let init = WriterInit {
        width: scan.points.len() as u64,
        height: 1,
        viewpoint: ViewPoint { tx, ty, tz, ..ViewPoint::default() },
        data_kind,
        schema: Some(schema.into_iter().collect()),
        version: None,
    };
    let mut file = Cursor::new(Vec::new());
    let mut writer: DynWriter<_> = init.build_from_writer(&mut file).expect("the fields have different names");
    for (i, point) in scan.points.iter().enumerate() {
        let coordinate = |&v: &f64| if as_float { Field::F32(vec![v as f32]) } else { Field::F64(vec![v]) };
        let mut record: Vec<Field> = point.iter().map(coordinate).collect();
        record.extend(scan.normals.iter().flat_map(|normals| normals[i]).map(|v| Field::F32(vec![v])));
        writer.push(&DynRecord(record)).expect("a vector takes any record of its own fields");
    }
    writer.finish().expect("a vector takes any number of bytes");
    file.into_inner()
}
