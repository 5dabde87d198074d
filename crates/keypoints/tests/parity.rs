//! Agreement with PCL's keypoints on a stored scan. `scripts/parity` creates the tables.
//!
//! Harris responses differ only by rounding, but on smooth parts rounding decides: PCL computes them in `f32`, we in
//! `f64`. There the sets differ; where the response exceeds rounding they do not. Suppression itself agrees to the last
//! point.

#[allow(dead_code, reason = "each crate's test reads a part of the tables")]
#[cfg(test)]
#[path = "../../../scripts/parity/tables.rs"]
mod tables;

use congruent_geometry::{Length, Surface};
use congruent_keypoints::{
    Detector, HarrisConfig, HarrisResponse, IssConfig, IssVariant, Keypoint, Ties, local_maxima,
};

const RADIUS: Length = Length::Resolutions(3.0);

fn indices(keypoints: &[Keypoint]) -> Vec<u32> {
    keypoints.iter().map(|k| k.index).collect()
}

struct Comparison {
    name: &'static str,
    surface: Surface,
    ours: Vec<Keypoint>,
    pcls: Vec<u32>,
    /// PCL's response at every point.
    responses: Vec<f64>,
}

impl Comparison {
    fn new(name: &'static str, response: HarrisResponse) -> Comparison {
        let surface = tables::surface();
        let config =
            HarrisConfig { radius: RADIUS, response, threshold: 0.0, ties: Ties::KeepAll, ..HarrisConfig::default() };
        let ours = config.build(surface.resolution()).detect(&surface);
        let responses = tables::rows::<1>(&format!("{name}.f32")).iter().map(|r| f64::from(r[0])).collect();
        Comparison { name, surface, ours, pcls: tables::indices(&format!("{name}.u32")), responses }
    }

    /// Similarity of the sets, restricted to keypoints with at least this response.
    fn likeness(&self, least: f64) -> f64 {
        let ours: Vec<u32> = self.ours.iter().filter(|k| k.response >= least).map(|k| k.index).collect();
        let pcls: Vec<u32> = self.pcls.iter().copied().filter(|&i| self.responses[i as usize] >= least).collect();
        tables::jaccard(&format!("{}, responses from {least:e}", self.name), &ours, &pcls)
    }

    /// Fraction of our keypoints at which PCL's response is the same.
    fn same_responses(&self, tolerance: f64) -> f64 {
        let differences = self.ours.iter().map(|k| (k.response - self.responses[k.index as usize]).abs()).collect();
        tables::share_within(&format!("{}, responses", self.name), tolerance, differences)
    }

    /// Similarity of the sets if we suppress PCL's responses.
    fn suppressed_alike(&self) -> f64 {
        let candidates: Vec<Option<f64>> = self.responses.iter().map(|r| Some(*r).filter(|r| *r >= 0.0)).collect();
        let radius = RADIUS.resolve(self.surface.resolution());
        let ours = local_maxima(&self.surface, &candidates, radius, Ties::KeepAll);
        tables::jaccard(&format!("{}, suppression", self.name), &indices(&ours), &self.pcls)
    }
}

/// PCL adds 0.04 to the determinant in `f32` and subtracts it again: this leaves multiples of 3.7e-9, with errors of up
/// to 2e-8. It adds two points, both of which truly have a response of zero: 93 of 95 are shared, hence not 0.98.
#[test]
fn harris_keypoints_are_pcls() {
    let harris = Comparison::new("harris", HarrisResponse::Harris);
    let (all, clear) = (harris.likeness(0.0), harris.likeness(1e-6));
    let (same, suppressed) = (harris.same_responses(1e-5), harris.suppressed_alike());
    assert!(all >= 0.975 && clear >= 0.98);
    assert!(same == 1.0 && suppressed == 1.0);
}

/// Uses the determinant alone: the same detector without the detour via 0.04.
#[test]
fn noble_keypoints_are_pcls() {
    let noble = Comparison::new("noble", HarrisResponse::Noble);
    let (all, same, suppressed) = (noble.likeness(0.0), noble.same_responses(1e-5), noble.suppressed_alike());
    assert!(all >= 0.98 && same == 1.0 && suppressed == 1.0);
}

/// PCL computes the smallest eigenvalue in closed form in `f32`, with errors of up to 3e-4, and sets negative results
/// to zero. Flat parts, where the eigenvalue is no larger than that, have other keypoints: hence 0.955, not 0.98.
#[test]
fn tomasi_keypoints_are_pcls() {
    let tomasi = Comparison::new("tomasi", HarrisResponse::Tomasi);
    let (all, clear) = (tomasi.likeness(0.0), tomasi.likeness(1e-3));
    let (close, same, suppressed) =
        (tomasi.same_responses(1e-5), tomasi.same_responses(4e-4), tomasi.suppressed_alike());
    assert!(all >= 0.95 && clear >= 0.98);
    assert!(close >= 0.95 && same == 1.0 && suppressed == 1.0);
}

#[test]
fn iss_keypoints_are_pcls() {
    let surface = tables::surface();
    let config = IssConfig {
        variant: IssVariant::Pcl,
        salient_radius: Length::Resolutions(2.7),
        suppression_radius: Length::Resolutions(1.8),
        gamma_21: 0.975,
        gamma_32: 0.975,
        min_neighbors: 5,
        boundary_radius: None,
        ties: Ties::KeepAll,
    };
    let ours = config.build(surface.resolution()).detect(&surface);
    assert!(tables::jaccard("iss", &indices(&ours), &tables::indices("iss.u32")) >= 0.98);
}
