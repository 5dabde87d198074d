//! Agreement with PCL's frames and descriptors on a stored scan with PCL's normals. `scripts/parity` creates the
//! tables.

#[allow(dead_code, reason = "each crate's test reads a part of the tables")]
#[cfg(test)]
#[path = "../../../scripts/parity/tables.rs"]
mod tables;

use congruent_descriptors::{
    Descriptor, FpfhConfig, FpfhVariant, ReferenceFrame, ShotConfig, ShotFrameConfig, SpinImageConfig,
};
use congruent_geometry::{Length, Surface};

const RADIUS: Length = Length::Resolutions(15.0);

/// Returns our rows and PCL's for the keypoints that both could describe, which must be the same keypoints.
fn pairs<const DIM: usize>(
    surface: &Surface,
    descriptor: &impl Descriptor,
    name: &str,
) -> Vec<([f32; DIM], [f32; DIM])> {
    let described = tables::indices("described.u32");
    let features = descriptor.describe(surface, &described);
    let pcls: Vec<(u32, [f32; DIM])> =
        described.into_iter().zip(tables::rows(name)).filter(|r| r.1[0].is_finite()).collect();
    assert!(features.keypoints.iter().eq(pcls.iter().map(|r| &r.0)), "{name}: others are described");
    let (ours, rest) = features.rows.as_chunks::<DIM>();
    assert!(rest.is_empty());
    ours.iter().copied().zip(pcls.iter().map(|r| r.1)).collect()
}

fn distance<const DIM: usize>((a, b): &([f32; DIM], [f32; DIM])) -> f64 {
    a.iter().zip(b).map(|(x, y)| f64::from(x - y).powi(2)).sum::<f64>().sqrt()
}

fn largest_difference<const DIM: usize>((a, b): &([f32; DIM], [f32; DIM])) -> f64 {
    a.iter().zip(b).map(|(x, y)| f64::from(x - y).abs()).fold(0.0, f64::max)
}

fn length<const DIM: usize>(row: &[f32; DIM]) -> f64 {
    distance(&(*row, [0.0; DIM]))
}

#[test]
fn frames_are_pcls() {
    let surface = tables::surface();
    let frames = ShotFrameConfig { radius: RADIUS }.build(surface.resolution());
    let mut differences = Vec::new();
    for (keypoint, pcls) in tables::indices("described.u32").into_iter().zip(tables::rows::<9>("frames.f32")) {
        let ours = frames.frame(&surface, keypoint);
        assert_eq!(ours.is_some(), pcls[0].is_finite(), "{keypoint}");
        if let Some(frame) = ours {
            // nalgebra iterates along columns.
            let by_rows = frame.axes.transpose();
            differences.push(by_rows.iter().zip(pcls).map(|(a, b)| (a - f64::from(b)).abs()).fold(0.0, f64::max));
        }
    }
    assert!(tables::share_within("frames, largest entry", 1e-4, differences) >= 0.99);
}

#[test]
fn shot_is_pcls() {
    let surface = tables::surface();
    let shot = ShotConfig { radius: RADIUS, pcl_wrap: true }.build(surface.resolution());
    let differences = pairs::<352>(&surface, &shot, "shot.f32").iter().map(distance).collect();
    assert!(tables::share_within("shot, distance", 1e-3, differences) >= 0.98);
}

#[test]
fn spin_images_are_pcls() {
    let surface = tables::surface();
    let spin = SpinImageConfig { radius: RADIUS }.build(surface.resolution());
    let differences = pairs::<153>(&surface, &spin, "spin.f32").iter().map(largest_difference).collect();
    assert_eq!(tables::share_within("spin images, largest entry", 1e-4, differences), 1.0);
}

/// For two of the 200, the normals of a close pair are equally inclined to their line, up to the rounding of PCL's
/// `f32`: which point leads is then arbitrary, and one count goes to the mirrored bin.
#[test]
fn fpfh_is_pcls() {
    let surface = tables::surface();
    let fpfh = FpfhConfig { radius: RADIUS, variant: FpfhVariant::Pcl }.build(surface.resolution());
    let pairs = pairs::<33>(&surface, &fpfh, "fpfh.f32");
    let differences: Vec<f64> = pairs.iter().map(|pair| distance(pair) / length(&pair.1)).collect();
    assert!(tables::share_within("fpfh, relative distance", 1e-3, differences.clone()) >= 0.985);
    assert_eq!(tables::share_within("fpfh, relative distance", 5e-3, differences), 1.0);
}
