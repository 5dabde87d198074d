//! Whether a pose is as accurate as its covariance says.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_geometry::{NeighborIndex, RigidTransform, Scan, resolution};
use congruent_pipeline::{Guess, PipelineConfig, refine};
use congruent_refinement::Uncertainty;
use congruent_simulation::pair::{PairOptions, figurine_pair};
use congruent_simulation::scanner::RangeNoise;
use nalgebra::{Point3, Vector3, Vector6};

/// `ξᵀΣ⁻¹ξ` of the motion from the answer to the truth: six on average if the covariance is right.
fn normalised_error(answer: &RigidTransform, truth: &RigidTransform, known: &Uncertainty) -> f64 {
    let missing = truth * answer.inverse();
    let (turn, about) = (missing.rotation.scaled_axis(), Point3::from(known.about));
    let shift = missing * about - about;
    let error = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
    error.dot(&known.covariance.cholesky().unwrap().solve(&error))
}

#[test]
fn errors_are_as_large_as_the_covariance_says() {
    let config = PipelineConfig::default();
    let mut errors = Vec::new();
    for (seed, angle, noise_pr) in
        [(0u64, 20.0f64, 0.1), (1, 60.0, 0.1), (2, 20.0, 0.3), (3, 60.0, 0.3), (4, 20.0, 0.1), (5, 60.0, 0.3)]
    {
        let clean = PairOptions {
            seed: 1 + seed % 5,
            azimuth: 1.3 * seed as f64,
            view_angle: angle.to_radians(),
            pixels: 160,
            ..PairOptions::default()
        };
        let scan = Scan::new(&figurine_pair(&clean).source).unwrap();
        let pr = resolution(scan.points(), &NeighborIndex::new(scan.points())).unwrap().mean;
        let pair = figurine_pair(&PairOptions { noise: RangeNoise::gaussian(noise_pr * pr), ..clean });
        let truth = pair.target_from_source;
        let start = RigidTransform::new(Vector3::new(pr, -pr, 0.5 * pr), Vector3::new(0.002, -0.001, 0.002)) * truth;
        let (source, target) = (Scan::new(&pair.source).unwrap(), Scan::new(&pair.target).unwrap());
        let found = refine(&source, &target, &Guess::new(start), &config);
        let known = found.uncertainty().unwrap();
        assert!(known.free_directions.is_empty());
        errors.push(normalised_error(found.pose().unwrap(), &truth, known));
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    // Six, within a factor of two.
    println!("mean squared normalised error of {} poses: {mean:.2} (6 if the covariance is right)", errors.len());
    assert!((3.0..12.0).contains(&mean), "{mean}: {errors:?}");
}
