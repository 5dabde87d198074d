//! The nearest other point of a few points of a large cloud, without an index of the whole cloud.

use super::ordered::distance_sq;
use crate::bounds::bounds;
use crate::{Neighbor, NeighborIndex, OrderedPoints, Point};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Number of points from which the distance between neighbours is estimated, and the stride at which they are queried.
const GUESSED_FROM: usize = 2000;
const GUESSED_AT_EVERY: usize = 8;
/// Clouds of up to this many points are sorted into a grid; of a larger one only the surroundings of the queried points
/// are examined. For a single cloud a grid is faster up to 200 000 points, but if two are measured in parallel,
/// releasing its megabytes interrupts the other thread.
const SORTED_UP_TO: usize = 10_000;
/// Reach of the first search in estimated distances, and the factor by which it grows where nothing was found.
const REACH: f64 = 2.0;
const GROWTH: f64 = 4.0;

type Cell = [i32; 3];

/// Returns the nearest other point of each of the points `asked` (positions, in any order); one at infinite distance if
/// there is none. Exact.
pub(crate) fn nearest_others(points: &[Point], asked: &[u32]) -> Vec<Neighbor> {
    let reach = REACH * guessed_spacing(points);
    let is_small = points.len() <= SORTED_UP_TO;
    match is_small.then(|| OrderedPoints::unless_crowded(points, reach)).flatten() {
        Some(ordered) => {
            let nearest = |keys: &mut Vec<u64>, &i: &u32| ordered.nearest_other(i, &points[i as usize], reach, keys);
            asked.par_iter().map_init(Vec::new, |keys, i| nearest(keys, i).unwrap_or(NOTHING)).collect()
        }
        None => looked_through(points, asked, reach),
    }
}

const NOTHING: Neighbor = Neighbor { index: u32::MAX, distance_sq: f32::INFINITY };

/// Scans the whole cloud once for each reach.
fn looked_through(points: &[Point], asked: &[u32], mut reach: f64) -> Vec<Neighbor> {
    let mut found = vec![NOTHING; asked.len()];
    let mut open: Vec<u32> = (0..asked.len() as u32).collect();
    let (low, high) = bounds(points);
    let extent = (0..3).map(|k| f64::from(high[k] - low[k])).fold(0.0, f64::max);
    while !open.is_empty() {
        // Finally a single cell that contains everything.
        let is_last = reach.is_nan() || reach <= 0.0 || reach >= extent;
        let cells = CornerCells { low, side: if is_last { f64::INFINITY } else { 2.0 * reach } };
        let centres: Vec<u32> = open.iter().map(|&i| asked[i as usize]).collect();
        let nearest = Members::around(points, &centres, &cells).nearest(points, &centres);
        open.iter().zip(&nearest).for_each(|(&i, nearest)| found[i as usize] = *nearest);
        open.retain(|&i| !is_last && f64::from(found[i as usize].distance_sq) > reach * reach);
        reach *= GROWTH;
    }
    found
}

/// Cells so wide that the eight around the corner nearest to a point hold everything within half a side of it.
struct CornerCells {
    low: Point,
    side: f64,
}

impl CornerCells {
    fn place(&self, p: &Point) -> [f64; 3] {
        std::array::from_fn(|k| f64::from(p[k] - self.low[k]) / self.side)
    }

    /// Returns the cell of a point; the numbers of very distant cells saturate.
    fn of(&self, p: &Point) -> Cell {
        self.place(p).map(|v| v as i32)
    }

    fn around(&self, p: &Point) -> impl Iterator<Item = Cell> + use<> {
        let first = self.place(p).map(|v| (v - 0.5).floor() as i32);
        (0..8).map(move |i| std::array::from_fn(|k| first[k].saturating_add(i >> k & 1)))
    }
}

/// The points in and around some cells.
struct Members {
    /// For each centre the numbers of the cells around it; empty cells have numbers, too.
    around: Vec<[u32; 8]>,
    /// For each number its first place in `order`, and finally the end of `order`.
    starts: Vec<u32>,
    order: Vec<u32>,
}

