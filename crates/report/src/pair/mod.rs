//! The page of one registration.

mod errors;
mod view;

use crate::numbers::{digits, pose_rows};
use crate::page::{Block, Page, Tone};
use congruent_geometry::{RigidTransform, Scan, angle_between, to_rows};
use congruent_pipeline::{Fit, Pair, PipelineConfig, Registration, Trace, Verdict};

/// One pair of scans with its result.
pub struct PairReport<'a> {
    /// Names of the scans.
    pub names: Pair<&'a str>,
    /// The scans as read.
    pub scans: Pair<&'a Scan>,
    /// The result.
    pub registration: &'a Registration,
    /// Intermediate results of the stages.
    pub trace: &'a Trace,
    /// The configuration with which the result was found.
    pub config: &'a PipelineConfig,
    /// The configuration as text, for the end of the page.
    pub config_text: &'a str,
    /// The true pose between file coordinates, if known.
    pub truth: Option<&'a RigidTransform>,
    /// Version of the program.
    pub version: &'a str,
}

/// Returns the page of one pair: verdict, view, figures, pose, configuration.
#[must_use]
pub fn pair_page(report: &PairReport<'_>) -> Page {
    let off = report.rmse_pr();
    let mut blocks = vec![
        report.verdict(),
        Block::Views(vec![(report.caption(off), report.scene())]),
        Block::Section("Measurements".to_owned()),
        Block::Facts(report.facts(off)),
        Block::Section("Pose".to_owned()),
    ];
    blocks.extend(report.pose());
    blocks.extend(ending(report.config_text, report.version));
    Page { title: report.title(), subtitle: String::new(), blocks }
}

