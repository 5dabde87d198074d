//! How the neighbours of a point scatter around it.

use super::eigen::{MATRICES, Smallest, Triangles, smallest_eigen};
use crate::lanes::{dot, sum};
use crate::neighbors::blocks::{Column, LANES};
use crate::{OuterSum, Point, PointNormal, SortedEigen, narrow, sorted_eigen, wide};
use multiversion::multiversion;
use nalgebra::{Matrix3, Vector3};
use std::cmp::Ordering;
use std::ops::Range;

/// First and second moments relative to a nearby point: without the shift, large coordinates would suffer from
/// cancellation.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Scatter {
    pub(crate) n: f64,
    pub(crate) sum: Vector3<f64>,
    pub(crate) squares: OuterSum,
}

impl Scatter {
    #[inline]
    pub(crate) fn add(&mut self, point: &Point, centre: &Point) {
        let offset = wide(*point) - wide(*centre);
        self.n += 1.0;
        self.sum += offset;
        self.squares.add(&offset, 1.0);
    }

    /// Returns the upper triangle of the covariance matrix; zero for fewer than three points.
    fn triangle(&self) -> [f64; 6] {
        if self.n < 3.0 {
            return [0.0; 6];
        }
        let mean = self.sum / self.n;
        let outer = self.squares.matrix() / self.n - mean * mean.transpose();
        [outer.m11, outer.m12, outer.m13, outer.m22, outer.m23, outer.m33]
    }
}

/// Computes the normal of each neighbourhood; zero if it has none.
pub(crate) fn normals_of(scatters: &[Scatter], normals: &mut [PointNormal]) {
    for (some, normals) in scatters.chunks(MATRICES).zip(normals.chunks_mut(MATRICES)) {
        let (mut triangles, mut smallest) = (Triangles::default(), Smallest::default());
        for (i, scatter) in some.iter().enumerate() {
            let triangle = scatter.triangle();
            triangles.iter_mut().zip(triangle).for_each(|(lanes, entry)| lanes[i] = entry);
        }
        smallest_eigen(&triangles, &mut smallest);
        for (i, found) in normals.iter_mut().enumerate() {
            *found = if smallest.is_sure[i] {
                let normal = smallest.vector.map(|lanes| lanes[i] as f32);
                PointNormal { normal, curvature: smallest.share[i].abs() as f32 }
            } else {
                slow_normal(triangles.map(|lanes| lanes[i])).unwrap_or_default()
            };
        }
    }
}

/// Fraction of the largest spread up to which a spread is only rounding error.
const LINE: f64 = 1e-12;

fn slow_normal([xx, xy, xz, yy, yz, zz]: [f64; 6]) -> Option<PointNormal> {
    let SortedEigen { values: [smallest, middle, largest], vectors: [normal, ..] } =
        sorted_eigen(&Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
    // On a line, all directions perpendicular to it are equally good.
    if middle.is_nan() || middle <= LINE * largest {
        return None;
    }
    let curvature = (smallest / (smallest + middle + largest)).abs() as f32;
    Some(PointNormal { normal: narrow(&normal), curvature })
}

/// Which points of a block are neighbours of a member of its cell.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Near {
    /// Those up to this squared distance, if there are at least this many.
    Within(f32, u32),
    /// This many nearest points, if they are within this squared distance.
    Nearest(u32, f32),
}

/// Number of attempts to find a distance between the `k`-th nearest point and the next.
const TRIALS: usize = 12;

/// What is computed of the points of a block for one of its members; reused from one to the next.
#[derive(Default)]
pub(crate) struct Beside {
    /// Squared distances.
    away: Vec<[f32; LANES]>,
    /// Positions of the near points; the list is longer than they are.
    chosen: Vec<u32>,
    /// Offsets of the near points, one coordinate at a time; zero in the unused lanes at the end.
    offsets: [Vec<[f64; LANES]>; 3],
}

