//! Every scan format through the program.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_geometry::{RawScan, RigidTransform, Scan, from_rows, mean_displacement, uncentred};
use congruent_simulation::pair::{PairOptions, figurine_pair};
use congruent_simulation::scanner::{RangeNoise, VirtualScanner};
use congruent_simulation::shapes::figurine;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// These formats round coordinates: LAS and LAZ to whole steps (a billionth of the longest side), E57 in the last bit
/// of a sum, STL to `float`, and STL also orders points by its faces. A point on the border of a grid cell may then
/// count for another cell, so the samples differ, and the poses may differ by this many resolutions. All other formats
/// keep every digit, and thus every bit of the pose.
const ROUNDING: [&str; 4] = ["las", "laz", "e57", "stl"];
const SAME_POSE_PR: f64 = 0.1;

fn congruent(arguments: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_congruent")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    str::from_utf8(bytes).unwrap()
}

/// Writes both scans as PLY files, and converts them to the format with the program.
fn converted(folder: &Path, scans: &[RawScan; 2], extension: &str) -> [PathBuf; 2] {
    [("source", &scans[0]), ("target", &scans[1])].map(|(name, scan)| {
        let ply = folder.join(name).with_extension("ply");
        congruent_io::write_scan(&ply, scan).unwrap();
        let path = ply.with_extension(extension);
        if extension != "ply" {
            let output = congruent(&["convert".as_ref(), &ply, &path]);
            assert_eq!(output.status.code(), Some(0), "{extension}: {}", text(&output.stderr));
            let counts = format!("{}, {} points", extension.to_uppercase(), scan.points.len());
            assert!(text(&output.stdout).contains(&counts), "{extension}: {}", text(&output.stdout));
        }
        path
    })
}

/// Returns the pose that the program finds, and the resolution of the scans.
fn aligned([source, target]: &[PathBuf; 2]) -> (RigidTransform, f64) {
    let output = congruent(&["align".as_ref(), source, target, "--json".as_ref()]);
    assert_eq!(output.status.code(), Some(0), "{}: {}", source.display(), text(&output.stderr));
    let value: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows: [[f64; 4]; 4] = serde_json::from_value(value["target_from_source"].clone()).unwrap();
    (from_rows(&rows, 1e-9).unwrap(), value["resolution"]["raw"].as_f64().unwrap())
}

/// Checks that files of every format give the same pose as PLY files.
fn check_same_pose(scans: &[RawScan; 2], extensions: &[&str]) {
    let folder = TempDir::new().unwrap();
    let (expected, resolution) = aligned(&converted(folder.path(), scans, "ply"));
    let centred = scans.each_ref().map(|raw| Scan::new(raw).unwrap());
    // The pose between the centred clouds.
    let between = |pose: &RigidTransform| uncentred(pose, &-centred[0].origin(), &-centred[1].origin());
    for extension in extensions {
        let (pose, _) = aligned(&converted(folder.path(), scans, extension));
        if !ROUNDING.contains(extension) {
            assert_eq!(pose, expected, "{extension}");
        }
        let off = mean_displacement(centred[0].points(), &between(&pose), &between(&expected)) / resolution;
        assert!(off < SAME_POSE_PR, "{extension}: off by {off} pr");
    }
}

#[test]
fn the_same_clouds_in_every_format_give_the_same_pose() {
    let pair = figurine_pair(&PairOptions { noise: RangeNoise::gaussian(0.05), pixels: 200, ..PairOptions::default() });
    check_same_pose(&[pair.source, pair.target], &["obj", "off", "pcd", "xyz", "csv", "las", "laz", "e57"]);
}

#[test]
fn the_same_meshes_in_every_format_of_faces_give_the_same_pose() {
    /// Maximum difference in depth between neighbouring pixels on one surface, data units.
    const MAX_JUMP: f64 = 3.0;
    let shape = figurine(1);
    let scans = [0.0, 0.7].map(|azimuth| {
        let meshed = VirtualScanner::orbit(&shape, azimuth, 0.25, 3.5, 200).scan(&shape, 1).meshed(MAX_JUMP);
        without_loose_points(&meshed)
    });
    check_same_pose(&scans, &["obj", "off", "stl"]);
}

/// Removes points that no triangle uses, because STL cannot hold them.
fn without_loose_points(scan: &RawScan) -> RawScan {
    let mut used: Vec<u32> = scan.triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let place = |i: &u32| used.binary_search(i).unwrap() as u32;
    RawScan {
        points: used.iter().map(|&i| scan.points.at(i as usize)).collect(),
        triangles: scan.triangles.iter().map(|t| t.each_ref().map(place)).collect(),
        ..RawScan::default()
    }
}

#[test]
fn convert_warns_of_what_is_lost_and_refuses_what_cannot_be() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("scan.dat"), "OFF 4 1 0\n0.1 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n").unwrap();
    let check = |from: &str, to: &str, code: i32, expected: &[&str]| {
        let output = congruent(&["convert".as_ref(), &at(from), &at(to)]);
        let said = format!("{}{}", text(&output.stdout), text(&output.stderr));
        assert_eq!(output.status.code(), Some(code), "{said}");
        for fragment in expected {
            assert!(said.contains(fragment), "`{fragment}` is not in: {said}");
        }
        assert!(code != 0 || expected.len() > 1 || output.stderr.is_empty(), "{said}");
    };
    let coloured = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nend_header\n1 2 3 255\n";
    std::fs::write(at("coloured.ply"), coloured).unwrap();
    check("coloured.ply", "grey.ply", 0, &["1 points", "warning:", "grey.ply: without red"]);
    check("scan.dat", "scan.ply", 0, &["scan.ply: PLY, 4 points, 1 faces, 0 normals"]);
    check("scan.ply", "scan.pcd", 0, &["PCD, 4 points, 0 faces", "warning:", "PCD does not hold faces"]);
    check("scan.ply", "scan.stl", 0, &["STL, 3 points, 1 faces", "1 points without a face", "double precision"]);
    check("scan.ply", "scan.laz", 0, &["LAZ, 4 points", "faces", "rounded to"]);
    check("scan.pcd", "new.stl", 2, &["cannot be STL", "no faces; write PLY"]);
    check("scan.ply", "new.docx", 2, &["the extension (docx)", ".ply .obj"]);
    check("absent.ply", "new.ply", 2, &["cannot be read"]);
    assert!(!at("new.stl").exists() && !at("new.ply").exists());
}
