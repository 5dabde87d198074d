//! Agreement with PCL on a stored scan: resolution, voxel grid, normals. `scripts/parity` creates the tables.

#[allow(dead_code, reason = "each crate's test reads a part of the tables")]
#[cfg(test)]
#[path = "../../../scripts/parity/tables.rs"]
mod tables;

use congruent_geometry::{
    NeighborIndex, Neighborhood, Orientation, Point, estimate_normals, orient, resolution, voxel_centroids, wide,
};
use nalgebra::Vector3;

#[test]
fn resolution_is_pcls() {
    let points = tables::points();
    let ours = resolution(&points, &NeighborIndex::new(&points)).unwrap().mean;
    let difference = (ours / tables::resolution() - 1.0).abs();
    println!("resolution: {difference:.1e} relative");
    assert!(difference < 1e-6);
}

/// On other scans the number of cells may differ slightly: PCL multiplies by 1 / leaf in `f32`, which moves a point
/// next to a cell's face into the other cell.
#[test]
fn voxel_centroids_are_pcls() {
    let leaf = 2.0 * tables::resolution();
    let ours = voxel_centroids(&tables::points(), None, leaf).points;
    let pcls: Vec<Point> = tables::rows("voxels.f32");
    println!("voxels: {} of ours, {} of PCL's", ours.len(), pcls.len());
    assert_eq!(ours.len(), pcls.len());
    let index = NeighborIndex::new(&pcls);
    let distances = ours.iter().map(|p| f64::from(index.nearest(p).unwrap().distance_sq).sqrt() / leaf).collect();
    assert_eq!(tables::share_within("centroids, distance in leaves", 1e-4, distances), 1.0);
}

/// Returns whether the `k` nearest points are unambiguous: the next is farther by more than rounding.
fn has_settled_neighbors(index: &NeighborIndex, point: &Point, k: usize) -> bool {
    let nearest = index.nearest_n(point, k + 1);
    nearest.len() <= k || nearest[k].distance_sq > nearest[k - 1].distance_sq * (1.0 + 1e-5)
}

#[test]
fn normals_are_pcls() {
    for k in [20, 50] {
        let points = tables::points();
        let index = NeighborIndex::new(&points);
        let estimates = estimate_normals(&points, &index, Neighborhood::Nearest(k));
        let mut ours: Vec<Point> = estimates.iter().map(|n| n.normal).collect();
        orient(
            Orientation::Viewpoint { at: [0.0; 3] },
            &points,
            &Vector3::zeros(),
            &index,
            tables::resolution(),
            None,
            &mut ours,
        );
        let pcls: Vec<[f32; 4]> = tables::rows(&format!("normals{k}.f32"));

        let settled: Vec<usize> = (0..points.len()).filter(|&i| has_settled_neighbors(&index, &points[i], k)).collect();
        println!("normals of {k}: {} of {} points have settled neighbours", settled.len(), points.len());
        let dot = |&i: &usize| wide(ours[i]).dot(&wide([pcls[i][0], pcls[i][1], pcls[i][2]]));
        let lines = settled.iter().map(|i| 1.0 - dot(i).abs()).collect();
        assert!(tables::share_within(&format!("normals of {k}, 1 − |dot|"), 1e-5, lines) >= 0.999);
        let signs = settled.iter().map(|i| f64::from(u8::from(dot(i) < 0.0))).collect();
        assert!(tables::share_within(&format!("normals of {k}, other side"), 0.0, signs) >= 0.999);
        let curvatures = settled.iter().map(|&i| f64::from(estimates[i].curvature - pcls[i][3]).abs()).collect();
        assert!(tables::share_within(&format!("curvatures of {k}"), 1e-5, curvatures) >= 0.999);
    }
}
