//! The records behind the header, whatever they are encoded in.
//!
//! One loop serves every encoding: a [`Numbers`] yields the next number as `f64`, which holds every PLY type exactly.

use super::PlyFault;
use super::header::{Element, Header, Property};
use crate::gathered::{Gathered, Keep, Precision};
use crate::text::fan;
use congruent_geometry::RawScan;
use ply_rs::ply::{PropertyType, ScalarType};

/// The numbers of a body, one after the other.
pub(super) trait Numbers {
    /// The next number, which the header says is of this type.
    fn number(&mut self, kind: &ScalarType) -> Result<f64, Stop>;

    /// Passes over the next `n` numbers.
    fn skip(&mut self, kind: &ScalarType, n: usize) -> Result<(), Stop>;

    /// Reads whole records of which only the coordinates are wanted, at most `n`, and says how many; none where they do not lie
    /// next to each other in every record.
    fn points(&mut self, _: &[Property], _: &[Option<usize>], _n: usize, _points: &mut Gathered) -> usize {
        0
    }

    /// Reads whole records of plain numbers, at most `n`, and says how many; none where every number has to be looked for.
    fn records(&mut self, _: &[Property], _: &[Option<usize>], _n: usize, _visit: impl FnMut(Row)) -> usize {
        0
    }

    /// What numbers of a type need.
    fn precision(&self, kind: &ScalarType) -> Precision;

    /// How many records are left at most, from the bytes that are left.
    fn room(&self, properties: &[Property]) -> usize;
}

/// A vertex: coordinates, then the normal, as far as the file has them.
pub(super) type Row = [f64; 6];

/// Properties of a vertex that a scan keeps.
const KEPT: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];

/// Why there is no next number.
#[derive(Debug)]
pub(super) enum Stop {
    /// The file ends.
    End,
    /// Something else is wrong.
    Fault(Box<PlyFault>),
}

impl From<PlyFault> for Stop {
    fn from(fault: PlyFault) -> Self {
        Stop::Fault(Box::new(fault))
    }
}

/// Reads all elements; those that are neither vertices, faces nor cameras are passed over.
pub(super) fn read(header: &Header, numbers: &mut impl Numbers, keep: Keep) -> Result<RawScan, PlyFault> {
    let vertices = header.elements.iter().find(|e| e.name == "vertex");
    let vertices =
        vertices.ok_or_else(|| PlyFault::NoVertices { found: list(header.elements.iter().map(|e| &e.name)) })?;
    let unread = vertices.properties.iter().map(|property| &property.name);
    let unread = unread.filter(|name| !KEPT.contains(&name.as_str())).cloned().collect();
    let mut scan = RawScan { viewpoint: header.viewpoint, unread, ..RawScan::default() };
    // The faces of a mesh refer to all of its vertices.
    let is_mesh = header.elements.iter().any(|element| element.name == "face" && element.count > 0);
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read_vertices(element, numbers, if is_mesh { Keep::All } else { keep }, &mut scan)?,
            "face" => read_faces(element, vertices.count, numbers, &mut scan)?,
            "camera" => read_camera(element, numbers, &mut scan)?,
            _ => each_record(element, numbers, |numbers, record| {
                element.properties.iter().try_for_each(|p| skip_property(p, element, record, numbers))
            })?,
        }
    }
    Ok(if is_mesh { keep.of(scan) } else { scan })
}

/// Runs `read` for every record, counted from one, and says which one was cut short.
fn each_record<N: Numbers>(
    element: &Element,
    numbers: &mut N,
    read: impl FnMut(&mut N, usize) -> Result<(), Stop>,
) -> Result<(), PlyFault> {
    each_record_from(0, element, numbers, read)
}

/// The same where the first records have been read.
fn each_record_from<N: Numbers>(
    first: usize,
    element: &Element,
    numbers: &mut N,
    mut read: impl FnMut(&mut N, usize) -> Result<(), Stop>,
) -> Result<(), PlyFault> {
    if element.properties.is_empty() {
        return Ok(()); // Any number of empty records fits into no bytes.
    }
    for held in first..element.count {
        read(numbers, held + 1).map_err(|stop| match stop {
            Stop::End => PlyFault::Truncated { element: element.name.clone(), promised: element.count, held },
            Stop::Fault(fault) => *fault,
        })?;
    }
    Ok(())
}

fn read_vertices<N: Numbers>(
    element: &Element,
    numbers: &mut N,
    keep: Keep,
    scan: &mut RawScan,
) -> Result<(), PlyFault> {
    let columns = Columns::of(element)?;
    let is_single = |kind: &ScalarType| numbers.precision(kind) == Precision::Single;
    let precision = if columns.coordinates(element).all(is_single) { Precision::Single } else { Precision::Double };
    let mut points =
        if columns.normals { Gathered::with_normals(keep, precision) } else { Gathered::new(keep, precision) };
    points.reserve(element.count.min(numbers.room(&element.properties)));
    let read = numbers.points(&element.properties, &columns.of_property, element.count, &mut points);
    let mut keep = |[x, y, z, nx, ny, nz]: Row| {
        points.push([x, y, z], columns.normals.then_some([nx as f32, ny as f32, nz as f32]));
    };
    let read = read + numbers.records(&element.properties, &columns.of_property, element.count - read, &mut keep);
    each_record_from(read, element, numbers, |numbers, record| {
        let mut row = Row::default();
        for (property, column) in element.properties.iter().zip(&columns.of_property) {
            match (&property.kind, *column) {
                (PropertyType::Scalar(kind), Some(column)) => row[column] = numbers.number(kind)?,
                _ => skip_property(property, element, record, numbers)?,
            }
        }
        keep(row);
        Ok(())
    })?;
    let read = points.into_scan();
    (scan.points, scan.normals) = (read.points, read.normals);
    Ok(())
}

