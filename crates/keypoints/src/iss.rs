//! Intrinsic Shape Signatures keypoints (Zhong 2009; details as in PCL's `ISSKeypoint3D`).
//!
//! A point is salient if its neighbours spread by three clearly different amounts.

use crate::boundary::near_boundary;
use crate::detector::POINTS_AT_A_TIME;
use crate::{Detector, Keypoint, Ties, local_maxima, supported};
use congruent_geometry::{Length, OuterSum, RadiusSearch, Surface, sorted_eigen, wide};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Up to this fraction of the largest eigenvalue, the smallest is rounding error of `f32` coordinates: the patch is
/// flat.
const FLAT: f64 = 1e-12;

/// How the scatter matrix of a neighbourhood is formed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IssVariant {
    /// Sum about the point, not normalised (PCL). Responses favour dense parts.
    #[default]
    Pcl,
    /// Mean about the point; a neighbour is weighted by one over the number of its own neighbours (Zhong 2009).
    Weighted,
    /// Covariance about the neighbours' mean (Open3D, with radii of 6 pr and 4 pr). Points that share all their
    /// neighbours tie, which is common with small radii.
    Centred,
}

/// `[detector.iss]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct IssConfig {
    /// How the scatter matrix is formed.
    pub variant: IssVariant,
    /// Radius of the scatter; 2.7 pr in the demo code of Yang et al.
    pub salient_radius: Length,
    /// Radius of the suppression; 1.8 pr in the demo code of Yang et al.
    pub suppression_radius: Length,
    /// Upper bound of the middle eigenvalue as a fraction of the largest; PCL's default.
    #[serde(deserialize_with = "congruent_geometry::numbers::positive")]
    pub gamma_21: f64,
    /// Upper bound of the smallest eigenvalue as a fraction of the middle one; PCL's default.
    #[serde(deserialize_with = "congruent_geometry::numbers::positive")]
    pub gamma_32: f64,
    /// Minimum number of points within either radius, the point itself included; PCL's default.
    pub min_neighbors: usize,
    /// Points this close to the surface's boundary are no keypoints (PCL's border radius); without it they may be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub boundary_radius: Option<Length>,
    /// Which of neighbours with exactly equal responses are kept; PCL keeps all.
    pub ties: Ties,
}

impl Default for IssConfig {
    fn default() -> Self {
        IssConfig {
            variant: IssVariant::Pcl,
            salient_radius: Length::Resolutions(2.7),
            suppression_radius: Length::Resolutions(1.8),
            gamma_21: 0.975,
            gamma_32: 0.975,
            min_neighbors: 5,
            boundary_radius: None,
            ties: Ties::LowestIndex,
        }
    }
}

impl IssConfig {
    /// Builds the detector for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Iss {
        Iss {
            variant: self.variant,
            salient_radius: self.salient_radius.resolve(resolution),
            suppression_radius: self.suppression_radius.resolve(resolution),
            gamma_21: self.gamma_21,
            gamma_32: self.gamma_32,
            min_neighbors: self.min_neighbors,
            boundary_radius: self.boundary_radius.map(|radius| radius.resolve(resolution)),
            ties: self.ties,
        }
    }
}

/// Keypoint detector by ratios of the eigenvalues of the scatter; the response is the smallest eigenvalue.
///
/// Flat, straight and isotropic neighbourhoods and those with too few points have no response. Normals are read only
/// for the boundary.
#[derive(Clone, Debug, PartialEq)]
pub struct Iss {
    /// How the scatter matrix is formed.
    pub variant: IssVariant,
    /// Radius of the scatter, data units.
    pub salient_radius: f64,
    /// Radius of the suppression, data units.
    pub suppression_radius: f64,
    /// Upper bound of middle / largest eigenvalue.
    pub gamma_21: f64,
    /// Upper bound of smallest / middle eigenvalue.
    pub gamma_32: f64,
    /// Minimum number of points within either radius, the point itself included.
    pub min_neighbors: usize,
    /// Distance kept from the boundary, data units.
    pub boundary_radius: Option<f64>,
    /// Which of neighbours with exactly equal responses are kept.
    pub ties: Ties,
}

impl Detector for Iss {
    fn detect(&self, surface: &Surface) -> Vec<Keypoint> {
        let around = RadiusSearch::new(surface, self.salient_radius);
        let weights = self.weights(surface, &around);
        let mut responses: Vec<Option<f64>> = (0..surface.len())
            .into_par_iter()
            .with_max_len(POINTS_AT_A_TIME)
            .map(|i| self.response_at(surface, &around, &weights, i))
            .collect();
        if let Some(radius) = self.boundary_radius {
            let near = near_boundary(surface, radius);
            responses.iter_mut().zip(near).filter(|(_, near)| *near).for_each(|(response, _)| *response = None);
        }
        let maxima = local_maxima(surface, &responses, self.suppression_radius, self.ties);
        supported(surface, &maxima, self.suppression_radius, self.min_neighbors)
    }
}

