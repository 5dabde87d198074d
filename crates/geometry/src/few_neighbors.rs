//! The nearest other point of a few points of a large cloud, without an index of the whole.

use crate::{NeighborIndex, Point};
use rayon::prelude::*;
use std::collections::HashMap;

/// Points from which the distance between neighbours is guessed.
const GUESSED_FROM: usize = 2000;
/// Cells are so many guessed distances wide at first, and grow by this factor where nothing was found.
const WIDTH: f64 = 3.0;
const GROWTH: f64 = 4.0;

type Cell = [i32; 3];

/// The squared distance from each of the points `asked` (positions, in any order) to its nearest other point; infinite
/// where there is no other one. Exact: the whole cloud is looked through, once for each width of the cells.
pub(crate) fn nearest_others_sq(points: &[Point], asked: &[u32]) -> Vec<f32> {
    let mut found = vec![f32::INFINITY; asked.len()];
    let mut open: Vec<usize> = (0..asked.len()).collect();
    let (low, extent) = bounds(points);
    let mut side = WIDTH * guessed_spacing(points);
    while !open.is_empty() {
        // One cell at last, in which everything is.
        let is_last = side.is_nan() || side <= 0.0 || side >= extent;
        let cell = |p: &Point| -> Cell {
            if is_last { [0; 3] } else { std::array::from_fn(|k| (f64::from(p[k] - low[k]) / side) as i32) }
        };
        let members = members_around(points, open.iter().map(|&i| cell(&points[asked[i] as usize])), cell);
        let nearest: Vec<f32> = open.par_iter().map(|&i| nearest_in(points, asked[i], cell, &members)).collect();
        open.iter().zip(&nearest).for_each(|(&i, &distance_sq)| found[i] = distance_sq);
        // Within a side everything is in the cells around.
        open.retain(|&i| !is_last && f64::from(found[i]) > side * side);
        side *= GROWTH;
    }
    found
}

/// The points in the given cells and next to them.
fn members_around(
    points: &[Point],
    centres: impl Iterator<Item = Cell>,
    cell: impl Fn(&Point) -> Cell + Sync,
) -> HashMap<Cell, Vec<u32>> {
    let mut members: HashMap<Cell, Vec<u32>> = centres.flat_map(around).map(|cell| (cell, Vec::new())).collect();
    let inside: Vec<(Cell, u32)> = points
        .par_iter()
        .zip(0u32..points.len() as u32)
        .filter_map(|(p, i)| Some(cell(p)).filter(|cell| members.contains_key(cell)).map(|cell| (cell, i)))
        .collect();
    for (cell, i) in inside {
        members.entry(cell).or_default().push(i);
    }
    members
}

fn nearest_in(points: &[Point], asked: u32, cell: impl Fn(&Point) -> Cell, members: &HashMap<Cell, Vec<u32>>) -> f32 {
    let query = &points[asked as usize];
    let others = around(cell(query)).filter_map(|cell| members.get(&cell)).flatten().filter(|&&i| i != asked);
    others.map(|&i| distance_sq(&points[i as usize], query)).fold(f32::INFINITY, f32::min)
}

fn around([x, y, z]: Cell) -> impl Iterator<Item = Cell> {
    // Numbers of very far cells are cut off at the largest one.
    (0..27).map(move |i| [x.saturating_add(i % 3 - 1), y.saturating_add(i / 3 % 3 - 1), z.saturating_add(i / 9 - 1)])
}

fn distance_sq(a: &Point, b: &Point) -> f32 {
    (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum()
}

/// Lower corner and longest side.
fn bounds(points: &[Point]) -> (Point, f64) {
    let first = points.first().copied().unwrap_or_default();
    let (low, high) = points.iter().fold((first, first), |(low, high), p| {
        (std::array::from_fn(|k| low[k].min(p[k])), std::array::from_fn(|k| high[k].max(p[k])))
    });
    (low, (0..3).map(|k| f64::from(high[k] - low[k])).fold(0.0, f64::max))
}

/// From an even part of the points, as if the cloud were a sheet: its neighbours are farther by the root of what was left
/// out. The median, so that stray points do not count.
fn guessed_spacing(points: &[Point]) -> f64 {
    let stride = points.len().div_ceil(GUESSED_FROM).max(1);
    let some: Vec<Point> = points.iter().step_by(stride).copied().collect();
    let index = NeighborIndex::new(&some);
    let mut distances: Vec<f32> =
        some.iter().filter_map(|p| index.nearest_n(p, 2).get(1).map(|n| n.distance_sq.sqrt())).collect();
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
        // Stray points, a far one, and a clump.
        sheet.extend((0..50).map(|i| [5.0 + i as f32, 3.0, -2.0]));
        sheet.push([1e12, 0.0, 0.0]);
        sheet.extend((0..500).map(|i| [2.0 + 1e-6 * i as f32, 2.0, 2.0]));
        let index = NeighborIndex::new(&sheet);
        let asked: Vec<u32> = (0..sheet.len() as u32).step_by(7).chain(30_000..30_060).collect();
        for (i, distance_sq) in asked.iter().zip(nearest_others_sq(&sheet, &asked)) {
            let expected = index.nearest_n(&sheet[*i as usize], 2)[1].distance_sq;
            assert!((distance_sq - expected).abs() <= 1e-6 * expected, "{i}: {distance_sq} {expected}");
        }
    }

    #[test]
    fn few_points_are_fine() {
        assert_eq!(nearest_others_sq(&[[1.0; 3]], &[0]), [f32::INFINITY]);
        assert_eq!(nearest_others_sq(&[[0.0; 3], [0.0, 3.0, 0.0]], &[1, 0]), [9.0, 9.0]);
        assert_eq!(nearest_others_sq(&[[2.0; 3]; 4], &[2]), [0.0]);
        assert!(nearest_others_sq(&[], &[]).is_empty());
    }
}
