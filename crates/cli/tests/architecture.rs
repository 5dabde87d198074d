//! The edges between the crates are those that ARCHITECTURE.md allows.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

const ANYTHING: &[&str] = &[
    "geometry",
    "io",
    "keypoints",
    "descriptors",
    "matching",
    "metrics",
    "estimators",
    "refinement",
    "pipeline",
    "simulation",
    "evaluation",
    "multiway",
    "report",
];

/// What each crate may use.
const ALLOWED: &[(&str, &[&str])] = &[
    ("geometry", &[]),
    ("io", &["geometry"]),
    ("keypoints", &["geometry"]),
    ("descriptors", &["geometry"]),
    ("matching", &["geometry", "descriptors"]),
    ("metrics", &["geometry"]),
    ("estimators", &["geometry", "metrics"]),
    ("refinement", &["geometry"]),
    ("pipeline", &["geometry", "keypoints", "descriptors", "matching", "metrics", "estimators", "refinement"]),
    ("simulation", &["geometry"]),
    ("multiway", &["geometry"]),
    (
        "evaluation",
        &[
            "geometry",
            "keypoints",
            "descriptors",
            "matching",
            "metrics",
            "estimators",
            "refinement",
            "pipeline",
            "simulation",
        ],
    ),
    (
        "report",
        &[
            "geometry",
            "keypoints",
            "descriptors",
            "matching",
            "metrics",
            "estimators",
            "refinement",
            "pipeline",
            "simulation",
            "evaluation",
        ],
    ),
    ("cli", ANYTHING),
];

/// Only the program may know these.
const ONLY_CLI: &[&str] = &["clap", "indicatif", "anyhow"];

#[test]
fn crates_use_only_what_they_may() {
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml");
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1", "--manifest-path", manifest])
        .output()
        .unwrap();
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let allowed: BTreeMap<&str, BTreeSet<&str>> =
        ALLOWED.iter().map(|(name, uses)| (*name, uses.iter().copied().collect())).collect();
    let mut seen = BTreeSet::new();
    for package in metadata["packages"].as_array().unwrap() {
        let name = package["name"]
            .as_str()
            .unwrap()
            .strip_prefix("congruent-")
            .expect("packages are called congruent-<folder>");
        let may_use = allowed.get(name).unwrap_or_else(|| panic!("{name} is not in the table"));
        seen.insert(name.to_owned());
        // Tests may use what they like.
        let normal = package["dependencies"].as_array().unwrap().iter().filter(|d| d["kind"].is_null());
        for dependency in normal.map(|d| d["name"].as_str().unwrap()) {
            match dependency.strip_prefix("congruent-") {
                Some(ours) => assert!(may_use.contains(ours), "{name} may not use {ours}"),
                None => assert!(name == "cli" || !ONLY_CLI.contains(&dependency), "{name} may not use {dependency}"),
            }
        }
    }
    assert_eq!(seen.len(), ALLOWED.len(), "a crate of the table is missing");
}
