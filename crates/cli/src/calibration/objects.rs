//! What the scans of data sets show: scans connected by a chain of listed pairs show the same object or scene.

use crate::args::Alike;
use congruent_io::Dataset;
use std::collections::BTreeMap;
use std::path::Path;

/// The name of what each scan shows, by its file.
pub(super) struct Objects<'a>(BTreeMap<&'a Path, String>);

impl<'a> Objects<'a> {
    /// Data sets that are alike show the same object.
    pub(super) fn of(datasets: &'a [Dataset], alike: &[Alike]) -> Objects<'a> {
        let mut objects = BTreeMap::new();
        for dataset in datasets {
            let first = first_of_each(dataset);
            let shared = alike.iter().find(|object| object.includes(&dataset.name));
            let name = |file: &Path| match shared {
                Some(object) => object.names().join("+"),
                None => format!("{}/{}", dataset.name, file.file_name().unwrap_or_default().to_string_lossy()),
            };
            objects.extend(first.into_iter().map(|(file, first)| (file, name(first))));
        }
        Objects(objects)
    }

    /// Returns what the scan in a file of the data sets shows.
    pub(super) fn shown_in(&self, file: &Path) -> String {
        self.0.get(file).cloned().unwrap_or_else(|| file.display().to_string())
    }
}

/// Returns, for each scan, the first of all scans connected with it.
fn first_of_each(dataset: &Dataset) -> BTreeMap<&Path, &Path> {
    let mut first: BTreeMap<&Path, &Path> = BTreeMap::new();
    for pair in &dataset.pairs {
        let ends = [pair.source_file.as_path(), pair.target_file.as_path()];
        let [a, b] = ends.map(|file| *first.entry(file).or_insert(file));
        let (kept, gone) = (a.min(b), a.max(b));
        first.values_mut().filter(|of| **of == gone).for_each(|of| *of = kept);
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::testing::{dataset, pair};

    fn of_names(name: &str, pairs: &[[&str; 2]]) -> Dataset {
        dataset(name, pairs.iter().map(|[source, target]| pair(source, target, 0.0)).collect())
    }

    #[test]
    fn chains_of_pairs_are_one_object_and_alike_sets_are_one() {
        let sets = [
            of_names("rooms", &[["b", "a"], ["d", "c"], ["c", "e"], ["e", "f"]]),
            of_names("x", &[["p", "q"]]),
            of_names("y", &[["r", "s"]]),
            of_names("v", &[["t", "u"]]),
            of_names("w", &[["v", "w"]]),
        ];
        let alike: Vec<Alike> = ["x,y", "v,w"].map(|names| names.parse::<Alike>().unwrap()).to_vec();
        let objects = Objects::of(&sets, &alike);
        let shown = |files: [&str; 4]| files.map(|file| objects.shown_in(Path::new(file)));
        assert_eq!(shown(["a", "b", "c", "d"]), ["rooms/a", "rooms/a", "rooms/c", "rooms/c"]);
        assert_eq!(shown(["e", "f", "p", "q"]), ["rooms/c", "rooms/c", "x+y", "x+y"]);
        assert_eq!(shown(["r", "s", "t", "w"]), ["x+y", "x+y", "v+w", "v+w"]);
    }
}
