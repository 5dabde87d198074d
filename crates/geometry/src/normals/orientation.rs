//! The sign of the normals: which side of the surface is the outside.

use crate::view::face;
use crate::{Neighbor, NeighborIndex, Point, Scanner, ViewKind, estimate_view, view_of_scanner, wide};
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Number of neighbours to which a sign is propagated.
const PROPAGATION_NEIGHBORS: usize = 10;
/// Number of neighbours from which the convexity of the surface is judged.
const CONVEXITY_NEIGHBORS: usize = 30;

/// How the signs of estimated normals are settled. Both scans of a pair must use the same policy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Orientation {
    /// Towards a viewpoint in the file's coordinates: correct for a range scan in its sensor's frame, whose sensor is
    /// at the origin. The signs of a scan that was moved afterwards come out mixed.
    Viewpoint {
        /// File coordinates.
        #[serde(deserialize_with = "crate::numbers::finite_place")]
        at: [f64; 3],
    },
    /// Away from the middle of the cloud: correct for closed, roughly convex models.
    Outward {},
    /// Propagated from neighbour to neighbour along the flattest path (a minimum spanning tree of `1 − |n·n'|`); each
    /// connected part is then turned so that the surface is convex on the whole. Needs no frame and no viewpoint.
    Propagate {},
    /// Towards a viewpoint that is estimated from the points: correct for scans seen from one side or from within, in
    /// any frame. For a closed model, signs are propagated.
    Estimated {},
}

/// How the signs were settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oriented {
    /// The viewpoint of the scan in centred coordinates, if a single viewpoint explains it.
    pub viewpoint: Option<Vector3<f64>>,
    /// What the scan looks like from its viewpoint, if that was estimated.
    pub kind: Option<ViewKind>,
    /// Whether the common sign is reliable; if not, all normals may point the wrong way.
    pub sure: bool,
}

/// Turns each normal to the side that the policy determines. Zero normals stay zero.
///
/// `origin` is what was subtracted from the file's coordinates to get `points`; `unit` is the working length, about
/// half the distance between neighbours (used only to estimate the viewpoint). `scanner` is what sampled the points,
/// if that was recognised before they were thinned; a viewpoint that is to be estimated follows from it.
pub fn orient(
    policy: Orientation,
    points: &[Point],
    origin: &Vector3<f64>,
    index: &NeighborIndex,
    unit: f64,
    scanner: Option<&Scanner>,
    normals: &mut [Point],
) -> Oriented {
    match policy {
        Orientation::Viewpoint { at } => {
            let viewpoint = Vector3::from(at) - origin;
            face(&viewpoint, points, normals);
            Oriented { viewpoint: Some(viewpoint), kind: None, sure: true }
        }
        Orientation::Outward {} => {
            let middle: Vector3<f64> =
                points.iter().map(|p| wide(*p)).sum::<Vector3<f64>>() / points.len().max(1) as f64;
            face(&middle, points, normals);
            normals.iter_mut().for_each(flip);
            Oriented { viewpoint: None, kind: None, sure: true }
        }
        Orientation::Propagate {} => {
            propagate(points, index, normals);
            Oriented { viewpoint: None, kind: None, sure: false }
        }
        Orientation::Estimated {} => {
            let view = match scanner {
                Some(scanner) => view_of_scanner(points, normals, index, unit, scanner),
                None => estimate_view(points, normals, index, unit),
            };
            if view.kind == ViewKind::Closed {
                propagate(points, index, normals);
                return Oriented { viewpoint: None, kind: Some(view.kind), sure: false };
            }
            face(&view.viewpoint, points, normals);
            Oriented { viewpoint: Some(view.viewpoint), kind: Some(view.kind), sure: view.sure }
        }
    }
}

fn flip(normal: &mut Point) {
    *normal = normal.map(|v| -v);
}

pub(crate) fn propagate(points: &[Point], index: &NeighborIndex, normals: &mut [Point]) {
    let near: Vec<Vec<Neighbor>> = points.par_iter().map(|p| index.nearest_n(p, CONVEXITY_NEIGHBORS)).collect();
    let mut part = vec![u32::MAX; points.len()];
    let mut n_parts = 0;
    for start in 0..points.len() {
        if part[start] == u32::MAX {
            spread_sign(start as u32, n_parts, &near, normals, &mut part);
            n_parts += 1;
        }
    }
    turn_convex(points, &near, normals, &part, n_parts as usize);
}

