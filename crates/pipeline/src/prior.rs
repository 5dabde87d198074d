//! Prior knowledge of a pose, and the poses that it admits.

use crate::Pair;
use congruent_geometry::{Length, RigidTransform, angle_between};
use congruent_refinement::Freedom;
use nalgebra::{Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

/// Maximum tilt of a pose proposed for levelled scans, radians; poses within it are made level.
pub const MAX_TILT: f64 = 0.26;

/// Prior knowledge of a pose; by default none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prior {
    /// A pose that the true one may be near.
    pub guess: Option<Guess>,
    /// The direction that is up in both scans, if they are levelled: the pose then rotates only about this direction.
    /// Poses that the correspondences propose may tilt by up to [`MAX_TILT`] (about 15°) and are made level; refinement
    /// keeps them level.
    pub up: Option<Unit<Vector3<f64>>>,
}

/// A pose that the true one may be near, and how far from it the answer may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Guess {
    /// Pose between file coordinates.
    pub target_from_source: RigidTransform,
    /// Maximum angle between the rotations of the answer and of the guess, radians; `None` for no limit.
    pub max_rotation: Option<f64>,
    /// Maximum distance between the positions to which the answer and the guess move the source's centre (the middle of
    /// its bounding box); `pr` is the mean resolution of the scans as provided. `None` for no limit.
    pub max_translation: Option<Length>,
}

impl Guess {
    /// Creates a guess that imposes no bounds.
    #[must_use]
    pub fn new(target_from_source: RigidTransform) -> Guess {
        Guess { target_from_source, max_rotation: None, max_translation: None }
    }
}

impl Prior {
    /// Creates a prior with a guess that imposes no bounds.
    #[must_use]
    pub fn guess(target_from_source: RigidTransform) -> Prior {
        Prior { guess: Some(Guess::new(target_from_source)), up: None }
    }

    /// Returns the poses that the prior admits between scans that were centred at these origins; the guess is made level
    /// if the scans are levelled. `resolution` is that of the scans as provided, the meaning of `pr`.
    pub(crate) fn bounds(&self, origins: &Pair<Vector3<f64>>, resolution: f64) -> Bounds {
        let near = self.guess.as_ref().map(|guess| {
            let pose = &guess.target_from_source;
            let shift = pose * nalgebra::Point3::from(origins.source) - nalgebra::Point3::from(origins.target);
            let centred = RigidTransform::from_parts(Translation3::from(shift), pose.rotation);
            Near {
                guess: level(&centred, self.up),
                max_rotation: guess.max_rotation,
                max_translation: guess.max_translation.map(|most| most.resolve(resolution)),
            }
        });
        Bounds { near, up: self.up }
    }
}

/// The poses between the centred clouds that the answer may be; by default all.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bounds {
    near: Option<Near>,
    up: Option<Unit<Vector3<f64>>>,
}

impl Bounds {
    /// Returns whether any pose is admitted.
    pub(crate) fn are_open(&self) -> bool {
        self.up.is_none() && !self.hold_to_guess()
    }

    /// Returns whether poses must be near a guess.
    pub(crate) fn hold_to_guess(&self) -> bool {
        self.near.as_ref().is_some_and(|near| near.max_rotation.is_some() || near.max_translation.is_some())
    }

    /// Returns the guess, made level if the scans are levelled.
    pub(crate) fn guess(&self) -> Option<RigidTransform> {
        self.near.as_ref().map(|near| near.guess)
    }

    /// Returns the motions that a refinement may make.
    pub(crate) fn freedom(&self) -> Freedom {
        self.up.map_or(Freedom::All, Freedom::About)
    }

    /// Returns the pose, made level if the scans are levelled; `None` if it is out of bounds.
    pub(crate) fn admitted(&self, pose: &RigidTransform) -> Option<RigidTransform> {
        if tilt(pose, self.up) > MAX_TILT {
            return None;
        }
        let pose = level(pose, self.up);
        self.near.as_ref().is_none_or(|near| near.holds(&pose)).then_some(pose)
    }
}

/// A guess between centred clouds, and how far from it poses may be, data units and radians.
#[derive(Clone, Debug)]
struct Near {
    guess: RigidTransform,
    max_rotation: Option<f64>,
    max_translation: Option<f64>,
}

