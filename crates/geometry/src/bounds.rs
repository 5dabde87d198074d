//! The bounding box of a cloud.

use crate::Point;

/// Number of coordinates processed together: those of four points.
const LANES: usize = 12;

/// Returns the lower and the upper corner; without points they are infinite and the wrong way round. NaN is ignored.
pub(crate) fn bounds(points: &[Point]) -> (Point, Point) {
    let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let (whole, rest) = points.as_flattened().as_chunks::<LANES>();
    for coordinates in whole {
        for lane in 0..LANES {
            low[lane] = if coordinates[lane] < low[lane] { coordinates[lane] } else { low[lane] };
            high[lane] = if coordinates[lane] > high[lane] { coordinates[lane] } else { high[lane] };
        }
    }
    for (lane, v) in rest.iter().enumerate() {
        (low[lane], high[lane]) = (low[lane].min(*v), high[lane].max(*v));
    }
    let of_axis = |lanes: [f32; LANES], axis: usize| (axis..LANES).step_by(3).map(move |lane| lanes[lane]);
    (
        std::array::from_fn(|axis| of_axis(low, axis).fold(f32::INFINITY, f32::min)),
        std::array::from_fn(|axis| of_axis(high, axis).fold(f32::NEG_INFINITY, f32::max)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_counts() {
        assert_eq!(bounds(&[]), ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]));
        for n in 1..12 {
            for far in 0..n {
                let mut points = vec![[1.0, 2.0, -3.0]; n];
                points[far] = [-4.0, 9.0, -3.5];
                let others = if n == 1 { points[0] } else { [1.0, 9.0, -3.0] };
                assert_eq!(bounds(&points), ([-4.0, if n == 1 { 9.0 } else { 2.0 }, -3.5], others), "{far} of {n}");
            }
        }
    }
}
