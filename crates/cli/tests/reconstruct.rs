//! `congruent reconstruct` as a user sees it: two objects in one folder, a broken scan, other names.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_geometry::{RigidTransform, from_rows, mean_displacement, narrow};
use congruent_io::{read_pose, read_scan, write_ply};
use congruent_simulation::pair::scan_pair;
use congruent_simulation::scanner::VirtualScanner;
use congruent_simulation::shapes::figurine;
use nalgebra::Vector3;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// Angle from one view to the next, degrees.
const TURN: f64 = 25.0;

/// Three small scans of a figurine, each in its scanner's frame, and the true poses of the first one in these frames.
struct Looks {
    scans: Vec<Vec<[f64; 3]>>,
    /// The i-th maps the frame of the first scan to that of the i-th.
    from_first: [RigidTransform; 3],
}

/// Scans a figurine stretched along the three axes, which makes it another object.
fn looks(stretch: [f64; 3]) -> Looks {
    let mut mesh = figurine(1);
    mesh.points.iter_mut().for_each(|p| (0..3).for_each(|axis| p[axis] *= stretch[axis]));
    let scanner = |i: u32| VirtualScanner::orbit(&mesh, (TURN * f64::from(i)).to_radians(), 0.25, 3.5, 100);
    let (one, two) = (scan_pair(&mesh, &scanner(0), &scanner(1), 1), scan_pair(&mesh, &scanner(1), &scanner(2), 1));
    let from_first =
        [RigidTransform::identity(), one.target_from_source, two.target_from_source * one.target_from_source];
    Looks { scans: [one.source, one.target, two.target].map(|scan| scan.points.to_vec()).to_vec(), from_first }
}

fn put(folder: &Path, name: &str, points: &[[f64; 3]]) {
    write_ply(&folder.join(name), &points.to_vec().into(), None, &[]).unwrap();
}

fn reconstruct(folder: &Path, output: &Path, more: &[&str]) -> Output {
    let places = [folder.to_str().unwrap(), "-o", output.to_str().unwrap(), "--json"];
    let arguments = [&["reconstruct"], &places[..], more].concat();
    Command::new(env!("CARGO_BIN_EXE_congruent")).args(arguments).output().unwrap()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)))
}

fn pose_of(result: &Value, scan: &str) -> RigidTransform {
    let line = result["scans"].as_array().unwrap().iter().find(|line| line["scan"] == scan).unwrap();
    from_rows(&serde_json::from_value::<[[f64; 4]; 4]>(line["frame_from_scan"].clone()).unwrap(), 1e-6).unwrap()
}

/// Returns the distance between two relative poses, in units of the resolution.
fn off(points: &[[f64; 3]], a: &RigidTransform, b: &RigidTransform, result: &Value) -> f64 {
    let points: Vec<_> = points.iter().map(|p| narrow(&Vector3::from(*p))).collect();
    mean_displacement(&points, a, b) / result["resolution"].as_f64().unwrap()
}

