//! Pairs of a data set: those that it lists, as provided, moved and mirrored, and those that it does not list.

use super::{Objects, Scene, SceneMaker, Trial};
use crate::fingerprint::fingerprint;
use anyhow::Result;
use congruent_evaluation::calibration::Origin;
use congruent_geometry::random::Stream;
use congruent_geometry::{RigidTransform, to_rows};
use congruent_io::{Dataset, TruePair, read_scan};
use congruent_pipeline::Pair;
use congruent_simulation::nuisances::moved;
use nalgebra::{Translation3, Vector3};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;

/// Scans are moved along each axis by at most this many times their largest coordinate.
const REACH: f64 = 5.0;

/// Returns all pairs of a data set whose truth is known.
pub(super) fn trials<'a>(dataset: &'a Dataset, objects: &Objects<'a>) -> Vec<Trial<'a>> {
    let groups = |pair: &TruePair| vec![objects.shown_in(&pair.source_file)];
    let listed = dataset.pairs.iter().flat_map(|pair| {
        let trial = |origin, scene| Trial { id: id(dataset, pair, origin), groups: groups(pair), origin, scene };
        let as_it_came: SceneMaker<'_> = Box::new(|| scene(pair));
        let by_itself = format!("{}/{}", dataset.name, pair.source);
        let each_moved: SceneMaker<'_> = Box::new(move || Ok(each_moved(scene(pair)?, &by_itself)));
        let in_a_mirror: SceneMaker<'_> = Box::new(|| scene(pair).map(mirrored));
        [trial(Origin::Listed, as_it_came), trial(Origin::Moved, each_moved), trial(Origin::Mirrored, in_a_mirror)]
    });
    let unlisted = unlisted(dataset).into_iter().map(|pair| {
        let (id, groups) = (id(dataset, &pair, Origin::Unlisted), groups(&pair));
        Trial { id, groups, origin: Origin::Unlisted, scene: Box::new(move || scene(&pair)) }
    });
    listed.chain(unlisted).collect()
}

/// Returns the name of a trial, with a fingerprint of the ground truth if it is judged by that.
fn id(dataset: &Dataset, pair: &TruePair, origin: Origin) -> String {
    let kind = format!("{origin:?}").to_lowercase();
    let name = format!("{kind}/{}/{}--{}", dataset.name, pair.source, pair.target);
    match origin {
        Origin::Mirrored => name,
        _ => format!("{name}/{}", fingerprint(&[&format!("{:?}", to_rows(&pair.target_from_source))])),
    }
}

fn scene(pair: &TruePair) -> Result<Scene> {
    let scans = Pair { source: read_scan(&pair.source_file)?, target: read_scan(&pair.target_file)? };
    Ok(Scene { scans, target_from_source: Some(pair.target_from_source) })
}

/// Moves each scan by a random motion of its own and discards its viewpoint.
fn each_moved(scene: Scene, name: &str) -> Scene {
    let mut stream = Stream::new(name.bytes().fold(0, |hash, byte| hash * 31 % 1_000_003 + u64::from(byte)), 0);
    let mut motion = |size: f64| {
        let shift = Vector3::from_fn(|_, _| stream.between(-REACH, REACH) * size);
        RigidTransform::from_parts(Translation3::from(shift), stream.rotation())
    };
    let size = |scan: &congruent_geometry::RawScan| scan.points.iter().flatten().fold(0.0, |a: f64, v| a.max(v.abs()));
    let motions = Pair { source: motion(size(&scene.scans.source)), target: motion(size(&scene.scans.target)) };
    let mut scans = Pair {
        source: moved(&scene.scans.source, &motions.source),
        target: moved(&scene.scans.target, &motions.target),
    };
    scans.source.viewpoint = None;
    scans.target.viewpoint = None;
    let truth = scene.target_from_source.map(|truth| motions.target * truth * motions.source.inverse());
    Scene { scans, target_from_source: truth }
}

