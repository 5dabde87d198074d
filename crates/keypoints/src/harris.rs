//! Harris keypoints on surfaces (Harris and Stephens 1988, with normals for gradients, as in PCL's `HarrisKeypoint3D`).
//!
//! A point is salient if the normals around it point in three clearly different directions: a corner.

use crate::corner::refined;
use crate::detector::POINTS_AT_A_TIME;
use crate::{Detector, Keypoint, Ties, local_maxima};
use congruent_geometry::{
    Length, Neighborhood, OuterSum, PointNormal, RadiusSearch, Surface, estimate_normals, sorted_eigen, wide,
};
use nalgebra::Matrix3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Weight of the squared trace in the Harris response (PCL's constant, and the classic one).
const HARRIS_K: f64 = 0.04;
/// A refinement ends with a move of at most this length, in resolutions (PCL's bound is in data units).
const REFINEMENT_STEP: f64 = 1e-3;

/// The measure of `M`, the mean of `n nᵀ` over the unit normals `n` around a point. Its trace is 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HarrisResponse {
    /// `0.04 + det M − 0.04 (tr M)²`. As the trace is 1 this is `det M`, from 0 (an edge) to 1/27 (a cube's corner).
    #[default]
    Harris,
    /// `det M / tr M`; the same detector as [`HarrisResponse::Harris`].
    Noble,
    /// `det M / (tr M)²`; the same detector as [`HarrisResponse::Harris`].
    Lowe,
    /// The smallest eigenvalue of `M`, from 0 to 1/3.
    Tomasi,
    /// Surface variation λ0 / (λ0 + λ1 + λ2) of the points instead of the normals, from 0 to 1/3.
    Curvature,
}

/// `[detector.harris]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct HarrisConfig {
    /// Radius of normals, response and suppression alike (as in PCL). 2 pr in the demo code of Yang et al.
    pub radius: Length,
    /// The measure used as response.
    pub response: HarrisResponse,
    /// Points with a lower response are no keypoints; no unit. PCL's default of 0 also keeps noise on smooth parts.
    #[serde(deserialize_with = "congruent_geometry::numbers::finite")]
    pub threshold: f64,
    /// Which of neighbours with exactly equal responses are kept; PCL keeps all.
    pub ties: Ties,
    /// Where a keypoint is placed once it is found. The programs of Yang et al. keep it in place.
    pub placement: Placement,
}

/// Where a keypoint is placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Placement {
    /// Where it was found.
    #[default]
    Kept,
    /// At the surface point nearest to where the tangent planes around it meet. (PCL's refinement leaves the surface.)
    Refined,
}

impl Default for HarrisConfig {
    fn default() -> Self {
        HarrisConfig {
            radius: Length::Resolutions(2.0),
            response: HarrisResponse::Harris,
            threshold: 0.0,
            ties: Ties::LowestIndex,
            placement: Placement::Kept,
        }
    }
}

impl HarrisConfig {
    /// Builds the detector for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Harris {
        Harris {
            radius: self.radius.resolve(resolution),
            response: self.response,
            threshold: self.threshold,
            ties: self.ties,
            placement: self.placement,
            step: REFINEMENT_STEP * resolution,
        }
    }
}

/// Keypoint detector by the spread of normals.
///
/// Reads only the points: it estimates its own normals, whose sign does not matter. Points without any valid normal
/// around them have a response of 0, so that a threshold of 0 keeps them; [`supported`](crate::supported) drops them.
#[derive(Clone, Debug, PartialEq)]
pub struct Harris {
    /// Radius of normals, response and suppression; data units.
    pub radius: f64,
    /// The measure used as response.
    pub response: HarrisResponse,
    /// Minimum response of a keypoint.
    pub threshold: f64,
    /// Which of neighbours with exactly equal responses are kept.
    pub ties: Ties,
    /// Where a keypoint is placed once it is found.
    pub placement: Placement,
    /// A refinement ends with a move of at most this length; data units.
    pub step: f64,
}

impl Detector for Harris {
    fn detect(&self, surface: &Surface) -> Vec<Keypoint> {
        let normals = estimate_normals(surface.points(), surface.index(), Neighborhood::Radius(self.radius));
        let around = RadiusSearch::new(surface, self.radius);
        let response = |i| Some(self.response_at(surface, &around, &normals, i)).filter(|r| *r >= self.threshold);
        let responses: Vec<Option<f64>> =
            (0..surface.len()).into_par_iter().with_max_len(POINTS_AT_A_TIME).map(response).collect();
        let found = local_maxima(surface, &responses, self.radius, self.ties);
        match self.placement {
            Placement::Kept => found,
            Placement::Refined => self.refined(surface, &normals, &found),
        }
    }
}

impl Harris {
    /// Refines keypoints; of those that meet in one point only the strongest is kept.
    fn refined(&self, surface: &Surface, normals: &[PointNormal], found: &[Keypoint]) -> Vec<Keypoint> {
        let mut moved: Vec<Keypoint> =
            found.par_iter().map(|k| refined(surface, normals, *k, self.radius, self.step)).collect();
        moved.sort_by(|a, b| a.index.cmp(&b.index).then(b.response.total_cmp(&a.response)));
        moved.dedup_by_key(|k| k.index);
        moved
    }

    fn response_at(&self, surface: &Surface, around: &RadiusSearch<'_>, normals: &[PointNormal], i: usize) -> f64 {
        if self.response == HarrisResponse::Curvature {
            return f64::from(normals[i].curvature);
        }
        mean_of_squares(surface, around, normals, i).map_or(0.0, |m| self.response.of(&m))
    }
}

