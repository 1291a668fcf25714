//! The studies: known numbers come out, equal seeds give equal results.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use boresight_lab::{
    Hand, Outcome, Params, directionality, guidance, monotonicity, outcome::Table, pairs, skip,
    table1, varying_focal,
};

fn few() -> Params {
    Params {
        skip_trials: 40,
        tilt_trials: 8,
        focal_trials: 200,
        guidance_runs: 4,
        guidance_views: 4,
        ..Params::default()
    }
}

fn reproduced(outcome: &Outcome) {
    assert!(!outcome.checks.is_empty());
    for check in &outcome.checks {
        assert!(check.passes(), "{}: {} for {}", check.what, check.measured, check.reference);
    }
    assert!(outcome.figures.iter().all(|figure| figure.svg.ends_with("</svg>\n")));
    assert!(outcome.tables.iter().all(|table| {
        !table.rows.is_empty() && table.rows.iter().all(|row| row.len() == table.columns.len())
    }));
}

#[test]
fn what_is_known_in_closed_form_comes_out() {
    for experiment in [directionality::outcome, monotonicity::outcome, pairs::outcome] {
        reproduced(&experiment(&few()));
    }
}

#[test]
fn the_paper_s_statistic_and_tables_come_out() {
    for experiment in [table1::outcome, skip::outcome, varying_focal::outcome] {
        reproduced(&experiment(&few()));
    }
}

#[test]
fn corners_found_in_rendered_pictures_say_the_same() {
    let params = Params { rendered: true, directions: 4, ..few() };
    let table = directionality::outcome(&params).tables.remove(0);
    let offset_px: Vec<f64> =
        table.rows.iter().map(|row| row[2].parse::<f64>().map_or(f64::NAN, f64::abs)).collect();
    let known = [8.47, 0.0, 8.47, 0.0];
    assert_eq!(offset_px.len(), known.len());
    for (seen, known) in offset_px.iter().zip(known) {
        assert!((seen - known).abs() < 0.6, "{seen} for {known}");
    }
}

fn part(params: &Params, name: &str) -> guidance::Part {
    let found = guidance::parts(params).into_iter().find(|part| part.name() == name);
    found.expect("a part of that name")
}

#[test]
fn equal_seeds_give_equal_runs_and_other_seeds_others() {
    let runs = |seed: u64| {
        let params = Params { seed, ..few() };
        ["guidance-ours-adaptive-right-screen", "guidance-information-k3-metric"]
            .map(|name| guidance::runs(&params, part(&params, name), &|| ()))
    };
    let [ours, information] = runs(1);
    assert_eq!(runs(1), [ours.clone(), information.clone()]);
    assert_ne!(runs(2), [ours.clone(), information.clone()]);
    for runs in [ours, information].into_iter().flatten() {
        assert_eq!(runs.runs.len(), 4);
        for marks in &runs.runs {
            assert!(!marks.is_empty(), "{}: a run without a view", runs.strategy);
            // Time goes on, and views make the principal point surer.
            assert!(marks.windows(2).all(|pair| pair[1].secs > pair[0].secs));
            let (first, last) = (marks[0].fitted, marks[marks.len() - 1].fitted);
            assert!(marks.len() == 1 || last.pp_sd_px < first.pp_sd_px, "{}", runs.strategy);
        }
    }
}

#[test]
fn every_strategy_leads_to_a_lens_and_is_compared() {
    let hands = vec![Hand::Screen, Hand::Metric, Hand::Clumsy];
    let params = Params { guidance_hands: hands, ..few() };
    let mut parts = Vec::new();
    for part in guidance::parts(&params) {
        let runs = guidance::runs(&params, part, &|| ()).expect("a part");
        let arrived = runs.runs.iter().filter(|run| run.len() >= 3).count();
        assert!(arrived >= 2, "{}: {arrived} of 4", part.name());
        let calibrated = runs.runs.iter().flatten().filter(|mark| mark.calibrated.is_some());
        assert!(calibrated.count() >= 2, "{}: no lens by BIC", part.name());
        parts.push(runs);
    }
    let outcome = guidance::outcome(&params, &parts);
    let table = |name: &str| outcome.tables.iter().find(|table| table.name == name).expect(name);
    for name in ["guidance", "guidance_lenses"] {
        assert_eq!(table(name).rows.len(), 3 * guidance::STRATEGIES.len(), "{name}");
    }
    assert!(outcome.tables.iter().all(|table| {
        !table.rows.is_empty() && table.rows.iter().all(|row| row.len() == table.columns.len())
    }));
    for hand in ["screen", "metric", "clumsy"] {
        let said = outcome.claims.iter().filter(|claim| claim.claim.contains(hand)).count();
        assert!(said >= 10, "{said} claims of the {hand} hand");
    }
}

#[test]
fn no_strategy_beats_the_limit() {
    let params = Params { guidance_runs: 8, ..few() };
    let parts: Vec<_> = guidance::parts(&params)
        .into_iter()
        .filter(|part| part.name().ends_with("-right-screen"))
        .map(|part| guidance::runs(&params, part, &|| ()).expect("a part"))
        .collect();
    let outcome = guidance::outcome(&params, &parts);
    let limits = outcome.tables.iter().find(|t| t.name == "guidance_limit").expect("the limit");
    let sd_px = |row: &[String], column: usize| row[column].parse::<f64>().expect("a number");
    // An exhaustive search elsewhere finds 0.55 px for two views and 0.30 px for eight, of corners
    // 12 px inside.
    let pp_sd_px: Vec<f64> = limits.rows.iter().map(|row| sd_px(row, 1)).collect();
    assert_eq!(pp_sd_px.len(), 6);
    assert!(pp_sd_px.windows(2).all(|pair| pair[1] < pair[0]), "{pp_sd_px:?}");
    assert!((0.5..0.66).contains(&pp_sd_px[1]), "{pp_sd_px:?}");
    assert!((0.27..0.36).contains(&pp_sd_px[5]), "{pp_sd_px:?}");
    let four = pp_sd_px[3];
    for runs in &parts {
        for mark in runs.runs.iter().filter_map(|run| run.get(3)) {
            let stated = mark.fitted.pp_sd_px;
            // The design weighs projection, too, so that a run may have a slightly surer principal
            // point.
            assert!(stated > 0.85 * four, "{}: {stated} below {four}", runs.strategy);
        }
    }
}

#[test]
fn tables_are_quoted_where_they_must_be() {
    let mut table = Table::new("t", &["a", "b"]);
    table.push(&[&"x, y", &"say \"no\""]);
    table.push(&[&1.5, &2]);
    assert_eq!(table.csv(), "a,b\n\"x, y\",\"say \"\"no\"\"\"\n1.5,2\n");
}
