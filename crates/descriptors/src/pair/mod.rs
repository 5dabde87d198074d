//! How two points with normals lie relative to each other (Rusu 2009; role of the points and binning as in PCL).
//!
//! With unit normals a and b of the leading and the other point and the offset δ between them, the three features need
//! only four products: a·δ, b·δ, a·b and δ·(a × b). These keep their values (the first two up to a sign) when the
//! points swap roles, so a pair is evaluated once for both.

mod histograms;

pub(crate) use histograms::PairHistograms;

use congruent_geometry::Point;

/// Number of bins of each feature.
pub(crate) const BINS: usize = 11;
/// Length of a histogram: three features, one block of bins each.
pub(crate) const DIM: usize = 3 * BINS;

/// Value for a pair that has no bins.
const NO_BINS: u32 = u32::MAX;
/// A connecting line at most this close to the leading normal (squared sine) does not define a frame.
const MIN_SINE_SQ: f32 = 1e-7;

/// Cosines of the borders of the bins of f1, odd multiples of π/11: the middle bin is centred on zero.
const ANGLE_BORDERS: [f32; 5] = [0.959_493, 0.654_860_7, 0.142_314_84, -0.415_415, -0.841_253_5];

/// Returns the three bins of a pair, eight bits each, the first block's lowest: of a point with normal `a` and another
/// with normal `b` at `offset` from it. There are none if the points coincide, are more than a radius apart, or their
/// line is along the leading normal; or if `b` is zero.
#[inline(always)]
fn bins(a: Point, b: Point, offset: Point, radius_sq: f32) -> u32 {
    let distance_sq = dot(offset, offset);
    let (along_a, along_b) = (dot(a, offset), dot(b, offset));
    // The point whose normal is closer to the line leads; if both are equally close, the one whose normal points along
    // it.
    let a_leads = along_a.abs() > along_b.abs() || (along_a.abs() == along_b.abs() && along_a > 0.0);
    let (leading, other) = if a_leads { (along_a, along_b) } else { (-along_b, -along_a) };
    let across_sq = distance_sq - leading * leading;
    let is_pair = distance_sq <= radius_sq && across_sq > MIN_SINE_SQ * distance_sq && b != [0.0; 3];
    let per_across = 1.0 / across_sq.sqrt();
    // f1 as a vector, along and perpendicular to the zero direction: its bin is found by comparing cosines.
    let along = dot(a, b);
    let aside = (other - leading * along) * per_across;
    let length = (along * along + aside * aside).sqrt();
    let mut steps = 0;
    for border in ANGLE_BORDERS {
        steps += i32::from(along <= border * length);
    }
    let half = (BINS / 2) as i32;
    let f1 = if aside >= 0.0 { half + steps } else { half - steps };
    let f2 = cosine_bin(dot(offset, cross(a, b)) * per_across);
    let f3 = cosine_bin(leading / distance_sq.sqrt());
    if is_pair { (f1 | f2 << 8 | f3 << 16) as u32 } else { NO_BINS }
}

#[inline(always)]
fn cosine_bin(cosine: f32) -> i32 {
    ((cosine + 1.0) * (BINS as f32 / 2.0)).clamp(0.0, (BINS - 1) as f32) as i32
}

#[inline(always)]
fn dot(a: Point, b: Point) -> f32 {
    a[0] * b[0] + (a[1] * b[1] + a[2] * b[2])
}

#[inline(always)]
fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::narrow;
    use congruent_geometry::random::Stream;
    use nalgebra::Vector3;

    fn direction(stream: &mut Stream) -> Point {
        narrow(&Vector3::new(stream.normal(), stream.normal(), stream.normal()).normalize())
    }

    fn blocks(bins: u32) -> [u32; 3] {
        [bins & 0xff, bins >> 8 & 0xff, bins >> 16]
    }

    #[test]
    fn the_roles_of_the_points_do_not_matter() {
        let mut stream = Stream::new(1, 0);
        for i in 0..2000 {
            let (a, mut b, offset) = (direction(&mut stream), direction(&mut stream), direction(&mut stream));
            if i % 4 == 0 {
                b = a;
            }
            assert_eq!(bins(a, b, offset, 2.0), bins(b, a, offset.map(|v| -v), 2.0));
        }
    }

    /// The features by definition: Rusu's frame at the leading point, in `f64`.
    fn by_definition(a: Point, b: Point, offset: Point) -> [f64; 3] {
        let [mut a, mut b, mut line] = [a, b, offset].map(congruent_geometry::wide);
        if a.dot(&line).abs() < b.dot(&line).abs() {
            (a, b, line) = (b, a, -line);
        }
        let v = line.cross(&a).normalize();
        let w = a.cross(&v);
        [w.dot(&b).atan2(a.dot(&b)), v.dot(&b), a.dot(&line) / line.norm()]
    }

    #[test]
    fn the_bins_are_those_of_the_definition() {
        let mut stream = Stream::new(2, 0);
        for _ in 0..5000 {
            let (a, b, offset) = (direction(&mut stream), direction(&mut stream), direction(&mut stream));
            let [f1, f2, f3] = by_definition(a, b, offset);
            let places = [f1 / std::f64::consts::TAU + 0.5, f2 / 2.0 + 0.5, f3 / 2.0 + 0.5].map(|share| share * 11.0);
            for (bin, place) in blocks(bins(a, b, offset, 2.0)).into_iter().zip(places) {
                // On a border rounding decides.
                let on_border = (place - place.round()).abs() < 1e-4;
                assert!(on_border || f64::from(bin) == place.floor().min(10.0), "{bin} {place}");
            }
        }
    }

    #[test]
    fn a_known_pair_has_its_features() {
        // The first normal leads at 60° to the line; the other is turned from it by 30°.
        let angled = |degrees: f32| [degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0];
        // f1 = 30° or −30°, f2 = 0, f3 = 0.5.
        let [f1, f2, f3] = blocks(bins(angled(60.0), angled(90.0), [1.0, 0.0, 0.0], 2.0));
        assert!((f1 == 4 || f1 == 6) && f2 == 5 && f3 == 8, "{f1} {f2} {f3}");
    }

    #[test]
    fn pairs_without_a_frame_have_none() {
        let (x, y) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        for (a, b, offset) in [(x, y, [0.0; 3]), (x, y, x), (x, [0.0; 3], y), (x, y, [0.0, 2.0, 0.1])] {
            assert_eq!(bins(a, b, offset, 2.0), NO_BINS);
        }
    }
}