impl Near {
    /// Returns whether a pose is within both limits, which are inclusive. Between centred clouds the source's centre is
    /// the origin.
    fn holds(&self, pose: &RigidTransform) -> bool {
        let shift = (pose.translation.vector - self.guess.translation.vector).norm();
        self.max_rotation.is_none_or(|most| angle_between(pose, &self.guess) <= most)
            && self.max_translation.is_none_or(|most| shift <= most)
    }
}

/// Returns the angle by which a pose tilts the direction `up`, radians; zero if there is none.
#[must_use]
pub fn tilt(pose: &RigidTransform, up: Option<Unit<Vector3<f64>>>) -> f64 {
    up.map_or(0.0, |up| (pose.rotation * up).angle(&up))
}

/// Returns the part of a pose that rotates about `up`; the source's centre goes to the same place.
fn level(pose: &RigidTransform, up: Option<Unit<Vector3<f64>>>) -> RigidTransform {
    let Some(up) = up else { return *pose };
    let turning = up.as_ref() * pose.rotation.imag().dot(&up);
    let twist = Quaternion::from_parts(pose.rotation.w, turning);
    // Half a turn about a horizontal axis has no part about `up`.
    let rotation = UnitQuaternion::try_new(twist, 1e-12).unwrap_or_else(UnitQuaternion::identity);
    RigidTransform::from_parts(pose.translation, rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(axis: [f64; 3], degrees: f64, shift: [f64; 3]) -> RigidTransform {
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(axis).normalize() * degrees.to_radians());
        RigidTransform::from_parts(Translation3::from(shift), rotation)
    }

    #[test]
    fn poses_beyond_either_bound_are_not_admitted() {
        let guess = Guess {
            target_from_source: turned([0.0, 0.0, 1.0], 30.0, [5.0, 0.0, 0.0]),
            max_rotation: Some(10f64.to_radians()),
            max_translation: Some(Length::Resolutions(2.0)),
        };
        let bounds = Prior { guess: Some(guess), up: None }.bounds(&Pair::default(), 0.5);
        for (degrees, x, admitted) in
            [(30.0, 5.0, true), (39.9, 5.0, true), (40.1, 5.0, false), (30.0, 5.99, true), (30.0, 6.01, false)]
        {
            let pose = turned([0.0, 0.0, 1.0], degrees, [x, 0.0, 0.0]);
            assert_eq!(bounds.admitted(&pose).is_some(), admitted, "{degrees} {x}");
        }
    }

    #[test]
    fn the_bounds_are_about_the_sources_centre_and_not_the_origin_of_its_file() {
        let origins = Pair { source: Vector3::new(1e5, 0.0, 0.0), target: Vector3::new(0.0, 1e5, 0.0) };
        let guess = turned([0.0, 0.0, 1.0], 90.0, [0.0, 0.0, 0.0]);
        let bounds = Prior {
            guess: Some(Guess {
                target_from_source: guess,
                max_rotation: None,
                max_translation: Some(Length::Units(1.0)),
            }),
            up: None,
        }
        .bounds(&origins, 1.0);
        assert!(bounds.guess().unwrap().translation.vector.norm() < 1e-6);
        assert!(bounds.admitted(&turned([0.0, 0.0, 1.0], 91.0, [0.5, 0.0, 0.0])).is_some());
    }

    #[test]
    fn levelled_poses_turn_about_up_alone_and_much_tilt_is_refused() {
        let up = Unit::new_normalize(Vector3::new(0.1, -0.2, 1.0));
        let bounds = Prior { guess: None, up: Some(up) }.bounds(&Pair::default(), 0.5);
        let yaw =
            RigidTransform::from_parts(Translation3::new(1.0, 2.0, 3.0), UnitQuaternion::from_axis_angle(&up, 2.5));
        let tilted = RigidTransform::from_parts(
            yaw.translation,
            UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.0, 0.0)) * yaw.rotation,
        );
        let admitted = bounds.admitted(&tilted).unwrap();
        assert!((admitted.rotation * up).angle(&up) < 1e-9 && angle_between(&admitted, &yaw) < 0.03);
        assert!(bounds.admitted(&turned([1.0, 0.0, 0.0], 20.0, [0.0; 3])).is_none());
        assert!(!bounds.are_open() && Bounds::default().are_open());
    }
}