/// Mirrors the source along one axis, as in a file whose axes are exchanged.
fn mirrored(mut scene: Scene) -> Scene {
    let source = &mut scene.scans.source;
    source.points.edited().iter_mut().for_each(|p| p[0] = -p[0]);
    source.normals.iter_mut().flatten().for_each(|n| n[0] = -n[0]);
    // Mirroring turns counter-clockwise into clockwise.
    source.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    source.viewpoint = source.viewpoint.map(|[x, y, z]| [-x, y, z]);
    Scene { target_from_source: None, ..scene }
}

/// Returns the pairs of scans that the data set does not list but whose truth follows from pairs that it lists.
fn unlisted(dataset: &Dataset) -> Vec<TruePair> {
    let mut files: BTreeMap<&str, &Path> = BTreeMap::new();
    let mut steps: BTreeMap<&str, Vec<(&str, RigidTransform)>> = BTreeMap::new();
    let mut known = BTreeSet::new();
    for pair in &dataset.pairs {
        let (source, target) = (pair.source.as_str(), pair.target.as_str());
        files.extend([(source, pair.source_file.as_path()), (target, pair.target_file.as_path())]);
        steps.entry(source).or_default().push((target, pair.target_from_source));
        steps.entry(target).or_default().push((source, pair.target_from_source.inverse()));
        known.extend([(source, target), (target, source)]);
    }
    let mut found = Vec::new();
    for (&source, &source_file) in &files {
        for (target, target_from_source) in reached(source, &steps) {
            if source > target && !known.contains(&(source, target)) {
                found.push(TruePair {
                    id: None,
                    source: source.to_owned(),
                    target: target.to_owned(),
                    place: "other pairs".to_owned(),
                    source_file: source_file.to_owned(),
                    target_file: files[target].to_owned(),
                    overlap: None,
                    target_from_source,
                });
            }
        }
    }
    found
}

/// Returns all scans to which a chain of listed poses leads, with the pose by the fewest steps.
fn reached<'a>(
    start: &'a str,
    steps: &BTreeMap<&'a str, Vec<(&'a str, RigidTransform)>>,
) -> BTreeMap<&'a str, RigidTransform> {
    let mut reached = BTreeMap::from([(start, RigidTransform::identity())]);
    let mut open = VecDeque::from([start]);
    while let Some(here) = open.pop_front() {
        let here_from_start = reached[here];
        for (there, there_from_here) in &steps[here] {
            if !reached.contains_key(there) {
                reached.insert(there, there_from_here * here_from_start);
                open.push_back(there);
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::testing::{dataset, pair};

    #[test]
    fn a_corrected_truth_makes_another_trial_of_what_it_judges() {
        let ids = |x: f64| -> Vec<String> {
            let set = dataset("set", vec![pair("b", "a", x), pair("c", "b", 10.0)]);
            trials(&set, &Objects::of(std::slice::from_ref(&set), &[])).into_iter().map(|trial| trial.id).collect()
        };
        let (first, same, corrected) = (ids(1.0), ids(1.0), ids(1.001));
        assert_eq!(first, same);
        for (old, new) in first.iter().zip(&corrected) {
            let depends = !old.starts_with("mirrored/") && !old.contains("c--b");
            assert_eq!(old != new, depends, "{old} and {new}");
        }
        assert!(first.len() == 7 && first[6].starts_with("unlisted/set/c--a/"), "{first:?}");
    }

    #[test]
    fn truths_are_chained_and_what_is_listed_or_apart_is_not_made_up() {
        let pairs = vec![pair("b", "a", 1.0), pair("c", "b", 10.0), pair("d", "c", 100.0), pair("y", "x", 5.0)];
        let found: Vec<(String, String, f64)> = unlisted(&dataset("set", pairs))
            .into_iter()
            .map(|pair| (pair.source, pair.target, pair.target_from_source.translation.vector.x))
            .collect();
        let expected = [("c", "a", 11.0), ("d", "a", 111.0), ("d", "b", 110.0)];
        assert_eq!(found, expected.map(|(s, t, x)| (s.to_owned(), t.to_owned(), x)));
    }
}
