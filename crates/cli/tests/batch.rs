//! `congruent batch` and `merge` as a user sees them: one broken scan among four good ones.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_geometry::to_rows;
use congruent_io::write_ply;
use congruent_simulation::pair::{PairOptions, figurine_pair};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// Four small scans of a figurine, and a truncated file.
fn scans() -> TempDir {
    let folder = TempDir::new().unwrap();
    let look = |azimuth: f64| {
        let options = PairOptions { azimuth, view_angle: 30f64.to_radians(), pixels: 100, ..PairOptions::default() };
        let pair = figurine_pair(&options);
        [pair.source, pair.target]
    };
    let looks = [look(0.0), look(60f64.to_radians())];
    for (i, scan) in looks.as_flattened().iter().enumerate() {
        write_ply(&folder.path().join(format!("view{}.ply", i + 8)), &scan.points, None, &[]).unwrap();
    }
    std::fs::write(folder.path().join("broken.ply"), "ply\nformat ascii 1.0\nelement vertex 9\n").unwrap();
    std::fs::write(folder.path().join("congruent.toml"), "seed = 11\n").unwrap();
    folder
}

fn congruent(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_congruent")).args(arguments).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn batch(input: &Path, output: &Path, more: &[&str]) -> Output {
    let places = [input.to_str().unwrap(), "-o", output.to_str().unwrap()];
    congruent(&[&["batch"], &places[..], more].concat())
}

/// The rows without their times.
fn rows(folder: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(folder.join("results.jsonl")).unwrap();
    let row = |line: &str| {
        let mut row: Value = serde_json::from_str(line).unwrap();
        assert!(row["timings"].take()["total"].is_number());
        row
    };
    text.lines().map(row).collect()
}

/// The table without its last column, the time.
fn table(folder: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join("results.csv")).unwrap();
    text.lines().map(|line| line.rsplit_once(',').unwrap().0.to_owned()).collect()
}

#[test]
fn every_pair_has_a_row_and_shards_and_threads_change_nothing() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let at = |name: &str| out.path().join(name);
    let whole = batch(scans.path(), &at("whole"), &["--threads", "4"]);
    assert_eq!(whole.status.code(), Some(1), "{}", stderr(&whole));
    assert!(stderr(&whole).contains("[10/10]") && stderr(&whole).contains("4 without a verdict"), "{}", stderr(&whole));
    let rows_of_whole = rows(&at("whole"));
    assert_eq!(rows_of_whole.len(), 10);
    for row in &rows_of_whole {
        if row["id"].as_str().unwrap().contains("broken") {
            assert!(row["status"] == "error" && row["error"].as_str().unwrap().contains("broken.ply: "), "{row}");
        } else {
            assert!(row["status"] == "done" && row["verdict"].is_string() && row["confidence"].is_number(), "{row}");
        }
    }
    let neighbours = rows_of_whole.iter().find(|row| row["id"] == "view9.ply--view8.ply").unwrap();
    assert_eq!(neighbours["verdict"], "ok");

    let plain = batch(scans.path(), &at("plain"), &["--threads", "1", "--memory", "1K"]);
    assert_eq!(plain.status.code(), Some(1), "{}", stderr(&plain));
    assert_eq!((rows(&at("plain")), table(&at("plain"))), (rows_of_whole.clone(), table(&at("whole"))));

    let parts = [("1/3", "1"), ("2/3", "4"), ("3/3", "2")].map(|(part, threads)| {
        let folder = at(&part.replace('/', "of"));
        batch(scans.path(), &folder, &["--shard", part, "--threads", threads]);
        folder.to_str().unwrap().to_owned()
    });
    let merge = |parts: &[&String], name: &str| {
        let parts: Vec<&str> = parts.iter().map(|part| part.as_str()).collect();
        congruent(&[&["merge", "-o", at(name).to_str().unwrap()], &parts[..]].concat())
    };
    let merged = merge(&[&parts[2], &parts[0], &parts[1]], "merged");
    assert_eq!(merged.status.code(), Some(1), "{}", stderr(&merged));
    assert_eq!(rows(&at("merged")), rows_of_whole);
    assert_eq!(table(&at("merged")), table(&at("whole")));
    for name in ["run.json", "configuration.toml"] {
        assert_eq!(std::fs::read(at("merged").join(name)).unwrap(), std::fs::read(at("whole").join(name)).unwrap());
    }
    for (some, expected) in [(&[&parts[0]][..], "4 of 10"), (&[&parts[0], &parts[1], &parts[0]], "is in two parts")] {
        let refused = merge(some, "refused");
        assert!(refused.status.code() == Some(2) && stderr(&refused).contains(expected), "{}", stderr(&refused));
        assert!(!at("refused").exists());
    }
}

