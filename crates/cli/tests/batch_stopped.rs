//! `congruent batch` is killed, interrupted, or finds the disk full: nothing is lost, and it can be continued.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_io::write_ply;
use congruent_simulation::pair::{PairOptions, figurine_pair};
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;

/// Six small scans of a figurine: five pairs of neighbours.
fn scans() -> TempDir {
    let folder = TempDir::new().unwrap();
    let look = |azimuth: f64| {
        let options = PairOptions { azimuth, view_angle: 30f64.to_radians(), pixels: 80, ..PairOptions::default() };
        let pair = figurine_pair(&options);
        [pair.source, pair.target]
    };
    let looks = [0.0f64, 60.0, 120.0].map(|degrees| look(degrees.to_radians()));
    for (i, scan) in looks.as_flattened().iter().enumerate() {
        write_ply(&folder.path().join(format!("view{i}.ply")), &scan.points, None, &[]).unwrap();
    }
    folder
}

fn batch(scans: &TempDir, out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_congruent"));
    command.arg("batch").arg(scans.path()).arg("-o").arg(out).args(["--sequential", "--threads", "1"]).args(more);
    command
}

/// The rows without their times, by id.
fn rows(folder: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(folder.join("results.jsonl")).unwrap();
    let row = |line: &str| {
        let mut row: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
        assert!(row["timings"].take()["total"].is_number());
        row
    };
    let mut rows: Vec<Value> = text.lines().map(row).collect();
    rows.sort_by_key(|row| row["id"].as_str().unwrap().to_owned());
    rows
}

/// The table without its last column, the time.
fn table(folder: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join("results.csv")).unwrap();
    text.lines().map(|line| line.rsplit_once(',').unwrap().0.to_owned()).collect()
}

/// Starts a command and waits until it has written a row.
fn begun(mut command: Command) -> (Child, BufReader<std::process::ChildStderr>) {
    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.starts_with("[1/") {
        line.clear();
        assert!(said.read_line(&mut line).unwrap() > 0, "it ended before the first row");
    }
    (child, said)
}

/// Checks that `--resume` after a stop registers only what is missing and gives the result of an undisturbed run.
fn check_goes_on(scans: &TempDir, out: &Path) {
    let whole = TempDir::new().unwrap();
    assert!(batch(scans, whole.path(), &[]).output().unwrap().status.success());
    let text = std::fs::read_to_string(out.join("results.jsonl")).unwrap();
    let kept = text.matches('\n').count();
    assert!((1..5).contains(&kept), "it was stopped in the middle: {kept} rows");
    let resumed = batch(scans, out, &["--resume"]).output().unwrap();
    let said = String::from_utf8(resumed.stderr).unwrap();
    assert!(resumed.status.success(), "{said}");
    assert!(said.contains(&format!("/{}]", 5 - kept)), "only what is missing is done: {said}");
    assert_eq!(rows(out), rows(whole.path()));
    assert_eq!(rows(out).len(), 5);
    assert_eq!(table(out), table(whole.path()));
}

#[test]
fn a_killed_batch_goes_on_to_the_table_of_an_undisturbed_one() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let (mut child, _said) = begun(batch(&scans, out.path(), &[]));
    child.kill().unwrap();
    assert_eq!(child.wait().unwrap().code(), None, "it was killed, it did not end");
    check_goes_on(&scans, out.path());
}

#[test]
fn ctrl_c_and_a_schedulers_signal_end_the_running_pair_and_say_how_to_go_on() {
    for signal in ["-INT", "-TERM"] {
        let (scans, out) = (scans(), TempDir::new().unwrap());
        let (mut child, mut said) = begun(batch(&scans, out.path(), &[]));
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let mut rest = String::new();
        while said.read_line(&mut rest).unwrap() > 0 {}
        assert_eq!(child.wait().unwrap().code(), Some(130), "{rest}");
        assert!(rest.contains("--resume"), "{rest}");
        assert_eq!(table(out.path()).len(), rows(out.path()).len() + 1, "the table has the rows so far");
        check_goes_on(&scans, out.path());
    }
}

#[test]
fn nobody_listening_is_no_reason_to_stop() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let (mut child, said) = begun(batch(&scans, out.path(), &[]));
    drop(said);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(rows(out.path()).len(), 5);
}

/// A limit on the size of files fails as a full disk does, and also cuts off a part of the last line.
#[test]
fn a_full_disk_is_said_and_the_rows_before_it_are_whole() {
    /// Bytes: enough for the settings and two or three rows.
    const LIMIT: u64 = 4096;
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let mut limited = Command::new("bash");
    let script = format!("trap '' XFSZ; ulimit -f {}; exec \"$@\"", LIMIT / 1024);
    let command = batch(&scans, out.path(), &[]);
    limited.args(["-c", &script, "bash"]).arg(command.get_program()).args(command.get_args());
    let output = limited.output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("results.jsonl: cannot be written; free some disk space") && said.contains("--resume"),
        "{said}"
    );
    let text = std::fs::read_to_string(out.path().join("results.jsonl")).unwrap();
    assert!(text.ends_with('\n') && text.len() as u64 <= LIMIT, "no half line stays");
    check_goes_on(&scans, out.path());
}
