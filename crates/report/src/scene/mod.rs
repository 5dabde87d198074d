//! What a 3D view shows.
//!
//! Points and lines belong to bodies (for instance scans). A [`State`] says where each body is: as scanned, aligned, by
//! one metric or another. The viewer switches between states, so a scan is stored once however often it moves.

mod encode;

use congruent_geometry::RigidTransform;
use nalgebra::{Point3, Vector3};

/// Most points that a layer of a page has; more are thinned evenly.
pub(crate) const MAX_POINTS: usize = 60_000;
/// Most segments of a layer of lines.
pub(crate) const MAX_SEGMENTS: usize = 4000;

/// Layers on bodies, and where the bodies may be.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Where the bodies are; the viewer opens with the last one. Empty means one state in which nothing is moved.
    pub states: Vec<State>,
    /// Drawn in this order, each with a switch.
    pub layers: Vec<Layer>,
    /// What the numbers of [`Points::errors`] are; nothing where no layer has any.
    pub errors: Option<Errors>,
    /// Where to look from at first, in the frame of the states: for instance the target's scanner. From above and aside where
    /// it is not known.
    pub viewpoint: Option<Point3<f64>>,
    /// Name of the length unit at the scale bar. Empty means data units.
    pub unit: String,
    /// What is shown where a browser has no WebGL 2: SVG or HTML, put in as it is. Empty means a message alone.
    pub fallback: String,
}

/// Where each body is.
#[derive(Clone, Debug)]
pub struct State {
    /// On the switch.
    pub name: String,
    /// For each body the motion from its coordinates into the frame that is shown; bodies beyond the list rest.
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
    /// On the switch.
    pub name: String,
    /// Index of the body that the points are fixed to.
    pub body: usize,
    /// In the body's coordinates, as large as they like (kept relative to their middle). Points that are not finite are
    /// left out; beyond 60 000 they are thinned evenly.
    pub points: Vec<Point3<f64>>,
    /// `#rrggbb`.
    pub colour: String,
    /// One number a point, for the pseudo-colours; NaN is drawn grey. Empty for a layer without them.
    pub errors: Vec<f32>,
}

/// Segments between bodies.
#[derive(Clone, Debug)]
pub struct Lines {
    /// On the switch.
    pub name: String,
    /// Indices of the bodies that the first and the second ends are fixed to.
    pub bodies: [usize; 2],
    /// Each end in the coordinates of its body. Segments that are not finite are left out; beyond 4000 they are thinned evenly.
    pub segments: Vec<[Point3<f64>; 2]>,
    /// `#rrggbb`.
    pub colour: String,
    /// Whether the layer is switched on at first.
    pub shown: bool,
}

/// What pseudo-colours mean.
#[derive(Clone, Debug)]
pub struct Errors {
    /// What is measured, for the legend.
    pub name: String,
    /// Unit of the numbers.
    pub unit: String,
    /// Numbers from here on have the last colour.
    pub saturation: f32,
    /// What grey points are.
    pub grey: String,
}

impl Scene {
    /// Where a body is in a state; at rest where nothing is said.
    pub(crate) fn motion(&self, state: usize, body: usize) -> RigidTransform {
        let motion = self.states.get(state).and_then(|state| state.frame_from_body.get(body));
        motion.copied().unwrap_or_else(RigidTransform::identity)
    }

    pub(crate) fn n_states(&self) -> usize {
        self.states.len().max(1)
    }

    /// The middle of what is shown at first, and the distance from it within which nearly all points are.
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

/// A few stray points must not make all others small.
const FOCUS_SHARE: f64 = 0.98;

fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get((share * values.len().saturating_sub(1) as f64).round() as usize).copied()
}
