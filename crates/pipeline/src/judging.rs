//! How an attempt chooses one of its poses and judges it.

use crate::chain::{Answer, Chain, Proposals};
use crate::gauge::Gauge;
use crate::memory::Search;
use crate::prepared::PreparedPair;
use crate::ranking::{Ranked, Ranking};
use crate::verdict::{Judgement, Standing};
use crate::{Agreement, Failure, Fit, Stage, stages};
use congruent_estimators::Hypothesis;
use congruent_geometry::RigidTransform;
use congruent_metrics::Evidence;
use congruent_refinement::{PointToPlaneConfig, Refinement, Uncertainty};
use rayon::prelude::*;

/// The pose that an attempt chose.
pub(crate) struct Chosen {
    target_from_source: RigidTransform,
    uncertainty: Option<Uncertainty>,
    pub(crate) ranked: Option<Ranked>,
    /// Substantially different poses, best first.
    others: Vec<Ranked>,
    /// See [`Standing`].
    chosen_from: u32,
}

impl Chosen {
    fn standing(&self) -> Standing {
        let second = self.others.first().map_or(0.0, |other| other.score.value());
        Standing { ranked: self.ranked, second, chosen_from: self.chosen_from }
    }
}

impl Chain<'_, '_> {
    /// Returns the pose with the best score of the ranking or, without a ranking, of the metric; refined.
    pub(crate) fn chosen(
        &mut self,
        prepared: &PreparedPair,
        pool: &[Hypothesis],
        ranking: Option<&Ranking<'_>>,
    ) -> Chosen {
        let Some(ranking) = ranking else {
            let Refinement { target_from_source, uncertainty, .. } =
                self.refined(&prepared.surfaces, &pool[0].target_from_source, self.resolution);
            return Chosen { target_from_source, uncertainty, ranked: None, others: Vec::new(), chosen_from: 1 };
        };
        let poses: Vec<RigidTransform> = pool.iter().map(|h| h.target_from_source).collect();
        let search = Search::new(self.config, self.signs);
        let ranked = self.clock.time(Stage::Ranking, || {
            let mut order = self.memory.orders.get(&search).unwrap_or_else(|| ranking.order(&poses));
            let ranked = ranking.best(&mut order);
            self.memory.orders.keep(search, &order);
            ranked
        });
        self.settled(&ranked[0], &ranked, prepared, ranking)
    }

    /// Refines one of the ranked poses, and collects those that are substantially different from it.
    fn settled(&mut self, pose: &Ranked, ranked: &[Ranked], prepared: &PreparedPair, ranking: &Ranking<'_>) -> Chosen {
        let refined = self.refined(&prepared.surfaces, &pose.target_from_source, self.resolution);
        let kept = ranking.judge(&refined.target_from_source);
        Chosen {
            target_from_source: kept.target_from_source,
            uncertainty: refined.uncertainty,
            ranked: Some(kept),
            others: ranking.others(&kept, ranked),
            chosen_from: 1,
        }
    }

    /// Returns what the poses of this attempt are measured with.
    fn gauge<'g>(&self, prepared: &'g PreparedPair, evidence: &'g Evidence) -> Gauge<'g> {
        Gauge {
            surfaces: &prepared.surfaces,
            evidence,
            contact: PointToPlaneConfig::default().build(self.resolution).within(self.bounds.freedom()),
            inlier_threshold: self.config.verdict.inlier_threshold().resolve(self.resolution),
            trials: self.counts.trials,
            is_near: self.proposals == Proposals::Guessed || self.bounds.hold_to_guess(),
            resolution: self.resolution,
        }
    }

    /// Marks a failure as one within bounds, if there are any.
    pub(crate) fn bounded(&self, failure: Failure) -> Failure {
        if self.bounds.are_open() { failure } else { Failure::OutOfBounds { within: Box::new(failure) } }
    }