impl Members {
    fn around(points: &[Point], centres: &[u32], cells: &CornerCells) -> Self {
        let mut numbers: FxHashMap<Cell, u32> = FxHashMap::default();
        let mut number = |cell| {
            let next = numbers.len() as u32;
            *numbers.entry(cell).or_insert(next)
        };
        let mut around = vec![[0; 8]; centres.len()];
        for (own, &centre) in around.iter_mut().zip(centres) {
            own.iter_mut().zip(cells.around(&points[centre as usize])).for_each(|(own, cell)| *own = number(cell));
        }
        let inside: Vec<(u32, u32)> = points
            .par_iter()
            .zip(0u32..points.len() as u32)
            .filter_map(|(p, i)| Some((*numbers.get(&cells.of(p))?, i)))
            .collect();
        let mut starts = vec![0; numbers.len() + 1];
        inside.iter().for_each(|&(number, _)| starts[number as usize + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let (mut next, mut order) = (starts.clone(), vec![0; inside.len()]);
        for (number, i) in inside {
            order[next[number as usize] as usize] = i;
            next[number as usize] += 1;
        }
        Members { around, starts, order }
    }

    fn nearest(&self, points: &[Point], centres: &[u32]) -> Vec<Neighbor> {
        let of = |number: u32| self.starts[number as usize] as usize..self.starts[number as usize + 1] as usize;
        let nearest = |(centre, around): (&u32, &[u32; 8])| {
            let query = &points[*centre as usize];
            let others = around.iter().flat_map(|&number| &self.order[of(number)]).filter(|&i| i != centre);
            let others = others.map(|&i| Neighbor { index: i, distance_sq: distance_sq(&points[i as usize], query) });
            others.fold(NOTHING, |a, b| if b.distance_sq < a.distance_sq { b } else { a })
        };
        centres.par_iter().zip(&self.around).map(nearest).collect()
    }
}

/// Estimates the distance between neighbours from an evenly thinned part of the points, as if the cloud were a sheet:
/// thinning increases the distance by the square root of the stride. The median makes it insensitive to stray points.
fn guessed_spacing(points: &[Point]) -> f64 {
    let stride = points.len().div_ceil(GUESSED_FROM).max(1);
    let some: Vec<Point> = points.iter().step_by(stride).copied().collect();
    let index = NeighborIndex::new(&some);
    let asked = some.iter().step_by(GUESSED_AT_EVERY);
    let mut distances: Vec<f32> =
        asked.filter_map(|p| index.nearest_n(p, 2).get(1).map(|n| n.distance_sq.sqrt())).collect();
    distances.sort_by(f32::total_cmp);
    let median = distances.get(distances.len() / 2).copied().unwrap_or(0.0);
    f64::from(median) / (stride as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    #[test]
    fn an_index_says_the_same() {
        let mut stream = Stream::new(6, 0);
        let mut sheet: Vec<Point> =
            (0..30_000).map(|_| [stream.unit() as f32, stream.unit() as f32, 0.01 * stream.unit() as f32]).collect();
        // Stray points, a distant one, and a cluster.
        sheet.extend((0..50).map(|i| [5.0 + i as f32, 3.0, -2.0]));
        sheet.push([1e12, 0.0, 0.0]);
        sheet.extend((0..500).map(|i| [2.0 + 1e-6 * i as f32, 2.0, 2.0]));
        let index = NeighborIndex::new(&sheet);
        let asked: Vec<u32> = (0..sheet.len() as u32).step_by(7).chain(30_000..30_060).collect();
        for found in [nearest_others(&sheet, &asked), looked_through(&sheet, &asked, 0.01)] {
            for (i, other) in asked.iter().zip(found) {
                let point = &sheet[*i as usize];
                let expected = index.nearest_n(point, 2)[1].distance_sq;
                assert!((other.distance_sq - expected).abs() <= 1e-6 * expected, "{i}: {other:?} {expected}");
                assert!(other.index != *i && distance_sq(&sheet[other.index as usize], point) == other.distance_sq);
            }
        }
    }

    #[test]
    fn few_points_are_fine() {
        let distances_sq = |found: Vec<Neighbor>| found.iter().map(|other| other.distance_sq).collect::<Vec<f32>>();
        assert_eq!(distances_sq(nearest_others(&[[1.0; 3]], &[0])), [f32::INFINITY]);
        assert_eq!(distances_sq(nearest_others(&[[0.0; 3], [0.0, 3.0, 0.0]], &[1, 0])), [9.0, 9.0]);
        assert_eq!(distances_sq(nearest_others(&[[2.0; 3]; 4], &[2])), [0.0]);
        assert_eq!(distances_sq(looked_through(&[[2.0; 3]; 4], &[2], 0.0)), [0.0]);
        assert!(nearest_others(&[], &[]).is_empty());
    }
}
