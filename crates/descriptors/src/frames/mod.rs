//! Local reference frames: axes that the surface itself gives to a point, so that they move with it.

mod shot;
mod toldi;

pub(crate) use shot::shot_frame;
pub use shot::{ShotFrame, ShotFrameConfig};
pub use toldi::{ToldiFrame, ToldiFrameConfig};

use congruent_geometry::Surface;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// The local reference frame of a surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    /// Rows x, y, z: maps an offset from the point into the frame. A rotation.
    pub axes: Matrix3<f64>,
    /// How well the axes are determined.
    pub margins: Margins,
}

/// How well the axes of a frame are determined, each from 0 (arbitrary) to 1 (unambiguous).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// The line on which z lies: (λ1 − λ0) / λ2 of the ascending eigenvalues.
    pub z: f64,
    /// The line on which x lies: (λ2 − λ1) / λ2 (SHOT), or how far the votes for x agree (TOLDI).
    pub x: f64,
    /// The sign of z: how far the votes for it agree.
    pub z_sign: f64,
    /// The sign of x, likewise; for TOLDI the same as [`Margins::x`].
    pub x_sign: f64,
}

impl Margins {
    /// Returns the least of the margins.
    #[must_use]
    pub fn weakest(&self) -> f64 {
        self.z.min(self.x).min(self.z_sign).min(self.x_sign)
    }
}

/// Computes the local reference frames of surface points.
pub trait ReferenceFrame: Send + Sync {
    /// Returns the frame of one surface point; `None` if there is too little around it.
    fn frame(&self, surface: &Surface, keypoint: u32) -> Option<LocalFrame>;
}

/// The choice of a local reference frame with its settings: one table of `[frame.shot]`, `[frame.toldi]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrameConfig {
    /// From the scatter of the neighbours.
    Shot(ShotFrameConfig),
    /// From the normal and the heights above the tangent plane.
    Toldi(ToldiFrameConfig),
}

impl Default for FrameConfig {
    fn default() -> Self {
        FrameConfig::Shot(ShotFrameConfig::default())
    }
}

impl FrameConfig {
    /// Builds the reference frame for a cloud of this resolution.
    #[must_use]
    pub fn build(&self, resolution: f64) -> Box<dyn ReferenceFrame> {
        match self {
            FrameConfig::Shot(config) => Box::new(config.build(resolution)),
            FrameConfig::Toldi(config) => Box::new(config.build(resolution)),
        }
    }
}

/// Returns right-handed axes from perpendicular z and x.
fn axes(x: &Vector3<f64>, z: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_rows(&[x.transpose(), z.cross(x).transpose(), z.transpose()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_simulation::testing::{bumpy, plane, surface, turn, turned};

    fn family() -> [FrameConfig; 2] {
        [FrameConfig::Shot(ShotFrameConfig::default()), FrameConfig::Toldi(ToldiFrameConfig::default())]
    }

    #[test]
    fn frames_are_rotations_with_margins_between_zero_and_one() {
        let surface = bumpy(40, 1);
        for config in family() {
            let frames = config.build(0.5);
            for keypoint in 0..surface.len() as u32 {
                let frame = frames.frame(&surface, keypoint).unwrap();
                assert!((frame.axes * frame.axes.transpose() - Matrix3::identity()).norm() < 1e-6);
                assert!((frame.axes.determinant() - 1.0).abs() < 1e-6);
                let Margins { z, x, z_sign, x_sign } = frame.margins;
                assert!([z, x, z_sign, x_sign].iter().all(|m| (0.0..=1.0).contains(m)), "{:?}", frame.margins);
            }
        }
    }

    #[test]
    fn settled_frames_turn_with_the_surface() {
        let before = bumpy(40, 2);
        let after = turned(&before, 7);
        let rotation = turn(7).to_rotation_matrix();
        for config in family() {
            let frames = config.build(0.5);
            let (mut settled, mut same) = (0, 0);
            for keypoint in 0..before.len() as u32 {
                let a = frames.frame(&before, keypoint).unwrap();
                let b = frames.frame(&after, keypoint).unwrap();
                if a.margins.weakest() > 0.1 {
                    settled += 1;
                    same += u32::from((b.axes - a.axes * rotation.matrix().transpose()).norm() < 1e-4);
                }
            }
            // A neighbour on the very rim of the radius may fall on either side after rounding.
            assert!(settled > 100 && f64::from(same) >= 0.99 * f64::from(settled), "{config:?}: {same} of {settled}");
        }
    }

    #[test]
    fn too_few_and_coincident_points_have_no_frame() {
        for points in [vec![[0.0; 3]], vec![[1.0; 3]; 20], vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]] {
            for config in family() {
                assert_eq!(config.build(1.0).frame(&surface(points.clone()), 0), None);
            }
        }
    }

    #[test]
    fn on_a_plane_the_signs_are_open() {
        let plane = plane(21);
        let shot = FrameConfig::default().build(0.5).frame(&plane, 220).unwrap();
        assert_eq!(shot.margins.z_sign, 0.0);
        assert_eq!(FrameConfig::Toldi(ToldiFrameConfig::default()).build(0.5).frame(&plane, 220), None);
    }

    #[test]
    fn configurations_survive_the_round_trip() {
        for config in family() {
            let text = toml::to_string(&config).unwrap();
            assert_eq!(toml::from_str::<FrameConfig>(&text).unwrap(), config, "{text}");
        }
        assert_eq!(toml::from_str::<FrameConfig>("[toldi]").unwrap(), family()[1]);
        assert!(toml::from_str::<FrameConfig>("[shot]\nsize = \"3pr\"").is_err());
    }
}
