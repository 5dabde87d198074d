//! The means of the points in each cell and of their normals.

use super::Sample;
use super::cell::{Leaf, whole};
use super::numbered::Numbered;
use crate::{Point, narrow};
use multiversion::multiversion;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::ops::Range;

/// Bits of the integer steps into which a cell's side, or a unit of length of a normal, is divided: sums of them do not
/// depend on their order. Fewer for clouds so large that the sums would not fit.
const STEP_BITS: u32 = 36;
/// Number of points converted to steps at a time.
const CUT_AT_A_TIME: usize = 512;
/// Minimum number of points worth a thread.
const MIN_POINTS: usize = 1 << 16;
/// Minimum number of cells that one thread takes at a time.
const CELLS_AT_A_TIME: usize = 1 << 16;

/// Computes the means of each cell, in cell order.
pub(super) fn means(points: &[Point], normals: Option<&[Point]>, leaf: Leaf, cells: &Numbered) -> Sample {
    let per_unit = 2f64.powi(STEP_BITS.min((points.len() as u64).leading_zeros() - 1) as i32);
    let sums = summed(cells, |some, sums: &mut [Sum]| sum_points(points, some, cells, leaf, per_unit, sums));
    let mut centroids_of = vec![[0.0; 3]; cells.n_cells];
    let parts = centroids_of.par_chunks_mut(CELLS_AT_A_TIME).zip(sums.par_chunks(CELLS_AT_A_TIME));
    parts.for_each(|(centroids_of, sums)| centroids(sums, points, leaf, per_unit, centroids_of));
    let direction = |sum: &[i64; 3]| {
        let sum = Vector3::from(sum.map(|steps| steps as f64 / per_unit));
        narrow(&sum.try_normalize(1e-6).unwrap_or_default())
    };
    let directions = |normals: &[Point]| {
        let sums = summed(cells, |some, sums: &mut [[i64; 3]]| sum_normals(normals, some, cells, per_unit, sums));
        sums.par_iter().with_min_len(CELLS_AT_A_TIME).map(direction).collect()
    };
    Sample { points: centroids_of, normals: normals.map(directions) }
}

/// A sum over the points of a cell.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// How far the points are beyond the corner of the cell, in steps.
    steps: [u64; 3],
    n: u32,
    /// Position of one of them.
    member: u32,
}

/// A sum over some points, to which a sum over others can be added.
trait Add {
    fn add(&mut self, other: &Self);
}

impl Add for Sum {
    fn add(&mut self, other: &Self) {
        let member = if self.n > 0 { self.member } else { other.member };
        let steps = std::array::from_fn(|k| self.steps[k] + other.steps[k]);
        *self = Sum { steps, n: self.n + other.n, member };
    }
}

impl Add for [i64; 3] {
    fn add(&mut self, other: &Self) {
        self.iter_mut().zip(other).for_each(|(own, other)| *own += other);
    }
}

/// Computes a sum for each cell, over parts of the cloud in parallel; few enough that there are no more sums than
/// points.
fn summed<S: Add + Clone + Default + Send>(cells: &Numbered, sum: impl Fn(Range<usize>, &mut [S]) + Sync) -> Vec<S> {
    let n = cells.of_points.len();
    let n_parts = (n / cells.n_cells.max(1)).min(n / MIN_POINTS).clamp(1, rayon::current_num_threads());
    let of_part = |part: usize| {
        let mut sums = vec![S::default(); cells.n_cells];
        sum(part * n / n_parts..(part + 1) * n / n_parts, &mut sums);
        sums
    };
    let both = |mut sums: Vec<S>, others: Vec<S>| {
        sums.iter_mut().zip(&others).for_each(|(sum, other)| sum.add(other));
        sums
    };
    (0..n_parts).into_par_iter().map(of_part).reduce_with(both).unwrap_or_default()
}

/// Computes the mean of each cell's points.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn centroids(sums: &[Sum], points: &[Point], leaf: Leaf, per_side: f64, centroids: &mut [Point]) {
    for (sum, centroid) in sums.iter().zip(centroids) {
        let corner = points[sum.member as usize].map(|v| leaf.place(v).floor());
        let share = 1.0 / (per_side * f64::from(sum.n));
        *centroid = std::array::from_fn(|k| ((corner[k] + sum.steps[k] as f64 * share) * leaf.side) as f32);
    }
}

fn sum_points(points: &[Point], some: Range<usize>, cells: &Numbered, leaf: Leaf, per_side: f64, sums: &mut [Sum]) {
    let mut steps = [[0; 3]; CUT_AT_A_TIME];
    for start in some.clone().step_by(CUT_AT_A_TIME) {
        let some = start..some.end.min(start + CUT_AT_A_TIME);
        let steps = &mut steps[..some.len()];
        steps_within(points[some.clone()].as_flattened(), leaf, per_side, steps.as_flattened_mut());
        for ((member, &cell), steps) in (start as u32..).zip(&cells.of_points[some]).zip(steps) {
            let sum = &mut sums[cell as usize];
            *sum = Sum { steps: std::array::from_fn(|k| sum.steps[k] + steps[k]), n: sum.n + 1, member };
        }
    }
}

fn sum_normals(normals: &[Point], some: Range<usize>, cells: &Numbered, per_unit: f64, sums: &mut [[i64; 3]]) {
    for (&cell, normal) in cells.of_points[some.clone()].iter().zip(&normals[some]) {
        sums[cell as usize].add(&normal.map(|v| (f64::from(v) * per_unit) as i64));
    }
}

/// Computes, for each coordinate, how many steps it is beyond the corner of its cell.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn steps_within(coordinates: &[f32], leaf: Leaf, per_side: f64, steps: &mut [u64]) {
    for (steps, &v) in steps.iter_mut().zip(coordinates) {
        let place = leaf.place(v);
        *steps = whole(((place - place.floor()) * per_side).floor());
    }
}
