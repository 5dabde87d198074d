//! Triangle meshes, of which the shapes are made.

use congruent_geometry::RawScan;
use nalgebra::Vector3;

/// A triangle mesh in its own (world) frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners, shared between triangles.
    pub points: Vec<[f64; 3]>,
    /// Positions in `points`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Returns the centre of the bounding box, and the distance from it to the farthest point; zeros without points.
    #[must_use]
    pub fn bounding_sphere(&self) -> (Vector3<f64>, f64) {
        let Some(&first) = self.points.first() else { return (Vector3::zeros(), 0.0) };
        let start = (Vector3::from(first), Vector3::from(first));
        let (low, high) =
            self.points.iter().fold(start, |(l, h), p| (l.inf(&Vector3::from(*p)), h.sup(&Vector3::from(*p))));
        let centre = low * 0.5 + high * 0.5;
        let radius = self.points.iter().map(|p| (Vector3::from(*p) - centre).norm()).fold(0.0, f64::max);
        (centre, radius)
    }

    /// Returns the whole surface as if it had been read from a file, without normals.
    #[must_use]
    pub fn into_raw(self) -> RawScan {
        RawScan { points: self.points.into(), triangles: self.triangles, ..RawScan::default() }
    }

    /// Returns the same shape centred on the origin, with its longest side scaled to `side`; `None` for a mesh without
    /// extent or with coordinates that are not finite.
    pub(crate) fn fitted(mut self, side: f64) -> Option<Mesh> {
        let first = Vector3::from(*self.points.first()?);
        let (low, high) = self.points.iter().fold((first, first), |(low, high), p| {
            let p = Vector3::from(*p);
            (low.inf(&p), high.sup(&p))
        });
        let scale = side / (high - low).max();
        let finite = self.points.iter().flatten().all(|v| v.is_finite());
        if !(finite && scale.is_finite() && scale > 0.0) {
            return None;
        }
        let centre = (low + high) / 2.0;
        self.points.iter_mut().for_each(|p| *p = ((Vector3::from(*p) - centre) * scale).into());
        Some(self)
    }

    /// Appends the points and triangles of another mesh.
    pub(crate) fn append(&mut self, other: &Mesh) {
        let offset = self.points.len() as u32;
        self.points.extend_from_slice(&other.points);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + offset)));
    }

    /// Returns the same surface seen from the other side.
    pub(crate) fn inside_out(mut self) -> Mesh {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }
}

#[cfg(test)]
pub(crate) mod checks {
    use super::*;
    use std::collections::HashMap;

    /// Returns whether every edge is traversed exactly once in each direction.
    pub(crate) fn is_closed(mesh: &Mesh) -> bool {
        let mut walks: HashMap<(u32, u32), usize> = HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                *walks.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
            }
        }
        walks.iter().all(|(&(a, b), &n)| n == 1 && walks.get(&(b, a)) == Some(&1))
    }

    /// Returns the enclosed volume, positive if the triangles run counter-clockwise seen from outside.
    pub(crate) fn volume(mesh: &Mesh) -> f64 {
        let corner = |i: u32| Vector3::from(mesh.points[i as usize]);
        mesh.triangles.iter().map(|t| corner(t[0]).dot(&corner(t[1]).cross(&corner(t[2]))) / 6.0).sum()
    }

    #[test]
    fn appending_and_turning_keep_what_was_there() {
        let one = Mesh { points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], triangles: vec![[0, 1, 2]] };
        let mut two = one.clone();
        two.append(&one.inside_out());
        assert_eq!(two.triangles, [[0, 1, 2], [3, 5, 4]]);
        assert_eq!(two.bounding_sphere(), (Vector3::new(0.5, 0.5, 0.0), 0.5f64.sqrt()));
        assert_eq!(Mesh::default().bounding_sphere(), (Vector3::zeros(), 0.0));
    }
}
