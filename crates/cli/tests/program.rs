//! The program as a user sees it: help, exit codes, JSON, bad files.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

fn congruent(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_congruent")).args(arguments).env("COLUMNS", "100").output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Runs the demo, once for each test that needs its scans.
fn demo() -> (TempDir, Output) {
    let folder = TempDir::new().unwrap();
    let output = congruent(&["demo", folder.path().to_str().unwrap()]);
    (folder, output)
}

fn path(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

#[test]
fn help_is_as_it_was() {
    for command in [
        vec!["--help"],
        vec!["align", "--help"],
        vec!["refine", "--help"],
        vec!["batch", "--help"],
        vec!["merge", "--help"],
        vec!["reconstruct", "--help"],
        vec!["inspect", "--help"],
        vec!["convert", "--help"],
        vec!["config", "--help"],
        vec!["demo", "--help"],
        vec!["evaluate", "--help"],
        vec!["experiment", "--help"],
        vec!["simulate", "--help"],
        vec!["keypoints", "--help"],
        vec!["describe", "--help"],
        vec!["match", "--help"],
        vec!["estimate", "--help"],
        vec!["calibrate", "--help"],
        vec!["config", "show", "--help"],
        vec!["config", "check", "--help"],
    ] {
        let output = congruent(&command);
        assert_eq!(output.status.code(), Some(0));
        insta::assert_snapshot!(command.join("_").replace("--", ""), stdout(&output));
    }
}

#[test]
fn the_demo_registers_and_says_what_it_wrote() {
    let (folder, output) = demo();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("verdict  ok") && stdout(&output).contains("truth  right"), "{}", stdout(&output));
    for name in ["source.ply", "target.ply", "truth.txt", "result.json", "aligned.ply", "picture.svg", "report.html"] {
        assert!(folder.path().join(name).exists() && stderr(&output).contains(name), "{name}");
    }
}

/// Replaces values that change from run to run or from machine to machine.
fn shape_of(value: &serde_json::Value) -> serde_json::Value {
    use serde_json::Value;
    match value {
        Value::Object(map) => Value::Object(map.iter().map(|(k, v)| (k.clone(), shape_of(v))).collect()),
        Value::Array(items) => Value::Array(items.iter().map(shape_of).collect()),
        Value::Number(_) => "number".into(),
        Value::String(text) if text.contains(std::path::MAIN_SEPARATOR) => "path".into(),
        Value::String(text) if text.contains(|c: char| c.is_ascii_digit()) => "text with figures".into(),
        other => other.clone(),
    }
}

#[test]
fn json_has_its_shape() {
    let (folder, _) = demo();
    let output = congruent(&["align", &path(&folder, "source.ply"), &path(&folder, "target.ply"), "--json"]);
    assert_eq!(output.status.code(), Some(0));
    let value: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    insta::assert_snapshot!("align_json", serde_json::to_string_pretty(&shape_of(&value)).unwrap());
    assert_eq!(value["target_from_source"][3], serde_json::json!([0.0, 0.0, 0.0, 1.0]));
}

#[test]
fn json_is_equal_to_the_byte_on_any_number_of_threads() {
    let (folder, _) = demo();
    for preset in ["default", "paper"] {
        let on = |threads: &str| {
            let output = congruent(&[
                "align",
                &path(&folder, "source.ply"),
                &path(&folder, "target.ply"),
                "--json",
                "-c",
                preset,
                "--threads",
                threads,
            ]);
            let mut value: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
            value["timings"].take();
            value.to_string()
        };
        let one = on("1");
        assert!(one == on("2") && one == on("4"), "{preset}");
    }
}

#[test]
fn a_result_can_be_refined_and_bounds_need_a_guess() {
    let (folder, _) = demo();
    let (source, target, result) =
        (path(&folder, "source.ply"), path(&folder, "target.ply"), path(&folder, "result.json"));
    let refined = congruent(&["refine", &source, &target, "--init", &result, "--json"]);
    assert_eq!(refined.status.code(), Some(0), "{}", stderr(&refined));
    let value: serde_json::Value = serde_json::from_str(&stdout(&refined)).unwrap();
    assert!(value["verdict"] == "ok" && value["uncertainty"]["rotation_deg"].as_f64().unwrap() < 0.5, "{value}");
    let summary = stdout(&congruent(&["refine", &source, &target, "--init", &result]));
    assert!(summary.contains("uncertainty  good to 0."), "{summary}");
    // The scans are forty degrees apart.
    let bounds = ["--init", "identity", "--max-rotation", "5", "--max-translation", "20pr"];
    let bounded = congruent(&[&["align", &source, &target][..], &bounds].concat());
    assert_eq!(bounded.status.code(), Some(1));
    assert!(stdout(&bounded).contains("within the bounds"), "{}", stdout(&bounded));
    for wrong in [&["--max-rotation", "5"][..], &["--up", "0,0,1"], &["--init", "none.txt"]] {
        let output = congruent(&[&["align", &source, &target][..], wrong].concat());
        assert_eq!(output.status.code(), Some(2), "{wrong:?}");
    }
}

#[test]
fn results_are_written_where_they_were_wanted() {
    let (folder, _) = demo();
    let (json, matrix, aligned) = (path(&folder, "r.json"), path(&folder, "r.xf"), path(&folder, "moved.ply"));
    let (source, target) = (path(&folder, "source.ply"), path(&folder, "target.ply"));
    let output = congruent(&["align", &source, &target, "-o", &json, "--write-aligned", &aligned]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let value: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    assert_eq!(value["verdict"], "ok");
    congruent(&["align", &source, &target, "-o", &matrix]);
    assert_eq!(std::fs::read_to_string(&matrix).unwrap().split_whitespace().count(), 16);
    // The moved source is already aligned.
    let again = congruent(&["align", &aligned, &target, "--json"]);
    let value: serde_json::Value = serde_json::from_str(&stdout(&again)).unwrap();
    for (i, row) in value["target_from_source"].as_array().unwrap().iter().enumerate() {
        for (j, number) in row.as_array().unwrap().iter().enumerate() {
            let expected = if i == j { 1.0 } else { 0.0 };
            assert!((number.as_f64().unwrap() - expected).abs() < 0.05 * if j == 3 { 4.0 } else { 1.0 }, "{value}");
        }
    }
}

#[test]
fn nothing_is_written_over_what_is_read() {
    let (folder, _) = demo();
    let (source, target, new) = (path(&folder, "source.ply"), path(&folder, "target.ply"), path(&folder, "new.json"));
    let (truth, stages) = (path(&folder, "truth.txt"), path(&folder, "stages"));
    let (keypoints, pool) = (path(&folder, "stages/source-keypoints.csv"), path(&folder, "stages/pool.csv"));
    std::fs::create_dir(&stages).unwrap();
    std::fs::write(&keypoints, "x,y,z\n0,0,0\n").unwrap();
    let before = std::fs::read(&target).unwrap();
    for (arguments, expected) in [
        (vec!["align", &source, &target, "-o", &target], "--write-aligned"),
        (vec!["align", &source, &target, "--write-aligned", &target], "is also an input"),
        (vec!["align", &source, &target, "-o", &new, "--report", &new], "two results"),
        (vec!["align", &source, &target, "--report", "no-such-folder/x.html"], "folder does not exist"),
        (vec!["keypoints", &target, "-o", &target], "is also an input"),
        (vec!["convert", &target, &target], "is also an input"),
        (vec!["align", &source, &target, "--write-aligned", "moved"], "not supported for writing"),
        (vec!["align", &source, &target, "--save-stages", &target], "is a file; give a folder"),
        (vec!["align", &keypoints, &target, "--save-stages", &stages], "is also an input"),
        (vec!["align", &source, &target, "--save-stages", &stages, "--report", &pool], "two results"),
        (vec!["refine", &source, &target, "--init", &truth, "-o", &truth], "is also an input"),
    ] {
        let output = congruent(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains(expected) && stdout(&output).is_empty(), "{}", stderr(&output));
    }
    assert!(std::fs::read(&target).unwrap() == before && !Path::new(&new).exists());
    assert_eq!(std::fs::read_to_string(&keypoints).unwrap(), "x,y,z\n0,0,0\n");
    // A demo may replace an earlier one, but no scans of one's own.
    let own = TempDir::new().unwrap();
    std::fs::copy(&source, own.path().join("target.ply")).unwrap();
    let again = congruent(&["demo", own.path().to_str().unwrap()]);
    assert!(again.status.code() == Some(2) && stderr(&again).contains("target.ply: is not from"), "{}", stderr(&again));
    assert_eq!(std::fs::read_dir(own.path()).unwrap().count(), 1);
    // A simulated data set may replace itself, but no other one.
    let set = path(&folder, "set");
    let simulate = |pairs: &str| congruent(&["simulate", "bmr-like", &set, "--pairs", pairs]).status.code();
    assert_eq!(["1", "1", "2"].map(simulate), [Some(0), Some(0), Some(2)]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_stdout_is_said() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_congruent"));
    let output = command.args(["config", "show"]).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("standard output"), "{}", stderr(&output));
}

#[test]
fn one_point_that_stands_for_nothing_changes_no_pose() {
    let (folder, _) = demo();
    let (clean, spoilt, target) = (path(&folder, "a.xyz"), path(&folder, "b.xyz"), path(&folder, "target.ply"));
    congruent(&["convert", &path(&folder, "source.ply"), &clean]);
    let points = std::fs::read_to_string(&clean).unwrap();
    std::fs::write(&spoilt, format!("-9999 -9999 -9999\n{points}")).unwrap();
    let pose = |file: &str| {
        let value: serde_json::Value =
            serde_json::from_str(&stdout(&congruent(&["align", file, &target, "--json"]))).unwrap();
        (value["verdict"].clone(), value["target_from_source"].clone())
    };
    assert_eq!(pose(&spoilt), pose(&clean));
    let inspected = congruent(&["inspect", &spoilt, "--json"]);
    let value: serde_json::Value = serde_json::from_str(&stdout(&inspected)).unwrap();
    assert_eq!(value["dropped_far"], 1);
}

#[test]
fn settings_that_leave_nothing_of_a_scan_are_refused() {
    for spoilt in ["noise=-1", "noise=nan", "keep-randomly=0", "keep-evenly=2", "holes=100", "strays=1e9"] {
        let output = congruent(&["evaluate", "none", "-o", "none-either", "--spoil", spoilt]);
        assert_eq!(output.status.code(), Some(2), "{spoilt}");
        assert!(stderr(&output).contains("--spoil"), "{}", stderr(&output));
    }
    let output = congruent(&["align", "a.ply", "b.ply", "--set", "sampling.budget.max-points=3"]);
    assert!(stderr(&output).contains("too few for a scan"), "{}", stderr(&output));
}

#[test]
fn a_folder_does_not_hide_a_preset() {
    let (folder, _) = demo();
    std::fs::create_dir(folder.path().join("paper")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_congruent"));
    let output = command.current_dir(&folder).args(["keypoints", "source.ply", "-c", "paper"]).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

#[test]
fn bad_files_end_in_a_message_with_code_2() {
    let (folder, _) = demo();
    let good = path(&folder, "target.ply");
    let write = |name: &str, bytes: &[u8]| -> PathBuf {
        let at = folder.path().join(name);
        std::fs::write(&at, bytes).unwrap();
        at
    };
    let head = |n: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        )
    };
    let whole = std::fs::read(&good).unwrap();
    for (file, expected) in [
        (folder.path().join("none.ply"), "none.ply"),
        (folder.path().to_path_buf(), "directory"),
        (write("empty.ply", b""), "empty"),
        (write("cut.ply", &whole[..whole.len() / 2]), "cut.ply"),
        (write("boast.ply", (head("4000000000") + "0 0 0\n").as_bytes()), "4000000000"),
        (write("absurd.ply", head("99999999999999999999999").as_bytes()), "absurd.ply"),
        (write("other.xyz", b"hello"), "PLY"),
        (write("two.ply", (head("2") + "0 0 0\n1 1 1\n").as_bytes()), "at least 3"),
        (write("same.ply", (head("4") + &"1 2 3\n".repeat(4)).as_bytes()), "1 distinct"),
        (write("nan.ply", (head("3") + &"nan 0 0\n".repeat(3)).as_bytes()), "0 distinct"),
        (write("word.ply", (head("3") + "0 0 zero\n").as_bytes()), "zero"),
    ] {
        for arguments in
            [vec!["align", file.to_str().unwrap(), &good, "--json"], vec!["inspect", file.to_str().unwrap()]]
        {
            let output = congruent(&arguments);
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{file:?}: {message}");
            assert!(
                stdout(&output).is_empty() && message.starts_with("error: ") && message.contains(expected),
                "{file:?}: {message}"
            );
        }
    }
}

#[test]
fn what_cannot_be_registered_exits_1_and_still_prints_json() {
    let folder = TempDir::new().unwrap();
    let plane: String = (0..3600).map(|i| format!("{} {} 0\n", i % 60, i / 60)).collect();
    let file = folder.path().join("plane.ply");
    let head = "ply\nformat ascii 1.0\nelement vertex 3600\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    std::fs::write(&file, head.to_owned() + &plane).unwrap();
    let file = file.to_str().unwrap();
    let (moved, page) = (path(&folder, "moved.ply"), path(&folder, "page.html"));
    let output =
        congruent(&["align", file, file, "--json", "-c", "paper", "--write-aligned", &moved, "--report", &page]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let value: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(value["verdict"], "failed");
    assert!(value["reason"].as_str().is_some_and(|reason| !reason.is_empty()));
    assert!(!Path::new(&moved).exists() && stderr(&output).contains("not written"));
    // A failure also gets a page.
    assert!(std::fs::read_to_string(&page).unwrap().contains("<strong>failed</strong>"));
}

#[test]
fn configurations_are_shown_and_checked() {
    let folder = TempDir::new().unwrap();
    let shown = congruent(&["config", "show", "paper"]);
    assert_eq!(shown.status.code(), Some(0));
    let file = path(&folder, "mine.toml");
    std::fs::write(&file, stdout(&shown)).unwrap();
    assert_eq!(congruent(&["config", "check", &file]).status.code(), Some(0));
    std::fs::write(&file, "[metric.mse]\nthresold = \"5pr\"\n").unwrap();
    let refused = congruent(&["config", "check", &file]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        stderr(&refused).contains("mine.toml:2:1") && stderr(&refused).contains("did you mean `threshold`?"),
        "{}",
        stderr(&refused)
    );
    let unknown = congruent(&["config", "show", "papper"]);
    assert!(
        unknown.status.code() == Some(2) && stderr(&unknown).contains("'paper'") | stderr(&unknown).contains("`paper`"),
        "{}",
        stderr(&unknown)
    );
}

#[test]
fn misspelt_flags_are_refused_with_code_2() {
    let output = congruent(&["align", "a.ply", "b.ply", "--jsn"]);
    assert!(output.status.code() == Some(2) && stderr(&output).contains("--json"), "{}", stderr(&output));
}

#[test]
fn a_demo_that_cannot_be_run_writes_nothing() {
    let folder = TempDir::new().unwrap();
    let place = path(&folder, "first");
    for wrong in [["-c", "nosuch.toml"], ["--seed", "9223372036854775808"], ["--set", "detector.harris.threshold=nan"]]
    {
        let output = congruent(&[["demo", &place].as_slice(), &wrong].concat());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(!std::path::Path::new(&place).exists(), "{wrong:?}");
    }
}

#[test]
fn a_check_refuses_what_a_run_would() {
    let folder = TempDir::new().unwrap();
    let file = path(&folder, "mine.toml");
    for (text, code) in [("[ranking.none]\n", 2), ("[ranking.none]\n[verdict.a-contrario]\n", 0)] {
        std::fs::write(&file, text).unwrap();
        let output = congruent(&["config", "check", &file]);
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
    }
}

#[test]
fn inspect_says_what_a_file_holds() {
    let folder = TempDir::new().unwrap();
    let file = path(&folder, "square.ply");
    let text = "ply\nformat ascii 1.0\nelement vertex 6\nproperty double x\nproperty double y\nproperty double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n2 2 0\nnan 0 0\n4 0 1 2 3\n";
    std::fs::write(&file, text).unwrap();
    let output = congruent(&["inspect", &file, "--json"]);
    let value: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((&value["points"], &value["triangles"]), (&4.into(), &2.into()));
    assert_eq!((&value["dropped_non_finite"], &value["dropped_duplicates"]), (&1.into(), &1.into()));
    assert_eq!((&value["resolution"], &value["normals"]), (&2.0.into(), &"from the mesh".into()));
}
