//! Data sets for the tests of the trials.

use congruent_geometry::RigidTransform;
use congruent_io::{Dataset, TruePair};

pub(super) fn dataset(name: &str, pairs: Vec<TruePair>) -> Dataset {
    Dataset {
        name: name.to_owned(),
        pairs,
        warnings: Vec::new(),
        broken: Vec::new(),
        read_from: Vec::new(),
        min_overlap: 0.0,
    }
}

/// A pair of scans whose files have their names; the true pose is a shift along x.
pub(super) fn pair(source: &str, target: &str, x: f64) -> TruePair {
    TruePair {
        id: None,
        source: source.to_owned(),
        target: target.to_owned(),
        place: String::new(),
        source_file: source.into(),
        target_file: target.into(),
        overlap: None,
        target_from_source: RigidTransform::translation(x, 0.0, 0.0),
    }
}
