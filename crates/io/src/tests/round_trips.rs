//! What is written is read back, as far as the format can hold it.

use super::*;
use crate::gathered::Keep;
use crate::{Loss, read_scan, read_scan_thinned, write_scan};
use congruent_geometry::Coordinates;
use pcd_rs::DataKind;

fn there_and_back(name: &str, scan: &RawScan) -> (crate::Written, RawScan) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let written = write_scan(&path, scan).unwrap();
    // Under a name that says nothing: the content decides.
    let plain = folder.path().join("plain");
    std::fs::rename(&path, &plain).unwrap();
    (written, read_scan(&plain).unwrap())
}

fn farthest(a: &Coordinates, b: &Coordinates) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// How far coordinates of the sheet may be off: nothing, half a step of LAS, the last bit of a sum, half a bit of `f32`.
fn tolerance(extension: &str) -> f64 {
    match extension {
        "las" | "laz" => 0.51e-9,
        "e57" => 5e-13,
        "stl" => 7e-5,
        _ => 0.0,
    }
}

#[test]
fn every_format_keeps_what_it_can_hold() {
    for extension in EXTENSIONS {
        let whole = sheet();
        let (written, back) = there_and_back(&format!("scan.{extension}"), &whole);
        assert_eq!((written.points, back.points.len()), (30, 30), "{extension}");
        assert_eq!(written.triangles, back.triangles.len(), "{extension}");
        assert_eq!(written.normals, back.normals.as_ref().map_or(0, Vec::len), "{extension}");
        if extension == "stl" {
            // The points come in the order of the faces.
            let corners = |scan: &RawScan| -> Coordinates {
                scan.triangles.iter().flatten().map(|&i| scan.points.at(i as usize)).collect()
            };
            assert!(farthest(&corners(&whole), &corners(&back)) <= tolerance(extension));
            continue;
        }
        assert!(farthest(&whole.points, &back.points) <= tolerance(extension), "{extension}");
        for loss in [Loss::Normals, Loss::Triangles, Loss::Viewpoint] {
            let (kept, is_lost) = match loss {
                Loss::Normals => (back.normals == whole.normals, back.normals.is_none()),
                Loss::Triangles => (back.triangles == whole.triangles, back.triangles.is_empty()),
                _ => (back.viewpoint == whole.viewpoint, back.viewpoint.is_none()),
            };
            assert!(if written.lost.contains(&loss) { is_lost } else { kept }, "{extension}: {loss}");
        }
    }
}

#[test]
fn a_cloud_alone_survives_in_every_format_but_stl() {
    for extension in EXTENSIONS {
        let cloud = RawScan { points: sheet().points, ..RawScan::default() };
        if extension == "stl" {
            let message = write_scan(Path::new("scan.stl"), &cloud).unwrap_err().to_string();
            assert!(message.contains("no faces; write PLY"), "{message}");
            continue;
        }
        let (written, back) = there_and_back(&format!("scan.{extension}"), &cloud);
        assert!(farthest(&cloud.points, &back.points) <= tolerance(extension), "{extension}");
        assert_eq!((back.normals, back.triangles, back.viewpoint), (None, vec![], None), "{extension}");
        assert!(written.lost.iter().all(|loss| matches!(loss, Loss::Rounded(_))), "{extension}: {:?}", written.lost);
    }
}

#[test]
fn every_encoding_of_pcd_is_read() {
    for kind in [DataKind::Ascii, DataKind::Binary, DataKind::BinaryCompressed] {
        for exact in [false, true] {
            let mut whole = sheet();
            if !exact {
                whole.points.edited().iter_mut().flatten().for_each(|v| *v = f64::from(*v as f32));
            }
            whole.points.edited()[3] = [f64::NAN; 3];
            let back = scan(&crate::pcd::encode(&whole, kind)).unwrap();
            assert!(back.points.at(3).iter().all(|v| v.is_nan()), "{kind:?}");
            whole.points.edited()[3] = [0.0; 3];
            assert_eq!(back.points.to_vec()[4..], whole.points.to_vec()[4..], "{kind:?}");
            assert_eq!((back.normals, back.viewpoint), (whole.normals, whole.viewpoint), "{kind:?}");
        }
    }
}