#[test]
fn another_run_is_refused_and_a_cut_one_goes_on() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let out = out.path();
    let run = |more: &[&str]| batch(scans.path(), out, &[&["--sequential"], more].concat());
    assert_eq!(run(&[]).status.code(), Some(1));
    let before = (rows(out), table(out));
    assert_eq!(before.0.len(), 4);
    assert_eq!(before.0[3]["id"], "view9.ply--view8.ply");
    assert_eq!(before.0[0]["id"], "view10.ply--view9.ply");

    let again = run(&[]);
    assert!(again.status.code() == Some(2) && stderr(&again).contains("--resume"), "{}", stderr(&again));
    let other = run(&["--resume", "--seed", "12"]);
    assert!(other.status.code() == Some(2) && stderr(&other).contains("configuration"), "{}", stderr(&other));

    let rows_file = out.join("results.jsonl");
    let text = std::fs::read(&rows_file).unwrap();
    std::fs::write(&rows_file, &text[..text.len() / 2]).unwrap();
    let resumed = run(&["--resume"]);
    assert_eq!(resumed.status.code(), Some(1), "{}", stderr(&resumed));
    assert!(!stderr(&resumed).contains("/4]"), "rows that were there are not made again: {}", stderr(&resumed));
    assert_eq!((rows(out), table(out)), before);
}

#[test]
fn a_repaired_scan_has_its_pairs_done_and_the_others_stay_as_they_are() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let run = |more: &[&str]| batch(scans.path(), out.path(), &[&["--sequential"], more].concat());
    assert_eq!(run(&[]).status.code(), Some(1));
    let before = rows(out.path());
    std::fs::copy(scans.path().join("view9.ply"), scans.path().join("broken.ply")).unwrap();
    let resumed = run(&["--resume"]);
    assert_eq!(resumed.status.code(), Some(0), "{}", stderr(&resumed));
    for (was, is) in before.iter().zip(rows(out.path())) {
        let was_done = was["status"] == "done";
        assert!(is["status"] == "done" && (!was_done || is == *was), "{is}");
    }
    let changed = std::fs::copy(scans.path().join("view8.ply"), scans.path().join("view9.ply")).unwrap();
    let refused = run(&["--resume"]);
    assert!(changed > 0 && refused.status.code() == Some(2) && stderr(&refused).contains("has changed"));
}

