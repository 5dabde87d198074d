//! Writing binary PLY files.

use crate::{IoError, write_file};
use congruent_geometry::RawScan;
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
    points: &[[f64; 3]],
    normals: Option<&[[f32; 3]]>,
    triangles: &[[u32; 3]],
) -> Result<(), IoError> {
    write_file(path, &encoded(points, normals, triangles, None))
}

/// A scan as a file, its viewpoint as a `camera` element.
pub(crate) fn encode(scan: &RawScan) -> Vec<u8> {
    encoded(&scan.points, scan.normals.as_deref(), &scan.triangles, scan.viewpoint)
}

fn encoded(
    points: &[[f64; 3]],
    normals: Option<&[[f32; 3]]>,
    triangles: &[[u32; 3]],
    viewpoint: Option<[f64; 3]>,
) -> Vec<u8> {
    assert!(normals.is_none_or(|n| n.len() == points.len()), "one normal a point");
    assert!(triangles.iter().flatten().all(|&i| (i as usize) < points.len()), "triangles of existing points");
    let as_float = crate::write::fits_float(points);
    let mut file = header(points.len(), as_float, normals.is_some(), triangles.len(), viewpoint.is_some()).into_bytes();
    for (i, point) in points.iter().enumerate() {
        for &v in point {
            if as_float {
                file.extend((v as f32).to_le_bytes());
            } else {
                file.extend(v.to_le_bytes());
            }
        }
        for v in normals.map_or([].as_slice(), |normals| &normals[i]) {
            file.extend(v.to_le_bytes());
        }
    }
    for triangle in triangles {
        file.push(3);
        triangle.iter().for_each(|corner| file.extend(corner.to_le_bytes()));
    }
    viewpoint.iter().flatten().for_each(|v| file.extend(v.to_le_bytes()));
    file
}

fn header(n_points: usize, as_float: bool, normals: bool, n_triangles: usize, camera: bool) -> String {
    let kind = if as_float { "float" } else { "double" };
    let mut text = format!("ply\nformat binary_little_endian 1.0\nelement vertex {n_points}\n");
    ["x", "y", "z"].iter().for_each(|name| text += &format!("property {kind} {name}\n"));
    if normals {
        text += "property float nx\nproperty float ny\nproperty float nz\n";
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
