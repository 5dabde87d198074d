//! Which format a file is in, and which one a name asks for.
//!
//! A further format is one module with a test of the first bytes, a reader and a writer, a variant, and its row in each
//! match.

use crate::gathered::Keep;
use crate::window::Window;
use crate::{IoError, e57, las, obj, off, pcd, ply, stl, xyz};
use congruent_geometry::RawScan;
use std::path::Path;

/// A scan format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Polygon File Format, also called Stanford Triangle Format.
    Ply,
    /// Point Cloud Library.
    Pcd,
    /// ASPRS LAS; compressed, it is called LAZ.
    Las,
    Laz,
    /// ASTM E2807.
    E57,
    /// Object File Format of Geomview.
    Off,
    /// Stereolithography.
    Stl,
    /// Wavefront.
    Obj,
    /// Lines of numbers parted by white space.
    Xyz,
    /// Lines of numbers parted by commas.
    Csv,
}

impl Format {
    /// From the surest first bytes to the least sure.
    const BY_CONTENT: [Format; 8] =
        [Format::Ply, Format::Las, Format::E57, Format::Pcd, Format::Off, Format::Stl, Format::Obj, Format::Xyz];

    /// Extensions of names, in small letters, and what they ask for.
    const BY_EXTENSION: [(&str, Format); 13] = [
        ("ply", Format::Ply),
        ("obj", Format::Obj),
        ("stl", Format::Stl),
        ("off", Format::Off),
        ("pcd", Format::Pcd),
        ("xyz", Format::Xyz),
        ("txt", Format::Xyz),
        ("asc", Format::Xyz),
        ("pts", Format::Xyz),
        ("csv", Format::Csv),
        ("las", Format::Las),
        ("laz", Format::Laz),
        ("e57", Format::E57),
    ];

    /// What is named when a format is not known.
    pub(crate) const SUPPORTED: &str = "PLY, OBJ, STL, OFF, PCD, XYZ, CSV, LAS, LAZ or E57";

    /// The format of a file's first bytes, whatever its name ends in.
    ///
    /// The name settles what the content leaves open: an STL file of the wrong size, an OBJ file with unusual first
    /// lines.
    pub(crate) fn recognise(path: &Path, file: &Window) -> Result<Format, IoError> {
        // Its lines look like points, but the first ten are a scanner's position and a pose.
        if extension(path).eq_ignore_ascii_case("ptx") {
            return Err(IoError::UnknownFormat {
                path: path.to_owned(),
                extension: extension(path),
                supported: Format::SUPPORTED.into(),
            });
        }
        let by_content = Format::BY_CONTENT.into_iter().find(|format| format.matches(file));
        let by_name = || Format::asked_for(path).filter(|format| matches!(format, Format::Stl | Format::Obj));
        by_content.or_else(by_name).ok_or_else(|| IoError::UnknownFormat {
            path: path.to_owned(),
            extension: extension(path),
            supported: Format::SUPPORTED.into(),
        })
    }

    /// The format that a name asks for.
    pub(crate) fn of_name(path: &Path) -> Result<Format, IoError> {
        Format::asked_for(path).ok_or_else(|| IoError::UnknownExtension {
            path: path.to_owned(),
            extension: extension(path),
            supported: Format::BY_EXTENSION.map(|(name, _)| format!(".{name}")).join(" "),
        })
    }

    fn asked_for(path: &Path) -> Option<Format> {
        let extension = extension(path).to_ascii_lowercase();
        Format::BY_EXTENSION.into_iter().find(|(name, _)| *name == extension).map(|(_, format)| format)
    }

    /// Reads a file of this format; `path` is for messages only.
    pub(crate) fn read(self, path: &Path, mut file: Window, keep: Keep) -> Result<RawScan, IoError> {
        let scan = match self {
            Format::Ply => {
                return ply::read(&mut file, keep).map_err(|fault| IoError::Ply { path: path.to_owned(), fault });
            }
            Format::Xyz | Format::Csv => xyz::read(file, keep),
            Format::Pcd => file.rewound().and_then(|file| pcd::read(file, keep)),
            Format::Las | Format::Laz => file.rewound().and_then(|file| las::read(file, keep)),
            Format::E57 => file.rewound().and_then(|file| e57::read(file, keep)),
            // Meshes: their faces refer to all points.
            Format::Off => off::read(file).map(|scan| keep.of(scan)),
            Format::Stl => stl::read(file).map(|scan| keep.of(scan)),
            Format::Obj => obj::read(file).map(|scan| keep.of(scan)),
        };
        scan.map_err(|what| IoError::Malformed { path: path.to_owned(), format: self.name(), what })
    }

    /// A file of this format, or why there can be none.
    pub(crate) fn encode(self, scan: &RawScan) -> Result<Vec<u8>, String> {
        match self {
            Format::Ply => Ok(ply::encode(scan)),
            Format::Pcd => Ok(pcd::encode(scan, pcd_rs::DataKind::Binary)),
            Format::Las => las::encode(scan, false),
            Format::Laz => las::encode(scan, true),
            Format::E57 => e57::encode(scan),
            Format::Off => Ok(off::encode(scan)),
            Format::Stl if scan.triangles.is_empty() => Err("the scan has no faces; write PLY or PCD".into()),
            Format::Stl => Ok(stl::encode(scan)),
            Format::Obj => Ok(obj::encode(scan)),
            Format::Xyz => Ok(xyz::encode(scan, ' ')),
            Format::Csv => Ok(xyz::encode(scan, ',')),
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Format::Ply => "PLY",
            Format::Pcd => "PCD",
            Format::Las => "LAS",
            Format::Laz => "LAZ",
            Format::E57 => "E57",
            Format::Off => "OFF",
            Format::Stl => "STL",
            Format::Obj => "OBJ",
            Format::Xyz => "XYZ",
            Format::Csv => "CSV",
        }
    }

    /// Whether a file of this format says which way points face.
    pub(crate) fn holds_normals(self) -> bool {
        !matches!(self, Format::Las | Format::Laz | Format::E57 | Format::Stl)
    }

    /// Whether a file of this format has faces.
    pub(crate) fn holds_triangles(self) -> bool {
        matches!(self, Format::Ply | Format::Off | Format::Stl | Format::Obj)
    }

    /// Whether a file of this format says where the scanner stood.
    pub(crate) fn holds_viewpoint(self) -> bool {
        matches!(self, Format::Ply | Format::Pcd | Format::E57)
    }

    fn matches(self, file: &Window) -> bool {
        let bytes = file.bytes();
        match self {
            Format::Ply => ply::is_ply(bytes),
            Format::Pcd => pcd::is_pcd(bytes),
            Format::Las | Format::Laz => las::is_las(bytes),
            Format::E57 => e57::is_e57(bytes),
            Format::Off => off::is_off(bytes),
            Format::Stl => stl::is_stl(bytes, file.length()),
            Format::Obj => obj::is_obj(bytes),
            Format::Xyz | Format::Csv => xyz::is_xyz(bytes),
        }
    }
}

/// What follows the last point of a name, or `none`.
fn extension(path: &Path) -> String {
    path.extension().map_or("none".into(), |e| e.to_string_lossy().into_owned())
}