/// A broken scan has one pair; as soon as it can be described, it has those with the scans most similar to it.
#[test]
fn a_repaired_scan_gets_the_pairs_that_are_like_it() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let run =
        |more: &[&str]| batch(scans.path(), out.path(), &[&["--pairs", "auto", "--neighbors", "2"], more].concat());
    assert_eq!(run(&[]).status.code(), Some(1));
    let before = rows(out.path());
    std::fs::copy(scans.path().join("view9.ply"), scans.path().join("broken.ply")).unwrap();
    let resumed = run(&["--resume"]);
    assert_eq!(resumed.status.code(), Some(0), "{}", stderr(&resumed));
    let after = rows(out.path());
    let of_repaired = after.iter().filter(|row| row["id"].as_str().unwrap().contains("broken")).count();
    assert!(of_repaired >= 2, "{after:?}");
    for row in before.iter().filter(|row| row["status"] == "done") {
        assert!(after.iter().find(|now| now["id"] == row["id"]).is_none_or(|now| now == row), "{row}");
    }
    assert!(before.iter().any(|row| row["status"] == "done" && after.contains(row)), "{}", stderr(&resumed));
    // The repaired scan is known from now on.
    std::fs::copy(scans.path().join("view8.ply"), scans.path().join("broken.ply")).unwrap();
    let refused = run(&["--resume"]);
    assert!(refused.status.code() == Some(2) && stderr(&refused).contains("has changed"), "{}", stderr(&refused));
}

#[test]
fn tables_name_pairs_and_the_written_table_is_one() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let pairs = scans.path().join("pairs.jsonl");
    let identity = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";
    let line = format!("{{\"source\":\"view9.ply\",\"target\":\"view9.ply\",\"id\":\"self\",\"truth\":{identity}}}\n");
    std::fs::write(&pairs, line).unwrap();
    let first = batch(&pairs, &out.path().join("first"), &[]);
    assert_eq!(first.status.code(), Some(0), "{}", stderr(&first));
    let row = &rows(&out.path().join("first"))[0];
    assert!(row["id"] == "self" && row["rotation_error_deg"].as_f64().unwrap() < 0.1, "{row}");
    std::fs::copy(out.path().join("first/results.csv"), scans.path().join("again.csv")).unwrap();
    let second = batch(&scans.path().join("again.csv"), &out.path().join("second"), &[]);
    assert_eq!(second.status.code(), Some(0), "{}", stderr(&second));
    let again = &rows(&out.path().join("second"))[0];
    assert_eq!((&again["target_from_source"], &again["seed"]), (&row["target_from_source"], &row["seed"]));
}

/// Rows that are there already, and parts of a run, belong to the table as it was.
#[test]
fn rows_of_another_table_are_neither_kept_nor_merged() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let at = |name: &str| out.path().join(name);
    let pairs = scans.path().join("pairs.jsonl");
    let write = |first: &str| {
        let first = format!("{{\"source\":\"view9.ply\",\"target\":\"view8.ply\",\"id\":\"p1\"{first}}}\n");
        std::fs::write(&pairs, first + "{\"source\":\"view11.ply\",\"target\":\"view10.ply\",\"id\":\"p2\"}\n")
            .unwrap();
    };
    let init = ",\"init\":[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]";
    write("");
    let options = ["-c", "paper", "--set", "estimator.ransac.iterations=1"];
    batch(&pairs, &at("one"), &[&options[..], &["--shard", "1/2"]].concat());
    write(init);
    let resumed = batch(&pairs, &at("one"), &[&options[..], &["--shard", "1/2", "--resume"]].concat());
    assert!(resumed.status.code() == Some(2) && stderr(&resumed).contains("other pairs"), "{}", stderr(&resumed));
    batch(&pairs, &at("two"), &[&options[..], &["--shard", "2/2"]].concat());
    let [one, two, all] = ["one", "two", "all"].map(|name| at(name).to_str().unwrap().to_owned());
    let merged = congruent(&["merge", &one, &two, "-o", &all]);
    assert!(merged.status.code() == Some(2) && stderr(&merged).contains("other pairs"), "{}", stderr(&merged));
}

