//! Tests of the claims on invented counts.

use super::*;

fn count(dataset: &str, metric: &'static str, right: usize) -> Count {
    let cell = Cell {
        variant: "v".to_owned(),
        nuisance: "none".to_owned(),
        estimator: "RANSAC".into(),
        iterations: ITERATIONS,
        metric: metric.into(),
        threshold_pr: THRESHOLD_PR,
    };
    Count { dataset: dataset.to_owned(), cell, d_rmse: D_RMSE, right, total: 100, microseconds: None }
}

/// Evaluates the claims that begin with the given text.
fn said(experiment: &str, counts: Vec<Count>, beginning: &str) -> Vec<(String, bool, String)> {
    let experiments = [(experiment.to_owned(), counts)];
    let all = claims(&Counts { experiments: &experiments });
    let about = all.into_iter().filter(|claim| claim.text.starts_with(beginning));
    about.map(|claim| (claim.dataset, claim.holds, claim.figures)).collect()
}

fn one(experiment: &str, counts: Vec<Count>, beginning: &str) -> (bool, String) {
    let said = said(experiment, counts, beginning);
    assert_eq!(said.len(), 1, "{said:?}");
    (said[0].1, said[0].2.clone())
}

fn with(count: Count, change: impl FnOnce(&mut Cell)) -> Count {
    let mut count = count;
    change(&mut count.cell);
    count
}

#[test]
fn above_the_inlier_count_means_in_every_single_case() {
    let at = |iterations, mse, inlier| {
        [count("set", "MSE", mse), count("set", "INLIER", inlier)].map(|c| with(c, |cell| cell.iterations = iterations))
    };
    let (holds, figures) = one("iterations", [at(200, 30, 20), at(400, 31, 29)].concat(), "every proposed");
    assert!(holds && figures.starts_with("above in 2 of 2 cases, on average by +6.0; least +2.0: MSE"), "{figures}");
    let (holds, figures) = one("iterations", [at(200, 30, 20), at(400, 31, 31)].concat(), "every proposed");
    assert!(!holds && figures.contains("above in 1 of 2"), "{figures}");
    // Counts at other bounds are ignored.
    let mut counts = at(200, 30, 20).to_vec();
    counts.extend(at(200, 1, 90).map(|c| Count { d_rmse: 0.5, ..c }));
    assert!(one("iterations", counts, "every proposed").0);
}

#[test]
fn the_best_three_are_alike_and_above_the_rest() {
    let counts = |mae, mse, log_cosh, exp| {
        let best = [("MAE", mae), ("MSE", mse), ("LOG-COSH", log_cosh)];
        let rest = [("EXP", exp), ("QUANTILE", 20), ("-QUANTILE", 21)];
        best.into_iter().chain(rest).map(|(metric, right)| count("set", metric, right)).collect::<Vec<_>>()
    };
    let alike = |c| one("metrics", c, "MAE, MSE and LOG-COSH are within").0;
    let above = |c| one("metrics", c, "MAE, MSE and LOG-COSH are above").0;
    assert!(alike(counts(30, 32, 31, 25)) && above(counts(30, 32, 31, 25)));
    assert!(!alike(counts(30, 33, 31, 25)) && above(counts(30, 33, 31, 25)));
    assert!(!above(counts(30, 32, 31, 30)));
    // If a metric was not run, there is no claim.
    assert!(said("metrics", counts(30, 32, 31, 25)[1..].to_vec(), "MAE").is_empty());
}

#[test]
fn flatness_is_judged_from_5_to_15_pr() {
    let sweep = |metric, rights: [usize; 4]| {
        let of = |(t, right)| with(count("set", metric, right), |cell| cell.threshold_pr = t);
        [1.0, 5.0, 10.0, 15.0].into_iter().zip(rights).map(of).collect::<Vec<_>>()
    };
    let said = |mse, inlier| one("thresholds", [sweep("MSE", mse), sweep("INLIER", inlier)].concat(), "MSE is flat");
    assert_eq!(said([0, 30, 35, 33], [0, 30, 40, 20]), (true, "MSE moves by 5.0, INLIER by 20.0".to_owned()));
    assert!(!said([0, 30, 36, 33], [0, 30, 40, 20]).0);
    assert!(!said([0, 30, 35, 33], [90, 30, 31, 30]).0);
}

#[test]
fn two_points_are_to_help_all_three() {
    let with_two = |right| {
        let of = |estimator: &'static str, right| {
            BEST.map(|m| with(count("set", m, right), |c| c.estimator = estimator.into()))
        };
        [of("RANSAC", 30), of("2SAC-GC", right)].concat()
    };
    assert_eq!(one("estimators", with_two(30), "2SAC-GC"), (true, "MAE +0.0, MSE +0.0, LOG-COSH +0.0".to_owned()));
    assert!(!one("estimators", with_two(29), "2SAC-GC").0);
}

#[test]
fn the_slowest_over_correspondences_is_compared_with_the_fastest_over_clouds() {
    let timed = |metric, time| Count { microseconds: Some(time), ..count("set", metric, 0) };
    let said = |dense| {
        one(
            "time",
            vec![timed("MSE", 1.0), timed("LOG-COSH", 2.0), timed("PC Dist", 9000.0), timed("#OP", dense)],
            "metrics",
        )
    };
    assert!(said(2000.0).0 && !said(1999.0).0);
    assert!(said(4000.0).1.ends_with("2000 times"), "{:?}", said(4000.0));
}

#[test]
fn the_distance_between_clouds_is_to_lead_under_holes_alone() {
    let under = |nuisance: &str, dense, mse| {
        [count("set", "PC Dist", dense), count("set", "MSE", mse), count("set", "INLIER", 99)]
            .map(|c| with(c, |cell| cell.nuisance = nuisance.to_owned()))
    };
    let said = |elsewhere, holes| {
        one("nuisances", [under("none", elsewhere, 30), under("6 holes", holes, 30)].concat(), "PC Dist")
    };
    assert!(said(30, 31).0 && !said(31, 31).0 && !said(30, 30).0);
    assert_eq!(said(31, 35).1, "ahead at 1 of 1 levels of holes (at most +5.0), at 1 of 1 others (at most +1.0)");
}

#[test]
fn data_sets_are_judged_apart_and_together() {
    let counts = [("a", 40, 10), ("b", 20, 21)]
        .into_iter()
        .flat_map(|(set, mse, inlier)| [count(set, "MSE", mse), count(set, "INLIER", inlier)])
        .collect();
    let said = said("estimators", counts, "every proposed");
    let held: Vec<(&str, bool)> = said.iter().map(|(set, holds, _)| (set.as_str(), *holds)).collect();
    assert_eq!(held, [("a", true), ("b", false), ("all pairs", true)]);
    // 60 against 31 of 200.
    assert!(said[2].2.contains("on average by +14.5"), "{}", said[2].2);
}

#[test]
fn the_table_says_yes_or_no() {
    let claim = |holds| Claim { text: "so", dataset: "set".to_owned(), holds, figures: "1".to_owned() };
    let table = claims_table(&[claim(true), claim(false)]);
    assert!(table.ends_with("| so | set | yes | 1 |\n| so | set | no | 1 |\n"), "{table}");
    assert!(claims(&Counts { experiments: &[] }).is_empty());
}
