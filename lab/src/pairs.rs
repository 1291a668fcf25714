//! Cancellation of a principal line's deflection by the opposed pose, and the number of pairs
//! needed. (The paper's Figs 4 and 5.)

use nalgebra::{Point2, Vector2};

use super::{
    estimate::{View, by_principal_lines, view},
    outcome::{Check, Claim, Figure, Outcome, Table, Verdict, Within},
    params::Params,
    setup::{SLOTS, Setup, slot_rad},
};
use boresight_present::chart::{Plot, Series};

/// Lines of a slot and of the opposed slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Direction of the first board.
    pub slot_rad: f64,
    /// Length of the shift across the line.
    pub shift_m: f64,
    /// Signed distance of the first line from the true principal point.
    pub first_px: f64,
    /// Signed distance of the opposed line, along the *same* normal.
    pub opposed_px: f64,
    /// Angle between the two lines, `[0, π/2]`: not cancelled.
    pub angle_rad: f64,
}

/// Principal point from some of the eight slots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Set {
    /// Number of poses: two pairs or four.
    pub poses: usize,
    /// Centre of rotation, off the optical axis.
    pub centre_m: Vector2<f64>,
    /// Shift across the line.
    pub shift_m: f64,
    /// Intersection of the lines, minus the true principal point.
    pub error_px: Vector2<f64>,
}

/// Four opposed pairs of a board rotating about the optical axis, shifted across the line.
pub fn pairs(setup: &Setup, shift_m: f64) -> Vec<Pair> {
    let views = views(setup, shift_m, &Vector2::zeros());
    let half = SLOTS / 2;
    (0..half)
        .filter_map(|slot| {
            let first = views.get(slot)?.line.as_ref()?;
            let opposed = views.get(slot + half)?.line.as_ref()?;
            let sign = first.normal().dot(&opposed.normal()).signum();
            Some(Pair {
                slot_rad: slot_rad(slot),
                shift_m,
                first_px: first.c_px,
                opposed_px: sign * opposed.c_px,
                angle_rad: first.angle_to(opposed),
            })
        })
        .collect()
}

/// Principal point from two pairs at right angles and from all four.
pub fn sets(setup: &Setup, shift_m: f64, centre_m: &Vector2<f64>) -> Vec<Set> {
    let views = views(setup, shift_m, centre_m);
    [2, 1]
        .into_iter()
        .filter_map(|every| {
            let chosen: Vec<&View> = views.iter().step_by(every).collect();
            let found: Point2<f64> = by_principal_lines(&chosen)?;
            let error_px = found - setup.camera.pp_px;
            Some(Set { poses: chosen.len(), centre_m: *centre_m, shift_m, error_px })
        })
        .collect()
}

fn views(setup: &Setup, shift_m: f64, centre_m: &Vector2<f64>) -> Vec<View> {
    setup
        .slot_poses(&Vector2::new(shift_m, 0.0), centre_m)
        .iter()
        .filter_map(|pose| {
            let corners = setup.corners_px(pose)?;
            view(&setup.board, &corners, setup.camera.pp_px, 1e-6)
        })
        .collect()
}