/// Computes, for each member of a cell (places in the order of `all`), the scatter of its neighbours among the points
/// of a block; `None` where the block does not tell which are the nearest.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn scatters_in_block(
    members: Range<usize>,
    all: &[Vec<f32>; 3],
    block: [Column<'_>; 3],
    near: Near,
    beside: &mut Beside,
    found: &mut Vec<Option<Scatter>>,
) {
    let Beside { away, chosen, offsets } = beside;
    found.clear();
    away.resize(block[0].len(), [0.0; LANES]);
    chosen.resize(LANES * block[0].len(), 0);
    for place in members {
        let centre = [all[0][place], all[1][place], all[2][place]];
        distances_sq(centre, block, away);
        let limit = match near {
            Near::Within(limit, at_least) => (count_within(away, limit) >= at_least).then_some(limit),
            Near::Nearest(k, limit) => nearest_limit(away, k, limit),
        };
        let Some(limit) = limit else {
            found.push(None);
            continue;
        };
        let chosen = choose(away, limit, chosen);
        for axis in 0..3 {
            near_offsets(block[axis], f64::from(centre[axis]), chosen, &mut offsets[axis]);
        }
        found.push(Some(summed(chosen.len() as u32, [&offsets[0], &offsets[1], &offsets[2]])));
    }
}

#[inline(always)]
fn distances_sq([x, y, z]: Point, block: [Column<'_>; 3], away: &mut [[f32; LANES]]) {
    let [xs, ys, zs] = block.map(<[_]>::as_flattened);
    for (((away, px), py), pz) in away.as_flattened_mut().iter_mut().zip(xs).zip(ys).zip(zs) {
        let (dx, dy, dz) = (px - x, py - y, pz - z);
        *away = dx * dx + dy * dy + dz * dz;
    }
}

#[inline(always)]
fn count_within(away: &[[f32; LANES]], limit: f32) -> u32 {
    away.as_flattened().iter().map(|&away| u32::from(away <= limit)).sum()
}

/// Finds a squared distance within which there are `k` points, by interpolation; `None` if there is none up to `limit`,
/// or if those at the rim are equally far.
#[inline(always)]
fn nearest_limit(away: &[[f32; LANES]], k: u32, limit: f32) -> Option<f32> {
    let (mut low, mut high) = ((0.0, 0), (limit, count_within(away, limit)));
    if high.1 <= k {
        return (high.1 == k).then_some(limit);
    }
    for _ in 0..TRIALS {
        let share = ((k - low.1) as f32 + 0.5) / (high.1 - low.1) as f32;
        let trial = low.0 + share * (high.0 - low.0);
        let n = count_within(away, trial);
        match n.cmp(&k) {
            Ordering::Less => low = (trial, n),
            Ordering::Equal => return Some(trial),
            Ordering::Greater => high = (trial, n),
        }
    }
    None
}

/// Collects the positions of points that are not farther than the limit. Each is written in any case and kept only if
/// near: a branch would be unpredictable.
#[inline(always)]
fn choose<'a>(away: &[[f32; LANES]], limit: f32, chosen: &'a mut [u32]) -> &'a [u32] {
    let mut n = 0;
    for (i, away) in (0u32..).zip(away.as_flattened()) {
        chosen[n] = i;
        n += usize::from(*away <= limit);
    }
    &chosen[..n]
}

#[inline(always)]
fn near_offsets(column: Column<'_>, from: f64, chosen: &[u32], offsets: &mut Vec<[f64; LANES]>) {
    let column = column.as_flattened();
    offsets.clear();
    offsets.resize(chosen.len().div_ceil(LANES), [0.0; LANES]);
    for (offset, &i) in offsets.as_flattened_mut().iter_mut().zip(chosen) {
        *offset = f64::from(column[i as usize]) - from;
    }
}

#[inline(always)]
fn summed(n: u32, [xs, ys, zs]: [&[[f64; LANES]]; 3]) -> Scatter {
    Scatter {
        n: f64::from(n),
        sum: Vector3::new(sum(xs), sum(ys), sum(zs)),
        squares: OuterSum::of([dot(xs, xs), dot(xs, ys), dot(xs, zs), dot(ys, ys), dot(ys, zs), dot(zs, zs)]),
    }
}