/// Returns a page of one pair, registered in several ways (for instance by different metrics), side by side: the
/// paper's figure 11. Each way has a name. Without reports the page has no views.
#[must_use]
pub fn comparison_page(reports: &[(String, PairReport<'_>)]) -> Page {
    let off: Vec<Option<f64>> = reports.iter().map(|(_, report)| report.rmse_pr()).collect();
    let view = |((name, report), off): (&(String, PairReport<'_>), &Option<f64>)| {
        (format!("{name}: {}", report.caption(*off)), report.scene())
    };
    let mut blocks = vec![Block::Views(reports.iter().zip(&off).map(view).collect())];
    for ((name, report), off) in reports.iter().zip(off) {
        blocks.extend([Block::Section(name.clone()), report.verdict(), Block::Facts(report.facts(off))]);
        blocks.extend(report.pose());
    }
    let first = reports.first().map(|(_, report)| report);
    blocks.extend(first.map(|report| ending(report.config_text, report.version)).into_iter().flatten());
    Page { title: first.map_or(String::new(), PairReport::title), subtitle: String::new(), blocks }
}

/// Returns the configuration, and the program that made the page.
pub(crate) fn ending(config: &str, version: &str) -> [Block; 3] {
    [
        Block::Section("Configuration".to_owned()),
        Block::Printed(config.trim_end().to_owned()),
        Block::Text(format!("congruent {version}")),
    ]
}

impl PairReport<'_> {
    fn title(&self) -> String {
        format!("{} onto {}", self.names.source, self.names.target)
    }

    fn verdict(&self) -> Block {
        let kind = self.registration.verdict();
        let tone = match kind {
            Verdict::Ok => Tone::Good,
            Verdict::Ambiguous => Tone::Doubtful,
            Verdict::Failed => Tone::Bad,
        };
        let confidence = self.registration.confidence();
        let sentence = self.registration.reason().unwrap_or_else(|| {
            "The surfaces fit each other, little contradicts the pose, and no other pose fits nearly as well."
                .to_owned()
        });
        Block::Verdict(tone, kind.to_string(), format!("confidence {confidence:.3}. {}", capital(&sentence)))
    }

    /// Returns the caption; `off` is the paper's RMSE, in `pr`, if known.
    fn caption(&self, off: Option<f64>) -> String {
        let moved = match self.registration.estimate() {
            Some(_) => "the source moved onto the target",
            None => "no pose; the scans as provided",
        };
        match off {
            Some(rmse) => format!("{moved}; off by {rmse:.2} pr where the scans overlap"),
            None => moved.to_owned(),
        }
    }

    fn facts(&self, off: Option<f64>) -> Vec<(String, String)> {
        let (r, counts) = (self.registration, &self.registration.counts);
        let two = |pair: Pair<usize>| format!("{} and {}", pair.source, pair.target);
        let mut facts = vec![
            ("Points, source and target".to_owned(), two(counts.points)),
            ("Points after sampling".to_owned(), two(counts.sampled)),
            ("Keypoints described".to_owned(), two(counts.described)),
            ("Correspondences".to_owned(), format!("{}, {} of them inliers", counts.correspondences, counts.inliers)),
            ("Poses examined".to_owned(), format!("{} of {} proposed", counts.poses, counts.trials)),
            ("Resolution (1 pr)".to_owned(), format!("{} data units", digits(r.raw_resolution, 4))),
        ];
        if let Some(Fit { agreement, .. }) = r.fit() {
            facts.push(("Overlap of the surfaces".to_owned(), format!("{:.0} %", 100.0 * agreement.overlap)));
            if let Some(residual) = agreement.residual_pr {
                facts.push(("Distance where they touch".to_owned(), format!("{residual:.2} pr")));
            }
            let against = 100.0 * (agreement.hover + agreement.occlusion);
            facts.push(("Points that contradict the pose".to_owned(), format!("{against:.1} %")));
        }
        if let (Some(rmse), Some(pose), Some(truth)) = (off, r.pose(), self.truth) {
            facts.push(("Error against the ground truth, where the scans overlap".to_owned(), format!("{rmse:.2} pr")));
            let angle = angle_between(pose, truth).to_degrees();
            facts.push(("Rotation error against the ground truth".to_owned(), format!("{angle:.2}°")));
        }
        let seconds: f64 = r.timings.iter().map(|t| t.time.as_secs_f64()).sum();
        facts.push(("Time in all stages".to_owned(), format!("{seconds:.2} s")));
        facts
    }

    fn pose(&self) -> Vec<Block> {
        let Some(pose) = self.registration.pose() else {
            return vec![Block::Text("No pose was found.".to_owned())];
        };
        let reach = self.registration.uncertainty().map_or(0.0, |known| known.about.amax());
        let rows = pose_rows(&to_rows(pose), self.registration.raw_resolution, reach);
        let mut what = "Maps source coordinates into the target's frame, as in the files.".to_owned();
        if self.registration.verdict() != Verdict::Ok {
            what += " It is only the best guess; do not rely on it.";
        }
        vec![Block::Text(what), Block::Printed(rows.join("\n"))]
    }
}

fn capital(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layer;
    use congruent_pipeline::{Prior, register_traced};
    use congruent_simulation::pair::{PairOptions, figurine_pair};

    #[test]
    fn a_right_answer_has_small_errors_and_as_many_inliers_as_it_says() {
        let pair = figurine_pair(&PairOptions { pixels: 120, view_angle: 0.3, ..PairOptions::default() });
        let scans = Pair { source: &pair.source, target: &pair.target }.map(|raw| Scan::new(raw).unwrap());
        let config = PipelineConfig::default();
        let (registration, trace) = register_traced(scans.as_ref(), &Prior::default(), &config, &|_| ());
        let report = |truth| PairReport {
            names: Pair { source: "a", target: "b" },
            scans: scans.as_ref(),
            registration: &registration,
            trace: &trace,
            config: &config,
            config_text: "",
            truth,
            version: "",
        };
        let judged = report(Some(&pair.target_from_source));
        assert!(judged.rmse_pr().unwrap() < 1.0);
        let errors = judged.point_errors();
        let known: Vec<f32> = errors.iter().copied().filter(|e| !e.is_nan()).collect();
        assert_eq!(errors.len(), scans.source.points().len());
        assert!(known.len() > errors.len() / 2 && known.len() < errors.len() && known.iter().all(|e| *e < 2.0));
        let scene = judged.scene();
        let Some(Layer::Lines(inliers)) = scene.layers.get(2) else { panic!() };
        assert_eq!(inliers.segments.len(), registration.counts.inliers);
        let names: Vec<&str> = scene.states.iter().map(|state| state.name.as_str()).collect();
        assert_eq!(names, ["as scanned", "true pose", "aligned"]);
        // Without ground truth, only points with a target point within ten resolutions have a number.
        assert!(report(None).point_errors().iter().all(|e| e.is_nan() || *e <= 10.0));
    }
}
