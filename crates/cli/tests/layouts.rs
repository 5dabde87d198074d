//! The layouts of published data sets, each as a miniature made of simulated scans.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_evaluation::GroundTruth;
use congruent_geometry::{RigidTransform, Scan, to_rows};
use congruent_io::{PairLine, pairs_csv, read_dataset, read_scan, write_file, write_ply};
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

/// Checks that the data set has one pair, and that its ground truth aligns the scans.
fn check(folder: &TempDir, pair: &ScanPair) {
    check_at(folder.path(), pair);
}

fn check_at(folder: &Path, pair: &ScanPair) {
    let dataset = read_dataset(folder, None).unwrap();
    assert_eq!((dataset.pairs.len(), dataset.warnings.len(), dataset.name.as_str()), (1, 0, "miniature"));
    assert!(dataset.broken.is_empty(), "{:?}", dataset.broken);
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
fn a_folder_of_xf_as_of_bod5() {
    let (folder, pair) = (TempDir::new().unwrap(), miniature());
    scans(folder.path(), &pair, "PeterRabbit_0.ply", "Scene3.ply");
    let toml = format!("{UPRIGHT}format = 'xf-folder'\npath = 'truth'\n");
    write_file(&folder.path().join("dataset.toml"), toml.as_bytes()).unwrap();
    std::fs::create_dir(folder.path().join("truth")).unwrap();
    let matrix = matrix(&pair.target_from_source);
    write_file(&folder.path().join("truth/PeterRabbit_0-Scene3.xf"), matrix.as_bytes()).unwrap();
    check(&folder, &pair);
}

/// Both views of an object are in a folder of its own, each with a pose into a common frame that is neither view's.
#[test]
fn views_with_poses_as_of_u3m_and_bmr() {
    let (folder, pair) = (TempDir::new().unwrap(), miniature());
    std::fs::create_dir_all(folder.path().join("truth/chef")).unwrap();
    scans(folder.path(), &pair, "view2.ply", "view1.ply");
    std::fs::rename(folder.path().join("scans"), folder.path().join("chef")).unwrap();
    let toml = "name = 'miniature'\nscenes = ['chef']\nscans = '{scene}'\n[pairs]\nmin-overlap = 0.1\n[truth]\nformat = 'xf-views'\npath = 'truth/{scene}'\n";
    write_file(&folder.path().join("dataset.toml"), toml.as_bytes()).unwrap();
    let world_from_target = RigidTransform::new([1.0, -20.0, 7.0].into(), [0.3, 1.0, -0.4].into());
    for (view, pose) in [("view1", world_from_target), ("view2", world_from_target * pair.target_from_source)] {
        let place = folder.path().join(format!("truth/chef/{view}.xf"));
        write_file(&place, matrix(&pose).as_bytes()).unwrap();
    }
    check(&folder, &pair);
}

#[test]
fn several_scenes_as_of_3dmatch_and_3dlomatch() {
    let (folder, pair) = (TempDir::new().unwrap(), miniature());
    scans(folder.path(), &pair, "cloud_bin_3.ply", "cloud_bin_0.ply");
    std::fs::rename(folder.path().join("scans"), folder.path().join("kitchen")).unwrap();
    let toml = "name = 'miniature'\nscenes = ['kitchen']\nscans = '{scene}'\n[truth]\nformat = 'gt-log'\npath = '3DLoMatch/{scene}/gt.log'\nnames = 'cloud_bin_{}.ply'\n";
    write_file(&folder.path().join("dataset.toml"), toml.as_bytes()).unwrap();
    std::fs::create_dir_all(folder.path().join("3DLoMatch/kitchen")).unwrap();
    let log = format!("0\t3\t60\n{}\n", matrix(&pair.target_from_source));
    write_file(&folder.path().join("3DLoMatch/kitchen/gt.log"), log.as_bytes()).unwrap();
    check(&folder, &pair);
}

#[test]
fn a_plain_folder_with_pairs() {
    let (parent, pair) = (TempDir::new().unwrap(), miniature());
    let folder = parent.path().join("miniature");
    scans(&folder, &pair, "b.ply", "a.ply");
    let line = PairLine {
        source: "b.ply".into(),
        target: "a.ply".into(),
        overlap: pair.overlap,
        target_from_source: pair.target_from_source,
    };
    write_file(&folder.join("pairs.csv"), pairs_csv(&[line]).as_bytes()).unwrap();
    check_at(&folder, &pair);
}

#[test]
fn every_description_that_comes_along_can_be_read() {
    let all = concat!(env!("CARGO_MANIFEST_DIR"), "/../../datasets");
    let empty = TempDir::new().unwrap();
    let entries = std::fs::read_dir(all).unwrap().map(|entry| entry.unwrap().path());
    for path in entries.filter(|path| path.is_dir()) {
        // The data are not included, so the first thing that is missing is the ground truth.
        let message = read_dataset(&path, Some(empty.path())).unwrap_err().to_string();
        assert!(message.contains(empty.path().to_str().unwrap()) && message.contains("cannot be read"), "{message}");
    }
}
