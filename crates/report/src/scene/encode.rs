//! A scene as the JSON that `assets/viewer.js` reads.
//!
//! Positions are 16-bit steps within the bounding box of their layer: a street of 200 m is accurate to 3 mm, in half of
//! the bytes that floats take. The box, the motion and the middle of the scene are multiplied here, in `f64`, so that
//! map coordinates lose no precision.

use super::{Layer, Lines, MAX_POINTS, MAX_SEGMENTS, Points, Scene};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nalgebra::{Matrix4, Point3, Vector3};
use serde_json::{Value, json};

/// Number of steps along each axis of a box.
const STEPS: f64 = 65535.0;
/// Number of steps between no error and the saturation; one more means that there is no number.
const ERROR_STEPS: f32 = 254.0;
const NO_ERROR: u8 = 255;

impl Scene {
    /// Returns everything that the viewer needs.
    pub(crate) fn json(&self) -> Value {
        let (middle, radius) = self.focus();
        let layers: Vec<Value> = self.layers.iter().map(|layer| self.layer(layer, &middle)).collect();
        json!({
            "states": self.states.iter().map(|state| state.name.as_str()).collect::<Vec<_>>(),
            "layers": layers,
            "errors": self.errors.as_ref().map(|e| json!({
                "name": e.name, "unit": e.unit, "saturation": e.saturation, "grey": e.grey,
            })),
            "radius": radius,
            "middle": <[f64; 3]>::from(middle),
            "viewpoint": self.viewpoint.map(|from| <[f64; 3]>::from(from.coords - middle)),
            "unit": if self.unit.is_empty() { "data units" } else { &self.unit },
        })
    }

    fn layer(&self, layer: &Layer, middle: &Vector3<f64>) -> Value {
        match layer {
            Layer::Points(points) => self.points(points, middle),
            Layer::Lines(lines) => self.lines(lines, middle),
        }
    }

    fn points(&self, layer: &Points, middle: &Vector3<f64>) -> Value {
        let finite: Vec<usize> = (0..layer.points.len()).filter(|&i| is_finite(&layer.points[i])).collect();
        let kept: Vec<usize> = spread(&finite, MAX_POINTS).copied().collect();
        let points: Vec<Point3<f64>> = kept.iter().map(|&i| layer.points[i]).collect();
        let grid = Grid::of(&points);
        let saturation = self.errors.as_ref().map_or(1.0, |errors| errors.saturation);
        let errors: Vec<u8> = if layer.errors.is_empty() {
            Vec::new()
        } else {
            kept.iter().map(|&i| step(layer.errors.get(i), saturation)).collect()
        };
        json!({
            "kind": "points",
            "name": layer.name,
            "colour": layer.colour,
            "shown": true,
            "total": finite.len(),
            "positions": STANDARD.encode(bytes(&points, &[grid])),
            "errors": STANDARD.encode(errors),
            "motions": self.motions(middle, &[(layer.body, grid)]),
        })
    }

    fn lines(&self, layer: &Lines, middle: &Vector3<f64>) -> Value {
        let finite: Vec<&[Point3<f64>; 2]> = layer.segments.iter().filter(|ends| ends.iter().all(is_finite)).collect();
        let kept: Vec<&[Point3<f64>; 2]> = spread(&finite, MAX_SEGMENTS).copied().collect();
        let grids = [0, 1].map(|end| Grid::of(&kept.iter().map(|ends| ends[end]).collect::<Vec<_>>()));
        let ends: Vec<Point3<f64>> = kept.iter().flat_map(|ends| ends.iter().copied()).collect();
        json!({
            "kind": "lines",
            "name": layer.name,
            "colour": layer.colour,
            "shown": layer.shown,
            "total": finite.len(),
            "positions": STANDARD.encode(bytes(&ends, &grids)),
            "errors": "",
            "motions": self.motions(middle, &[(layer.bodies[0], grids[0]), (layer.bodies[1], grids[1])]),
        })
    }

    /// Returns, for each state and each kind of end, the matrix, column by column, from steps of the grid (0 to 1) to
    /// the displayed frame, with `middle` at its origin.
    fn motions(&self, middle: &Vector3<f64>, ends: &[(usize, Grid)]) -> Vec<Vec<Vec<f64>>> {
        let one = |state: usize, (body, grid): &(usize, Grid)| {
            let matrix =
                Matrix4::new_translation(&-middle) * self.motion(state, *body).to_homogeneous() * grid.matrix();
            matrix.as_slice().to_vec()
        };
        (0..self.n_states()).map(|state| ends.iter().map(|end| one(state, end)).collect()).collect()
    }
}

/// The bounding box of some points.
#[derive(Clone, Copy)]
struct Grid {
    low: Vector3<f64>,
    size: Vector3<f64>,
}

impl Grid {
    fn of(points: &[Point3<f64>]) -> Grid {
        let Some(first) = points.first() else { return Grid { low: Vector3::zeros(), size: Vector3::zeros() } };
        let (low, high) = points
            .iter()
            .fold((first.coords, first.coords), |(low, high), p| (low.inf(&p.coords), high.sup(&p.coords)));
        Grid { low, size: high - low }
    }