/// Grows Prim's tree from one point over its connected part.
fn spread_sign(start: u32, id: u32, near: &[Vec<Neighbor>], normals: &mut [Point], part: &mut [u32]) {
    // Costs are at most 1; as non-negative floats their bits sort like their values; ties go to the lower index.
    let mut frontier = BinaryHeap::from([Reverse((0u32, start, start))]);
    while let Some(Reverse((_, at, from))) = frontier.pop() {
        if part[at as usize] != u32::MAX {
            continue;
        }
        part[at as usize] = id;
        if wide(normals[at as usize]).dot(&wide(normals[from as usize])) < 0.0 {
            flip(&mut normals[at as usize]);
        }
        for neighbor in near[at as usize].iter().take(PROPAGATION_NEIGHBORS) {
            if part[neighbor.index as usize] == u32::MAX {
                let agreement = wide(normals[at as usize]).dot(&wide(normals[neighbor.index as usize])).abs();
                let cost = (1.0 - agreement).max(0.0) as f32;
                frontier.push(Reverse((cost.to_bits(), neighbor.index, at)));
            }
        }
    }
}

/// Turns each part so that, summed up, its neighbourhoods lie behind their normals.
fn turn_convex(points: &[Point], near: &[Vec<Neighbor>], normals: &mut [Point], part: &[u32], n_parts: usize) {
    let mut ahead = vec![0.0; n_parts];
    for (i, point) in points.iter().enumerate() {
        let offset: Vector3<f64> = near[i].iter().map(|n| wide(points[n.index as usize]) - wide(*point)).sum();
        ahead[part[i] as usize] += offset.dot(&wide(normals[i]));
    }
    for (normal, id) in normals.iter_mut().zip(part) {
        if ahead[*id as usize] > 0.0 {
            flip(normal);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{narrow, random::Stream};

    /// Two separate unit spheres of random points, with radial normals of random sign.
    fn two_spheres() -> (Vec<Point>, Vec<Point>, Vec<Point>) {
        let mut stream = Stream::new(4, 0);
        let (mut points, mut outward, mut mixed) = (vec![], vec![], vec![]);
        for i in 0..4000 {
            let n = Vector3::new(stream.normal(), stream.normal(), stream.normal()).normalize();
            points.push(narrow(&(n + Vector3::x() * if i % 2 == 0 { 0.0 } else { 5.0 })));
            outward.push(narrow(&n));
            mixed.push(narrow(&if stream.below(2) == 0 { n } else { -n }));
        }
        (points, outward, mixed)
    }

    fn oriented(policy: Orientation, points: &[Point], origin: &Vector3<f64>, normals: &mut [Point]) {
        orient(policy, points, origin, &NeighborIndex::new(points), 1.0, None, normals);
    }

    #[test]
    fn propagation_finds_the_outside_of_every_part() {
        let (points, outward, mut normals) = two_spheres();
        oriented(Orientation::Propagate {}, &points, &Vector3::zeros(), &mut normals);
        assert_eq!(normals, outward);
    }

    #[test]
    fn the_viewpoint_is_in_file_coordinates() {
        let points = [[0.0f32, 0.0, 0.0]];
        for (z, expected) in [(1000.0 + 1.0, 1.0), (1000.0 - 1.0, -1.0)] {
            let mut normals = [[0.0f32, 0.0, 1.0]];
            let origin = Vector3::new(0.0, 0.0, 1000.0);
            oriented(Orientation::Viewpoint { at: [0.0, 0.0, z] }, &points, &origin, &mut normals);
            assert_eq!(normals[0][2], expected);
        }
    }

    #[test]
    fn outward_points_away_from_the_middle() {
        let points = [[1.0f32, 0.0, 0.0], [-1.0, 0.0, 0.0]];
        let mut normals = [[-1.0f32, 0.0, 0.0], [-1.0, 0.0, 0.0]];
        oriented(Orientation::Outward {}, &points, &Vector3::zeros(), &mut normals);
        assert_eq!(normals, [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]);
    }
}
