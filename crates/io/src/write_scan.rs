//! Writing a scan in the format that a name asks for.

use crate::format::Format;
use crate::write::fits_float;
use crate::{IoError, las, write_file};
use congruent_geometry::RawScan;
use std::path::Path;

/// What a written file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// Name of the format.
    pub format: &'static str,
    /// How many points.
    pub points: usize,
    /// How many faces.
    pub triangles: usize,
    /// How many normals.
    pub normals: usize,
    /// What of the scan the file does not hold.
    pub lost: Vec<Loss>,
}

/// Something of a scan that a format cannot hold.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Loss {
    /// The normals.
    #[error("normals")]
    Normals,
    /// The faces; the points stay.
    #[error("faces")]
    Triangles,
    /// Where the scanner stood.
    #[error("the scanner's viewpoint")]
    Viewpoint,
    /// Points without a face, in a format of faces.
    #[error("{0} points without a face")]
    LoosePoints(usize),
    /// Points with a coordinate that is NaN or infinite.
    #[error("{0} points that are not finite")]
    NonFinite(usize),
    /// Coordinates were rounded to `float`.
    #[error("double precision (coordinates are rounded to seven digits)")]
    Doubles,
    /// Coordinates were rounded to whole multiples of a step, data units.
    #[error("full precision (coordinates are rounded to {0:e})")]
    Rounded(f64),
}

/// Writes a scan, whole or not at all (see [`write_file`]), in the format that the path's extension asks for: `.ply`,
/// `.obj`, `.stl`, `.off`, `.pcd`, `.xyz`, `.txt`, `.asc`, `.pts`, `.csv`, `.las`, `.laz` or `.e57`.
///
/// PLY, PCD and STL are written in binary. Only STL (always `float`) and LAS (whole multiples of a power of ten, at most
/// 2.5 billionths of the longest side) round coordinates. What the format cannot hold is left out and told.
///
/// # Errors
/// The extension is none of these, the file cannot be written, or the format can hold nothing of the scan: STL without
/// faces.
///
/// # Panics
/// When the normals are not as many as the points, or a triangle points outside: a broken promise of the caller.
///
/// # Examples
/// ```
/// # let folder = tempfile::tempdir()?;
/// use congruent_io::{Loss, read_scan, write_scan};
/// let scan = congruent_geometry::RawScan {
///     points: vec![[0.0f64; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into(),
///     triangles: vec![[0, 1, 2]],
///     ..Default::default()
/// };
/// let path = folder.path().join("scan.pcd");
/// assert_eq!(write_scan(&path, &scan)?.lost, [Loss::Triangles]);
/// assert_eq!(read_scan(&path)?.points, scan.points);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_scan(path: &Path, scan: &RawScan) -> Result<Written, IoError> {
    assert!(scan.normals.as_ref().is_none_or(|n| n.len() == scan.points.len()), "one normal a point");
    assert!(scan.triangles.iter().flatten().all(|&i| (i as usize) < scan.points.len()), "triangles of existing points");
    let format = Format::of_name(path)?;
    let file = format.encode(scan).map_err(|what| IoError::CannotHold {
        path: path.to_owned(),
        format: format.name(),
        what,
    })?;
    write_file(path, &file)?;
    let lost = losses(format, scan);
    let missing = |loss: &Loss| match loss {
        Loss::LoosePoints(n) | Loss::NonFinite(n) => *n,
        _ => 0,
    };
    let normals = scan.normals.as_ref().filter(|_| format.holds_normals());
    Ok(Written {
        format: format.name(),
        points: scan.points.len() - lost.iter().map(missing).sum::<usize>(),
        triangles: if format.holds_triangles() { scan.triangles.len() } else { 0 },
        normals: normals.map_or(0, Vec::len),
        lost,
    })
}

/// Whether [`write_scan`] knows which format a name asks for.
///
/// # Errors
/// The extension is none of those that it knows.
pub fn check_scan_name(path: &Path) -> Result<(), IoError> {
    Format::of_name(path).map(|_| ())
}

fn losses(format: Format, scan: &RawScan) -> Vec<Loss> {
    let mut lost = Vec::new();
    let mut tell = |is_lost: bool, loss: Loss| lost.extend(is_lost.then_some(loss));
    tell(scan.normals.is_some() && !format.holds_normals(), Loss::Normals);
    tell(!scan.triangles.is_empty() && !format.holds_triangles(), Loss::Triangles);
    tell(scan.viewpoint.is_some() && !format.holds_viewpoint(), Loss::Viewpoint);
    match format {
        Format::Stl => {
            let mut is_corner = vec![false; scan.points.len()];
            scan.triangles.iter().flatten().for_each(|&i| is_corner[i as usize] = true);
            let n_loose = is_corner.iter().filter(|is_corner| !**is_corner).count();
            tell(n_loose > 0, Loss::LoosePoints(n_loose));
            tell(!fits_float(&scan.points), Loss::Doubles);
        }
        Format::Las | Format::Laz => {
            let n_broken = scan.points.iter().filter(|p| p.iter().any(|v| !v.is_finite())).count();
            tell(n_broken > 0, Loss::NonFinite(n_broken));
            tell(n_broken < scan.points.len(), Loss::Rounded(las::step(scan)));
        }
        _ => {}
    }
    lost
}
