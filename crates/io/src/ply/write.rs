//! Writing binary PLY files.

use crate::{IoError, write_file};
use congruent_geometry::{Coordinates, RawScan};
use std::path::Path;

/// Writes a binary little-endian PLY file, whole or not at all (see [`write_file`]).
///
/// Coordinates are stored as `double`, or as `float` where that loses nothing. A cloud without triangles gets no face
/// element. NaN and infinite values are written as they are.
///
/// # Errors
/// The file cannot be written.
///
/// # Panics
/// When the normals are not as many as the points, or a triangle points outside: a broken promise of the caller.
pub fn write_ply(
    path: &Path,
    points: &Coordinates,
    normals: Option<&[[f32; 3]]>,
    triangles: &[[u32; 3]],
) -> Result<(), IoError> {
    write_file(path, &encoded(points, Extras { normals, ..Extras::default() }, triangles, None))
}

/// The same for a cloud whose points have colours: red, green and blue, 0 to 255.
///
/// # Errors
/// The file cannot be written.
///
/// # Panics
/// When the colours are not as many as the points: a broken promise of the caller.
pub fn write_coloured_ply(path: &Path, points: &Coordinates, colours: &[[u8; 3]]) -> Result<(), IoError> {
    write_file(path, &encoded(points, Extras { colours: Some(colours), ..Extras::default() }, &[], None))
}

/// What a point may have besides its place, one for each.
#[derive(Clone, Copy, Default)]
struct Extras<'a> {
    normals: Option<&'a [[f32; 3]]>,
    colours: Option<&'a [[u8; 3]]>,
}

/// A scan as a file, its viewpoint as a `camera` element.
pub(crate) fn encode(scan: &RawScan) -> Vec<u8> {
    encoded(
        &scan.points,
        Extras { normals: scan.normals.as_deref(), ..Extras::default() },
        &scan.triangles,
        scan.viewpoint,
    )
}

fn encoded(points: &Coordinates, extras: Extras<'_>, triangles: &[[u32; 3]], viewpoint: Option<[f64; 3]>) -> Vec<u8> {
    let Extras { normals, colours } = extras;
    assert!(normals.is_none_or(|n| n.len() == points.len()), "one normal a point");
    assert!(colours.is_none_or(|c| c.len() == points.len()), "one colour a point");
    assert!(triangles.iter().flatten().all(|&i| (i as usize) < points.len()), "triangles of existing points");
    let as_float = crate::write::fits_float(points);
    let mut file = header(points.len(), as_float, extras, triangles.len(), viewpoint.is_some()).into_bytes();
    for (i, point) in points.iter().enumerate() {
        for v in point {
            if as_float {
                file.extend((v as f32).to_le_bytes());
            } else {
                file.extend(v.to_le_bytes());
            }
        }
        for v in normals.map_or([].as_slice(), |normals| &normals[i]) {
            file.extend(v.to_le_bytes());
        }
        file.extend(colours.map_or([].as_slice(), |colours| &colours[i]));
    }
    for triangle in triangles {
        file.push(3);
        triangle.iter().for_each(|corner| file.extend(corner.to_le_bytes()));
    }
    viewpoint.iter().flatten().for_each(|v| file.extend(v.to_le_bytes()));
    file
}

fn header(n_points: usize, as_float: bool, extras: Extras<'_>, n_triangles: usize, camera: bool) -> String {
    let kind = if as_float { "float" } else { "double" };
    let mut text = format!("ply\nformat binary_little_endian 1.0\nelement vertex {n_points}\n");
    ["x", "y", "z"].iter().for_each(|name| text += &format!("property {kind} {name}\n"));
    if extras.normals.is_some() {
        text += "property float nx\nproperty float ny\nproperty float nz\n";
    }
    if extras.colours.is_some() {
        text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    }
    if n_triangles > 0 {
        text += &format!("element face {n_triangles}\nproperty list uchar uint vertex_indices\n");
    }
    if camera {
        text += "element camera 1\n";
        ["view_px", "view_py", "view_pz"].iter().for_each(|name| text += &format!("property double {name}\n"));
    }
    text + "end_header\n"
}