impl HarrisResponse {
    /// Returns the response for `m`. The curvature cannot be computed from `m`; the smallest eigenvalue stands in for
    /// it.
    fn of(self, m: &Matrix3<f64>) -> f64 {
        let (det, trace) = (m.determinant(), m.trace());
        match self {
            // 0.04 − 0.04 tr² as a product: the difference of two numbers near 0.04 would lose digits of det.
            HarrisResponse::Harris => det + HARRIS_K * (1.0 - trace) * (1.0 + trace),
            HarrisResponse::Noble => det / trace,
            HarrisResponse::Lowe => det / (trace * trace),
            HarrisResponse::Tomasi | HarrisResponse::Curvature => sorted_eigen(m).values[0],
        }
    }
}

/// Returns the mean of `n nᵀ` over the valid normals around a point, its own included; `None` if there are none.
fn mean_of_squares(
    surface: &Surface,
    around: &RadiusSearch<'_>,
    normals: &[PointNormal],
    i: usize,
) -> Option<Matrix3<f64>> {
    let (mut squares, mut count) = (OuterSum::default(), 0u32);
    around.visit(&surface.points()[i], |n| {
        let normal = wide(normals[n.index as usize].normal);
        // Stored as `f32`, normals have unit length only to 1e-7; det is often smaller than that.
        let length_sq = normal.norm_squared();
        if length_sq > 0.0 {
            squares.add(&normal, 1.0 / length_sq);
            count += 1;
        }
    });
    (count > 0).then(|| squares.matrix() / f64::from(count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{cube_corner, indices, overlap};
    use congruent_simulation::testing::{bumpy, plane, surface, turned};

    const METHODS: [HarrisResponse; 5] = [
        HarrisResponse::Harris,
        HarrisResponse::Noble,
        HarrisResponse::Lowe,
        HarrisResponse::Tomasi,
        HarrisResponse::Curvature,
    ];

    #[test]
    fn a_cube_corner_responds_most_and_an_edge_not_at_all() {
        let (corner, normals) = cube_corner(3, 5);
        let m = mean_of_squares(&corner, &RadiusSearch::new(&corner, 4.0), &normals, 0).unwrap();
        assert!((m.trace() - 1.0).abs() < 1e-12);
        for method in [HarrisResponse::Harris, HarrisResponse::Noble, HarrisResponse::Lowe] {
            assert!((method.of(&m) - 1.0 / 27.0).abs() < 1e-12);
        }
        assert!((HarrisResponse::Tomasi.of(&m) - 1.0 / 3.0).abs() < 1e-12);

        let (edge, normals) = cube_corner(2, 5);
        let m = mean_of_squares(&edge, &RadiusSearch::new(&edge, 4.0), &normals, 0).unwrap();
        for method in METHODS {
            assert!(method.of(&m).abs() < 1e-12);
        }
    }

    #[test]
    fn flipped_normals_change_nothing() {
        let (corner, mut normals) = cube_corner(3, 5);
        let before = mean_of_squares(&corner, &RadiusSearch::new(&corner, 4.0), &normals, 0);
        normals.iter_mut().step_by(3).for_each(|n| n.normal = n.normal.map(|v| -v));
        assert_eq!(mean_of_squares(&corner, &RadiusSearch::new(&corner, 4.0), &normals, 0), before);
    }

    #[test]
    fn on_a_plane_without_noise_keep_all_keeps_every_point_and_lowest_index_few() {
        let plane = plane(40);
        for response in METHODS {
            let mut config = HarrisConfig { response, ties: Ties::KeepAll, ..HarrisConfig::default() };
            assert_eq!(config.build(1.0).detect(&plane).len(), 1600);
            config.ties = Ties::LowestIndex;
            assert!(config.build(1.0).detect(&plane).len() < 10);
        }
    }

    #[test]
    fn a_turned_surface_has_the_same_keypoints() {
        let before = bumpy(50, 1);
        let after = turned(&before, 2);
        for response in METHODS {
            let config = HarrisConfig { response, threshold: 1e-4, ..HarrisConfig::default() };
            let detector = config.build(before.resolution());
            let (a, b) = (indices(&detector.detect(&before)), indices(&detector.detect(&after)));
            assert!(a.len() > 30 && overlap(&a, &b) >= 0.99, "{response:?}: {} {}", a.len(), overlap(&a, &b));
        }
    }

    #[test]
    fn harris_noble_and_lowe_are_one_detector() {
        let surface = bumpy(40, 3);
        let keypoints = |response| {
            let config = HarrisConfig { response, threshold: 1e-6, ..HarrisConfig::default() };
            indices(&config.build(surface.resolution()).detect(&surface))
        };
        assert_eq!(keypoints(HarrisResponse::Harris), keypoints(HarrisResponse::Noble));
        assert_eq!(keypoints(HarrisResponse::Harris), keypoints(HarrisResponse::Lowe));
    }

    #[test]
    fn lone_points_respond_zero() {
        let lone = surface(vec![[0.0; 3], [10.0, 0.0, 0.0], [20.0, 0.0, 0.0]]);
        let keypoints = HarrisConfig::default().build(1.0).detect(&lone);
        assert!(keypoints.len() == 3 && keypoints.iter().all(|k| k.response == 0.0));
        let strict = HarrisConfig { threshold: 1e-9, ..HarrisConfig::default() };
        assert!(strict.build(1.0).detect(&lone).is_empty());
    }
}