impl Iss {
    /// Returns the weight of each point in the scatter of its neighbours.
    fn weights(&self, surface: &Surface, around: &RadiusSearch<'_>) -> Vec<f64> {
        let crowding = |point| {
            let mut count = 0u32;
            around.visit(point, |_| count += 1);
            1.0 / f64::from(count)
        };
        match self.variant {
            IssVariant::Pcl | IssVariant::Centred => vec![1.0; surface.len()],
            IssVariant::Weighted => surface.points().par_iter().map(crowding).collect(),
        }
    }

    fn response_at(&self, surface: &Surface, around: &RadiusSearch<'_>, weights: &[f64], i: usize) -> Option<f64> {
        let [smallest, middle, largest] = sorted_eigen(&self.scatter(surface, around, weights, i)?).values;
        let flat = largest.is_nan() || largest <= 0.0 || smallest <= FLAT * largest;
        let distinct = middle < self.gamma_21 * largest && smallest < self.gamma_32 * middle;
        (!flat && distinct).then_some(smallest)
    }

    fn scatter(&self, surface: &Surface, around: &RadiusSearch<'_>, weights: &[f64], i: usize) -> Option<Matrix3<f64>> {
        let centre = wide(surface.points()[i]);
        let (mut count, mut total) = (0usize, 0.0);
        let (mut sum, mut squares) = (Vector3::zeros(), OuterSum::default());
        around.visit(&surface.points()[i], |n| {
            let weight = weights[n.index as usize];
            let offset = wide(surface.points()[n.index as usize]) - centre;
            count += 1;
            total += weight;
            sum += offset * weight;
            squares.add(&offset, weight);
        });
        let squares = squares.matrix();
        (count >= self.min_neighbors).then(|| match self.variant {
            IssVariant::Pcl => squares,
            IssVariant::Weighted => squares / total,
            IssVariant::Centred => (squares - sum * sum.transpose() / total) / total,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{indices, overlap};
    use congruent_simulation::testing::{bumpy, height_field, plane, surface, turned};

    const VARIANTS: [IssVariant; 3] = [IssVariant::Pcl, IssVariant::Weighted, IssVariant::Centred];

    fn detector(variant: IssVariant, resolution: f64) -> Iss {
        IssConfig { variant, ..IssConfig::default() }.build(resolution)
    }

    #[test]
    fn a_plane_has_no_keypoints_however_it_lies() {
        let flat = plane(30);
        for variant in VARIANTS {
            for plane in [&flat, &turned(&flat, 5)] {
                assert!(detector(variant, 1.0).detect(plane).is_empty(), "{variant:?}");
            }
        }
    }

    #[test]
    fn the_inside_of_an_isotropic_blob_does_not_respond() {
        let lattice = surface((0..729u16).map(|i| [i % 9, i / 9 % 9, i / 81].map(f32::from)).collect());
        let middle = 4 + 4 * 9 + 4 * 81;
        for variant in VARIANTS {
            let iss = detector(variant, 1.0);
            let around = RadiusSearch::new(&lattice, iss.salient_radius);
            assert_eq!(
                iss.response_at(&lattice, &around, &iss.weights(&lattice, &around), middle),
                None,
                "{variant:?}"
            );
        }
    }

    #[test]
    fn the_apex_of_an_oblong_bump_is_a_keypoint() {
        let bump = height_field(31, |x, y| 4.0 * (-(x * x) / 20.0 - y * y / 5.0).exp());
        for variant in VARIANTS {
            let keypoints = detector(variant, 1.0).detect(&bump);
            let near = |k: &&Keypoint| wide(bump.points()[k.index as usize]).xy().norm() <= 1.5;
            assert!(keypoints.iter().any(|k| near(&k)), "{variant:?}: {keypoints:?}");
        }
    }

    #[test]
    fn a_turned_surface_has_the_same_keypoints() {
        let before = bumpy(60, 1);
        let after = turned(&before, 3);
        // The wider radii leave no two points with the same neighbours, and thus no ties for rounding to break.
        for (variant, scale) in [(IssVariant::Pcl, 1.0), (IssVariant::Weighted, 1.0), (IssVariant::Centred, 2.2)] {
            let iss = detector(variant, scale * before.resolution());
            let (a, b) = (indices(&iss.detect(&before)), indices(&iss.detect(&after)));
            assert!(a.len() > 30 && overlap(&a, &b) >= 0.99, "{variant:?}: {} {}", a.len(), overlap(&a, &b));
        }
    }

    #[test]
    fn keypoints_keep_their_distance_from_the_boundary() {
        let surface = bumpy(40, 2);
        let iss = IssConfig { boundary_radius: Some(Length::Resolutions(4.0)), ..IssConfig::default() };
        let kept = iss.build(surface.resolution()).detect(&surface);
        let all = IssConfig::default().build(surface.resolution()).detect(&surface);
        assert!(!kept.is_empty() && kept.len() < all.len());
        let half_side = 20.0;
        for k in kept {
            let p = surface.points()[k.index as usize];
            assert!(f64::from(p[0].abs().max(p[1].abs())) < half_side - 3.0 * surface.resolution());
        }
    }

    #[test]
    fn lone_and_coincident_points_do_not_respond() {
        let mut points = vec![[0.0; 3]; 8];
        points.extend([[50.0, 0.0, 0.0], [100.0, 0.0, 0.0]]);
        for variant in VARIANTS {
            assert!(detector(variant, 1.0).detect(&surface(points.clone())).is_empty());
        }
    }
}
