//! Exact nearest neighbours among rows of many dimensions.

use crate::leaves::Leaves;
use crate::products;
use crate::shortlist::squared_norms;
use congruent_descriptors::Features;

/// Maximum number of dimensions for which similar rows are found by boxes around them; with more, boxes exclude
/// nothing.
const MAX_BOXED: usize = 64;
/// Products of rows whose squared norms are larger than this may overflow.
const MODERATE_SQ: f32 = 1e30;

/// A row of the table and its distance to the query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Row of the table.
    pub row: u32,
    /// L2 distance, evaluated in `f64`.
    pub distance: f32,
}

/// Returns the `k` nearest rows of `table` for every row of `queries`, nearest first; equal distances are ordered by
/// row. Fewer than `k` if the table is smaller.
///
/// # Panics
/// If the rows of the two tables differ in length.
#[must_use]
pub fn nearest_k(queries: &Features, table: &Features, k: usize) -> Vec<Vec<Candidate>> {
    assert_eq!(queries.dim, table.dim, "descriptors of one kind");
    if k == 0 || table.is_empty() || queries.dim == 0 {
        return vec![Vec::new(); queries.len()];
    }
    let k = k.min(table.len());
    let [queries, table] = [queries, table].map(Normed::new);
    if queries.features.dim <= MAX_BOXED || !queries.are_moderate() || !table.are_moderate() {
        let (blocks, leaves) = rayon::join(|| Leaves::new(queries), || Leaves::new(table));
        return leaves.nearest_k(&blocks, k);
    }
    products::nearest_k(&queries, &table, k)
}

/// Rows with their squared norms.
pub(crate) struct Normed<'a> {
    pub(crate) features: &'a Features,
    pub(crate) norms: Vec<f32>,
}

impl<'a> Normed<'a> {
    fn new(features: &'a Features) -> Self {
        Normed { features, norms: squared_norms(features) }
    }

    /// Returns the squared norm of the longest row.
    pub(crate) fn largest_norm(&self) -> f32 {
        self.norms.iter().fold(0.0f32, |a, &b| a.max(b))
    }

    /// Returns whether products of rows cannot overflow; false if a value is not a number.
    fn are_moderate(&self) -> bool {
        self.norms.iter().all(|norm| *norm <= MODERATE_SQ)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shortlist::squared_distance;
    use congruent_geometry::random::Stream;

    fn random_features(n: usize, dim: usize, seed: u64) -> Features {
        let mut stream = Stream::new(seed, 0);
        Features { keypoints: (0..n as u32).collect(), dim, rows: (0..n * dim).map(|_| stream.unit() as f32).collect() }
    }

    fn brute_force(queries: &Features, table: &Features, k: usize) -> Vec<Vec<u32>> {
        (0..queries.len())
            .map(|q| {
                let mut all: Vec<(f64, u32)> =
                    (0..table.len()).map(|t| (squared_distance(queries.row(q), table.row(t)), t as u32)).collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                all.iter().take(k).map(|c| c.1).collect()
            })
            .collect()
    }

    #[test]
    fn any_size_of_values_and_any_count_will_do() {
        let (mut queries, mut table) = (random_features(30, 100, 1), random_features(40, 100, 2));
        let expected = nearest_k(&queries, &table, 2);
        assert_eq!(nearest_k(&queries, &table, usize::MAX)[0].len(), 40);
        for features in [&mut queries, &mut table] {
            features.rows.iter_mut().for_each(|v| *v *= 1e20);
        }
        let rows = |found: &[Vec<Candidate>]| found.iter().flatten().map(|c| c.row).collect::<Vec<_>>();
        assert_eq!(rows(&nearest_k(&queries, &table, 2)), rows(&expected));
    }

    #[test]
    fn agrees_with_brute_force() {
        for (n, m, dim, k) in [(70, 2500, 33, 2), (3, 5, 352, 2), (65, 64, 7, 5), (4, 1, 9, 3)] {
            let (queries, table) = (random_features(n, dim, 1), random_features(m, dim, 2));
            let found: Vec<Vec<u32>> =
                nearest_k(&queries, &table, k).iter().map(|c| c.iter().map(|c| c.row).collect()).collect();
            assert_eq!(found, brute_force(&queries, &table, k));
        }
    }

    #[test]
    fn rows_that_lie_on_few_dimensions_are_found_among_leaves() {
        // A curved sheet in 33 dimensions, with repeated rows; more leaves than need to be examined.
        let mut stream = Stream::new(5, 0);
        let row = |u: f64, v: f64| (0..33).map(move |i| ((u * f64::from(i)).sin() + (v * f64::from(i)).cos()) as f32);
        let mut table = Features { dim: 33, ..Features::default() };
        for i in 0..1500 {
            table.rows.extend(row(stream.unit(), stream.unit()));
            table.keypoints.push(i);
        }
        table.rows.extend_from_within(..33 * 100);
        table.keypoints.extend(1500..1600);
        let queries = Features { keypoints: (0..300).collect(), dim: 33, rows: table.rows[..33 * 300].to_vec() };
        let found: Vec<Vec<u32>> =
            nearest_k(&queries, &table, 3).iter().map(|c| c.iter().map(|c| c.row).collect()).collect();
        assert_eq!(found, brute_force(&queries, &table, 3));
        assert_eq!(found[7][..2], [7, 1507]);
    }

    #[test]
    fn what_is_no_number_is_never_found() {
        for dim in [5, 100] {
            let mut table = random_features(200, dim, 6);
            table.rows[3 * dim + 2] = f32::NAN;
            let mut queries = random_features(3, dim, 7);
            queries.rows[dim] = f32::NAN;
            let found = nearest_k(&queries, &table, 200);
            assert_eq!([found[0].len(), found[1].len(), found[2].len()], [199, 0, 199]);
        }
    }

    #[test]
    fn near_ties_are_settled_exactly_and_true_ties_by_row() {
        // Rows so similar that the product in `f32` cannot tell them apart.
        let dim = 352;
        let mut table = random_features(1, dim, 3);
        let first = table.rows.clone();
        for i in 1..50usize {
            let mut row = first.clone();
            row[i] += 1e-6 * (50 - i) as f32;
            table.rows.extend(row);
            table.keypoints.push(i as u32);
        }
        table.rows.extend_from_slice(&first);
        table.keypoints.push(50);
        let queries = Features { keypoints: vec![0], dim, rows: first };
        let found: Vec<u32> = nearest_k(&queries, &table, 5)[0].iter().map(|c| c.row).collect();
        assert_eq!(found, brute_force(&queries, &table, 5)[0]);
        assert_eq!(found[..2], [0, 50]);
    }

    #[test]
    fn empty_tables_find_nothing() {
        let (none, some) = (random_features(0, 8, 1), random_features(3, 8, 1));
        assert!(nearest_k(&none, &some, 2).is_empty());
        assert_eq!(nearest_k(&some, &none, 2), vec![Vec::new(); 3]);
    }
}