    fn steps(&self, point: &Point3<f64>) -> [u16; 3] {
        [0, 1, 2].map(|axis| {
            let size = self.size[axis];
            let share = if size > 0.0 { (point[axis] - self.low[axis]) / size } else { 0.0 };
            (share * STEPS).round() as u16
        })
    }

    fn matrix(&self) -> Matrix4<f64> {
        Matrix4::new_translation(&self.low) * Matrix4::new_nonuniform_scaling(&self.size)
    }
}

/// Returns little-endian steps, the grids taken in turn.
fn bytes(points: &[Point3<f64>], grids: &[Grid]) -> Vec<u8> {
    let steps = points.iter().zip(grids.iter().cycle()).flat_map(|(point, grid)| grid.steps(point));
    steps.flat_map(u16::to_le_bytes).collect()
}

fn step(error: Option<&f32>, saturation: f32) -> u8 {
    match error {
        Some(error) if error.is_finite() => (error / saturation * ERROR_STEPS).clamp(0.0, ERROR_STEPS).round() as u8,
        _ => NO_ERROR,
    }
}

fn is_finite(point: &Point3<f64>) -> bool {
    point.iter().all(|v| v.is_finite())
}

/// Returns at most this many elements, spread evenly over the list.
pub(crate) fn spread<T>(all: &[T], at_most: usize) -> impl Iterator<Item = &T> {
    let kept = all.len().min(at_most);
    (0..kept).map(move |i| &all[i * all.len() / kept])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::State;
    use congruent_geometry::RigidTransform;

    /// Returns where the viewer would draw the `i`-th vertex in a state.
    fn drawn(layer: &Value, state: usize, i: usize) -> Vector3<f64> {
        let raw = STANDARD.decode(layer["positions"].as_str().unwrap()).unwrap();
        let step =
            |axis: usize| f64::from(u16::from_le_bytes([raw[6 * i + 2 * axis], raw[6 * i + 2 * axis + 1]])) / STEPS;
        let ends = layer["motions"][state].as_array().unwrap();
        let numbers: Vec<f64> = ends[i % ends.len()].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        Matrix4::from_column_slice(&numbers).transform_point(&Point3::new(step(0), step(1), step(2))).coords
    }

    fn scene() -> Scene {
        let far = Vector3::new(5e5, 5.4e6, 300.0);
        let points: Vec<Point3<f64>> = (0..100)
            .map(|i| Point3::from(far + Vector3::new(f64::from(i), f64::from(i % 7), f64::from(i % 3))))
            .collect();
        let turn = RigidTransform::new(Vector3::new(-4e5, 1.0, 2.0), Vector3::new(0.0, 0.0, 0.4));
        let state = |name: &str, first| State { name: name.to_owned(), frame_from_body: vec![first] };
        let errors = (0..100).map(|i| if i == 3 { f32::NAN } else { i as f32 }).collect();
        let cloud =
            Points { name: "a".to_owned(), body: 0, points: points.clone(), colour: "#000000".to_owned(), errors };
        let segments = points.iter().map(|p| [*p, p + Vector3::new(0.0, 0.0, 9.0)]).collect();
        let lines = Lines { name: "b".to_owned(), bodies: [0, 1], segments, colour: "#000000".to_owned(), shown: true };
        Scene {
            states: vec![state("before", RigidTransform::identity()), state("after", turn)],
            layers: vec![Layer::Points(cloud), Layer::Lines(lines)],
            errors: Some(crate::Errors {
                name: String::new(),
                unit: String::new(),
                saturation: 10.0,
                grey: String::new(),
            }),
            ..Scene::default()
        }
    }

    #[test]
    fn vertices_are_drawn_where_their_bodies_are_to_a_step_of_their_box() {
        let scene = scene();
        let (json, (middle, _)) = (scene.json(), scene.focus());
        let [Layer::Points(cloud), Layer::Lines(lines)] = &scene.layers[..] else { panic!() };
        // A box of 100 × 6 × 2, in 65 535 steps, and the precision of `f64` this far from the origin.
        let tolerance = 100.0 / STEPS;
        for state in 0..2 {
            for i in 0..100 {
                let expected = (scene.motion(state, 0) * cloud.points[i]).coords - middle;
                assert!((drawn(&json["layers"][0], state, i) - expected).norm() < tolerance, "{state} {i}");
                for end in 0..2 {
                    let expected = (scene.motion(state, end) * lines.segments[i][end]).coords - middle;
                    assert!(
                        (drawn(&json["layers"][1], state, 2 * i + end) - expected).norm() < tolerance,
                        "{state} {i}"
                    );
                }
            }
        }
    }

    #[test]
    fn errors_saturate_and_nan_is_told_apart() {
        let errors = STANDARD.decode(scene().json()["layers"][0]["errors"].as_str().unwrap()).unwrap();
        assert_eq!((errors[0], errors[5], errors[10], errors[99], errors[3]), (0, 127, 254, 254, NO_ERROR));
    }

    #[test]
    fn a_part_is_taken_evenly() {
        assert_eq!(spread(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9], 4).copied().collect::<Vec<i32>>(), [0, 2, 5, 7]);
        assert_eq!(spread::<i32>(&[], 4).count(), 0);
    }
}
