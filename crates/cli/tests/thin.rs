//! `--thin`: files of which fewer points are wanted than they hold.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_io::write_ply;
use congruent_simulation::pair::{PairOptions, figurine_pair};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// A dense pair in `scans`: some 15 000 points each, half a unit apart.
fn scans() -> TempDir {
    let folder = TempDir::new().unwrap();
    let pair = figurine_pair(&PairOptions { pixels: 200, ..PairOptions::default() });
    std::fs::create_dir(folder.path().join("scans")).unwrap();
    for (name, scan) in [("source", pair.source), ("target", pair.target)] {
        write_ply(&folder.path().join("scans").join(name).with_extension("ply"), &scan.points, None, &[]).unwrap();
    }
    folder
}

fn congruent(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_congruent")).current_dir(folder).args(line.split(' ')).output().unwrap()
}

/// The JSON object that a command prints.
fn value(folder: &Path, line: &str) -> Value {
    serde_json::from_slice(&congruent(folder, line).stdout).unwrap()
}

#[test]
fn a_pair_that_is_thinned_while_it_is_read_is_the_pair_of_thinned_files() {
    let folder = scans();
    let at = folder.path();
    let whole = value(at, "align scans/source.ply scans/target.ply --json");
    let on_the_way = value(at, "align scans/source.ply scans/target.ply --thin 1.5u --json");
    let points = |value: &Value| value["counts"]["points"][0].as_u64().unwrap();
    assert!(points(&on_the_way) < points(&whole) / 2, "{on_the_way}");
    for name in ["source", "target"] {
        let output = congruent(at, &format!("convert scans/{name}.ply {name}.ply --thin 1.5u"));
        assert_eq!(output.status.code(), Some(0), "{output:?}");
    }
    let from_files = value(at, "align source.ply target.ply --json");
    let pose = "target_from_source";
    assert_eq!((&on_the_way["verdict"], &on_the_way[pose]), (&from_files["verdict"], &from_files[pose]));
    assert_eq!(on_the_way["verdict"], "ok");

    std::fs::write(at.join("identity.txt"), "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n").unwrap();
    let refined = |line: &str| value(at, &format!("refine {line} --init identity.txt --json"))[pose].clone();
    let thinned = refined("scans/source.ply scans/target.ply --thin 1.5u");
    assert!(thinned.is_array() && thinned == refined("source.ply target.ply"), "{thinned}");
}

#[test]
fn a_batch_is_resumed_only_with_its_thinning() {
    let folder = scans();
    let batch = |more: &str| {
        let output = congruent(folder.path(), &format!("batch scans -o out {more}"));
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let pose = || {
        let text = std::fs::read_to_string(folder.path().join("out/results.jsonl")).unwrap();
        let row: Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
        row["target_from_source"].clone()
    };
    assert_eq!(batch("--thin 1.5u").0, Some(0));
    let thinned = pose();
    assert_eq!((batch("--thin 1.5u --resume").0, pose()), (Some(0), thinned.clone()));
    let (code, said) = batch("--resume");
    assert!(code == Some(2) && said.contains("--thin") && pose() == thinned, "{said}");
}

#[test]
fn the_side_of_a_cell_is_a_length_of_the_file() {
    let folder = scans();
    for (length, expected) in [("2pr", "data units"), ("0u", "above zero"), ("1", "as in 0.6u")] {
        let output = congruent(folder.path(), &format!("convert scans/source.ply new.ply --thin {length}"));
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(expected), "{said}");
    }
}