#[test]
fn broken_points_pass_through_or_are_told() {
    for extension in ["ply", "obj", "off", "pcd", "xyz", "csv", "las", "laz", "e57"] {
        let broken = [[f64::NAN, 1.0, 2.0], [3.0, f64::INFINITY, 5.0]];
        let cloud = RawScan { points: sheet().points.into_iter().chain(broken).collect(), ..RawScan::default() };
        let (written, back) = there_and_back(&format!("scan.{extension}"), &cloud);
        let n_broken = back.points.iter().filter(|p| p.iter().any(|v| !v.is_finite())).count();
        let n_told = if written.lost.contains(&Loss::NonFinite(2)) { 2 } else { 0 };
        assert_eq!(n_broken + n_told, 2, "{extension}");
    }
}

#[test]
fn geographic_coordinates_keep_their_tenths_of_millimetres() {
    let far = |v: [f64; 3]| [v[0] + 4.5e6, v[1] + 5.4e5, v[2]];
    let cloud = RawScan { points: sheet().points.into_iter().map(far).collect(), ..RawScan::default() };
    for extension in ["ply", "obj", "off", "pcd", "xyz", "csv", "las", "laz", "e57"] {
        let (_, back) = there_and_back(&format!("scan.{extension}"), &cloud);
        assert!(farthest(&cloud.points, &back.points) < 1e-7, "{extension}");
    }
}

#[test]
fn the_same_scan_gives_the_same_bytes() {
    for extension in EXTENSIONS {
        assert!(file_of(extension) == file_of(extension), "{extension}");
    }
}

#[test]
fn empty_scans_are_written_and_binary_ones_read() {
    for extension in ["ply", "off", "pcd", "las", "laz", "e57"] {
        let (written, back) = there_and_back(&format!("scan.{extension}"), &RawScan::default());
        assert_eq!((written.points, back.points.len()), (0, 0), "{extension}");
    }
}

#[test]
fn names_without_a_format_are_refused() {
    for name in ["scan", "scan.docx", "scan.ply.bak"] {
        let message = write_scan(Path::new(name), &sheet()).unwrap_err().to_string();
        assert!(message.starts_with(name) && message.contains(".ply .obj"), "{message}");
    }
    let (written, _) = there_and_back("SCAN.PLY", &sheet());
    assert_eq!(written.format, "PLY");
}

#[test]
fn the_content_decides_whatever_the_name() {
    for extension in EXTENSIONS {
        let expected = scan(&file_of(extension)).unwrap();
        for name in ["scan.ply", "scan.stl", "scan.obj", "scan.txt", "scan.las", "scan"] {
            assert_eq!(scan_from(Path::new(name), &file_of(extension)).unwrap(), expected, "{extension} as {name}");
        }
    }
}

#[test]
fn thinned_while_it_is_read_is_thinned_afterwards() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = RawScan { triangles: Vec::new(), ..sheet() };
    let bare = RawScan { normals: None, ..cloud.clone() };
    for extension in EXTENSIONS {
        for scan in [sheet(), cloud.clone(), bare.clone()] {
            let path = folder.path().join("scan").with_extension(extension);
            if write_scan(&path, &scan).is_err() {
                continue; // An STL file is nothing but faces.
            }
            let whole = read_scan(&path).unwrap();
            let thinned = read_scan_thinned(&path, 0.9).unwrap();
            assert!((4..whole.points.len() / 2).contains(&thinned.points.len()), "{extension}: {thinned:?}");
            assert_eq!(thinned, Keep::OnePerCell(0.9).of(whole), "{extension}");
        }
    }
}
