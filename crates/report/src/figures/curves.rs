//! Curves over numbers or names, with intervals.

use super::{Area, Drawn, FAINT, INK, SIZE, TEXT, colour, font, svg};
use crate::palette::scan_colour;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Width of the legend, pixels.
const LEGEND: u32 = 150;
/// Number of letters in names that fit side by side under a plot.
const LETTERS: usize = 56;
/// Distance between the intervals of neighbouring curves, as a fraction of the width.
const DODGE: f64 = 0.004;

/// Several curves in one frame.
pub(crate) struct Curves {
    pub(crate) x: Axis,
    pub(crate) y: Measure,
    pub(crate) curves: Vec<Curve>,
}

/// The vertical measure.
#[derive(Clone)]
pub(crate) struct Measure {
    name: &'static str,
    range: (f64, f64),
    label: fn(&f64) -> String,
}

impl Measure {
    /// Returns a measure from 0 to 100.
    pub(crate) fn percent(name: &'static str) -> Measure {
        Measure { name, range: (0.0, 100.0), label: number }
    }

    /// Returns a measure of whole decades around positive values; samples are decimal logarithms.
    pub(crate) fn decades(name: &'static str, values: impl Iterator<Item = f64>) -> Measure {
        let (low, high) = values
            .filter(|v| *v > 0.0 && v.is_finite())
            .map(f64::log10)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v.floor()), high.max(v.ceil())));
        let range = if low < high { (low, high) } else { (0.0, 1.0) };
        // Between whole decades a label would look like that of a whole one.
        let label = |y: &f64| if y.fract() == 0.0 { number(&10f64.powf(*y)) } else { String::new() };
        Measure { name, range, label }
    }
}

/// The horizontal axis.
pub(crate) enum Axis {
    /// Numbers, with the name of the quantity.
    Numbers(String),
    /// Names, in order; samples are at 0, 1, …
    Names(Vec<String>),
}

/// A curve with its name.
pub(crate) struct Curve {
    pub(crate) name: String,
    pub(crate) samples: Vec<Sample>,
}

/// A point of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Its 95 % interval.
    pub(crate) interval: Option<(f64, f64)>,
}

impl Curves {
    pub(crate) fn svg(&self) -> String {
        svg(|area| self.draw(area))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let (plot, _) = area.split_horizontally(SIZE.0 - LEGEND);
        let (low, high) = self.span();
        let below = self.room_below();
        let mut chart = ChartBuilder::on(&plot)
            .margin(12)
            .x_label_area_size(below)
            .y_label_area_size(52)
            .build_cartesian_2d(low..high, self.y.range.0..self.y.range.1)?;
        let mut mesh = chart.configure_mesh();
        mesh.disable_x_mesh().max_light_lines(0).bold_line_style(FAINT).axis_style(INK);
        mesh.label_style(font(TEXT)).axis_desc_style(font(TEXT)).y_desc(self.y.name);
        mesh.y_label_formatter(&self.y.label).x_label_formatter(&number);
        match &self.x {
            Axis::Numbers(name) => mesh.x_labels(8).x_desc(name.as_str()),
            // The names are written afterwards: plotters puts rotated ones across the axis.
            Axis::Names(_) => mesh.x_labels(0),
        };
        mesh.draw()?;
        if let Axis::Names(names) = &self.x {
            for (i, name) in names.iter().enumerate() {
                let (x, y) = chart.backend_coord(&(i as f64, self.y.range.0));
                area.draw(&Text::new(name.clone(), (x, y + 8), self.name_style()))?;
            }
        }
        for (i, curve) in self.curves.iter().enumerate() {
            let look = Look::of(i);
            let shift = (i as f64 - 0.5 * (self.curves.len() - 1) as f64) * DODGE * (high - low);
            let bars = curve.samples.iter().filter_map(|s| s.interval.map(|interval| (s, interval)));
            let faint = look.colour.mix(0.45).stroke_width(1);
            chart.draw_series(
                bars.map(|(s, (from, to))| ErrorBar::new_vertical(s.x + shift, from, s.y, to, faint, 4)),
            )?;
            let points: Vec<(f64, f64)> = curve.samples.iter().map(|s| (s.x, s.y)).collect();
            let line = look.colour.stroke_width(2);
            match look.dashes {
                None => chart.draw_series(LineSeries::new(points.clone(), line))?,
                Some((dash, gap)) => chart.draw_series(DashedLineSeries::new(points.clone(), dash, gap, line))?,
            };
            points.iter().try_for_each(|at| look.mark(area, chart.backend_coord(at)))?;
        }
        self.legend(area)
    }