/// Runs the experiment with `params`.
pub fn outcome(params: &Params) -> Outcome {
    let setup = Setup::of(params);
    let pairs = pairs(&setup, params.shift_m);
    let mut lines = Table::new(
        "pairs",
        &["slot_deg", "shift_m", "first_px", "opposed_px", "sum_px", "angle_deg"],
    );
    for pair in &pairs {
        lines.push(&[
            &pair.slot_rad.to_degrees(),
            &pair.shift_m,
            &pair.first_px,
            &pair.opposed_px,
            &(pair.first_px + pair.opposed_px),
            &pair.angle_rad.to_degrees(),
        ]);
    }
    let centred = sets(&setup, params.shift_m, &Vector2::zeros());
    let beside = sets(&setup, params.shift_m, &Vector2::new(params.shift_m, 0.0));
    let mut points =
        Table::new("pairs_points", &["poses", "centre_x_m", "shift_m", "error_x_px", "error_y_px"]);
    for set in centred.iter().chain(&beside) {
        points.push(&[&set.poses, &set.centre_m.x, &set.shift_m, &set.error_px.x, &set.error_px.y]);
    }
    let sum = pairs.iter().map(|p| (p.first_px + p.opposed_px).abs()).fold(0.0, f64::max);
    let single = pairs.iter().map(|p| p.first_px.abs()).fold(0.0, f64::max);
    let error = |sets: &[Set], i: usize| sets.get(i).map_or(f64::NAN, |set| set.error_px.norm());
    let apart = match beside.as_slice() {
        [two, four] => (two.error_px - four.error_px).norm(),
        _ => f64::NAN,
    };
    let views = views(&setup, params.shift_m, &Vector2::zeros());
    let pp = setup.camera.pp_px;
    let fan = |every: usize| -> Vec<Series> {
        views
            .iter()
            .enumerate()
            .step_by(every)
            .filter_map(|(slot, view)| {
                let line = view.line.as_ref()?;
                let foot = line.normal() * line.c_px;
                let end = |reach: f64| {
                    let at = pp + foot + line.direction() * reach;
                    (at.x, at.y)
                };
                let label = format!("{:.0}°", slot_rad(slot).to_degrees());
                Some(Series::line(label, vec![end(-60.0), end(60.0)]))
            })
            .collect()
    };
    let drawing = |title: &str, every: usize| {
        Plot { picture: true, ..Plot::new(title, "x (px)", "y (px)", fan(every)) }.svg()
    };
    let exact = !params.rendered;
    Outcome {
        name: "pairs".into(),
        title: "Opposed pairs (Figs 4 and 5)".into(),
        method: format!(
            "The board, shifted by {:.0} mm across its line, turns about the optical axis in steps of 45°.",
            1e3 * params.shift_m
        ),
        claims: vec![
            Claim {
                claim: "The opposed pose cancels the deflection.".into(),
                measured: format!(
                    "Each line is {single:.2} px off, the mean of a pair {:.1e} px: the position is cancelled. The two lines stay parallel: their common error of direction is not.",
                    sum / 2.0
                ),
                verdict: Verdict::of(sum < 0.01 * single),
            },
            Claim {
                claim: "Two independent pairs are as good as four.".into(),
                measured: format!(
                    "About the optical axis both meet in the PP ({:.1e} and {:.1e} px off). About an axis {:.0} mm beside it they meet in that axis: {:.2} and {:.2} px off. The bias is the same; the noise of two pairs is √2 larger.",
                    error(&centred, 0), error(&centred, 1), 1e3 * params.shift_m, error(&beside, 0), error(&beside, 1)
                ),
                verdict: Verdict::Partly,
            },
        ],
        checks: if exact {
            vec![
                Check { what: "largest sum of a pair's offsets (px)".into(), reference: 5e-12, measured: sum, within: Within::AtMost },
                Check { what: "two pairs, centred: error (px)".into(), reference: 1e-11, measured: error(&centred, 0), within: Within::AtMost },
                Check { what: "four pairs, centred: error (px)".into(), reference: 1e-11, measured: error(&centred, 1), within: Within::AtMost },
                Check { what: "difference of two and four pairs beside the axis, share of their bias".into(), reference: 1e-3, measured: apart / error(&beside, 1), within: Within::AtMost },
            ]
        } else {
            Vec::new()
        },
        tables: vec![lines, points],
        figures: vec![
            Figure { name: "pairs_eight".into(), caption: "The lines of all eight slots: opposed ones lie on both sides of the principal point.".into(), svg: drawing("Eight slots", 1) },
            Figure { name: "pairs_two".into(), caption: "Two pairs at right angles have the same centre.".into(), svg: drawing("Two pairs", 2) },
        ],
    }
}
