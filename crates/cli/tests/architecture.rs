//! The dependencies between the crates are those that ARCHITECTURE.md allows.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

const ARCHITECTURE: &str = include_str!("../../../ARCHITECTURE.md");
/// Only the program may depend on these.
const ONLY_CLI: &[&str] = &["clap", "ctrlc", "indicatif", "anyhow"];

/// Returns which crates each crate may use directly, according to the table.
fn table() -> BTreeMap<&'static str, Vec<&'static str>> {
    let (_, crates) = ARCHITECTURE.split_once("## Crates").expect("a section of crates");
    let (crates, _) = crates.split_once("\n## ").expect("a section after it");
    let row = |line: &'static str| {
        let cells: Vec<&str> = line.trim_matches('|').split(" | ").map(str::trim).collect();
        let name = cells[0].strip_prefix('`')?.strip_suffix('`')?;
        let uses = cells.last()?.split(", ").filter(|used| *used != "nothing of ours").collect();
        Some((name, uses))
    };
    crates.lines().filter(|line| line.starts_with("| `")).map(|line| row(line).expect(line)).collect()
}

/// Finds all crates that a crate may use, directly or through others.
fn all_used(by: &str, table: &BTreeMap<&'static str, Vec<&'static str>>, found: &mut BTreeSet<&'static str>) {
    for used in table.get(by).unwrap_or_else(|| panic!("`{by}` is not in the table of ARCHITECTURE.md")) {
        if found.insert(used) {
            all_used(used, table, found);
        }
    }
}

#[test]
fn crates_use_only_what_they_may() {
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml");
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1", "--manifest-path", manifest])
        .output()
        .unwrap();
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let (table, mut seen) = (table(), BTreeSet::new());
    for package in metadata["packages"].as_array().unwrap() {
        let name = package["name"]
            .as_str()
            .unwrap()
            .strip_prefix("congruent-")
            .expect("packages are called congruent-<folder>");
        let mut may_use = BTreeSet::new();
        all_used(name, &table, &mut may_use);
        seen.insert(name);
        // Tests may use what they like.
        let normal = package["dependencies"].as_array().unwrap().iter().filter(|d| d["kind"].is_null());
        for dependency in normal.map(|d| d["name"].as_str().unwrap()) {
            match dependency.strip_prefix("congruent-") {
                Some(ours) => assert!(may_use.contains(ours), "{name} may not use {ours}"),
                None => assert!(name == "cli" || !ONLY_CLI.contains(&dependency), "{name} may not use {dependency}"),
            }
        }
    }
    assert_eq!(seen, table.into_keys().collect(), "the table and the workspace have the same crates");
}
