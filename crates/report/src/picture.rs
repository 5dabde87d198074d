//! A picture of two scans before and after alignment: one SVG file that any browser opens.

use crate::{SOURCE, TARGET};
use congruent_geometry::RigidTransform;
use congruent_pipeline::Pair;
use nalgebra::{Point3, Vector3};
use std::fmt::Write;

/// Side of a panel, pixels.
const SIDE: f64 = 420.0;
const MARGIN: f64 = 18.0;
/// Maximum number of points drawn of each scan, spread evenly.
const POINTS: usize = 5000;

/// Draws two scans that are each in their sensor's frame: the target with the source as scanned, centred on it, and, if
/// there is a pose, with the source moved by it. Points that are not finite are left out.
#[must_use]
pub fn before_and_after(scans: Pair<&[[f64; 3]]>, target_from_source: Option<&RigidTransform>) -> String {
    let Pair { source, target } = scans.map(drawn);
    let view = View::of(&target);
    let panels = if target_from_source.is_some() { 2.0 } else { 1.0 };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"15\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        panels * SIDE,
        SIDE + 30.0
    );
    // Before alignment, the source is drawn about the target's middle, since their frames are unrelated.
    panel(&mut svg, 0.0, "as scanned", &[(&target, TARGET), (&centred_on(&source, &target), SOURCE)], &view);
    if let Some(pose) = target_from_source {
        let moved: Vec<Point3<f64>> = source.iter().map(|p| pose * p).collect();
        panel(&mut svg, SIDE, "aligned", &[(&target, TARGET), (&moved, SOURCE)], &view);
    }
    svg.push_str("</svg>\n");
    svg
}

fn drawn(points: &[[f64; 3]]) -> Vec<Point3<f64>> {
    let finite: Vec<Point3<f64>> =
        points.iter().filter(|p| p.iter().all(|v| v.is_finite())).map(|p| Point3::from(*p)).collect();
    finite.iter().step_by(finite.len().div_ceil(POINTS).max(1)).copied().collect()
}

fn middle(points: &[Point3<f64>]) -> Vector3<f64> {
    points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len().max(1) as f64
}

fn centred_on(points: &[Point3<f64>], other: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let shift = middle(other) - middle(points);
    points.iter().map(|p| p + shift).collect()
}

/// Looks from the target's sensor: along +z, with y down.
struct View {
    middle: Vector3<f64>,
    /// Pixels per data unit.
    scale: f64,
}

impl View {
    fn of(target: &[Point3<f64>]) -> View {
        let middle = middle(target);
        let radius = target.iter().map(|p| (p.coords - middle).norm()).fold(f64::MIN_POSITIVE, f64::max);
        View { middle, scale: (SIDE / 2.0 - MARGIN) / radius }
    }

    fn place(&self, point: &Point3<f64>) -> (f64, f64) {
        let offset = (point.coords - self.middle) * self.scale;
        (SIDE / 2.0 + offset.x, SIDE / 2.0 + offset.y)
    }
}

fn panel(svg: &mut String, left: f64, title: &str, clouds: &[(&[Point3<f64>], &str)], view: &View) {
    let mut line = |text: String| svg.push_str(&text);
    line(format!(
        "<g transform=\"translate({left} 0)\"><text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{title}</text>\n",
        SIDE / 2.0,
        SIDE + 16.0
    ));
    for (points, colour) in clouds {
        let mut path = String::new();
        for (x, y) in
            points.iter().map(|p| view.place(p)).filter(|(x, y)| (0.0..SIDE).contains(x) && (0.0..SIDE).contains(y))
        {
            write!(path, "M{x:.1} {y:.1}h0").expect("a string can be written to");
        }
        line(format!(
            "<path d=\"{path}\" stroke=\"{colour}\" stroke-width=\"1.6\" stroke-linecap=\"round\" stroke-opacity=\".55\"/>\n"
        ));
    }
    line("</g>\n".to_owned());
}
