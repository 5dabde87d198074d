//! The surface of a solid given by a function of space (marching tetrahedra).

use crate::Mesh;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Minimum distance of corners from the ends of an edge, as a fraction of its length, so that no two coincide.
const KEEP_OFF: f64 = 1e-3;
/// The six orders in which to walk along the three axes from one corner of a cube to the opposite one, each with
/// whether it is even; each walk is a tetrahedron.
const WALKS: [([usize; 3], bool); 6] = [
    ([0, 1, 2], true),
    ([1, 2, 0], true),
    ([2, 0, 1], true),
    ([0, 2, 1], false),
    ([2, 1, 0], false),
    ([1, 0, 2], false),
];

/// A box of cubic cells that holds a solid.
pub(crate) struct Lattice {
    /// Lowest corner.
    pub(crate) low: Vector3<f64>,
    /// Side of a cell.
    pub(crate) step: f64,
    /// Number of nodes along each axis.
    pub(crate) nodes: [usize; 3],
}

impl Lattice {
    fn position(&self, node: usize) -> Vector3<f64> {
        let [nx, ny, _] = self.nodes;
        let place = [node % nx, node / nx % ny, node / (nx * ny)];
        self.low + Vector3::from(place.map(|i| i as f64 * self.step))
    }

    /// Returns the surface where `field` passes from negative (inside) to positive. Closed if the solid does not reach
    /// the lattice's border, and free of self-intersections, because each tetrahedron holds a flat piece of its own.
    pub(crate) fn surface(&self, field: impl Fn(&Vector3<f64>) -> f64 + Sync) -> Mesh {
        let n_nodes = self.nodes.iter().product();
        let values: Vec<f64> = (0..n_nodes).into_par_iter().map(|node| field(&self.position(node))).collect();
        let mut cutter =
            Cutter { lattice: self, values, corners: HashMap::new(), edges: Vec::new(), triangles: Vec::new() };
        let [nx, ny, nz] = self.nodes;
        for z in 1..nz {
            for y in 1..ny {
                for x in 1..nx {
                    cutter.cut_cube((x - 1) + nx * ((y - 1) + ny * (z - 1)));
                }
            }
        }
        let crossing = |edge: &(usize, usize)| self.crossing(edge, &cutter.values, &field).into();
        Mesh { points: cutter.edges.par_iter().map(crossing).collect(), triangles: cutter.triangles }
    }

    /// Returns where the field passes zero on an edge from an inside to an outside node, by linear interpolation with
    /// one correction: without it the lattice would show through on curved parts.
    fn crossing(
        &self,
        &(inside, outside): &(usize, usize),
        values: &[f64],
        field: impl Fn(&Vector3<f64>) -> f64,
    ) -> Vector3<f64> {
        let (from, to) = (self.position(inside), self.position(outside));
        let share = zero_between([0.0, values[inside]], [1.0, values[outside]]);
        let value = field(&from.lerp(&to, share));
        let share = if value < 0.0 {
            zero_between([share, value], [1.0, values[outside]])
        } else {
            zero_between([0.0, values[inside]], [share, value])
        };
        from.lerp(&to, share.clamp(KEEP_OFF, 1.0 - KEEP_OFF))
    }
}

/// Returns where the straight line through two positions and their values, the first below zero, passes zero.
fn zero_between([low, below]: [f64; 2], [high, above]: [f64; 2]) -> f64 {
    low + (high - low) * below / (below - above)
}

struct Cutter<'a> {
    lattice: &'a Lattice,
    values: Vec<f64>,
    /// The corner on each cut edge, by the edge's nodes in ascending order.
    corners: HashMap<(usize, usize), u32>,
    /// The edge of each corner, its inside node first.
    edges: Vec<(usize, usize)>,
    triangles: Vec<[u32; 3]>,
}

impl Cutter<'_> {
    fn is_inside(&self, node: usize) -> bool {
        self.values[node] < 0.0
    }

    fn cut_cube(&mut self, first: usize) {
        let [nx, ny, _] = self.lattice.nodes;
        let strides = [1, nx, nx * ny];
        let corner = |bits: usize| first + (0..3).filter(|k| (bits >> k) & 1 == 1).map(|k| strides[k]).sum::<usize>();
        let n_inside = (0..8).filter(|&bits| self.is_inside(corner(bits))).count();
        if n_inside == 0 || n_inside == 8 {
            return;
        }
        for ([i, j, k], is_even) in WALKS {
            let second = first + strides[i];
            let third = second + strides[j];
            let last = third + strides[k];
            self.cut_tetrahedron(if is_even { [first, second, third, last] } else { [first, third, second, last] });
        }
    }

    /// Takes the nodes in positive orientation: the last three run counter-clockwise as seen from the outside.
    fn cut_tetrahedron(&mut self, mut nodes: [usize; 4]) {
        let n_inside = nodes.iter().filter(|&&node| self.is_inside(node)).count();
        let mut is_even = true;
        for end in (1..4).rev() {
            for k in 0..end {
                if !self.is_inside(nodes[k]) && self.is_inside(nodes[k + 1]) {
                    nodes.swap(k, k + 1);
                    is_even = !is_even;
                }
            }
        }
        // The inside nodes are first now; one more swap among equals repairs the orientation.
        if !is_even {
            let k = if n_inside == 3 { 0 } else { 2 };
            nodes.swap(k, k + 1);
        }
        let [a, b, c, d] = nodes;
        match n_inside {
            1 => self.add(&[(a, b), (a, c), (a, d)]),
            2 => self.add(&[(a, c), (a, d), (b, d), (b, c)]),
            3 => self.add(&[(a, d), (b, d), (c, d)]),
            _ => {}
        }
    }

    /// Adds a triangle, or a quadrilateral as two, with corners on edges from an inside to an outside node.
    fn add(&mut self, edges: &[(usize, usize)]) {
        let first = self.corner(edges[0]);
        for pair in edges[1..].windows(2) {
            let triangle = [first, self.corner(pair[0]), self.corner(pair[1])];
            self.triangles.push(triangle);
        }
    }

    fn corner(&mut self, (inside, outside): (usize, usize)) -> u32 {
        let edges = &mut self.edges;
        *self.corners.entry((inside.min(outside), inside.max(outside))).or_insert_with(|| {
            edges.push((inside, outside));
            edges.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::checks::{is_closed, volume};

    #[test]
    fn a_ball_becomes_a_closed_sphere_of_its_radius() {
        let lattice = Lattice { low: Vector3::repeat(-1.3), step: 0.1, nodes: [27; 3] };
        let mesh = lattice.surface(|p| p.norm() - 1.0);
        assert!(is_closed(&mesh));
        let ball = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((volume(&mesh) / ball - 1.0).abs() < 0.01, "{}", volume(&mesh));
        // Between nodes the distance is bent by at most (√3·step)² / 8 = 0.004; the correction leaves a quarter of it.
        assert!(mesh.points.iter().all(|&p| (Vector3::from(p).norm() - 1.0).abs() < 1e-3));
    }

    #[test]
    fn nothing_has_no_surface() {
        let lattice = Lattice { low: Vector3::zeros(), step: 1.0, nodes: [4; 3] };
        assert_eq!(lattice.surface(|_| 1.0), Mesh::default());
        assert_eq!(lattice.surface(|_| -1.0), Mesh::default());
    }
}
