//! Touching points side by side: what is computed for one pair is computed for many at once.

use congruent_geometry::lanes;
use multiversion::multiversion;
use nalgebra::Matrix3;

/// Number of pairs that are processed side by side.
pub(crate) const BLOCK: usize = 64;
/// Number of sums formed side by side; fixed, so that the order of additions is the same on every processor.
const LANES: usize = 8;

/// One number of each pair.
pub(crate) type Column = [f64; BLOCK];
/// One vector of each pair, one coordinate at a time.
pub(crate) type Vectors = [Column; 3];

/// The points of the first `n` pairs and their normals.
pub(crate) struct Ends {
    /// Points of the source, moved; target frame.
    pub(crate) moved: Vectors,
    /// Normals of the source, not rotated; zero where there is none, likewise in the target.
    pub(crate) source_normal: Vectors,
    pub(crate) target: Vectors,
    pub(crate) target_normal: Vectors,
    pub(crate) n: usize,
}

/// Which pairs touch, and how they are weighted.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    pub(crate) radius_sq: f64,
    pub(crate) min_normal_cosine: f64,
    pub(crate) scale_sq: f64,
}

/// Points of the moved source and what they touch; target frame. A pair without a normal at either end does not touch.
/// All values of a pair that does not touch are zero.
pub(crate) struct Touches {
    /// One if a pair touches.
    pub(crate) is_touch: Column,
    pub(crate) moved: Vectors,
    /// Offset from the touched point.
    pub(crate) offset: Vectors,
    /// Normal at the touched point.
    pub(crate) normal: Vectors,
    /// Rotated normal of the moved point.
    pub(crate) turned: Vectors,
    /// Cosine between the two normals.
    pub(crate) cosine: Column,
    /// Signed distance to the tangent plane.
    pub(crate) distance: Column,
    /// Robust weight (Cauchy).
    pub(crate) weight: Column,
}

const NONE: Column = [0.0; BLOCK];
const NOWHERE: Vectors = [NONE; 3];

impl Default for Ends {
    fn default() -> Self {
        Ends { moved: NOWHERE, source_normal: NOWHERE, target: NOWHERE, target_normal: NOWHERE, n: 0 }
    }
}

impl Default for Touches {
    fn default() -> Self {
        Touches {
            is_touch: NONE,
            moved: NOWHERE,
            offset: NOWHERE,
            normal: NOWHERE,
            turned: NOWHERE,
            cosine: NONE,
            distance: NONE,
            weight: NONE,
        }
    }
}

impl Touches {
    /// Evaluates these pairs under a rotation with which the points have already been moved.
    pub(crate) fn see(&mut self, ends: &Ends, rotation: &Matrix3<f64>, limits: Limits) {
        compare(ends, rotation.as_ref(), limits, self);
    }
}

/// Takes the rotation by columns. Compiled for several instruction sets and chosen at run time; the bits are the same
/// on all.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn compare(ends: &Ends, rotation: &[[f64; 3]; 3], limits: Limits, touches: &mut Touches) {
    let [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]] = *rotation;
    for k in 0..BLOCK {
        let [x, y, z] = [ends.source_normal[0][k], ends.source_normal[1][k], ends.source_normal[2][k]];
        let turned = [xx * x + xy * y + xz * z, yx * x + yy * y + yz * z, zx * x + zy * y + zz * z];
        let moved = [ends.moved[0][k], ends.moved[1][k], ends.moved[2][k]];
        let normal = [ends.target_normal[0][k], ends.target_normal[1][k], ends.target_normal[2][k]];
        let offset = [moved[0] - ends.target[0][k], moved[1] - ends.target[1][k], moved[2] - ends.target[2][k]];
        let cosine = turned[0] * normal[0] + turned[1] * normal[1] + turned[2] * normal[2];
        let distance = offset[0] * normal[0] + offset[1] * normal[1] + offset[2] * normal[2];
        let away_sq = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        let turned_sq = turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2];
        let normal_sq = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        // Written so that NaN is rejected.
        let agrees = cosine >= limits.min_normal_cosine && turned_sq > 0.0 && normal_sq > 0.0;
        let is_touch = away_sq <= limits.radius_sq && agrees && k < ends.n;
        touches.is_touch[k] = if is_touch { 1.0 } else { 0.0 };
        for axis in 0..3 {
            touches.moved[axis][k] = if is_touch { moved[axis] } else { 0.0 };
            touches.offset[axis][k] = if is_touch { offset[axis] } else { 0.0 };
            touches.normal[axis][k] = if is_touch { normal[axis] } else { 0.0 };
            touches.turned[axis][k] = if is_touch { turned[axis] } else { 0.0 };
        }
        touches.cosine[k] = if is_touch { cosine } else { 0.0 };
        touches.distance[k] = if is_touch { distance } else { 0.0 };
        let weight = 1.0 / (1.0 + distance * distance / limits.scale_sq);
        touches.weight[k] = if is_touch { weight } else { 0.0 };
    }
}

/// Moves a point of each pair: a rotation, given by its columns, then a translation.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn place_each(points: &Vectors, rotation: &[[f64; 3]; 3], shift: &[f64; 3], moved: &mut Vectors) {
    let [[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]] = *rotation;
    for k in 0..BLOCK {
        let [x, y, z] = [points[0][k], points[1][k], points[2][k]];
        moved[0][k] = xx * x + xy * y + xz * z + shift[0];
        moved[1][k] = yx * x + yy * y + yz * z + shift[1];
        moved[2][k] = zx * x + zy * y + zz * z + shift[2];
    }
}

/// Returns the sum of a column.
#[inline(always)]
pub(crate) fn sum(a: &Column) -> f64 {
    lanes::sum(a.as_chunks::<LANES>().0)
}

/// Returns the sum of the products of two columns.
#[inline(always)]
pub(crate) fn dot(a: &Column, b: &Column) -> f64 {
    lanes::dot(a.as_chunks::<LANES>().0, b.as_chunks::<LANES>().0)
}

/// Returns the product of two columns, pair by pair.
#[inline(always)]
pub(crate) fn times(a: &Column, b: &Column) -> Column {
    let mut product = NONE;
    for k in 0..BLOCK {
        product[k] = a[k] * b[k];
    }
    product
}

/// Returns the cross product of two vectors of each pair.
#[inline(always)]
pub(crate) fn cross(a: [&Column; 3], b: [&Column; 3]) -> Vectors {
    let mut product = NOWHERE;
    for k in 0..BLOCK {
        product[0][k] = a[1][k] * b[2][k] - a[2][k] * b[1][k];
        product[1][k] = a[2][k] * b[0][k] - a[0][k] * b[2][k];
        product[2][k] = a[0][k] * b[1][k] - a[1][k] * b[0][k];
    }
    product
}
