//! The stage commands, one after the other and compared with `align`.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_geometry::{RigidTransform, Scan, from_rows, mean_displacement};
use congruent_io::{read_matches, read_npy, read_places, read_scan, write_ply};
use congruent_simulation::pair::{PairOptions, figurine_pair};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder with two scans in it, far from the origin as surveyed scans are.
struct Folder(tempfile::TempDir);

impl Folder {
    fn with_scans() -> Folder {
        let folder = Folder(tempfile::tempdir().unwrap());
        let pair = figurine_pair(&PairOptions { view_angle: 0.35, pixels: 150, ..PairOptions::default() });
        let motion = RigidTransform::translation(5000.0, -300.0, 70.0);
        let pair = pair.moved(&motion, &motion.inverse());
        write_ply(&folder.path("source.ply"), &pair.source.points, None, &[]).unwrap();
        write_ply(&folder.path("target.ply"), &pair.target.points, None, &[]).unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    /// Runs the program in the folder; arguments are separated by spaces.
    fn run(&self, words: &str) -> Output {
        let program = Command::new(env!("CARGO_BIN_EXE_congruent"))
            .current_dir(self.0.path())
            .args(words.split_whitespace())
            .output();
        program.unwrap()
    }

    /// Runs the program, which must succeed, and returns what it printed.
    fn ok(&self, words: &str) -> String {
        let output = self.run(words);
        assert!(output.status.success(), "{words}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    fn json(&self, words: &str) -> serde_json::Value {
        serde_json::from_str(&self.ok(words)).unwrap()
    }
}

fn pose(result: &serde_json::Value) -> RigidTransform {
    let rows: [[f64; 4]; 4] = serde_json::from_value(result["target_from_source"].clone()).unwrap();
    from_rows(&rows, 1e-6).unwrap()
}

/// Returns the mean distance between the places to which two poses move the points of a scan, data units.
fn displacement(scan: &Path, a: &RigidTransform, b: &RigidTransform) -> f64 {
    let scan = Scan::new(&read_scan(scan).unwrap()).unwrap();
    // The points are centred, so the poses must include their offset.
    let shift = RigidTransform::from_parts((*scan.origin()).into(), nalgebra::UnitQuaternion::identity());
    mean_displacement(scan.points(), &(a * shift), &(b * shift))
}

#[test]
fn the_stages_one_by_one_come_to_the_pose_of_align() {
    let folder = Folder::with_scans();
    let align = folder.json("align source.ply target.ply -c paper --seed 3 --json");
    assert_eq!(align["verdict"], "ok", "{align}");
    // In a pair, `pr` depends on both scans; here it is given, and so is the grid.
    let resolution = align["resolution"]["sampled"].as_f64().unwrap();
    let leaf = align["lengths"]["sampling.voxel-grid.leaf"].as_f64().unwrap();
    let stage = format!("-c paper --resolution {resolution:?}u --set sampling.voxel-grid.leaf={leaf:?}u");
    for scan in ["source", "target"] {
        folder.ok(&format!("keypoints {scan}.ply -o {scan}.csv {stage}"));
        folder.ok(&format!("describe {scan}.ply --keypoints {scan}.csv -o {scan}-features.npy {stage}"));
    }
    folder.ok("match source-features.npy target-features.npy -o matches.csv -c paper");
    let estimate = folder.json(&format!("estimate matches.csv --resolution {resolution:?}u -c paper --seed 3 --json"));
    assert_eq!(estimate["verdict"], "ok", "{estimate}");
    assert_eq!(estimate["counts"]["correspondences"], align["counts"]["correspondences"]);
    let apart = displacement(&folder.path("source.ply"), &pose(&align), &pose(&estimate));
    // The same trial wins; its points are centred differently, which changes the last bits.
    assert!(apart < 1e-2 * resolution, "{apart}");
}

#[test]
fn saved_stages_are_read_again_and_give_the_same_winner() {
    let folder = Folder::with_scans();
    for config in ["-c paper", "-c default --set escalation=[]"] {
        let align = folder.json(&format!("align source.ply target.ply {config} --save-stages stages --json"));
        let counts = |of: &str, scan: usize| align["counts"][of][scan].as_u64().unwrap() as usize;
        for (i, scan) in ["source", "target"].into_iter().enumerate() {
            let at = |file: &str| folder.path("stages").join(format!("{scan}-{file}"));
            assert_eq!(read_places(&at("keypoints.csv")).unwrap().len(), counts("keypoints", i));
            assert_eq!(read_npy(&at("features.npy")).unwrap().rows, counts("described", i));
            assert_eq!(read_places(&at("features.csv")).unwrap().len(), counts("described", i));
        }
        let matches = read_matches(&folder.path("stages/matches.csv"), None).unwrap();
        assert_eq!(matches.len() as u64, align["counts"]["correspondences"].as_u64().unwrap());
        let again = folder.ok(&format!("match stages/source-features.npy stages/target-features.npy {config}"));
        assert_eq!(again, std::fs::read_to_string(folder.path("stages/matches.csv")).unwrap());

        let pool = std::fs::read_to_string(folder.path("stages/pool.csv")).unwrap();
        let winner: Vec<f64> = pool.lines().nth(1).unwrap().split(',').map(|v| v.parse().unwrap()).collect();
        let rows: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| winner[2 + 4 * i + j]));
        let resolution = align["resolution"]["sampled"].as_f64().unwrap();
        let from_scans = format!("estimate stages/matches.csv --source source.ply --target target.ply {config} --json");
        let alone = format!("estimate stages/matches.csv --resolution {resolution:?}u {config} --json");
        for words in [from_scans, alone] {
            let estimate = folder.json(&words);
            let score = estimate["score"].as_f64().unwrap();
            assert!((score - winner[0]).abs() < 1e-4 * winner[0].abs(), "{words}: {score} for {}", winner[0]);
            let apart = displacement(&folder.path("source.ply"), &pose(&estimate), &from_rows(&rows, 1e-6).unwrap());
            assert!(apart < 1e-2 * resolution, "{words}: {apart}");
        }
    }
}

