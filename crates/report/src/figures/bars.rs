//! Histograms.

use super::{Area, Drawn, FAINT, INK, TEXT, colour, font, svg};
use crate::TARGET;
use plotters::prelude::*;

/// Counts of numbers in equally wide bars.
pub(crate) struct Bars {
    /// Name of what is counted.
    pub(crate) x: String,
    /// Edge of the first bar, and width of all bars.
    pub(crate) from: f64,
    pub(crate) width: f64,
    pub(crate) counts: Vec<usize>,
    /// Whether the last bar also holds everything beyond its start.
    pub(crate) open: bool,
}

impl Bars {
    /// Counts the numbers in `n` bars from zero to `to`; larger ones in an additional bar, if there are any.
    pub(crate) fn counted(x: &str, values: &[f64], to: f64, n: usize) -> Bars {
        let width = to / n as f64;
        // The last of the `n` bars includes its upper edge.
        let place = |v: f64| if v == to { n - 1 } else { ((v / width).max(0.0) as usize).min(n) };
        let mut counts = vec![0; n + 1];
        values.iter().for_each(|&v| counts[place(v)] += 1);
        let open = counts[n] > 0;
        counts.truncate(if open { n + 1 } else { n });
        Bars { x: x.to_owned(), from: 0.0, width, counts, open }
    }

    pub(crate) fn svg(&self) -> String {
        svg(|area| self.draw(area))
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let most = self.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
        let edge = |i: usize| self.from + i as f64 * self.width;
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .margin_right(24)
            .x_label_area_size(44)
            .y_label_area_size(52)
            .build_cartesian_2d(edge(0)..edge(self.counts.len()), 0.0..1.08 * most)?;
        let last = edge(self.counts.len() - usize::from(self.open));
        let label = |x: &f64| {
            let rounded = (x * 1e6).round() / 1e6;
            if self.open && *x > last { String::new() } else { rounded.to_string() }
        };
        let count = |y: &f64| if y.fract() == 0.0 { format!("{y:.0}") } else { String::new() };
        let name = if self.open { format!("{} (last bar: {last} and more)", self.x) } else { self.x.clone() };
        let mut mesh = chart.configure_mesh();
        mesh.disable_x_mesh().max_light_lines(0).bold_line_style(FAINT).axis_style(INK);
        mesh.label_style(font(TEXT)).axis_desc_style(font(TEXT));
        mesh.x_label_formatter(&label).y_label_formatter(&count).x_desc(name).y_desc("pairs");
        mesh.y_labels((most as usize + 1).min(8)).draw()?;
        let style = colour(TARGET).mix(0.85).filled();
        chart.draw_series(self.counts.iter().enumerate().filter(|(_, n)| **n > 0).map(|(i, n)| {
            let mut bar = Rectangle::new([(edge(i), 0.0), (edge(i + 1), *n as f64)], style);
            bar.set_margin(0, 0, 1, 1);
            bar
        }))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_fall_into_bars_and_large_ones_into_the_last() {
        let bars = Bars::counted("x", &[0.0, 0.49, 0.5, 1.0, 1.0, 7.0, f64::INFINITY], 1.0, 2);
        assert_eq!((bars.counts, bars.open), (vec![2, 3, 2], true));
        assert_eq!(Bars::counted("x", &[], 1.0, 2).counts, [0, 0]);
    }
}