    fn legend(&self, area: &Area<'_>) -> Drawn {
        let left = (SIZE.0 - LEGEND) as i32;
        for (i, curve) in self.curves.iter().enumerate() {
            let (look, y) = (Look::of(i), 24 + 24 * i as i32);
            let line = look.colour.stroke_width(2);
            let sample = vec![(left + 2, y), (left + 34, y)];
            match look.dashes {
                None => area.draw(&PathElement::new(sample, line))?,
                Some((dash, gap)) => area.draw(&plotters::element::DashedPathElement::new(sample, dash, gap, line))?,
            }
            look.mark(area, (left + 18, y))?;
            area.draw(&Text::new(curve.name.clone(), (left + 42, y - 8), font(TEXT)))?;
        }
        Ok(())
    }

    fn span(&self) -> (f64, f64) {
        if let Axis::Names(names) = &self.x {
            return (-0.5, names.len() as f64 - 0.5);
        }
        let all = || self.curves.iter().flat_map(|curve| &curve.samples).map(|s| s.x);
        let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
        if low > high {
            return (0.0, 1.0);
        }
        let margin = if high > low { 0.03 * (high - low) } else { 0.5 };
        (low - margin, high + margin)
    }

    /// Returns the length of the longest name if names do not fit side by side.
    fn upright(&self) -> Option<usize> {
        let Axis::Names(names) = &self.x else { return None };
        let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        (longest * names.len() > LETTERS).then_some(longest)
    }

    fn room_below(&self) -> u32 {
        self.upright().map_or(44, |letters| 20 + 7 * letters.min(24) as u32)
    }

    fn name_style(&self) -> TextStyle<'static> {
        match self.upright() {
            Some(_) => font(12).transform(FontTransform::Rotate90).pos(Pos::new(HPos::Left, VPos::Center)),
            None => font(TEXT).pos(Pos::new(HPos::Center, VPos::Top)),
        }
    }
}

/// Formats a number without the digits that binary fractions leave.
fn number(x: &f64) -> String {
    ((x * 1e6).round() / 1e6).to_string()
}

/// The appearance of the `i`-th curve.
struct Look {
    colour: RGBColor,
    /// Length of a dash and of a gap, pixels.
    dashes: Option<(u32, u32)>,
    shape: usize,
}

impl Look {
    fn of(i: usize) -> Look {
        let dashes = [None, Some((8, 4)), Some((3, 3)), Some((14, 4)), Some((5, 6))];
        Look { colour: colour(scan_colour(i)), dashes: dashes[i % dashes.len()], shape: i % 6 }
    }

    /// Draws the marker at a pixel.
    fn mark(&self, area: &Area<'_>, at: (i32, i32)) -> Drawn {
        let (solid, open) = (self.colour.filled(), self.colour.stroke_width(2));
        let square = |style: ShapeStyle| Rectangle::new([(at.0 - 4, at.1 - 4), (at.0 + 4, at.1 + 4)], style);
        match self.shape {
            0 => area.draw(&Circle::new(at, 4, solid))?,
            1 => area.draw(&TriangleMarker::new(at, 6, solid))?,
            2 => area.draw(&Cross::new(at, 4, open))?,
            3 => area.draw(&square(solid))?,
            4 => area.draw(&Circle::new(at, 4, open))?,
            _ => area.draw(&square(open))?,
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_hold_all_values_and_only_they_are_named() {
        let measure = Measure::decades("t", [0.3, 20.0, 4000.0, 0.0, f64::NAN].into_iter());
        assert_eq!(measure.range, (-1.0, 4.0));
        let labels = [-1.0, 0.5, 3.0].map(|y| (measure.label)(&y));
        assert_eq!(labels, ["0.1", "", "1000"]);
        assert_eq!(Measure::decades("t", std::iter::empty()).range, (0.0, 1.0));
    }
}
