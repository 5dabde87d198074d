//! Properties of the generated benchmarks.

use super::*;

#[test]
fn every_kind_has_pairs_whose_truth_brings_surface_onto_surface() {
    for (kind, fewest) in [(Kind::U3m, 8), (Kind::Bmr, 8), (Kind::U3or, 4), (Kind::Bod5, 4)] {
        let group = Benchmark::new(kind, 5).group(0);
        assert!(group.pairs.len() >= fewest, "{kind:?}: {} pairs", group.pairs.len());
        for pair in &group.pairs {
            let (source, target) = (&group.scans[pair.source].1, &group.scans[pair.target].1);
            assert!(source.points.len() > 1000 && target.points.len() > 1000, "{kind:?}");
            let radius = 2.0 * spacing(source).max(spacing(target));
            let truly = overlap(source, target, &pair.target_from_source, radius);
            let aside = RigidTransform::translation(0.0, 0.0, 30.0) * pair.target_from_source;
            assert!(truly > 1.5 * overlap(source, target, &aside, radius), "{kind:?} {truly}");
        }
        let overlaps: Vec<f64> = group.pairs.iter().map(|pair| pair.overlap).collect();
        assert!(kind.has_scenes() || overlaps.iter().all(|v| (MIN_OVERLAP..=1.0).contains(v)), "{overlaps:?}");
    }
}

#[test]
fn other_shapes_are_scanned_in_turn_at_a_figurines_size() {
    let tall = |height: f64| {
        let mut mesh = figurine(1);
        mesh.points.iter_mut().for_each(|p| *p = [p[0] * height + 5e3, p[1] * height, p[2] * height]);
        mesh
    };
    let scans = |shapes: Vec<Mesh>| Benchmark::of_shapes(Kind::U3m, 3, shapes).group(1).scans;
    let (small, large) = (scans(vec![tall(0.01)]), scans(vec![Mesh::default(), tall(70.0)]));
    assert_eq!(small.len(), 8);
    let extent = |scan: &RawScan| {
        let z = || scan.points.iter().map(|p| p[0]);
        z().fold(f64::NEG_INFINITY, f64::max) - z().fold(f64::INFINITY, f64::min)
    };
    for ((_, small), (_, large)) in small.iter().zip(&large) {
        assert!((extent(small) / extent(large) - 1.0).abs() < 0.05 && small.points.len() > 10_000);
    }
}

#[test]
fn a_group_depends_on_seed_and_number_alone() {
    let scans = |seed, group| Benchmark::new(Kind::Bmr, seed).group(group).scans;
    assert_eq!(scans(1, 1), scans(1, 1));
    assert_ne!(scans(1, 1), scans(2, 1));
    assert_ne!(scans(1, 1)[0].1, scans(1, 0)[0].1);
}
