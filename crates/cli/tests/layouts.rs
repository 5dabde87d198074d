//! The layouts in which other people's data sets come, each as a miniature made of simulated scans.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_evaluation::GroundTruth;
use congruent_geometry::{RigidTransform, Scan, to_rows};
use congruent_io::{read_dataset, read_scan, write_file, write_ply};
use congruent_pipeline::Pair;
use congruent_simulation::pair::{PairOptions, ScanPair, figurine_pair};
use std::path::Path;
use tempfile::TempDir;

const UPRIGHT: &str = "name = 'miniature'\n[truth]\n";

fn miniature() -> ScanPair {
    figurine_pair(&PairOptions { pixels: 80, ..PairOptions::default() })
}

/// Writes the two scans under these names.
fn scans(folder: &Path, pair: &ScanPair, source: &str, target: &str) {
    std::fs::create_dir_all(folder.join("scans")).unwrap();
    for (name, scan) in [(source, &pair.source), (target, &pair.target)] {
        write_ply(&folder.join("scans").join(name), &scan.points, None, &[]).unwrap();
    }
}

fn matrix(pose: &RigidTransform) -> String {
    to_rows(pose).map(|row| row.map(|v| format!("{v:.6}")).join(" ")).join("\n")
}

/// The data set has one pair, and its truth brings the scans together.
fn check(folder: &TempDir, pair: &ScanPair) {
    let dataset = read_dataset(folder.path(), None).unwrap();
    assert_eq!((dataset.pairs.len(), dataset.warnings.len(), dataset.name.as_str()), (1, 0, "miniature"));
    let read = &dataset.pairs[0];
    let files = Pair { source: &read.source_file, target: &read.target_file };
    let scans = files.map(|file| Scan::new(&read_scan(file).unwrap()).unwrap());
    let truth = GroundTruth::of_scans(scans.as_ref(), &read.target_from_source);
    assert!(truth.overlap() > 0.5, "{}", truth.overlap());
    assert!(truth.errors(&pair.target_from_source).unwrap().rmse_pr < 1e-3);
}

#[test]
fn gt_log_as_of_3dmatch() {
    let (folder, pair) = (TempDir::new().unwrap(), miniature());
    scans(folder.path(), &pair, "cloud_bin_3.ply", "cloud_bin_0.ply");
    let toml = format!("{UPRIGHT}format = 'gt-log'\npath = 'gt.log'\nnames = 'cloud_bin_{{}}.ply'\n");
    write_file(&folder.path().join("dataset.toml"), toml.as_bytes()).unwrap();
    let log = format!("0\t3\t60\n{}\n", matrix(&pair.target_from_source));
    write_file(&folder.path().join("gt.log"), log.as_bytes()).unwrap();
    check(&folder, &pair);
}

#[test]
fn conf_as_of_stanford() {
    let (folder, pair) = (TempDir::new().unwrap(), miniature());
    scans(folder.path(), &pair, "bun045.ply", "bun000.ply");
    let toml = format!("{UPRIGHT}format = 'stanford-conf'\npath = 'bun.conf'\n");
    write_file(&folder.path().join("dataset.toml"), toml.as_bytes()).unwrap();
    // The common frame is the target's; the quaternion is written conjugated.
    let (t, q) = (pair.target_from_source.translation.vector, pair.target_from_source.rotation.conjugate());
    let conf = format!(
        "camera 0 0 0 0 0 0 1\nbmesh bun000.ply 0 0 0 0 0 0 1\nbmesh bun045.ply {} {} {} {} {} {} {}\n",
        t.x, t.y, t.z, q.i, q.j, q.k, q.w
    );
    write_file(&folder.path().join("bun.conf"), conf.as_bytes()).unwrap();
    check(&folder, &pair);
}

#[test]
fn a_folder_of_xf_as_of_u3or() {
    let (folder, pair) = (TempDir::new().unwrap(), miniature());
    scans(folder.path(), &pair, "chef.ply", "rs1.ply");
    std::fs::create_dir(folder.path().join("truth")).unwrap();
    let toml = format!("{UPRIGHT}format = 'xf-folder'\npath = 'truth'\n");
    write_file(&folder.path().join("dataset.toml"), toml.as_bytes()).unwrap();
    let matrix = matrix(&pair.target_from_source);
    write_file(&folder.path().join("truth/chef-rs1.xf"), matrix.as_bytes()).unwrap();
    check(&folder, &pair);
}

#[test]
fn a_list_of_poses_as_of_u3m() {
    let (folder, pair) = (TempDir::new().unwrap(), miniature());
    scans(folder.path(), &pair, "view2.ply", "view1.ply");
    let toml = format!("{UPRIGHT}format = 'pose-list'\npath = 'dataload.txt'\n");
    write_file(&folder.path().join("dataset.toml"), toml.as_bytes()).unwrap();
    let list = format!("view2.ply view1.ply {}\n", matrix(&pair.target_from_source).replace('\n', " "));
    write_file(&folder.path().join("dataload.txt"), list.as_bytes()).unwrap();
    check(&folder, &pair);
}

#[test]
fn every_description_that_comes_along_can_be_read() {
    let all = concat!(env!("CARGO_MANIFEST_DIR"), "/../../datasets");
    let empty = TempDir::new().unwrap();
    for entry in std::fs::read_dir(all).unwrap() {
        // The data do not come along, so the first thing that is missing is the truth.
        let message = read_dataset(&entry.unwrap().path(), Some(empty.path())).unwrap_err().to_string();
        assert!(message.contains(empty.path().to_str().unwrap()) && message.contains("cannot be read"), "{message}");
    }
}
