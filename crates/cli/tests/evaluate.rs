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
        let jsonl = fs::read_to_string(self.folder.path().join(output).join("pairs.jsonl")).unwrap();
        jsonl.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    fn csv(&self, output: &str) -> Vec<String> {
        let csv = fs::read_to_string(self.folder.path().join(output).join("pairs.csv")).unwrap();
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

    // As if the program had been killed in the middle of its last row: what is whole is kept to the last bit.
    fs::write(&scan, bytes).unwrap();
    let jsonl = bench.folder.path().join("out/pairs.jsonl");
    let whole = fs::read_to_string(&jsonl).unwrap();
    fs::write(&jsonl, whole.clone() + "{\"dataset\":\"u3m-l").unwrap();
    let second = bench.evaluate("out", &[]);
    assert_eq!(second.status.code(), Some(0), "{}", text(&second.stderr));
    assert!(text(&second.stderr).contains(&format!("{} pairs were already", 3 - bad)), "{}", text(&second.stderr));
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
fn two_configurations_are_compared_on_the_same_pairs() {
    let bench = Bench::new();
    bench.evaluate("out", &["--pairs", "2"]);
    let other = bench.evaluate("other", &["-c", "paper", "--compare", &bench.path("out")]);
    assert_eq!(other.status.code(), Some(0), "{}", text(&other.stderr));
    assert!(text(&other.stdout).contains("2 pairs in common. McNemar's exact test"), "{}", text(&other.stdout));
    let (ours, theirs) = (&bench.rows("out")[0], &bench.rows("other")[0]);
    assert_eq!(ours["pair"], theirs["pair"]);
    assert_ne!(ours["configuration"], theirs["configuration"]);
    let none = bench.evaluate("third", &["--min-overlap", "1.1"]);
    assert_eq!(none.status.code(), Some(2));
    assert!(text(&none.stderr).contains("lower --min-overlap"), "{}", text(&none.stderr));
}

#[test]
fn an_experiment_leaves_tables() {
    let bench = Bench::new();
    let output = congruent(&["experiment", "estimators", &bench.data(), "--pairs", "1", "-o", &bench.path("t2")]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("| metric \\ estimator | RANSAC | 2SAC-GC | 1P-RANSAC |"));
    let csv = fs::read_to_string(bench.folder.path().join("t2/estimators.csv")).unwrap();
    assert_eq!(csv.lines().count(), 1 + 3 * 7);
    for name in ["estimators.md", "estimators-pairs.csv"] {
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
