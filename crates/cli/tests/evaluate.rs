//! A simulated data set, evaluated, interrupted and compared; and one experiment on it.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};
use tempfile::TempDir;

fn congruent(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_congruent")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Three pairs and a directory for results.
struct Bench {
    folder: TempDir,
}

impl Bench {
    fn new() -> Bench {
        let bench = Bench { folder: TempDir::new().unwrap() };
        let output = congruent(&["simulate", "u3m-like", &bench.data(), "--pairs", "3", "--seed", "4"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        bench
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    fn data(&self) -> String {
        self.path("data")
    }

    fn evaluate(&self, output: &str, more: &[&str]) -> Output {
        let (data, output) = (self.data(), self.path(output));
        congruent(&[&["evaluate", &data, "-o", &output], more].concat())
    }

    fn rows(&self, output: &str) -> Vec<serde_json::Value> {
        let jsonl = fs::read_to_string(self.folder.path().join(output).join("results.jsonl")).unwrap();
        jsonl.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    fn csv(&self, output: &str) -> Vec<String> {
        let csv = fs::read_to_string(self.folder.path().join(output).join("results.csv")).unwrap();
        csv.lines().map(str::to_owned).collect()
    }
}

#[test]
fn a_stopped_evaluation_resumes_and_pairs_with_a_bad_file_are_rows() {
    let bench = Bench::new();
    let scan: PathBuf = bench.folder.path().join("data/scans/g000_v1.ply");
    let bytes = fs::read(&scan).unwrap();
    fs::write(&scan, "ply\nnothing").unwrap();
    let first = bench.evaluate("out", &[]);
    assert_eq!(first.status.code(), Some(1), "{}", text(&first.stderr));
    let rows = bench.rows("out");
    let bad = rows.iter().filter(|row| row["status"] == "error").count();
    assert!((1..3).contains(&bad) && rows.len() == 3, "{rows:?}");
    assert!(rows.iter().any(|row| row["error"].as_str().is_some_and(|why| why.contains("g000_v1.ply"))));

    // As if the program had been killed while it wrote its last row: complete rows are kept to the last bit.
    fs::write(&scan, bytes).unwrap();
    let jsonl = bench.folder.path().join("out/results.jsonl");
    let whole = fs::read_to_string(&jsonl).unwrap();
    fs::write(&jsonl, whole.clone() + "{\"dataset\":\"u3m-l").unwrap();
    let second = bench.evaluate("out", &[]);
    assert_eq!(second.status.code(), Some(0), "{}", text(&second.stderr));
    assert!(text(&second.stderr).contains(&format!("{} pairs had already", 3 - bad)), "{}", text(&second.stderr));
    let after = bench.rows("out");
    assert_eq!((after.len(), bench.csv("out").len()), (3, 4));
    for row in rows.iter().filter(|row| row["status"] == "scored") {
        assert!(after.contains(row), "{row}");
    }
    for row in &after {
        assert!(row["n_shared"].as_u64().unwrap() > 100 && row["repeatability"].as_f64().unwrap() > 0.3, "{row}");
        assert!(row["verdict"] != "ok" || row["rmse_pr"].as_f64().unwrap() < 5.0, "{row}");
    }
    assert!(text(&second.stdout).starts_with("3 pairs scored, 0 not evaluable, 0 with errors"));
}

#[test]
fn results_replace_neither_the_data_set_nor_each_other_and_need_a_folder() {
    let bench = Bench::new();
    let (data, truth, out) = (bench.data(), bench.path("data/pairs.csv"), bench.path("out"));
    let list = fs::read_to_string(&truth).unwrap();
    let pair = list.lines().nth(1).unwrap().split(',').take(2).collect::<Vec<_>>().join(",");
    let (table, claims, nowhere) =
        (bench.path("out/results.csv"), bench.path("out/claims.md"), bench.path("no/x.html"));
    let scan = bench.path("data/scans/g000_v1.ply");
    for (arguments, expected) in [
        (vec!["evaluate", &data, "--show", &pair, "--report", &truth], "is also an input"),
        (vec!["evaluate", &data, "--pairs", "1", "-o", &out, "--report", &scan], "is also an input"),
        (vec!["evaluate", &data, "-o", &out, "--report", &table], "two results"),
        (vec!["evaluate", &data, "-o", &out, "--figures", &truth], "is a file; give a folder"),
        (vec!["experiment", "inliers", &data, "-o", &out, "--report", &claims], "two results"),
        (vec!["experiment", "inliers", &data, "-o", &out, "--report", &nowhere], "folder does not exist"),
        (vec!["experiment", "inliers", &data, "-o", &truth], "is a file; give a folder"),
    ] {
        let output = congruent(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(text(&output.stderr).contains(expected) && output.stdout.is_empty(), "{}", text(&output.stderr));
    }
    assert_eq!(fs::read_to_string(&truth).unwrap(), list);
    assert_eq!(fs::read_dir(&out).unwrap().count(), 0, "nothing was measured");
}

#[test]
fn spoilt_scans_are_judged_as_they_came() {
    let bench = Bench::new();
    let spoilt = bench.evaluate("out", &["--pairs", "2", "--spoil", "strays=0.2", "--spoil", "noise=0.2"]);
    assert_eq!(spoilt.status.code(), Some(0), "{}", text(&spoilt.stderr));
    assert!(text(&spoilt.stdout).starts_with("spoilt: 20 % strays\nspoilt: noise 0.2 pr\n2 pairs scored"));
    bench.evaluate("out", &["--pairs", "2"]);
    let rows = bench.rows("out");
    assert_eq!(rows.len(), 4, "a spoilt pair is not the pair as it came");
    for (spoilt, clean) in rows[..2].iter().zip(&rows[2..]) {
        assert_eq!((&spoilt["pair"], &spoilt["raw_resolution"]), (&clean["pair"], &clean["raw_resolution"]));
        assert_ne!(spoilt["target_from_source"], clean["target_from_source"]);
        assert!(spoilt["verdict"] != "ok" || spoilt["rmse_pr"].as_f64().unwrap() < 5.0, "{spoilt}");
    }
    let twice = bench.evaluate("out", &["--pairs", "1", "--spoil", "noise=0.2", "--spoil", "noise=0.2"]);
    assert_eq!(twice.status.code(), Some(0), "{}", text(&twice.stderr));
    let once = bench.evaluate("out", &["--pairs", "1", "--spoil", "noise=0.4"]);
    assert_eq!(once.status.code(), Some(0), "{}", text(&once.stderr));
    let rows = bench.rows("out");
    assert_ne!(rows[4]["target_from_source"], rows[5]["target_from_source"], "two small noises are not one large");
    // Levels that differ by less than a percent are different levels.
    for level in ["strays=0.004", "strays=0.001"] {
        let one = bench.evaluate("levels", &["-c", "fast", "--pairs", "1", "--spoil", level]);
        assert!(!text(&one.stderr).contains("already"), "{}", text(&one.stderr));
    }
    let rows = bench.rows("levels");
    assert!(rows.len() == 2 && rows[0]["configuration"] != rows[1]["configuration"], "{rows:?}");
    let misspelt = bench.evaluate("out", &["--spoil", "nois=1"]);
    assert_eq!(misspelt.status.code(), Some(2));
    assert!(text(&misspelt.stderr).contains("`noise`"), "{}", text(&misspelt.stderr));
}

#[test]
fn two_configurations_are_compared_on_the_same_pairs() {
    let bench = Bench::new();
    bench.evaluate("out", &["--pairs", "2"]);
    let other = bench.evaluate("other", &["-c", "paper", "--compare", &bench.path("out")]);
    assert_eq!(other.status.code(), Some(0), "{}", text(&other.stderr));
    assert!(text(&other.stdout).contains("2 pairs in common. McNemar's exact test"), "{}", text(&other.stdout));
    let (ours, theirs) = (&bench.rows("out")[0], &bench.rows("other")[0]);
    assert_eq!(ours["pair"], theirs["pair"]);
    assert_ne!(ours["configuration"], theirs["configuration"]);
    // Evaluated again, the first configuration adds no row but is still the last one.
    let both = |more: &[&str]| bench.evaluate("out", &[&["--pairs", "2"], more].concat());
    both(&["--set", "seed=5"]);
    both(&[]);
    let same = bench.evaluate("again", &["--pairs", "2", "--compare", &bench.path("out")]);
    assert!(text(&same.stdout).contains("2 pairs in common"), "{}", text(&same.stdout));
    let file = |name: &str| fs::read_to_string(bench.folder.path().join(name).join("config.toml")).unwrap();
    assert_eq!(file("out"), file("again"));
    let named = file("out").lines().next().unwrap().replace("# configuration of rows: ", "");
    assert_eq!(bench.rows("out")[0]["configuration"], named.as_str());
    let none = bench.evaluate("third", &["--min-overlap", "1"]);
    assert_eq!(none.status.code(), Some(2));
    assert!(text(&none.stderr).contains("lower --min-overlap"), "{}", text(&none.stderr));
}

#[test]
fn a_truth_with_bad_lines_is_said_and_the_rest_is_evaluated() {
    let bench = Bench::new();
    let place = bench.folder.path().join("data/pairs.csv");
    let list = fs::read_to_string(&place).unwrap();
    let lines: Vec<&str> = list.lines().collect();
    let mut good: Vec<&str> = lines[1].split(',').collect();
    let line = |fields: &[&str]| fields.join(",");
    let x = good[6];
    good[6] = "NaN";
    let not_a_number = line(&good);
    good[6] = x;
    let mut mirrored = good.clone();
    for i in [3, 4, 5, 7, 8, 9] {
        mirrored[i] = "1";
    }
    let mut unknown = good.clone();
    unknown[0] = "nobody.ply";
    // Under this ground truth the scans share nothing, so no pose can be judged.
    let mut apart = good.clone();
    apart[6] = "1e6";
    let bad = [lines[0].to_owned(), not_a_number, line(&mirrored), line(&unknown), line(&apart), line(&good)];
    fs::write(&place, bad.join("\n")).unwrap();

    let output = bench.evaluate("out", &[]);
    let (said, summary) = (text(&output.stderr), text(&output.stdout));
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("pairs.csv: line 2: `NaN` in the column `tx` is not a finite number"), "{said}");
    assert!(said.contains("pairs.csv: line 3: the true pose: the upper left 3x3 part is farther than"), "{said}");
    assert!(summary.starts_with("1 pairs scored, 1 not evaluable, 1 with errors"), "{summary}");
    let rows = bench.rows("out");
    let why = rows[0]["error"].as_str().unwrap();
    assert!(why.contains("pairs.csv: line 4") && why.contains("nobody.ply"), "{why}");
    assert_eq!((rows[1]["status"].as_str(), rows[2]["status"].as_str()), (Some("not-evaluable"), Some("scored")));
}

#[test]
fn several_data_sets_are_evaluated_in_one_run() {
    let bench = Bench::new();
    let other = bench.path("other-data");
    congruent(&["simulate", "bmr-like", &other, "--pairs", "2", "--seed", "4"]);
    let output = bench.evaluate("out", &[&other, "--pairs", "1"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let summary = text(&output.stdout);
    for part in ["u3m-like: 1 pairs scored", "bmr-like: 1 pairs scored", "all: 2 pairs scored"] {
        assert!(summary.contains(part), "{part}\n{summary}");
    }
    let twice = bench.evaluate("twice", &[&bench.data()]);
    assert_eq!(twice.status.code(), Some(2));
    assert!(text(&twice.stderr).contains("another data set is also called `u3m-like`"), "{}", text(&twice.stderr));
}

#[test]
fn any_mesh_can_be_scanned_and_a_cloud_cannot() {
    let bench = Bench::new();
    let mesh = bench.path("pyramid.off");
    fs::write(&mesh, "OFF\n4 4 0\n0 0 0\n3 0 0\n0 2 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n").unwrap();
    let made = bench.path("made");
    let output = congruent(&["simulate", "u3m-like", &made, "--pairs", "2", "--mesh", &mesh]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("Wrote 2 pairs"), "{}", text(&output.stderr));
    let cloud = bench.path("data/scans/g000_v0.ply");
    let refused = congruent(&["simulate", "u3m-like", &bench.path("none"), "--mesh", &cloud]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("has no faces"), "{}", text(&refused.stderr));
    assert!(!bench.folder.path().join("none").exists());
}

#[test]
fn a_data_set_of_other_meshes_is_another_one_and_one_without_pairs_is_none() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let pyramid =
        |height: u32| format!("OFF\n4 4 0\n0 0 0\n3 0 0\n0 2 0\n0 0 {height}\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    fs::write(path("a.off"), pyramid(1)).unwrap();
    let simulate = |set: &str, mesh: &str, pairs: &str| {
        let output = congruent(&["simulate", "u3m-like", &path(set), "--pairs", pairs, "--mesh", &path(mesh)]);
        (output.status.code(), text(&output.stderr))
    };
    let (code, said) = simulate("set", "a.off", "1");
    assert_eq!(code, Some(0), "{said}");
    let description = fs::read_to_string(path("set/dataset.toml")).unwrap();
    assert!(description.contains("--mesh a.off") && description.contains("scans of a.off"), "{description}");
    assert!(!description.contains("figurines") && !description.contains(&path("")), "{description}");
    assert_eq!(simulate("set", "a.off", "1").0, Some(0), "the same again");
    fs::copy(path("a.off"), path("b.off")).unwrap();
    fs::write(path("a.off"), pyramid(2)).unwrap();
    for mesh in ["a.off", "b.off"] {
        let (code, said) = simulate("set", mesh, "1");
        assert!(code == Some(2) && said.contains("contains another data set"), "{said}");
    }
    assert_eq!(fs::read_to_string(path("set/dataset.toml")).unwrap(), description);
    // All faces of this one are lines.
    fs::write(path("line.off"), "OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n").unwrap();
    let (code, said) = simulate("none", "line.off", "1");
    assert!(code == Some(2) && said.contains("faces have an area"), "{said}");
    let (code, said) = simulate("none", "a.off", "0");
    assert!(code == Some(2) && said.contains("ask for more than 0"), "{said}");
    assert!(!folder.path().join("none/pairs.csv").exists());
}

#[test]
fn an_experiment_leaves_tables() {
    let bench = Bench::new();
    let output = congruent(&["experiment", "estimators", &bench.data(), "--pairs", "1", "-o", &bench.path("t2")]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("| metric \\ estimator | RANSAC | 2SAC-GC | 1P-RANSAC |"));
    let csv = fs::read_to_string(bench.folder.path().join("t2/estimators.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 3 * 7);
    assert!(
        text(&output.stdout).contains("| every proposed metric is above INLIER with every estimator | u3m-like | ")
    );
    for name in ["estimators.md", "estimators-pairs.csv", "claims.md"] {
        assert!(bench.folder.path().join("t2").join(name).exists(), "{name}");
    }
}

#[test]
fn pages_and_figures_are_written_and_one_pair_can_be_shown() {
    let bench = Bench::new();
    let (page, figures) = (bench.path("page.html"), bench.path("figures"));
    let output = bench.evaluate("out", &["-c", "fast", "--report", &page, "--figures", &figures]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.contains("<svg") && html.contains("g000_v1.ply \u{2192} g000_v0.ply"));
    for name in ["accuracy", "errors", "inlier-ratios", "inliers", "confidence"] {
        let svg = fs::read_to_string(format!("{figures}/{name}.svg")).unwrap();
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{name}");
    }
    let show = |pair: &str| {
        let metrics = ["--metrics", "mse,inlier-count", "-c", "paper", "--report", page.as_str()];
        congruent(&[&["evaluate", bench.data().as_str(), "--show", pair], &metrics[..]].concat())
    };
    assert_eq!(show("g000_v1.ply,g000_v0.ply").status.code(), Some(0));
    let html = fs::read_to_string(&page).unwrap();
    assert_eq!(html.matches("<figure class=\"view\"").count(), 2);
    let refused = show("none.ply,g000_v0.ply");
    assert!(refused.status.code() == Some(2) && text(&refused.stderr).contains("g000_v1.ply,g000_v0.ply"));
}

#[test]
fn a_calibration_does_not_take_two_data_sets_for_one() {
    let bench = Bench::new();
    let output = congruent(&["calibrate", &bench.data(), &bench.data(), "-o", &bench.path("calibration")]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stdout));
    assert!(text(&output.stderr).contains("another data set is also called `u3m-like`"), "{}", text(&output.stderr));
}
