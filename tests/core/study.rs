//! The studies: known numbers come out, equal seeds give equal results.

use boresight::study::{
    Outcome, Params, directionality, guidance, monotonicity, outcome::Table, pairs, skip, table1,
    varying_focal,
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

#[test]
fn equal_seeds_give_equal_runs_and_other_seeds_others() {
    let runs = |seed: u64| {
        let params = Params { seed, ..few() };
        [(2, 0), (9, 1)].map(|part| guidance::runs(&params, part, &|| ()))
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
            let (first, last) = (marks[0], marks[marks.len() - 1]);
            assert!(marks.len() == 1 || last.pp_sd_px < first.pp_sd_px, "{}", runs.strategy);
        }
    }
}

#[test]
fn every_strategy_leads_to_a_lens() {
    let params = few();
    for part in guidance::parts() {
        let runs = guidance::runs(&params, part, &|| ());
        let arrived = runs.iter().flat_map(|runs| &runs.runs).filter(|run| run.len() >= 3).count();
        assert!(arrived >= 2, "strategy {} on course {}: {arrived} of 4", part.0, part.1);
    }
}

#[test]
fn tables_are_quoted_where_they_must_be() {
    let mut table = Table::new("t", &["a", "b"]);
    table.push(&[&"x, y", &"say \"no\""]);
    table.push(&[&1.5, &2]);
    assert_eq!(table.csv(), "a,b\n\"x, y\",\"say \"\"no\"\"\"\n1.5,2\n");
}
