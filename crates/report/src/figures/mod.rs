//! Figures as SVG, drawn by `plotters`. Curves differ in dashes and markers as well as colours, so that they can be
//! distinguished in greyscale.

mod bars;
mod curves;

pub(crate) use bars::Bars;
pub(crate) use curves::{Axis, Curve, Curves, Measure, Sample};

use plotters::prelude::*;

/// Size of a figure, pixels.
const SIZE: (u32, u32) = (620, 380);
const TEXT: u32 = 14;
const FAINT: RGBColor = RGBColor(217, 221, 227);
const INK: RGBColor = RGBColor(29, 36, 48);

type Drawn = Result<(), Box<dyn std::error::Error>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Lets `draw` fill an area; drawing into a string cannot fail.
fn svg(draw: impl FnOnce(&Area<'_>) -> Drawn) -> String {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        area.fill(&WHITE)
            .map_err(Into::into)
            .and_then(|()| draw(&area))
            .and_then(|()| area.present().map_err(Into::into))
            .expect("a text can be drawn into");
    }
    // The size is determined by the page.
    text.replacen(&format!("width=\"{}\" height=\"{}\" ", SIZE.0, SIZE.1), "", 1)
}

fn font(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK)
}

fn colour(hex: &str) -> RGBColor {
    let part = |from: usize| u8::from_str_radix(hex.get(from..from + 2).unwrap_or("0"), 16).unwrap_or(0);
    RGBColor(part(1), part(3), part(5))
}

/// Returns the next of 1, 2, 5, 10, 20, …
pub(crate) fn round_up(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|d| d * power).into_iter().find(|v| *v >= value).unwrap_or(value)
}
