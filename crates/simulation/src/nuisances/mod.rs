//! Nuisances that degrade scans by measured amounts; seeded, each making a new scan from an old one.
//!
//! Points only move by known amounts, are removed or are added, so a known true motion stays true. If points are
//! removed, the order of the rest is kept, their normals are kept with them, and triangles are kept whose three corners
//! are.

mod decimate;
mod holes;

pub use decimate::decimate_uniform;
pub use holes::cut_holes;

use congruent_geometry::random::Stream;
use congruent_geometry::{RawScan, RigidTransform};

/// Adds independent normal noise of standard deviation `sigma` (data units) to x, y and z. Normals are unchanged.
#[must_use]
pub fn add_noise(scan: &RawScan, sigma: f64, seed: u64) -> RawScan {
    let mut noisy = scan.clone();
    for (i, point) in (0u64..).zip(noisy.points.edited()) {
        let mut stream = Stream::new(seed, i);
        *point = point.map(|v| v + sigma * stream.normal());
    }
    noisy
}

/// Adds `share` times as many random points as there are, in the bounding box enlarged by a fifth. Their normals are
/// zero.
#[must_use]
pub fn add_strays(scan: &RawScan, share: f64, seed: u64) -> RawScan {
    let none = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let [low, high] = scan.points.iter().fold(none, |[low, high], p| {
        [std::array::from_fn(|k| low[k].min(p[k])), std::array::from_fn(|k| high[k].max(p[k]))]
    });
    let n_strays = if scan.points.is_empty() { 0 } else { (share.max(0.0) * scan.points.len() as f64).round() as u64 };
    let mut strewn = scan.clone();
    strewn.points.edited().extend((0..n_strays).map(|i| {
        let mut stream = Stream::new(seed, i);
        std::array::from_fn(|k| {
            let margin = 0.1 * (high[k] - low[k]);
            stream.between(low[k] - margin, high[k] + margin)
        })
    }));
    if let Some(normals) = &mut strewn.normals {
        normals.resize(strewn.points.len(), [0.0; 3]);
    }
    strewn
}

/// Keeps a random subset of the points: the given fraction, rounded to whole points.
#[must_use]
pub fn keep_random(scan: &RawScan, share: f64, seed: u64) -> RawScan {
    let n = scan.points.len();
    let n_kept = (share.clamp(0.0, 1.0) * n as f64).round() as usize;
    let mut keep = vec![false; n];
    for &i in &shuffled(n, n_kept, seed)[..n_kept] {
        keep[i as usize] = true;
    }
    only(scan, &keep)
}

/// Returns the same scan moved rigidly: [`RawScan::moved`], beside the other changes of a scan.
#[must_use]
pub fn moved(scan: &RawScan, motion: &RigidTransform) -> RawScan {
    scan.moved(motion)
}

/// Returns the same scan in another unit: coordinates times `factor`, which should be above zero.
#[must_use]
pub fn scaled(scan: &RawScan, factor: f64) -> RawScan {
    let mut scaled = scan.clone();
    scaled.points.edited().iter_mut().chain(&mut scaled.viewpoint).for_each(|p| *p = p.map(|v| v * factor));
    scaled
}

/// Returns the same points in a random order; normals and triangles follow.
#[must_use]
pub fn permuted(scan: &RawScan, seed: u64) -> RawScan {
    let order = shuffled(scan.points.len(), scan.points.len(), seed);
    let mut new_place = vec![0u32; order.len()];
    for (place, &i) in (0u32..).zip(&order) {
        new_place[i as usize] = place;
    }
    RawScan {
        points: order.iter().map(|&i| scan.points.at(i as usize)).collect(),
        normals: scan.normals.as_ref().map(|n| order.iter().map(|&i| n[i as usize]).collect()),
        triangles: scan.triangles.iter().map(|t| t.map(|i| new_place[i as usize])).collect(),
        viewpoint: scan.viewpoint,
        unread: scan.unread.clone(),
    }
}

/// Returns the numbers below `n` with the first `n_drawn` positions drawn at random (Fisher and Yates, stopped early).
fn shuffled(n: usize, n_drawn: usize, seed: u64) -> Vec<u32> {
    let mut stream = Stream::new(seed, 0);
    let mut order: Vec<u32> = (0..n as u32).collect();
    for place in 0..n_drawn {
        order.swap(place, place + stream.below((n - place) as u32) as usize);
    }
    order
}

/// Returns the marked points, in their order.
fn only(scan: &RawScan, keep: &[bool]) -> RawScan {
    let mut n_kept = 0;
    let new_place: Vec<Option<u32>> = keep
        .iter()
        .map(|&kept| {
            n_kept += u32::from(kept);
            kept.then(|| n_kept - 1)
        })
        .collect();
    let whole = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| new_place[i as usize]);
        Some([a?, b?, c?])
    };
    RawScan {
        points: marked(scan.points.iter(), keep).collect(),
        normals: scan.normals.as_ref().map(|n| marked(n.iter().copied(), keep).collect()),
        triangles: scan.triangles.iter().filter_map(whole).collect(),
        viewpoint: scan.viewpoint,
        unread: scan.unread.clone(),
    }
}