    /// Judges the chosen pose.
    pub(crate) fn judged(
        &mut self,
        chosen: &Chosen,
        prepared: &PreparedPair,
        evidence: &Evidence,
        ranking: Option<&Ranking<'_>>,
    ) -> Answer {
        let surfaces = &prepared.surfaces;
        let (config, resolution) = (self.config, self.resolution);
        let pose = &chosen.target_from_source;
        let gauge = self.gauge(prepared, evidence);
        let evident = self.clock.time(Stage::Verdict, || gauge.evident(pose, chosen.standing()));
        self.counts.inliers = evident.significance.inliers;
        let mut judgement = config.verdict.judge(&evident);
        if let (Some(ranking), Some(answer)) = (ranking, &chosen.ranked) {
            let best = answer.score.value();
            // If only the guess was examined, the other pose is the guess itself.
            let is_rival = |other: &&Ranked| {
                self.proposals == Proposals::Searched && config.verdict.comes_close(other.score.value(), best)
            };
            if judgement.doubt.is_none() {
                judgement.rivals = chosen.others.iter().filter(is_rival).copied().collect();
                self.compare(&mut judgement, answer, prepared, evidence, ranking);
            }
        }
        judgement.doubt = judgement.doubt.map(|doubt| self.bounded(doubt));
        let metric = config.metric.build(resolution, stages::clouds(surfaces));
        Answer {
            target_from_source: *pose,
            score: metric.score(evidence, pose).value(),
            hold: evident.hold,
            uncertainty: chosen.uncertainty.clone(),
            oriented: prepared.oriented,
            fit: chosen
                .ranked
                .zip(judgement.predictors)
                .map(|(ranked, predictors)| Fit { agreement: Agreement::new(&ranked, resolution), predictors }),
            significance: evident.significance,
            judgement,
        }
    }

    /// Refines and examines the rivals like the answer; those that are then worse, or the same pose, are dropped.
    fn compare(
        &mut self,
        judgement: &mut Judgement,
        answer: &Ranked,
        prepared: &PreparedPair,
        evidence: &Evidence,
        ranking: &Ranking<'_>,
    ) {
        let (config, resolution) = (self.config, self.resolution);
        let gauge = self.gauge(prepared, evidence);
        for close in std::mem::take(&mut judgement.rivals) {
            let refined = self.refined(&prepared.surfaces, &close.target_from_source, resolution);
            let ranked = ranking.judge(&refined.target_from_source);
            if std::iter::once(answer).chain(&judgement.rivals).any(|known| !ranking.apart(&ranked, known)) {
                continue;
            }
            let standing = Standing { ranked: Some(ranked), second: answer.score.value(), chosen_from: 1 };
            let pose = &ranked.target_from_source;
            let known = self.clock.time(Stage::Verdict, || gauge.evident(pose, standing)).predictors();
            judgement.examined.extend(known);
            let both = known.as_ref().zip(judgement.predictors.as_ref());
            if both.is_some_and(|(known, answer)| config.verdict.is_rival(known, answer)) {
                judgement.rivals.push(ranked);
            }
        }
    }

    /// Replaces an answer that is not accepted by a substantially different pose of higher confidence, if there is one:
    /// the pose with the best score is not always the most probable. Only one other pose is refined, the one that has
    /// the highest confidence before refinement.
    pub(crate) fn more_believable(
        &mut self,
        answer: &Answer,
        chosen: &Chosen,
        prepared: &PreparedPair,
        evidence: &Evidence,
        ranking: &Ranking<'_>,
    ) -> Option<(Ranked, Answer)> {
        answer.judgement.doubt.as_ref()?;
        let chosen_from = 1 + chosen.others.len() as u32;
        let (verdict, gauge) = (&self.config.verdict, self.gauge(prepared, evidence));
        let confidence = |other: &Ranked| {
            let standing = Standing { ranked: Some(*other), second: 1.0, chosen_from };
            verdict.judge(&gauge.evident(&other.target_from_source, standing)).confidence
        };
        let all = || chosen.others.par_iter().with_max_len(1).map(confidence).collect();
        let confidences: Vec<f64> = self.clock.time(Stage::Verdict, all);
        let best = (0..confidences.len()).max_by(|&a, &b| confidences[a].total_cmp(&confidences[b]).then(b.cmp(&a)))?;
        if confidences[best] <= answer.judgement.confidence {
            return None;
        }
        let ranked: Vec<Ranked> = chosen.ranked.iter().chain(&chosen.others).copied().collect();
        let inliers = self.counts.inliers;
        let settled = self.settled(&chosen.others[best], &ranked, prepared, ranking);
        let other = Chosen { chosen_from, ..settled };
        let another = self.judged(&other, prepared, evidence, Some(ranking));
        if another.judgement.confidence <= answer.judgement.confidence {
            self.counts.inliers = inliers;
            return None;
        }
        Some((other.ranked?, another))
    }
}
