//! How well two whole surfaces fit each other under a pose: overlap, and what contradicts it.
//!
//! Correspondences propose poses; surfaces decide. Three things are measured, in both directions. *Overlap*: points
//! with a point of the other surface close by, which count the more the closer it is, if the normals agree. *Hover*:
//! points that float in front of the other surface, where its scanner looked through and saw nothing. *Occlusion*:
//! points that would have hidden what the other scanner saw; this requires the position of the scanner.

use crate::motion::{Motion, dot};
use crate::{DepthImage, Score};
use congruent_geometry::{NearestField, Point, RigidTransform, Surface};
use std::f64::consts::FRAC_PI_2;

/// A point hovers only if the cosine of the angle between its offset from the surface and the normal there exceeds
/// this.
const HOVER_COSINE: f32 = 0.7;

/// Number of points looked up together.
const BLOCK: usize = 64;

/// Settings of the measurement; lengths in data units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenseRule {
    /// Points closer than this overlap.
    pub overlap_distance: f64,
    /// Minimum cosine between the normals of points that overlap. Points without normals never do.
    pub min_normal_cosine: f64,
    /// Minimum distance of hovering points from the surface …
    pub hover_from: f64,
    /// … and their maximum distance.
    pub hover_to: f64,
    /// Points at least this far in front of what a scanner saw would have hidden it.
    pub occlusion_depth: f64,
    /// Rate at which the score declines with the fraction of hovering points.
    pub hover_weight: f64,
    /// Rate at which the score declines with the fraction of occluding points.
    pub occlusion_weight: f64,
    /// Maximum number of points examined, spread evenly over the surface's order.
    pub max_points: usize,
}

/// A surface prepared for queries.
pub struct DenseSurface<'a> {
    /// The points and normals.
    pub surface: &'a Surface,
    /// Closest points within the reach that overlap and refinement need.
    pub near: &'a NearestField,
    /// Closest points within the reach of hovering, on a coarser grid.
    pub far: &'a NearestField,
    /// What the scanner saw, if its position is known.
    pub depth: Option<DepthImage>,
}

/// The measurements, each averaged or summed over both directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DenseAgreement {
    /// Mean gain `(1 − d/α)²` over all points, `d` the distance to the other surface's tangent plane.
    pub soft_overlap: f64,
    /// Fraction of points that overlap.
    pub overlap: f64,
    /// Mean distance of overlapping points to the tangent plane, data units; infinite if none overlap.
    pub residual: f64,
    /// Fraction of points that hover, summed over both directions.
    pub hover: f64,
    /// Fraction of points that occlude, summed over both directions.
    pub occlusion: f64,
    /// Fraction of points close to the other surface whose normals disagree or are missing, averaged over both
    /// directions.
    pub disagreeing: f64,
    /// Mean angle between the normals of points that overlap, radians; a right angle if none do.
    pub normal_angle: f64,
}

impl DenseAgreement {
    /// Returns the fraction of points that hover plus the fraction that occlude, each summed over both directions.
    #[must_use]
    pub fn contradictions(&self) -> f64 {
        self.hover + self.occlusion
    }

    /// Combines the measurements into one number: overlap, discounted for every contradiction.
    #[must_use]
    pub fn score(&self, rule: &DenseRule) -> Score {
        Score::new(self.soft_overlap * (-rule.hover_weight * self.hover - rule.occlusion_weight * self.occlusion).exp())
    }
}

/// Measures a pose, in both directions.
#[must_use]
pub fn agreement(
    source: &DenseSurface<'_>,
    target: &DenseSurface<'_>,
    target_from_source: &RigidTransform,
    rule: &DenseRule,
) -> DenseAgreement {
    let (forth, back) = rayon::join(
        || Tally::of(source.surface, target, target_from_source, rule),
        || Tally::of(target.surface, source, &target_from_source.inverse(), rule),
    );
    let mean = |pick: fn(&Tally) -> f64| (forth.share(pick) + back.share(pick)) / 2.0;
    let overlapping = forth.overlapping + back.overlapping;
    DenseAgreement {
        soft_overlap: mean(|t| t.gain),
        overlap: mean(|t| t.overlapping),
        residual: if overlapping > 0.0 { (forth.distance + back.distance) / overlapping } else { f64::INFINITY },
        hover: 2.0 * mean(|t| t.hovering),
        occlusion: 2.0 * mean(|t| t.occluding),
        disagreeing: mean(|t| t.disagreeing),
        normal_angle: if overlapping > 0.0 { (forth.angle + back.angle) / overlapping } else { FRAC_PI_2 },
    }
}

