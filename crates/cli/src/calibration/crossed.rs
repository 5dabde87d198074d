//! Scans of different data sets, scaled to the same resolution so that size does not distinguish them.

use super::{Objects, Scene, Trial};
use crate::args::Alike;
use anyhow::{Context, Result};
use congruent_evaluation::calibration::Origin;
use congruent_geometry::random::Stream;
use congruent_geometry::{RawScan, Scan, resolution_sampled};
use congruent_io::{Dataset, read_scan};
use congruent_pipeline::Pair;
use congruent_simulation::nuisances::scaled;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Draws per wanted pair, after which no further pairs are looked for.
const MAX_DRAWS: usize = 50;
/// Number of points at which a resolution is measured.
const MEASURED_AT: usize = 4000;

/// Returns `n` pairs, or fewer if there are not as many. Data sets that are alike are not crossed with each other.
pub(super) fn trials<'a>(
    datasets: &'a [Dataset],
    objects: &Objects<'a>,
    alike: &[Alike],
    n: usize,
    seed: u64,
) -> Vec<Trial<'a>> {
    let scans: Vec<(&str, Vec<&'a Path>)> = datasets.iter().map(|d| (d.name.as_str(), scans_of(d))).collect();
    let are_alike = |a: &str, b: &str| alike.iter().any(|object| object.includes(a) && object.includes(b));
    let mut stream = Stream::new(seed, 0);
    let mut chosen = BTreeSet::new();
    for _ in 0..n * MAX_DRAWS {
        let mut draw = || {
            let dataset = stream.below(scans.len().max(1) as u32) as usize;
            scans
                .get(dataset)
                .filter(|(_, files)| !files.is_empty())
                .map(|(name, files)| (*name, dataset, files[stream.below(files.len() as u32) as usize]))
        };
        let (Some(source), Some(target)) = (draw(), draw()) else { break };
        if chosen.len() < n && source.1 != target.1 && !are_alike(source.0, target.0) {
            chosen.insert(((source.0, source.2), (target.0, target.2)));
        }
    }
    chosen.into_iter().map(|(source, target)| crossed(source, target, objects)).collect()
}

fn crossed<'a>(source: (&str, &'a Path), target: (&str, &'a Path), objects: &Objects<'_>) -> Trial<'a> {
    let name = |(dataset, file): (&str, &Path)| {
        format!("{dataset}/{}", file.file_name().unwrap_or_default().to_string_lossy())
    };
    let id = format!("crossed/{}--{}", name(source), name(target));
    let (source, target) = (source.1, target.1);
    let groups = vec![objects.shown_in(source), objects.shown_in(target)];
    Trial { id, groups, origin: Origin::Crossed, scene: Box::new(move || scene(source, target)) }
}

fn scene(source: &Path, target: &Path) -> Result<Scene> {
    let (source_scan, target_scan) = (read_scan(source)?, read_scan(target)?);
    let factor = resolution_of(&target_scan, target)? / resolution_of(&source_scan, source)?;
    let mut source_scan = scaled(&source_scan, factor);
    source_scan.viewpoint = None;
    Ok(Scene { scans: Pair { source: source_scan, target: target_scan }, target_from_source: None })
}

fn resolution_of(raw: &RawScan, path: &Path) -> Result<f64> {
    let scan = Scan::new(raw).with_context(|| path.display().to_string())?;
    let measured = resolution_sampled(scan.points(), MEASURED_AT);
    Ok(measured.with_context(|| format!("{}: all points coincide", path.display()))?.mean)
}

fn scans_of(dataset: &Dataset) -> Vec<&Path> {
    let files = dataset.pairs.iter().flat_map(|pair| [&pair.source_file, &pair.target_file]);
    files.collect::<BTreeSet<&PathBuf>>().into_iter().map(PathBuf::as_path).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::testing::{dataset, pair};
    use congruent_io::TruePair;

    fn of_two_files(name: &str) -> Dataset {
        let [source_file, target_file] = ["source", "target"].map(|scan| format!("{name}/{scan}").into());
        dataset(name, vec![TruePair { source_file, target_file, ..pair("source", "target", 0.0) }])
    }

    #[test]
    fn only_scans_of_different_objects_are_crossed() {
        let datasets = ["a", "b", "c", "d"].map(of_two_files);
        let alike: Vec<Alike> = ["a,b", "c,d"].map(|names| names.parse::<Alike>().unwrap()).to_vec();
        let trials = trials(&datasets, &Objects::of(&datasets, &alike), &alike, 40, 0);
        let has = |a: &str, b: &str| trials.iter().any(|trial| trial.id.contains(&format!("/{a}/source--{b}/target")));
        assert!(has("a", "c") && has("a", "d") && has("d", "b"));
        assert!(!has("a", "a") && !has("a", "b") && !has("b", "a") && !has("c", "d") && !has("d", "c"));
    }
}