fn marked<T>(values: impl Iterator<Item = T>, keep: &[bool]) -> impl Iterator<Item = T> {
    values.zip(keep).filter(|(_, kept)| **kept).map(|(value, _)| value)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use congruent_geometry::wide;
    use nalgebra::Vector3;

    /// A flat random cloud over 10 × 10 units; the normal of each point holds its number.
    pub(crate) fn cloud(n: u32) -> RawScan {
        let mut stream = Stream::new(9, 0);
        let points = (0..n).map(|_| [stream.between(0.0, 10.0), stream.between(0.0, 10.0), 1.0]).collect();
        let normals = Some((0..n).map(|i| [i as f32, 0.0, 0.0]).collect());
        let triangles = (2..n).map(|i| [i - 2, i - 1, i]).collect();
        RawScan { points, normals, triangles, viewpoint: Some([5.0, 5.0, 30.0]), ..RawScan::default() }
    }

    /// Returns the numbers of the points that are left, read from their normals; checks that points and triangles
    /// correspond.
    pub(crate) fn survivors(original: &RawScan, left: &RawScan) -> Vec<u32> {
        let numbers: Vec<u32> = left.normals.as_ref().unwrap().iter().map(|n| n[0] as u32).collect();
        assert_eq!(left.viewpoint, original.viewpoint);
        let expected: Vec<[f64; 3]> = numbers.iter().map(|&i| original.points.at(i as usize)).collect();
        assert_eq!(left.points, expected);
        for t in &left.triangles {
            assert!(original.triangles.contains(&t.map(|i| numbers[i as usize])));
        }
        numbers
    }

    #[test]
    fn strays_come_last_and_are_all_around() {
        let clean = cloud(1000);
        let strewn = add_strays(&clean, 0.3, 4);
        assert_eq!((strewn.points.len(), strewn.normals.as_ref().unwrap().len()), (1300, 1300));
        assert!(clean.points.iter().eq(strewn.points.iter().take(1000)));
        let outside = strewn.points.iter().skip(1000).filter(|p| !(0.0..=10.0).contains(&p[0])).count();
        assert!((20..90).contains(&outside), "{outside} of 50 expected");
        assert_eq!(add_strays(&RawScan::default(), 0.3, 4), RawScan::default());
    }

    #[test]
    fn noise_has_its_deviation_on_each_axis() {
        let clean = cloud(20_000);
        let noisy = add_noise(&clean, 0.5, 3);
        for axis in 0..3 {
            let errors = clean.points.iter().zip(noisy.points.iter()).map(|(a, b)| b[axis] - a[axis]);
            let variance = errors.map(|e| e * e).sum::<f64>() / 20_000.0;
            // Six standard errors of a variance from 20 000 draws.
            assert!((variance / 0.25 - 1.0).abs() < 0.06, "{axis}: {variance}");
        }
        assert_eq!(add_noise(&clean, 0.5, 3), noisy);
        assert_ne!(add_noise(&clean, 0.5, 4), noisy);
        assert_eq!(add_noise(&clean, 0.0, 3), clean);
    }

    #[test]
    fn random_decimation_keeps_the_exact_count_in_order() {
        let all = cloud(1001);
        for (share, expected) in [(0.0, 0), (0.2, 200), (0.5, 501), (1.0, 1001), (-1.0, 0), (7.0, 1001)] {
            let kept = survivors(&all, &keep_random(&all, share, 1));
            assert_eq!(kept.len(), expected);
            assert!(kept.is_sorted());
        }
        assert_eq!(keep_random(&all, 0.3, 5), keep_random(&all, 0.3, 5));
        assert_ne!(keep_random(&all, 0.3, 5), keep_random(&all, 0.3, 6));
        assert_eq!(keep_random(&RawScan::default(), 0.5, 0), RawScan::default());
    }

    #[test]
    fn permutation_keeps_the_set_and_the_triangles() {
        let all = cloud(500);
        let mixed = permuted(&all, 2);
        let mut numbers = survivors(&all, &mixed);
        assert_ne!(numbers, (0..500).collect::<Vec<_>>());
        numbers.sort_unstable();
        assert_eq!(numbers, (0..500).collect::<Vec<_>>());
        assert_eq!(mixed.triangles.len(), all.triangles.len());
    }

    #[test]
    fn motion_turns_normals_but_does_not_shift_them() {
        let scan = RawScan {
            points: vec![[1.0, 0.0, 0.0]].into(),
            normals: Some(vec![[1.0, 0.0, 0.0]]),
            triangles: vec![],
            viewpoint: Some([1.0, 0.0, 0.0]),
            ..RawScan::default()
        };
        let quarter = RigidTransform::new(Vector3::new(0.0, 0.0, 5.0), Vector3::z() * std::f64::consts::FRAC_PI_2);
        let turned = moved(&scan, &quarter);
        assert!((Vector3::from(turned.points.at(0)) - Vector3::new(0.0, 1.0, 5.0)).norm() < 1e-12);
        assert!((wide(turned.normals.as_ref().unwrap()[0]) - Vector3::y()).norm() < 1e-6);
        assert_eq!(turned.viewpoint, turned.points.get(0));
        assert_eq!(scaled(&scan, 1000.0).points, [[1000.0, 0.0, 0.0]]);
        assert_eq!(scaled(&scan, 1000.0).viewpoint, Some([1000.0, 0.0, 0.0]));
    }
}
