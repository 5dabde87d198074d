//! Evidence for and against an answer, in words and figures.

use congruent_pipeline::{Predictors, Registration};
use serde::Serialize;

/// Limits between for and against. They only affect the wording: the confidence is computed from the figures
/// themselves.
const MUCH_OVERLAP: f64 = 0.15;
const CLOSE_PR: f64 = 0.5;
const FEW_CONTRADICTIONS: f64 = 0.005;
const FEW_DISAGREEING: f64 = 0.02;
const FAR_BEHIND: f64 = 0.5;
const UNLIKELY: f64 = -3.0;
const FIRM: f64 = 0.02;
const SMALL_ANGLE: f64 = 0.2;

/// Phrases, each with its figure.
#[derive(Debug, Default, PartialEq, Serialize)]
pub(crate) struct Reasons {
    #[serde(rename = "for")]
    pub(crate) pro: Vec<String>,
    pub(crate) against: Vec<String>,
}

impl Reasons {
    /// Returns `None` if the surfaces were not compared.
    pub(crate) fn of(registration: &Registration) -> Option<Reasons> {
        let matches = registration.counts.correspondences;
        registration.fit().map(|fit| Reasons::new(&fit.predictors, registration.counts.inliers, matches))
    }

    fn new(measured: &Predictors, inliers: usize, matches: usize) -> Reasons {
        let mut reasons = Reasons::default();
        let mut say = |is_good: bool, phrase: String| {
            let side = if is_good { &mut reasons.pro } else { &mut reasons.against };
            side.push(phrase);
        };
        let Predictors { overlap, residual_pr, contradictions, disagreeing, runner_up, normal_angle, .. } = *measured;
        say(overlap >= MUCH_OVERLAP, format!("{:.0} % of the surfaces touch", 100.0 * overlap));
        say(residual_pr <= CLOSE_PR, format!("{residual_pr:.2} pr apart where they do"));
        let angle = format!("{:.0}° between the normals there", normal_angle.to_degrees());
        say(normal_angle <= SMALL_ANGLE, angle);
        let hang =
            format!("{:.1} % of the points float where the other scanner saw empty space", 100.0 * contradictions);
        say(contradictions <= FEW_CONTRADICTIONS, hang);
        say(disagreeing <= FEW_DISAGREEING, format!("{:.1} % touch with normals that disagree", 100.0 * disagreeing));
        say(
            runner_up <= FAR_BEHIND,
            format!("the best substantially different pose scores {:.0} % as much", 100.0 * runner_up),
        );
        let powers = measured.log10_false_alarms;
        let chance = format!("{inliers} of {matches} correspondences agree (expected by chance: 10^{powers:.0} poses)");
        say(powers <= UNLIKELY, chance);
        let firm = measured.stiffness >= FIRM;
        let held = if firm { "constrained in every direction" } else { "hardly constrained in one direction" };
        say(firm, format!("{held} (stiffness {:.3})", measured.stiffness));
        if measured.are_only_planes() {
            let flat =
                format!("{:.0} % of the touching surface faces only three directions", 100.0 * measured.flatness);
            say(false, flat);
        }
        if measured.chosen_from > 1 {
            say(false, format!("another pose has more overlap; this is the most credible of {}", measured.chosen_from));
        }
        reasons
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn good_figures_speak_for_an_answer_and_bad_ones_against() {
        let good = Predictors {
            score: 0.6,
            overlap: 0.7,
            residual_pr: 0.1,
            contradictions: 0.001,
            disagreeing: 0.0,
            runner_up: 0.1,
            log10_false_alarms: -250.0,
            stiffness: 0.05,
            normal_angle: 0.1,
            chosen_from: 1,
            flatness: 0.0,
        };
        let reasons = Reasons::new(&good, 404, 820);
        assert!(reasons.against.is_empty() && reasons.pro.len() == 8, "{reasons:?}");
        assert_eq!(reasons.pro[6], "404 of 820 correspondences agree (expected by chance: 10^-250 poses)");
        let bad = Predictors {
            score: 0.01,
            overlap: 0.05,
            residual_pr: 1.2,
            contradictions: 0.05,
            disagreeing: 0.1,
            runner_up: 0.95,
            log10_false_alarms: 2.0,
            stiffness: 0.001,
            normal_angle: 0.4,
            chosen_from: 1,
            flatness: 0.0,
        };
        let reasons = Reasons::new(&bad, 5, 300);
        assert!(reasons.pro.is_empty() && reasons.against.len() == 8, "{reasons:?}");
        let chosen = Reasons::new(&Predictors { chosen_from: 6, ..good }, 404, 820);
        assert_eq!(chosen.against, ["another pose has more overlap; this is the most credible of 6"]);
    }
}
