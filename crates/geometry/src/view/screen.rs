//! What a cloud looks like from far away along an axis.

use crate::Point;
use multiversion::multiversion;

/// All x, all y and all z coordinates.
pub(super) type Columns = [Vec<f32>; 3];

pub(super) fn columns(points: &[Point]) -> Columns {
    [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect())
}

/// Computes, for each normal, its unsigned n·d, and on which side of a plane perpendicular to `d` it points.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512bw", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn face_along([xs, ys, zs]: &Columns, d: Point, cosines: &mut [f32], sides: &mut [u8]) {
    for ((((side, cosine), x), y), z) in sides.iter_mut().zip(cosines).zip(xs).zip(ys).zip(zs) {
        let along = x * d[0] + y * d[1] + z * d[2];
        *cosine = along.abs();
        *side = u8::from(along >= 0.0);
    }
}

/// The screen on which a cloud is seen from far along an axis.
pub(super) struct Screen {
    /// Right, up, and away from the viewer.
    pub(super) axes: [Point; 3],
    pub(super) middle: Point,
    /// Half of its width, data units.
    pub(super) half: f32,
    pub(super) per_pixel: f32,
    /// In pixels.
    pub(super) width: u32,
}

/// Computes, for each point, its pixel and how far it is behind the middle.
#[multiversion(targets("x86_64+avx512f+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn project([xs, ys, zs]: &Columns, screen: &Screen, pixels: &mut [u32], depths: &mut [f32]) {
    let Screen { axes: [right, up, away], middle, half, per_pixel, width } = *screen;
    let dot = |a: Point, b: Point| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let last = (width - 1) as f32;
    for ((((x, y), z), pixel), depth) in xs.iter().zip(ys).zip(zs).zip(pixels).zip(depths) {
        let p = [x - middle[0], y - middle[1], z - middle[2]];
        let [column, row] = [right, up].map(|axis| ((dot(p, axis) + half) * per_pixel).max(0.0).min(last) as i32);
        *pixel = (row as u32) * width + column as u32;
        *depth = dot(p, away);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;
    use crate::wide;

    #[test]
    fn normals_have_sides_and_points_have_pixels() {
        let mut stream = Stream::new(2, 0);
        let points: Vec<Point> = (0..77).map(|_| std::array::from_fn(|_| stream.between(-1.0, 1.0) as f32)).collect();
        let d = [0.0, 0.6, 0.8];
        let mut sides = vec![0; points.len()];
        let mut cosines = vec![0.0; points.len()];
        face_along(&columns(&points), d, &mut cosines, &mut sides);
        let along: Vec<f64> = points.iter().map(|p| wide(*p).dot(&wide(d))).collect();
        assert!(cosines.iter().zip(&along).all(|(cosine, along)| (f64::from(*cosine) - along.abs()).abs() < 1e-6));
        assert!(sides.iter().zip(&along).all(|(side, along)| (*side == 1) == (*along >= 0.0)));

        let axes = [[1.0, 0.0, 0.0], [0.0, 0.8, -0.6], d];
        let screen = Screen { axes, middle: [0.0; 3], half: 2.0, per_pixel: 2.5, width: 10 };
        let (mut pixels, mut depths) = (vec![0; points.len()], vec![0.0; points.len()]);
        project(&columns(&points), &screen, &mut pixels, &mut depths);
        for (i, p) in points.iter().enumerate() {
            let place = |axis: Point| ((wide(*p).dot(&wide(axis)) + 2.0) * 2.5) as u32;
            assert_eq!(pixels[i], place(axes[1]) * 10 + place(axes[0]));
            assert!((f64::from(depths[i]) - along[i]).abs() < 1e-6);
        }
    }
}
