//! Solids as signed distances: limbs and bodies that blend into each other, with relief on them.

use nalgebra::Vector3;

/// Approximate distance within which parts blend into each other.
const BLEND: f64 = 1.6;
/// Number of widths from its centre up to which relief counts; there it has fallen to 1 %.
const REACH: f64 = 3.0;
/// Maximum depth of dents, however many of them meet, so that the centre line of a thicker part stays inside.
pub(crate) const DEEPEST: f64 = 1.6;

/// One part of a solid.
#[derive(Clone, Debug)]
pub(crate) enum Part {
    /// An ellipsoid with half axes along x, y and z.
    Body { centre: Vector3<f64>, half_axes: Vector3<f64> },
    /// A rod with round ends; its radius changes linearly from one end to the other.
    Limb { ends: [Vector3<f64>; 2], radii: [f64; 2] },
}

impl Part {
    /// Returns the distance: negative inside, and accurate to a few percent near the surface.
    fn distance(&self, p: &Vector3<f64>) -> f64 {
        match self {
            Part::Body { centre, half_axes } => {
                let scaled = (p - centre).component_div(half_axes);
                let slope = scaled.component_div(half_axes).norm();
                if slope > 0.0 { scaled.norm() * (scaled.norm() - 1.0) / slope } else { -half_axes.min() }
            }
            Part::Limb { ends: [from, to], radii } => {
                let along = to - from;
                let share = ((p - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                (p - from - along * share).norm() - (radii[0] + (radii[1] - radii[0]) * share)
            }
        }
    }
}

/// A Gaussian bump on the surface with three widths, or with a negative height a dent.
#[derive(Clone, Debug)]
pub(crate) struct Bump {
    pub(crate) at: Vector3<f64>,
    /// Rows: the three axes, each divided by the standard deviation along it.
    pub(crate) axes: nalgebra::Matrix3<f64>,
    /// Outward displacement of the surface at the top.
    pub(crate) height: f64,
}

impl Bump {
    fn height_at(&self, p: &Vector3<f64>) -> f64 {
        let distance_sq = (self.axes * (p - self.at)).norm_squared();
        if distance_sq > REACH * REACH { 0.0 } else { self.height * (-0.5 * distance_sq).exp() }
    }
}

/// Parts and the relief on them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solid {
    pub(crate) parts: Vec<Part>,
    pub(crate) bumps: Vec<Bump>,
}

impl Solid {
    /// Returns the distance to the parts alone, blended where they meet.
    pub(crate) fn bare_distance(&self, p: &Vector3<f64>) -> f64 {
        // The nearest part is factored out of the sum of exponentials, which would overflow or vanish far away.
        let nearest = self.parts.iter().map(|part| part.distance(p)).fold(f64::INFINITY, f64::min);
        let others = self.parts.iter().map(|part| ((nearest - part.distance(p)) / BLEND).exp());
        nearest - BLEND * others.sum::<f64>().ln()
    }

    /// Returns the distance with the relief, which is evaluated only up to `relief_reach` from the bare surface.
    pub(crate) fn distance(&self, p: &Vector3<f64>, relief_reach: f64) -> f64 {
        let bare = self.bare_distance(p);
        if bare.abs() > relief_reach {
            return bare;
        }
        let relief: f64 = self.bumps.iter().map(|bump| bump.height_at(p)).sum();
        bare - if relief < 0.0 { DEEPEST * (relief / DEEPEST).tanh() } else { relief }
    }

    /// Returns the point on the bare surface that is reached from `from` by descending the distance; close to the
    /// nearest one.
    pub(crate) fn on_surface(&self, from: Vector3<f64>) -> Vector3<f64> {
        /// Number of corrected steps; a few suffice because the distance is nearly exact.
        const STEPS: usize = 6;
        (0..STEPS).fold(from, |p, _| p - self.outward(&p) * self.bare_distance(&p))
    }

    /// Returns the direction in which the bare distance grows fastest, by finite differences.
    pub(crate) fn outward(&self, p: &Vector3<f64>) -> Vector3<f64> {
        const STEP: f64 = 1e-3;
        let slope = |axis: usize| {
            let ahead = Vector3::ith(axis, STEP);
            self.bare_distance(&(p + ahead)) - self.bare_distance(&(p - ahead))
        };
        Vector3::new(slope(0), slope(1), slope(2)).try_normalize(0.0).unwrap_or_else(Vector3::z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn parts_know_their_distance() {
        let ball = Part::Body { centre: Vector3::x(), half_axes: Vector3::repeat(2.0) };
        let rod = Part::Limb { ends: [Vector3::zeros(), Vector3::z() * 4.0], radii: [1.0, 2.0] };
        let check = |part: &Part, p: [f64; 3], expected: f64| {
            assert!((part.distance(&p.into()) - expected).abs() < 1e-12, "{part:?} {p:?}");
        };
        check(&ball, [6.0, 0.0, 0.0], 3.0);
        check(&ball, [1.0, 1.5, 0.0], -0.5);
        check(&ball, [1.0, 0.0, 0.0], -2.0);
        check(&rod, [5.0, 0.0, 2.0], 3.5);
        check(&rod, [0.0, 0.0, 9.0], 3.0);
        check(&rod, [0.0, 0.0, -3.0], 2.0);
    }

    #[test]
    fn bumps_move_the_surface_by_their_height_and_dents_at_most_by_the_deepest() {
        let ball = Part::Body { centre: Vector3::zeros(), half_axes: Vector3::repeat(10.0) };
        let bump = Bump { at: Vector3::x() * 10.0, axes: Matrix3::identity() * 0.5, height: 0.3 };
        let solid = Solid { parts: vec![ball], bumps: vec![bump] };
        assert!((solid.distance(&(Vector3::x() * 10.0), 5.0) + 0.3).abs() < 1e-9);
        assert!((solid.distance(&(Vector3::x() * -12.0), 5.0) - 2.0).abs() < 1e-9);
        let dent = Bump { at: Vector3::x() * 10.0, axes: Matrix3::identity() * 0.5, height: -50.0 };
        let dented = Solid { parts: solid.parts.clone(), bumps: vec![dent] };
        assert!((dented.distance(&(Vector3::x() * 10.0), 5.0) - DEEPEST).abs() < 1e-9);
        assert!((solid.on_surface(Vector3::new(3.0, -20.0, 5.0)).norm() - 10.0).abs() < 1e-9);
    }
}
