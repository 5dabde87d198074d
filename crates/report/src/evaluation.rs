//! The page of an evaluation: accuracy, errors, matches and verdicts over many pairs.

use crate::experiment::{Figure, accuracy};
use crate::figures::{Axis, Bars, Curve, Curves, Measure, Sample, round_up};
use crate::page::{Block, Cell, Page, Table};
use crate::pair::ending;
use congruent_evaluation::{BANDS, D_RMSE, PairRow, Status, VERDICT_D_RMSE};

/// Number of bars in a histogram.
const BARS: usize = 20;
/// Error above which pairs are counted together, `pr`.
const LARGEST_ERROR_PR: f64 = 10.0;
/// Number of bands of confidence.
const CONFIDENCES: usize = 10;

/// Returns the page for the rows of one data set with one configuration. `summary` is the text of
/// [`congruent_evaluation::Summary`].
#[must_use]
pub fn evaluation_page(dataset: &str, rows: &[PairRow], summary: &str, config: &str, version: &str) -> Page {
    let figures = evaluation_figures(rows).into_iter().map(|figure| (figure.caption, figure.svg)).collect();
    let mut blocks = vec![
        Block::Printed(summary.trim_end().to_owned()),
        Block::Section("Figures".to_owned()),
        Block::Figures(figures),
        Block::Section("Pairs".to_owned()),
        Block::Table(pairs(rows)),
    ];
    blocks.extend(ending(config, version));
    Page { title: format!("Evaluation on {dataset}"), subtitle: String::new(), blocks }
}

/// Returns the accuracy as a function of the bound, histograms of errors and matches, and how far the confidence can be
/// trusted. Pairs that are not scored do not count.
#[must_use]
pub fn evaluation_figures(rows: &[PairRow]) -> Vec<Figure> {
    let scored: Vec<&PairRow> = rows.iter().filter(|row| row.status == Status::Scored).collect();
    let of = |f: &dyn Fn(&PairRow) -> f64| scored.iter().map(|row| f(row)).collect::<Vec<f64>>();
    // No pose counts as the largest error.
    let errors = of(&|row| row.rmse_pr.unwrap_or(f64::INFINITY));
    let ratios = of(&|row| 100.0 * row.inliers_5pr as f64 / row.matches.max(1) as f64);
    let counts = of(&|row| row.inliers_5pr as f64);
    let most = round_up(counts.iter().copied().fold(1.0, f64::max));
    let figure =
        |name: &str, caption: &str, svg: String| Figure { name: name.to_owned(), caption: caption.to_owned(), svg };
    vec![
        figure(
            "accuracy",
            "Share of right pairs over the error bound, with 95 % intervals (Wilson)",
            accuracy_over_bound(&scored).svg(),
        ),
        figure(
            "errors",
            "Errors (pairs without a pose are in the last bar)",
            Bars::counted("RMSE (pr)", &errors, LARGEST_ERROR_PR, BARS).svg(),
        ),
        figure(
            "inlier-ratios",
            "Share of true matches (within 5 pr after sampling) among all matches",
            Bars::counted("true matches, %", &ratios, 100.0, BARS).svg(),
        ),
        figure("inliers", "Number of true matches", Bars::counted("true matches", &counts, most, BARS).svg()),
        figure(
            "confidence",
            &format!("Share of pairs right at {VERDICT_D_RMSE} pr, over the confidence"),
            confidence(&scored).svg(),
        ),
    ]
}

fn accuracy_over_bound(scored: &[&PairRow]) -> Curves {
    let curve = |name: &str, rows: Vec<&PairRow>| {
        let at = |&d: &f64| accuracy(d, rows.iter().filter(|row| row.is_right(d)).count(), rows.len());
        Curve { name: format!("{name} ({})", rows.len()), samples: D_RMSE.iter().map(at).collect() }
    };
    let bands = BANDS.iter().map(|&(from, below, name)| {
        (name, scored.iter().copied().filter(|row| (from..below).contains(&row.overlap)).collect::<Vec<_>>())
    });
    let all = std::iter::once(("all", scored.to_vec())).chain(bands);
    let curves = all.filter(|(_, rows)| !rows.is_empty()).map(|(name, rows)| curve(name, rows)).collect();
    Curves { x: Axis::Numbers("d_rmse (pr)".to_owned()), y: Measure::percent("accuracy, %"), curves }
}

/// Returns, for each band of confidence that has pairs, their mean confidence and the fraction of right ones.
fn confidence(scored: &[&PairRow]) -> Curves {
    let said: Vec<(f64, bool)> =
        scored.iter().filter_map(|row| Some((row.confidence?, row.is_right(VERDICT_D_RMSE)))).collect();
    let band = |confidence: f64| ((confidence * CONFIDENCES as f64) as usize).min(CONFIDENCES - 1);
    let samples = (0..CONFIDENCES).filter_map(|i| {
        let inside: Vec<&(f64, bool)> = said.iter().filter(|(confidence, _)| band(*confidence) == i).collect();
        let mean = inside.iter().map(|(confidence, _)| confidence).sum::<f64>() / inside.len() as f64;
        let right = inside.iter().filter(|(_, right)| *right).count();
        (!inside.is_empty()).then(|| accuracy(mean, right, inside.len()))
    });
    let diagonal = [0.0, 1.0].map(|x| Sample { x, y: 100.0 * x, interval: None });
    let curves = vec![
        Curve { name: "measured".to_owned(), samples: samples.collect() },
        Curve { name: "ideal".to_owned(), samples: diagonal.to_vec() },
    ];
    Curves { x: Axis::Numbers("confidence".to_owned()), y: Measure::percent("right, %"), curves }
}

fn pairs(rows: &[PairRow]) -> Table {
    let columns = [
        "pair",
        "overlap",
        "RMSE (pr)",
        "rotation (°)",
        "verdict",
        "confidence",
        "matches",
        "true (%)",
        "time (s)",
        "remark",
    ];
    let number = |value: Option<f64>, digits: usize| value.map_or("–".to_owned(), |v| format!("{v:.digits$}"));
    let row = |row: &PairRow| {
        let remark = match row.status {
            Status::Scored => String::new(),
            Status::NotEvaluable => "not evaluable".to_owned(),
            Status::Error => row.error.clone().unwrap_or_default(),
        };
        [
            format!("{} → {}", row.source, row.target),
            number(Some(row.overlap), 2),
            number(row.rmse_pr, 2),
            number(row.rotation_deg, 2),
            row.verdict.map_or("–".to_owned(), |verdict| verdict.to_string()),
            number(row.confidence, 3),
            row.matches.to_string(),
            number(Some(100.0 * row.inliers_5pr as f64 / row.matches.max(1) as f64), 1),
            number(Some(row.seconds), 2),
            remark,
        ]
        .map(Cell::from)
        .to_vec()
    };
    Table { columns: columns.map(str::to_owned).to_vec(), rows: rows.iter().map(row).collect(), sortable: true }
}