/// Reads where the scanner stood (`view_px view_py view_pz`) from the first camera that says so.
///
/// The origin is what writers put who know of no scanner, so it counts as nothing said.
fn read_camera<N: Numbers>(element: &Element, numbers: &mut N, scan: &mut RawScan) -> Result<(), PlyFault> {
    each_record(element, numbers, |numbers, record| {
        let mut place = [None; 3];
        for property in &element.properties {
            let axis = ["view_px", "view_py", "view_pz"].iter().position(|name| property.name == *name);
            match (&property.kind, axis) {
                (PropertyType::Scalar(kind), Some(axis)) => place[axis] = Some(numbers.number(kind)?),
                _ => skip_property(property, element, record, numbers)?,
            }
        }
        if let [Some(x), Some(y), Some(z)] = place {
            scan.viewpoint = scan.viewpoint.or(Some([x, y, z]).filter(|v| *v != [0.0; 3]));
        }
        Ok(())
    })
}

/// Where each vertex property goes: 0 to 2 are coordinates, 3 to 5 the normal.
struct Columns {
    of_property: Vec<Option<usize>>,
    /// Whether all three components of the normal are there.
    normals: bool,
}

impl Columns {
    fn of(element: &Element) -> Result<Columns, PlyFault> {
        let properties = &element.properties;
        let position =
            |name: &str| properties.iter().position(|p| p.name == name && matches!(p.kind, PropertyType::Scalar(_)));
        let mut of_property = vec![None; properties.len()];
        for (column, missing) in ["x", "y", "z"].into_iter().enumerate() {
            let found = || list(properties.iter().map(|p| &p.name));
            let at = position(missing).ok_or_else(|| PlyFault::NoCoordinate { missing, found: found() })?;
            of_property[at] = Some(column);
        }
        let normal = ["nx", "ny", "nz"].map(position);
        if let [Some(nx), Some(ny), Some(nz)] = normal {
            (of_property[nx], of_property[ny], of_property[nz]) = (Some(3), Some(4), Some(5));
        }
        Ok(Columns { of_property, normals: normal.iter().all(Option::is_some) })
    }

    /// The types of the coordinates.
    fn coordinates<'a>(&'a self, element: &'a Element) -> impl Iterator<Item = &'a ScalarType> {
        element.properties.iter().zip(&self.of_property).filter_map(|(property, column)| {
            match (&property.kind, column) {
                (PropertyType::Scalar(kind), Some(0..3)) => Some(kind),
                _ => None,
            }
        })
    }
}

/// Cuts every polygon into a fan of triangles. Faces without a list of corners, or with less than three, give none.
fn read_faces<N: Numbers>(
    element: &Element,
    n_vertices: usize,
    numbers: &mut N,
    scan: &mut RawScan,
) -> Result<(), PlyFault> {
    let is_corners = |p: &Property| matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
    let corners_at = element.properties.iter().position(is_corners);
    scan.triangles.reserve(corners_at.map_or(0, |_| element.count.min(numbers.room(&element.properties))));
    let mut corners = Vec::new();
    each_record(element, numbers, |numbers, record| {
        for (at, property) in element.properties.iter().enumerate() {
            match &property.kind {
                PropertyType::List(length, index) if corners_at == Some(at) => {
                    let n_corners = list_length(length, element, record, numbers)?;
                    corners.clear();
                    for _ in 0..n_corners {
                        corners.push(vertex_index(numbers.number(index)?, record, n_vertices)?);
                    }
                    scan.triangles.extend(fan(&corners));
                }
                _ => skip_property(property, element, record, numbers)?,
            }
        }
        Ok(())
    })
}

fn vertex_index(index: f64, face: usize, n_vertices: usize) -> Result<u32, PlyFault> {
    let exists = index >= 0.0 && index.fract() == 0.0 && index < n_vertices as f64 && index <= f64::from(u32::MAX);
    if exists { Ok(index as u32) } else { Err(PlyFault::FaceIndex { face, index, n_vertices }) }
}

fn skip_property(
    property: &Property,
    element: &Element,
    record: usize,
    numbers: &mut impl Numbers,
) -> Result<(), Stop> {
    match &property.kind {
        PropertyType::Scalar(kind) => numbers.skip(kind, 1),
        PropertyType::List(length, kind) => {
            let n = list_length(length, element, record, numbers)?;
            numbers.skip(kind, n)
        }
    }
}

fn list_length(kind: &ScalarType, element: &Element, record: usize, numbers: &mut impl Numbers) -> Result<usize, Stop> {
    let length = numbers.number(kind)?;
    if length < 0.0 || length.fract() != 0.0 {
        return Err(PlyFault::ListLength { element: element.name.clone(), record, length }.into());
    }
    // A length beyond the machine becomes the largest there is; the file ends long before.
    Ok(length as usize)
}

fn list<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let names: Vec<String> = names.map(|name| crate::error::excerpt(name.as_bytes())).collect();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}