/// Sums over the points of one surface, moved in front of the other.
#[derive(Default)]
struct Tally {
    points: f64,
    gain: f64,
    overlapping: f64,
    distance: f64,
    hovering: f64,
    occluding: f64,
    disagreeing: f64,
    angle: f64,
}

impl Tally {
    fn of(moving: &Surface, fixed: &DenseSurface<'_>, fixed_from_moving: &RigidTransform, rule: &DenseRule) -> Tally {
        let pose = Motion::new(fixed_from_moving);
        let stride = moving.len().div_ceil(rule.max_points.max(1)).max(1);
        let n_chosen = moving.len().div_ceil(stride);
        let mut tally = Tally { points: n_chosen as f64, ..Tally::default() };
        let (mut points, mut found) = ([[0.0; 3]; BLOCK], [None; BLOCK]);
        for start in (0..n_chosen).step_by(BLOCK) {
            let n = BLOCK.min(n_chosen - start);
            for (k, point) in points[..n].iter_mut().enumerate() {
                *point = pose.moved(&moving.points()[(start + k) * stride]);
            }
            fixed.near.nearest_each(&points[..n], &mut found);
            // The points that remain to be checked are moved to the front.
            let mut n_off = 0;
            for at in 0..n {
                let point = points[at];
                points[n_off] = point;
                let turned = || pose.turned(&moving.normals()[(start + at) * stride]);
                n_off += usize::from(!tally.is_near(&point, turned, found[at], fixed.surface, rule));
            }
            tally.contradict(&points[..n_off], &mut found, fixed, rule);
        }
        tally
    }

    fn share(&self, pick: fn(&Tally) -> f64) -> f64 {
        if self.points > 0.0 { pick(self) / self.points } else { 0.0 }
    }

    /// Tallies a point that touches the surface, and returns whether it is so near that it contradicts nothing; `found`
    /// is close to it, if anything is.
    #[inline]
    fn is_near(
        &mut self,
        point: &Point,
        normal: impl Fn() -> Point,
        found: Option<u32>,
        fixed: &Surface,
        rule: &DenseRule,
    ) -> bool {
        let Some(found) = found.map(|found| found as usize) else { return false };
        let reach_sq = (rule.overlap_distance as f32).powi(2);
        let offset = minus(point, &fixed.points()[found]);
        let distance_sq = dot(&offset, &offset);
        if distance_sq < reach_sq {
            self.touch(&offset, [&normal(), &fixed.normals()[found]], rule);
        }
        distance_sq < 4.0 * reach_sq
    }

    /// Counts points off the surface that float in front of it or hide it.
    fn contradict(&mut self, points: &[Point], found: &mut [Option<u32>], fixed: &DenseSurface<'_>, rule: &DenseRule) {
        fixed.far.nearest_each(points, found);
        let hovering = points.iter().zip(found).filter(|(point, found)| hovers(point, **found, fixed.surface, rule));
        self.hovering += hovering.count() as f64;
        if let Some(image) = &fixed.depth {
            let hiding = points.iter().filter(|point| image.hides(point, rule.occlusion_depth as f32));
            self.occluding += hiding.count() as f64;
        }
    }

    /// Tallies a point at this offset from one of the surface, and the normals at the two, zero if unknown.
    fn touch(&mut self, offset: &Point, [own, other]: [&Point; 2], rule: &DenseRule) {
        let (plane_distance, cosine) = (dot(offset, other).abs(), dot(own, other));
        let are_known = *own != [0.0; 3] && *other != [0.0; 3];
        if are_known && cosine > rule.min_normal_cosine as f32 {
            let nearness = (1.0 - f64::from(plane_distance) / rule.overlap_distance).max(0.0);
            self.gain += nearness * nearness;
            self.overlapping += 1.0;
            self.distance += f64::from(plane_distance);
            self.angle += f64::from(cosine.min(1.0).acos());
        } else {
            self.disagreeing += 1.0;
        }
    }
}

/// Returns whether a point hovers. Only the front counts: behind a surface there may be more of the object, which its
/// scan could not see.
fn hovers(point: &Point, found: Option<u32>, fixed: &Surface, rule: &DenseRule) -> bool {
    let Some(found) = found.map(|found| found as usize) else { return false };
    let offset = minus(point, &fixed.points()[found]);
    let distance = dot(&offset, &offset).sqrt();
    distance >= rule.hover_from as f32
        && distance <= rule.hover_to as f32
        && dot(&offset, &fixed.normals()[found]) > HOVER_COSINE * distance
}

