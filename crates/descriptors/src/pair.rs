//! How two points with normals lie to each other (Rusu 2009; role of the points and binning as in PCL).

use congruent_geometry::{Surface, wide};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Bins of each feature.
pub(crate) const BINS: usize = 11;
/// Three features, one block of bins each.
pub(crate) const DIM: usize = 3 * BINS;

/// The features of two points `delta` apart: the angle f1 in [−π, π], f2 and f3 in [−1, 1]. The same if the points
/// change roles. `None` where the points coincide or their line is along the leading normal.
pub(crate) fn pair_features(n1: &Vector3<f64>, n2: &Vector3<f64>, delta: &Vector3<f64>) -> Option<[f64; 3]> {
    // The point whose normal is nearer to the line leads.
    let (n1, n2, delta) = if n1.dot(delta).abs() < n2.dot(delta).abs() { (n2, n1, -delta) } else { (n1, n2, *delta) };
    let across = delta.cross(n1);
    let (length, width) = (delta.norm(), across.norm());
    if length <= 0.0 || width <= 0.0 {
        return None;
    }
    let v = across / width;
    let w = n1.cross(&v);
    Some([w.dot(n2).atan2(n1.dot(n2)), v.dot(n2), n1.dot(&delta) / length])
}

/// The simplified histogram (SPFH) of one point: percentages of its pairs with all neighbours, each block summing to
/// 100. All zero where there is no pair.
pub(crate) fn pair_histogram(surface: &Surface, i: u32, radius: f64) -> [f32; DIM] {
    let centre = surface.points()[i as usize];
    let normal = wide(surface.normals()[i as usize]);
    let (mut counts, mut n_pairs) = ([0u32; DIM], 0u32);
    if normal != Vector3::zeros() {
        surface.index().within(&centre, radius, |n| {
            let other = wide(surface.normals()[n.index as usize]);
            let delta = wide(surface.points()[n.index as usize]) - wide(centre);
            if other == Vector3::zeros() {
                return;
            }
            if let Some(features) = pair_features(&normal, &other, &delta) {
                bins(&features).iter().for_each(|&bin| counts[bin] += 1);
                n_pairs += 1;
            }
        });
    }
    counts.map(|count| (100.0 * f64::from(count) / f64::from(n_pairs.max(1))) as f32)
}

fn bins([f1, f2, f3]: &[f64; 3]) -> [usize; 3] {
    let bin = |share: f64| ((share * BINS as f64).max(0.0) as usize).min(BINS - 1);
    [bin((f1 + PI) / TAU), BINS + bin((f2 + 1.0) / 2.0), 2 * BINS + bin((f3 + 1.0) / 2.0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::random::Stream;

    fn direction(stream: &mut Stream) -> Vector3<f64> {
        Vector3::new(stream.normal(), stream.normal(), stream.normal()).normalize()
    }

    #[test]
    fn the_roles_of_the_points_do_not_matter() {
        let mut stream = Stream::new(1, 0);
        for _ in 0..1000 {
            let (n1, n2, delta) = (direction(&mut stream), direction(&mut stream), direction(&mut stream));
            assert_eq!(pair_features(&n1, &n2, &delta), pair_features(&n2, &n1, &-delta));
        }
    }

    #[test]
    fn a_known_pair_has_its_features() {
        // n1 leads at 60° to the line; n2 is turned from n1 by 30° about v = −z.
        let (n1, n2) = (angled(60.0), angled(90.0));
        let [f1, f2, f3] = pair_features(&n1, &n2, &Vector3::x()).unwrap();
        assert!((f1.abs() - 30f64.to_radians()).abs() < 1e-12 && f2.abs() < 1e-12 && (f3 - 0.5).abs() < 1e-12);
    }

    fn angled(degrees: f64) -> Vector3<f64> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Vector3::new(cos, sin, 0.0)
    }

    #[test]
    fn pairs_without_a_frame_have_none() {
        assert_eq!(pair_features(&Vector3::x(), &Vector3::y(), &Vector3::zeros()), None);
        assert_eq!(pair_features(&Vector3::x(), &Vector3::y(), &Vector3::x()), None);
    }

    #[test]
    fn the_ends_of_the_ranges_are_in_range() {
        assert_eq!(bins(&[-PI, -1.0, -1.0]), [0, 11, 22]);
        assert_eq!(bins(&[0.0, 0.0, 0.0]), [5, 16, 27]);
        assert_eq!(bins(&[PI, 1.0 + 1e-15, 1.0]), [10, 21, 32]);
    }
}