#[test]
fn two_objects_are_two_components_and_a_broken_scan_is_named() {
    let (folder, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let objects = [looks([1.0; 3]), looks([1.7, 0.7, 0.8])];
    for (object, name) in objects.iter().zip(["cat", "dog"]) {
        for (i, points) in object.scans.iter().enumerate() {
            put(folder.path(), &format!("{name}{i}.ply"), points);
        }
    }
    std::fs::write(folder.path().join("broken.ply"), "ply\nformat ascii 1.0\nelement vertex 9\n").unwrap();
    std::fs::create_dir(folder.path().join("drawer.ply")).unwrap();
    let onto_itself = reconstruct(folder.path(), folder.path(), &[]);
    let said = String::from_utf8(onto_itself.stderr).unwrap();
    assert!(onto_itself.status.code() == Some(2) && said.contains("choose another folder"), "{said}");
    let output = reconstruct(folder.path(), out.path(), &["--voxel", "3u"]);
    let (result, remarks) = (json(&output), String::from_utf8(output.stderr.clone()).unwrap());
    assert_eq!(output.status.code(), Some(1), "{remarks}");
    assert!(remarks.contains("drawer.ply: is a directory"), "{remarks}");
    let components: Vec<Vec<String>> = serde_json::from_value(result["components"].clone()).unwrap();
    let pairs = &result["pairs"];
    assert_eq!(components, [["cat0.ply", "cat1.ply", "cat2.ply"], ["dog0.ply", "dog1.ply", "dog2.ply"]], "{pairs:#}");
    for (object, name) in objects.iter().zip(["cat", "dog"]) {
        for i in 1..3 {
            let found = pose_of(&result, &format!("{name}{i}.ply")).inverse();
            let error = off(&object.scans[0], &found, &object.from_first[i], &result);
            assert!(error < 1.0, "{name}{i}: {error}");
        }
    }
    let broken = result["scans"].as_array().unwrap().iter().find(|line| line["scan"] == "broken.ply").unwrap();
    assert!(broken["problem"].as_str().unwrap().contains("broken.ply: ") && broken["component"].is_null(), "{broken}");

    let read = |name: &str| std::fs::read_to_string(out.path().join(name)).unwrap();
    assert_eq!(read("poses.csv").lines().count(), 1 + 7);
    assert!(read("graph.g2o").lines().filter(|line| line.starts_with("VERTEX_SE3:QUAT ")).count() == 6);
    assert!(read("results.csv").lines().count() == 1 + 21);
    let written = read_pose(&out.path().join("dog2.xf")).unwrap();
    assert!((written.to_homogeneous() - pose_of(&result, "dog2.ply").to_homogeneous()).norm() < 1e-9);
    assert!(!out.path().join("broken.xf").exists());
    let model = read_scan(&out.path().join("model-2.ply")).unwrap();
    let all: usize = objects[1].scans.iter().map(Vec::len).sum();
    assert!(model.points.len() > 50 && model.points.len() < all, "{} of {all}", model.points.len());
    assert!(!out.path().join("model-3.ply").exists());

    // As if an earlier result had placed the broken scan, in a component of its own.
    let earlier = ["broken.xf", "model-3.ply"].map(|name| out.path().join(name));
    earlier.iter().for_each(|path| std::fs::write(path, "earlier").unwrap());
    let resumed = reconstruct(folder.path(), out.path(), &["--resume"]);
    assert_eq!((json(&resumed)["components"].clone(), resumed.status.code()), (result["components"].clone(), Some(1)));
    assert!(!earlier.iter().any(|path| path.exists()) && out.path().join("dog2.xf").exists());
}

#[test]
fn neither_threads_nor_names_change_the_poses() {
    let object = looks([1.0; 3]);
    let run = |names: [&str; 3], more: &[&str]| {
        let (folder, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
        names.iter().zip(&object.scans).for_each(|(name, points)| put(folder.path(), &format!("{name}.ply"), points));
        let output = reconstruct(folder.path(), out.path(), more);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let result = json(&output);
        let relative = |i: usize| pose_of(&result, &format!("{}.ply", names[i])).inverse();
        let first = pose_of(&result, &format!("{}.ply", names[0]));
        ([relative(1) * first, relative(2) * first], result)
    };
    let (one, result) = run(["a", "b", "c"], &["--threads", "1"]);
    let (four, _) = run(["a", "b", "c"], &["--threads", "4"]);
    assert_eq!(one, four);
    let (renamed, _) = run(["z", "m", "k"], &[]);
    for (a, b) in one.iter().zip(&renamed) {
        // The pairs are registered the other way round and with other seeds.
        let error = off(&object.scans[0], a, b, &result);
        assert!(error < 0.1, "{error}");
    }
}

#[test]
fn what_cannot_be_reconstructed_is_refused() {
    let (folder, out) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let message = |output: &Output| String::from_utf8(output.stderr.clone()).unwrap();
    let none = reconstruct(folder.path(), &out.path().join("none"), &[]);
    assert!(none.status.code() == Some(2) && message(&none).contains("needs two scans"), "{}", message(&none));
    let absent = reconstruct(&folder.path().join("absent"), &out.path().join("absent"), &[]);
    assert!(absent.status.code() == Some(2) && message(&absent).contains("is not a folder"), "{}", message(&absent));
    std::fs::write(folder.path().join("a.ply"), "ply\n").unwrap();
    std::fs::write(folder.path().join("b.ply"), "").unwrap();
    let broken = reconstruct(folder.path(), &out.path().join("broken"), &[]);
    assert!(broken.status.code() == Some(2) && message(&broken).contains("no scan there"), "{}", message(&broken));
}
