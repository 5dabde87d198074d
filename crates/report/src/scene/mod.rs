//! The content of a 3D view.
//!
//! Points and lines belong to bodies (for instance scans). A [`State`] gives the pose of each body: as scanned,
//! aligned, by one metric or another. The viewer switches between states, so a scan is stored once however often it
//! moves.

mod encode;

use congruent_geometry::RigidTransform;
use nalgebra::{Point3, Vector3};

/// Maximum number of points in a layer of a page; more are thinned evenly.
pub(crate) const MAX_POINTS: usize = 60_000;
/// Maximum number of segments in a layer of lines.
pub(crate) const MAX_SEGMENTS: usize = 4000;

/// Layers on bodies, and the possible poses of the bodies.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Poses of the bodies; the viewer opens with the last state. Empty means one state in which nothing is moved.
    pub states: Vec<State>,
    /// Drawn in this order, each with a switch.
    pub layers: Vec<Layer>,
    /// The meaning of the numbers in [`Points::errors`]; `None` if no layer has any.
    pub errors: Option<Errors>,
    /// Initial viewpoint, in the frame of the states: for instance the target's scanner. From above and to the side if
    /// it is not known.
    pub viewpoint: Option<Point3<f64>>,
    /// Name of the length unit at the scale bar. Empty means data units.
    pub unit: String,
    /// Shown if a browser has no WebGL 2: SVG or HTML, inserted unchanged. Empty means only a message.
    pub fallback: String,
}

/// The pose of each body.
#[derive(Clone, Debug)]
pub struct State {
    /// Label of the switch.
    pub name: String,
    /// For each body the motion from its coordinates into the displayed frame; bodies beyond the list stay at rest.
    pub frame_from_body: Vec<RigidTransform>,
}

/// Something that can be switched on and off.
#[derive(Clone, Debug)]
pub enum Layer {
    /// A cloud.
    Points(Points),
    /// Straight segments.
    Lines(Lines),
}

/// A cloud on a body.
#[derive(Clone, Debug)]
pub struct Points {
    /// Label of the switch.
    pub name: String,
    /// Index of the body to which the points are fixed.
    pub body: usize,
    /// In the body's coordinates, of any magnitude (they are kept relative to their middle). Points that are not finite
    /// are left out; beyond 60 000 they are thinned evenly.
    pub points: Vec<Point3<f64>>,
    /// `#rrggbb`.
    pub colour: String,
    /// One number per point, for the pseudo-colours; NaN is drawn grey. Empty for a layer without them.
    pub errors: Vec<f32>,
}

/// Segments between bodies.
#[derive(Clone, Debug)]
pub struct Lines {
    /// Label of the switch.
    pub name: String,
    /// Indices of the bodies to which the first and the second ends are fixed.
    pub bodies: [usize; 2],
    /// Each end in the coordinates of its body. Segments that are not finite are left out; beyond 4000 they are thinned
    /// evenly.
    pub segments: Vec<[Point3<f64>; 2]>,
    /// `#rrggbb`.
    pub colour: String,
    /// Whether the layer is initially visible.
    pub shown: bool,
}

/// The meaning of pseudo-colours.
#[derive(Clone, Debug)]
pub struct Errors {
    /// The quantity measured, for the legend.
    pub name: String,
    /// Unit of the numbers.
    pub unit: String,
    /// Number from which on the last colour is used.
    pub saturation: f32,
    /// The meaning of grey points.
    pub grey: String,
}

impl Scene {
    /// Returns the pose of a body in a state; at rest if none is given.
    pub(crate) fn motion(&self, state: usize, body: usize) -> RigidTransform {
        let motion = self.states.get(state).and_then(|state| state.frame_from_body.get(body));
        motion.copied().unwrap_or_else(RigidTransform::identity)
    }

    pub(crate) fn n_states(&self) -> usize {
        self.states.len().max(1)
    }

    /// Returns the middle of what is shown initially, and the distance from it within which nearly all points are.
    pub(crate) fn focus(&self) -> (Vector3<f64>, f64) {
        let state = self.n_states() - 1;
        let mut shown: Vec<Vector3<f64>> = Vec::new();
        for layer in &self.layers {
            if let Layer::Points(points) = layer {
                let motion = self.motion(state, points.body);
                let finite = points.points.iter().filter(|p| p.iter().all(|v| v.is_finite()));
                shown.extend(encode::spread(&finite.collect::<Vec<_>>(), MAX_POINTS).map(|p| (motion * **p).coords));
            }
        }
        let middle_of = |axis: usize| quantile(shown.iter().map(|p| p[axis]).collect(), 0.5).unwrap_or(0.0);
        let middle = Vector3::from_fn(|axis, _| middle_of(axis));
        let radius = quantile(shown.iter().map(|p| (p - middle).norm()).collect(), FOCUS_SHARE);
        (middle, radius.filter(|r| *r > 0.0).unwrap_or(1.0))
    }
}

/// Fraction of the points that are in focus: a few stray points must not make all others small.
const FOCUS_SHARE: f64 = 0.98;

fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get((share * values.len().saturating_sub(1) as f64).round() as usize).copied()
}