/// One random sample finds nothing; a given pose competes with it and wins.
#[test]
fn an_initial_pose_in_the_table_is_used() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let options = PairOptions { view_angle: 30f64.to_radians(), pixels: 100, ..PairOptions::default() };
    let truth = to_rows(&figurine_pair(&options).target_from_source);
    let line = |id: &str, more: Value| {
        let mut line = serde_json::json!({ "source": "view8.ply", "target": "view9.ply", "id": id, "truth": truth });
        line.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        format!("{line}\n")
    };
    let table = line("searched", serde_json::json!({})) + &line("given", serde_json::json!({ "init": truth }));
    let pairs = scans.path().join("pairs.jsonl");
    std::fs::write(&pairs, table).unwrap();
    let ended = batch(&pairs, out.path(), &["-c", "paper", "--set", "estimator.ransac.iterations=1"]);
    let rows = rows(out.path());
    let error = |id: &str| {
        let row = rows.iter().find(|row| row["id"] == id).unwrap();
        row["rotation_error_deg"].as_f64().unwrap_or(f64::INFINITY)
    };
    assert!(error("given") < 1.0 && error("searched") > 5.0, "{rows:?}{}", stderr(&ended));
}

#[test]
fn a_data_set_is_compared_with_its_truth() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let toml = "name = 'set'\nscans = '.'\n[truth]\nformat = 'pose-list'\npath = 'truth.txt'\n";
    std::fs::write(scans.path().join("dataset.toml"), toml).unwrap();
    let truth = "view9.ply view9.ply 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n";
    std::fs::write(scans.path().join("truth.txt"), truth).unwrap();
    let output = batch(scans.path(), out.path(), &[]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let row = &rows(out.path())[0];
    assert!(row["id"] == "view9.ply--view9.ply" && row["rotation_error_deg"].as_f64().unwrap() < 0.1, "{row}");
}

/// The scans of one pair are the same; those of the other, moved far apart, share nothing.
#[test]
fn a_data_set_says_how_much_its_pairs_overlap_and_what_is_broken() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let toml = |scenes: &str, more: &str| {
        let truth = "[truth]\nformat = 'pose-list'\npath = '{scene}.txt'\n";
        let text = format!("name = 'set'\nscenes = [{scenes}]\nscans = '.'\n{more}{truth}");
        std::fs::write(scans.path().join("dataset.toml"), text).unwrap();
    };
    let motion = |x: &str| format!("1 0 0 {x} 0 1 0 0 0 0 1 0 0 0 0 1");
    let text = format!("view9.ply view9.ply {}\nview8.ply view8.ply {}\n", motion("0"), motion("1e4"));
    std::fs::write(scans.path().join("a.txt"), text).unwrap();
    let run = |name: &str, more: &[&str]| {
        let output = batch(scans.path(), &out.path().join(name), more);
        (output.status.code(), rows(&out.path().join(name)).len(), stderr(&output))
    };
    let quick = ["-c", "paper", "--set", "estimator.ransac.iterations=1"];
    toml("'a'", "[pairs]\nmin-overlap = 0.1\n");
    let (code, n_rows, said) = run("overlapping", &quick);
    assert_eq!((code, n_rows), (Some(0), 1), "{said}");
    let (code, n_rows, said) = run("chosen", &[&quick[..], &["--sequential"]].concat());
    assert_eq!((code, n_rows), (Some(0), 1), "both scans are there: {said}");
    toml("'a', 'gone'", "");
    let (code, n_rows, said) = run("broken", &quick);
    assert_eq!((code, n_rows), (Some(1), 2), "{said}");
    assert_eq!(said.matches("gone.txt: cannot be read").count(), 1, "{said}");
}

#[test]
fn corrupt_and_empty_scans_are_rows_and_a_directory_is_told() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    std::fs::write(scans.path().join("void.ply"), "").unwrap();
    std::fs::create_dir(scans.path().join("x.ply")).unwrap();
    std::fs::write(scans.path().join("notes.txt"), "no scan").unwrap();
    // The results are beside the scans and are not taken for scans.
    let output = batch(scans.path(), scans.path(), &["--sequential"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("x.ply: is a directory"), "{}", stderr(&output));
    let first = rows(scans.path());
    let error_of = |id: &str| {
        let row = first.iter().find(|row| row["id"] == id).unwrap_or_else(|| panic!("{id} is not in {first:?}"));
        row["error"].as_str().unwrap_or_default().to_owned()
    };
    assert_eq!(first.len(), 5);
    assert!(error_of("void.ply--view11.ply").contains("void.ply: is empty"));
    assert!(error_of("view8.ply--broken.ply").contains("broken.ply: "));
    assert_eq!(error_of("view9.ply--view8.ply"), "");
    batch(scans.path(), out.path(), &["--sequential"]);
    assert_eq!(rows(out.path()), first);
}

