//! What a cloud looks like from a viewpoint near it or within it.

use super::screen::Columns;
use crate::Point;
use multiversion::multiversion;

/// Number of pixels along a side of a face; there are six faces of a cube around the viewpoint.
const FACE: i32 = 52;
/// Number of pixels of all faces.
pub(super) const PIXELS: usize = (6 * FACE * FACE) as usize;

/// Computes, for each point seen from a viewpoint, its pixel, its distance, and the unsigned cosine between its normal
/// and the line of sight.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn look_around(
    [xs, ys, zs]: &Columns,
    [nxs, nys, nzs]: &Columns,
    viewpoint: Point,
    pixels: &mut [u32],
    distances: &mut [f32],
    cosines: &mut [f32],
) {
    let n = pixels.len();
    let (xs, ys, zs) = (&xs[..n], &ys[..n], &zs[..n]);
    let (nxs, nys, nzs) = (&nxs[..n], &nys[..n], &nzs[..n]);
    let (distances, cosines) = (&mut distances[..n], &mut cosines[..n]);
    for i in 0..n {
        let (x, y, z) = (xs[i] - viewpoint[0], ys[i] - viewpoint[1], zs[i] - viewpoint[2]);
        let distance = (x * x + y * y + z * z).sqrt();
        let along = nxs[i] * x + nys[i] * y + nzs[i] * z;
        distances[i] = distance;
        cosines[i] = along.abs() / if distance > f32::MIN_POSITIVE { distance } else { f32::MIN_POSITIVE };

        let (far_x, far_y, far_z) = (x.abs(), y.abs(), z.abs());
        let (is_x, is_y) = (far_x >= far_y && far_x >= far_z, far_y >= far_z);
        let (ahead, right, up) = if is_x {
            (x, y, z)
        } else if is_y {
            (y, x, z)
        } else {
            (z, x, y)
        };
        let axis = if is_x {
            0
        } else if is_y {
            2
        } else {
            4
        };
        let face = axis + i32::from(ahead < 0.0);
        let scale = (FACE as f32 / 2.0) / ahead.abs();
        // At the viewpoint itself there is no direction; NaN becomes 0.
        let column = ((right * scale + FACE as f32 / 2.0) as i32).clamp(0, FACE - 1);
        let row = ((up * scale + FACE as f32 / 2.0) as i32).clamp(0, FACE - 1);
        pixels[i] = ((face * FACE + row) * FACE + column) as u32;
    }
}

/// Computes, for each normal, on which side of its plane a viewpoint is; `planes` are n·p of each point p.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn sides_around([xs, ys, zs]: &Columns, planes: &[f32], viewpoint: Point, sides: &mut [u8]) {
    for ((((side, x), y), z), plane) in sides.iter_mut().zip(xs).zip(ys).zip(zs).zip(planes) {
        *side = u8::from(x * viewpoint[0] + y * viewpoint[1] + z * viewpoint[2] >= *plane);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::view::screen::columns;
    use crate::wide;

    #[test]
    fn points_in_one_direction_share_a_pixel() {
        let mut stream = Stream::new(7, 0);
        let viewpoint = [0.5, -1.0, 2.0];
        let mut point = || -> Point { std::array::from_fn(|_| stream.between(-3.0, 3.0) as f32) };
        let points: Vec<Point> = (0..99).map(|_| point()).collect();
        let normals: Vec<Point> = (0..99).map(|_| point()).collect();
        let farther: Vec<Point> =
            points.iter().map(|p| std::array::from_fn(|k| viewpoint[k] + 4.0 * (p[k] - viewpoint[k]))).collect();
        let looked = |points: &[Point]| {
            let (mut pixels, mut distances, mut cosines) = (vec![0; 99], vec![0.0; 99], vec![0.0; 99]);
            let [points, normals] = [points, &normals].map(columns);
            look_around(&points, &normals, viewpoint, &mut pixels, &mut distances, &mut cosines);
            (pixels, distances, cosines)
        };
        let (near, far) = (looked(&points), looked(&farther));
        let same = near.0.iter().zip(&far.0).filter(|(a, b)| a == b).count();
        assert!(same >= 97 && near.0.iter().all(|pixel| (*pixel as usize) < PIXELS), "{same}");
        let mut different = near.0.clone();
        different.sort_unstable();
        different.dedup();
        assert!(different.len() > 90);
        for (i, (p, n)) in points.iter().zip(&normals).enumerate() {
            let ray = wide(*p) - wide(viewpoint);
            assert!((f64::from(near.1[i]) - ray.norm()).abs() < 1e-5 && (far.1[i] - 4.0 * near.1[i]).abs() < 1e-4);
            assert!((f64::from(near.2[i]) - (ray.normalize().dot(&wide(*n))).abs()).abs() < 1e-5);
        }
        let planes: Vec<f32> = points.iter().zip(&normals).map(|(p, n)| wide(*p).dot(&wide(*n)) as f32).collect();
        let mut sides = vec![0; 99];
        sides_around(&columns(&normals), &planes, viewpoint, &mut sides);
        for (i, side) in sides.into_iter().enumerate() {
            let along = (wide(viewpoint) - wide(points[i])).dot(&wide(normals[i]));
            assert!(along.abs() < 1e-5 || (side == 1) == (along > 0.0));
        }
    }

    #[test]
    fn the_viewpoint_itself_is_seen_somewhere() {
        let columns = columns(&[[1.0, 2.0, 3.0]]);
        let (mut pixels, mut distances, mut cosines) = ([9], [9.0], [9.0]);
        look_around(&columns, &columns, [1.0, 2.0, 3.0], &mut pixels, &mut distances, &mut cosines);
        assert!(distances == [0.0] && cosines == [0.0] && (pixels[0] as usize) < PIXELS);
    }
}