#[test]
fn positions_of_points_and_bare_coordinates_are_estimated_from() {
    let folder = Folder::with_scans();
    let points = read_scan(&folder.path("source.ply")).unwrap().points.to_vec();
    // The source with itself: every point stays where it was.
    let some = || (0..points.len()).step_by(97);
    folder.write("pairs.txt", &some().map(|i| format!("{i} {i}\n")).collect::<String>());
    let line = |i: usize| format!("{0:?} {1:?} {2:?} {0:?} {1:?} {2:?}\n", points[i][0], points[i][1], points[i][2]);
    folder.write("six.txt", &some().map(line).collect::<String>());
    for words in [
        "estimate pairs.txt --source source.ply --target source.ply -c paper --json",
        "estimate six.txt --resolution 1u -c paper --json",
        "estimate six.txt --source source.ply --target source.ply -c paper --set estimator=two-point --json",
    ] {
        let estimate = folder.json(words);
        let apart = displacement(&folder.path("source.ply"), &pose(&estimate), &RigidTransform::identity());
        assert!(apart < 1e-2 && estimate["verdict"] == "ok", "{words}: {apart}, {estimate}");
    }
}

#[test]
fn a_pose_in_tiny_coordinates_is_printed_with_its_digits() {
    let folder = Folder::with_scans();
    let points = read_scan(&folder.path("source.ply")).unwrap().points.to_vec();
    // In units of ten million, moved along x by 2e-5.
    let tiny = |p: &[f64; 3]| p.map(|v| v * 1e-7);
    let line = |[x, y, z]: [f64; 3]| format!("{x:?} {y:?} {z:?} {:?} {y:?} {z:?}\n", x + 2e-5);
    folder.write("six.txt", &points.iter().step_by(97).map(|p| line(tiny(p))).collect::<String>());
    let text = folder.ok("estimate six.txt --resolution 1e-7u -c paper");
    let first = text.lines().find(|line| line.trim_start().starts_with("1.000")).unwrap_or_default();
    let shift = first.split_whitespace().nth(3).unwrap_or_default();
    assert!(shift.starts_with("0.0000200") || shift.starts_with("0.0000199"), "{text}");
}

#[test]
fn wrong_inputs_are_named_and_leave_with_two() {
    let folder = Folder::with_scans();
    folder.write("far.csv", "x,y,z\n1e300,0,0\n");
    folder.write("text.csv", "x,y,z\n1,2,three\n");
    folder.write("pairs.txt", "0 0\n1 99999999\n");
    folder.write("six.txt", "1 2 3 4 5 6\n1 2 3 4 5 1e300\n2 3 4 5 6 7\n");
    folder.write("seven.txt", "1 2 3 4 5 6 7\n");
    folder.write("no.npy", "x,y,z\n");
    folder.write("no.csv", "x,y,z\n");
    folder.write("good.csv", "x,y,z\n1,2,3\n");
    let matrix = |columns| congruent_io::Matrix { rows: 1, columns, values: vec![0.0; columns] };
    for (name, columns) in [("good.npy", 3), ("wide.npy", 4), ("alone.npy", 3)] {
        congruent_io::write_npy(&folder.path(name), &matrix(columns)).unwrap();
    }
    folder.write("wide.csv", "1 2 3\n");
    folder.write("matches.csv", "sx,sy,sz,tx,ty,tz\n0,0,0,0,0,0\n1,0,0,1,0,0\n0,1,0,0,1,0\n");
    for (words, expected) in [
        ("keypoints absent.ply", "absent.ply: cannot be read"),
        ("keypoints source.ply --resolution 2pr", "data units, as in 0.6u"),
        ("keypoints source.ply --set detector=haris", "did you mean `harris`?"),
        ("describe source.ply -o features.csv", "features.csv: descriptors need a name that ends in .npy"),
        ("describe source.ply -o f.npy --keypoints far.csv", "far.csv: line 2: the keypoint [1e300, 0.0, 0.0]"),
        ("describe source.ply -o f.npy --keypoints text.csv", "text.csv: line 2, field 3: `three`"),
        ("match good.npy no.npy", "no.npy: does not begin as a .npy file"),
        ("match good.npy alone.npy", "alone.csv: cannot be read"),
        ("match good.npy wide.npy", "wide.npy: has 4 numbers per row, good.npy has 3"),
        ("estimate matches.csv", "--resolution 0.6u"),
        ("estimate matches.csv --source source.ply", "--target"),
        ("estimate seven.txt --resolution 1u", "seven.txt: line 1: 7 fields and no header"),
        ("estimate six.txt --resolution 1u", "six.txt: correspondence"),
        ("estimate pairs.txt --resolution 1u", "pairs.txt: contains pairs of point indices"),
        (
            "estimate pairs.txt --source source.ply --target target.ply",
            "pairs.txt: line 2: 99999999 is not a point index",
        ),
        ("estimate matches.csv --resolution 1u --set estimator=one-point", "needs reference frames"),
        ("estimate matches.csv --resolution 1u --set metric=soft-overlap", "needs the whole scans"),
    ] {
        let output = folder.run(words);
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && message.contains(expected), "{words}: {} {message}", output.status);
    }
    // Three matches prove nothing: this is an answer, not an error.
    let output = folder.run("estimate matches.csv --resolution 1u -c paper");
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
}