fn minus(a: &Point, b: &Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use congruent_geometry::NeighborIndex;

    const RULE: DenseRule = DenseRule {
        overlap_distance: 3.0,
        min_normal_cosine: 0.6,
        hover_from: 6.0,
        hover_to: 24.0,
        occlusion_depth: 5.0,
        hover_weight: 20.0,
        occlusion_weight: 20.0,
        max_points: 10_000,
    };

    /// A flat sheet of 40 by 40 points, two apart, seen from above (+z).
    fn sheet() -> Surface {
        sheet_with([0.0, 0.0, 1.0])
    }

    fn sheet_with(normal: Point) -> Surface {
        let points: Vec<Point> =
            (0..1600).map(|i| [2.0 * (i % 40) as f32 - 39.0, 2.0 * (i / 40) as f32 - 39.0, 0.0]).collect();
        let index = NeighborIndex::new(&points);
        Surface::new(points, vec![normal; 1600], index, 2.0)
    }

    fn measured(pose: RigidTransform) -> DenseAgreement {
        measured_between([&sheet(), &sheet()], &pose, &RULE)
    }

    /// Measures two sheets, which differ only in their normals.
    fn measured_between([source, target]: [&Surface; 2], pose: &RigidTransform, rule: &DenseRule) -> DenseAgreement {
        let near = &NearestField::new(source.points(), 2.0, 6.0);
        let far = &NearestField::new(source.points(), 4.0, 24.0);
        let depth = || Some(DepthImage::new(source.points(), &[0.0, 0.0, 1e4], 4.0));
        let ready = |surface| DenseSurface { surface, near, far, depth: depth() };
        agreement(&ready(source), &ready(target), pose, rule)
    }

    #[test]
    fn a_surface_agrees_with_itself() {
        let same = measured(RigidTransform::identity());
        assert!(same.soft_overlap > 0.999 && same.overlap == 1.0 && same.residual < 1e-6);
        assert!(same.hover == 0.0 && same.occlusion == 0.0 && same.disagreeing == 0.0 && same.normal_angle == 0.0);
        assert_eq!(same.score(&RULE), Score::new(same.soft_overlap));
    }

    #[test]
    fn overlap_falls_with_the_distance_between_the_planes() {
        let lifted = measured(RigidTransform::translation(0.0, 0.0, 1.5));
        assert!((lifted.soft_overlap - 0.25).abs() < 0.01 && (lifted.residual - 1.5).abs() < 1e-3);
    }

    #[test]
    fn what_floats_before_a_surface_contradicts_it_and_what_lies_behind_does_not() {
        // When lifted, the source hovers in front of the target, while the target lies behind the source.
        let lifted = measured(RigidTransform::translation(0.0, 0.0, 12.0));
        assert!(lifted.hover > 0.9 && lifted.hover <= 1.0 && lifted.occlusion > 0.8, "{lifted:?}");
        assert!(lifted.soft_overlap == 0.0 && lifted.residual.is_infinite());
    }

    #[test]
    fn the_back_of_a_surface_does_not_overlap_its_front() {
        let turned = measured(RigidTransform::rotation(nalgebra::Vector3::x() * std::f64::consts::PI));
        assert!(turned.overlap == 0.0 && turned.disagreeing > 0.99 && turned.normal_angle == FRAC_PI_2);
    }

    #[test]
    fn points_without_normals_overlap_nothing_whatever_the_limit() {
        let (with, without) = (&sheet(), &sheet_with([0.0; 3]));
        for min_normal_cosine in [RULE.min_normal_cosine, -0.5] {
            let rule = DenseRule { min_normal_cosine, ..RULE };
            for surfaces in [[with, without], [without, with], [without, without]] {
                let measured = measured_between(surfaces, &RigidTransform::identity(), &rule);
                assert!(measured.overlap == 0.0 && measured.disagreeing == 1.0, "{measured:?}");
            }
        }
    }

    #[test]
    fn a_tilted_sheet_has_normals_at_its_angle() {
        let tilted = measured(RigidTransform::rotation(nalgebra::Vector3::x() * 0.03));
        assert!(tilted.overlap > 0.9 && (tilted.normal_angle - 0.03).abs() < 1e-3, "{tilted:?}");
    }
}
