//! A pool of poses that are substantially different.

use crate::Hypothesis;
use congruent_geometry::{Point, RigidTransform, wide};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

type Cell = [i64; 3];
/// Positions to which a pose moves the probes.
type Places = [Vector3<f64>; PROBES];

/// Number of poses compared in parallel with those kept before them: this many at first, then twice as many each time
/// up to the second number.
const FIRST_TOGETHER: usize = 256;
const MOST_TOGETHER: usize = 2048;
/// Minimum number of poses that one thread compares at a time.
const COMPARED_AT_A_TIME: usize = 32;

/// Number of points by which poses are compared.
const PROBES: usize = 8;

/// Distinguishes poses by how far apart they put a few points of the source.
#[derive(Clone, Debug)]
pub struct Distinctness {
    probes: [Point3<f64>; PROBES],
    /// Poses with a smaller mean displacement of the probes are the same.
    min_displacement: f64,
}

impl Distinctness {
    /// Creates the comparison; the probes are spread evenly over the order of `points`.
    #[must_use]
    pub fn new(points: &[Point], min_displacement: f64) -> Self {
        let probe =
            |i: usize| points.get(i * points.len() / PROBES).map_or(Point3::origin(), |p| Point3::from(wide(*p)));
        Distinctness { probes: std::array::from_fn(probe), min_displacement }
    }

    /// Returns the best of each group of similar poses, at most `keep`. The hypotheses must be ranked, and stay so.
    #[must_use]
    pub fn distinct(&self, ranked: &[Hypothesis], keep: usize) -> Vec<Hypothesis> {
        let kept = self.positions(ranked, |hypothesis| &hypothesis.target_from_source, keep);
        kept.into_iter().map(|position| ranked[position]).collect()
    }

    /// Returns the positions, ascending, of the best of each group of items that have a pose.
    pub(crate) fn positions<T: Sync>(
        &self,
        ranked: &[T],
        pose: impl Fn(&T) -> &RigidTransform + Sync,
        keep: usize,
    ) -> Vec<usize> {
        let mut kept = Kept { distinctness: self, all: Vec::new(), cells: FxHashMap::default() };
        let (mut start, mut together) = (0, FIRST_TOGETHER);
        while start < ranked.len() && kept.all.len() < keep {
            let end = ranked.len().min(start + together);
            let new = |position: usize| {
                let places = self.places(pose(&ranked[position]));
                kept.differs(&places, 0).then_some((position, places))
            };
            let range = (start..end).into_par_iter().with_min_len(COMPARED_AT_A_TIME);
            let survivors: Vec<(usize, Places)> = range.filter_map(new).collect();
            // Most are gone; the others are compared with each other.
            let before = kept.all.len();
            for (position, places) in survivors {
                if kept.all.len() < keep && kept.differs(&places, before) {
                    kept.add(position, places);
                }
            }
            (start, together) = (end, MOST_TOGETHER.min(2 * together));
        }
        kept.all.into_iter().map(|(position, _)| position).collect()
    }

    /// Returns where the centroid of the probes goes, in cells twice as wide as poses must be apart. The centroids of
    /// similar poses are no farther apart than their probes are on average: half a cell.
    fn place(&self, places: &Places) -> [f64; 3] {
        let middle = places.iter().sum::<Vector3<f64>>() / PROBES as f64;
        let side = if self.min_displacement > 0.0 { 2.0 * self.min_displacement } else { 1.0 };
        std::array::from_fn(|axis| middle[axis] / side)
    }

    fn places(&self, pose: &RigidTransform) -> Places {
        self.probes.map(|p| (pose * p).coords)
    }

    fn same(&self, a: &Places, b: &Places) -> bool {
        let limit = self.min_displacement * PROBES as f64;
        // A sum of lengths is at least its first term: most pairs are settled by one probe.
        let mut sum = 0.0;
        for (a, b) in a.iter().zip(b) {
            sum += (a - b).norm();
            if sum >= limit {
                return false;
            }
        }
        true
    }
}

/// Poses that differ from each other, with their positions.
struct Kept<'a> {
    distinctness: &'a Distinctness,
    all: Vec<(usize, Places)>,
    /// Kept poses, by each cell in which the centroid of the probes of a similar pose may be.
    cells: FxHashMap<Cell, Vec<usize>>,
}

impl Kept<'_> {
    /// Returns whether a pose differs from all that were kept; those before `first` are ignored.
    fn differs(&self, places: &Places, first: usize) -> bool {
        let cell = self.distinctness.place(places).map(cell);
        let mut near = self.cells.get(&cell).into_iter().flatten();
        !near.any(|&other| other >= first && self.distinctness.same(&self.all[other].1, places))
    }

    fn add(&mut self, position: usize, places: Places) {
        for cell in around(&self.distinctness.place(&places)) {
            self.cells.entry(cell).or_default().push(self.all.len());
        }
        self.all.push((position, places));
    }
}

fn cell(place: f64) -> i64 {
    place.floor() as i64
}

/// Returns the eight cells that hold everything within half a cell of a position.
fn around(place: &[f64; 3]) -> impl Iterator<Item = Cell> + use<> {
    let first = place.map(|v| cell(v - 0.5));
    (0..8).map(move |corner| std::array::from_fn(|axis| first[axis].saturating_add(corner >> axis & 1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;
    use congruent_metrics::Score;
    use nalgebra::{Translation3, UnitQuaternion};

    #[test]
    fn the_best_of_like_poses_stays() {
        let points: Vec<Point> = (0..100).map(|i| [i as f32, 0.0, 0.0]).collect();
        let at = |x: f64, trial: u64| Hypothesis {
            target_from_source: RigidTransform::translation(x, 0.0, 0.0),
            score: Score::new(-(trial as f64)),
            trial,
        };
        let ranked = [at(0.0, 0), at(3.0, 1), at(7.0, 2), at(6.5, 3), at(-9.0, 4)];
        let trials =
            |keep| Distinctness::new(&points, 5.0).distinct(&ranked, keep).iter().map(|h| h.trial).collect::<Vec<_>>();
        assert_eq!(trials(9), [0, 2, 4]);
        assert_eq!(trials(2), [0, 2]);
    }
    #[test]
    fn looking_around_misses_no_like_pose() {
        let points: Vec<Point> = (0..40).map(|i| [i as f32, (i % 7) as f32, (i % 3) as f32]).collect();
        let pool = Distinctness::new(&points, 5.0);
        let ranked: Vec<Hypothesis> = (0..600u64)
            .map(|trial| {
                let mut stream = Stream::new(8, trial);
                let turn = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| stream.between(-0.2, 0.2)));
                let shift = Translation3::from(Vector3::from_fn(|_, _| stream.between(-9.0, 9.0)));
                Hypothesis {
                    target_from_source: RigidTransform::from_parts(shift, turn),
                    score: Score::new(-(trial as f64)),
                    trial,
                }
            })
            .collect();
        let mut expected: Vec<&Hypothesis> = Vec::new();
        for hypothesis in &ranked {
            let places = pool.places(&hypothesis.target_from_source);
            if expected.iter().all(|other| !pool.same(&pool.places(&other.target_from_source), &places)) {
                expected.push(hypothesis);
            }
        }
        let found = pool.distinct(&ranked, usize::MAX);
        assert!(found.len() > 50 && found.len() < 500);
        assert!(found.iter().map(|h| h.trial).eq(expected.iter().map(|h| h.trial)));
    }
}