#[test]
fn what_cannot_be_done_is_said_before_anything_is_written() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let nowhere = out.path().join("nowhere");
    std::fs::write(scans.path().join("pairs.jsonl"), "").unwrap();
    for (input, more, expected) in [
        ("", &["--sequentail"][..], "--sequential"),
        ("", &["--neighbors", "3"], "--neighbors needs --pairs auto"),
        ("", &["--pairs", "auto", "--neighbors", "0"], "1.."),
        ("", &["--shard", "4/3"], "i from 1 to n"),
        ("", &["--memory", "lots"], "e.g. 500M or 4G"),
        ("", &["--data", "elsewhere"], "--data is for a dataset.toml"),
        ("", &["--set", "sed=1"], "seed"),
        ("pairs.jsonl", &[], "lists no pairs"),
        ("view8.ply", &[], "view8.ply: "),
        ("absent", &[], "absent: cannot be read"),
    ] {
        let output = batch(&scans.path().join(input), &nowhere, more);
        assert_eq!(output.status.code(), Some(2), "{more:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(expected), "`{expected}` is not in: {}", stderr(&output));
    }
    assert!(!nowhere.exists());
    let file = out.path().join("file");
    std::fs::write(&file, "").unwrap();
    let output = batch(scans.path(), &file.join("below"), &[]);
    assert!(output.status.code() == Some(2) && stderr(&output).contains("cannot be created"), "{}", stderr(&output));
}

#[test]
fn a_pair_over_its_time_is_a_row_and_alike_scans_are_paired() {
    let (scans, out) = (scans(), TempDir::new().unwrap());
    let output = batch(scans.path(), out.path(), &["--pairs", "auto", "--neighbors", "1", "--time-limit", "0.000001"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let rows = rows(out.path());
    assert!((3..=4).contains(&rows.len()), "{rows:?}");
    for row in rows {
        let expected = if row["id"].as_str().unwrap().contains("broken") { "error" } else { "timed-out" };
        assert_eq!(row["status"], expected);
    }
}

#[test]
fn config_show_explains_where_a_setting_comes_from() {
    let scans = scans();
    let folder = scans.path().to_str().unwrap();
    let output =
        congruent(&["config", "show", "paper", "--explain", "--folder", folder, "--set", "support.min-points=4"]);
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    let ends = |start: &str, end: &str| text.lines().any(|line| line.starts_with(start) && line.ends_with(end));
    assert!(
        ends("seed = 11", "congruent.toml") && ends("support.min-points = 4", "--set support.min-points=4"),
        "{text}"
    );
    assert!(ends("sampling.voxel-grid.leaf", "preset paper"), "{text}");
    let named = congruent(&["config", "show", "--explain", "-c", "paper"]);
    let as_shown = congruent(&["config", "show", "paper", "--explain"]);
    assert!(named.status.success() && named.stdout == as_shown.stdout, "{}", stderr(&named));
    let members = congruent(&["config", "show", "members", "--explain", "--set", "pool.poses=1"]);
    assert!(
        members.status.code() == Some(2) && stderr(&members).contains("leave out --explain"),
        "{}",
        stderr(&members)
    );
    let plain = congruent(&["config", "show", "--explain"]);
    assert!(String::from_utf8(plain.stdout).unwrap().lines().all(|line| line.ends_with("# default")));
}
