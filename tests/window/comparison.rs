//! A result held against an older calibration.

use boresight::{
    app::{explain::UserError, session::comparison::Compared},
    calibration::{Drift, OldLens, drift},
    geometry::Corner,
    pipeline::Background,
    session::Snapshot,
    text::{self, charts::Chart},
    ui::{
        UiAction,
        result::{Comparison, Outcome},
    },
};
use egui::{Theme, accesskit::Role};
use egui_kittest::kittest::Queryable;
use nalgebra::{Matrix2, Vector2};

use crate::{
    Page,
    fixtures::{Moment, moments},
    harness,
};

/// The session's views against the session's lens with the principal point elsewhere.
pub(crate) fn drift_from(snapshot: &Snapshot, moved_px: Vector2<f64>) -> Drift {
    let calibration = snapshot.calibration.as_ref().expect("calibrated");
    let noise = Matrix2::identity() * calibration.noise_px.powi(2);
    let corners = |px: &[_]| px.iter().map(|px| Corner::new(*px, noise)).collect();
    let views: Vec<Vec<Corner>> =
        snapshot.views.iter().map(|view| corners(&view.corners_px)).collect();
    let mut camera = calibration.camera;
    camera.pp_px -= moved_px;
    let old = OldLens {
        camera,
        covariance: Some(calibration.covariance_all),
        outlines: &[],
        image_size: calibration.image_size,
    };
    drift(&views, &snapshot.setup.board, calibration.image_size, &old, None).expect("determined")
}

pub(crate) fn compared(snapshot: &Snapshot, moved_px: Vector2<f64>) -> Comparison {
    let drift = drift_from(snapshot, moved_px);
    let (what, action) = text::drift(&drift);
    let against = "sessions/before/calibration.json".into();
    let drift = Some(Box::new(drift));
    let doubts = Vec::new();
    let compared = Compared { against, what, action, doubts, drift };
    Comparison { outcome: Outcome::Done(Ok(compared)), ..Comparison::default() }
}

pub(crate) fn done() -> Moment {
    moments().into_iter().find(|moment| moment.name == "done good").expect("there")
}

#[test]
fn a_comparison_is_asked_for_by_a_path() {
    let mut page = harness(Page::Result, &done(), Theme::Dark, 1.0);
    let button = "Compare";
    let field = "Compare with an older calibration:";
    page.get_by_role_and_label(Role::Button, button).click();
    page.run();
    assert_eq!(page.state().asks, [], "without a path there is nothing to compare with");
    page.get_by_role_and_label(Role::TextInput, field).focus();
    page.run();
    page.get_by_role_and_label(Role::TextInput, field).type_text("old/calibration.json");
    page.run();
    page.get_by_role_and_label(Role::Button, button).click();
    page.run();
    assert_eq!(page.state().asks, [UiAction::Compare("old/calibration.json".into())]);
    page.state_mut().result.comparison.older = vec!["sessions/a/calibration.json".into()];
    page.run();
    page.get_by_role_and_label(Role::ComboBox, field).click();
    page.run();
    page.get_by_label("sessions/a/calibration.json").click();
    page.run();
    assert_eq!(page.state().result.comparison.path, "sessions/a/calibration.json");
    // It may take as long as it likes.
    let work = Background::start(|| Err(UserError { what: String::new(), action: None }));
    page.state_mut().result.comparison.outcome = Outcome::Working(work.expect("a thread"));
    page.step();
    page.get_by_label("Comparing");
}

#[test]
fn a_change_is_told_with_its_uncertainty_and_what_to_do() {
    let done = done();
    let lens = done.snapshot.calibration.as_ref().expect("calibrated");
    let mut page = harness(Page::Result, &done, Theme::Dark, 1.0);
    for (moved_px, verdict, action) in [
        (0.0, "OK: no change detected", "Keep the calibration."),
        (
            5.0,
            "RECALIBRATE: changed by up to",
            "Recalibrate. Look for a loose lens or mount, or a changed focus or zoom.",
        ),
    ] {
        let comparison = compared(&done.snapshot, Vector2::new(moved_px, 0.0));
        let drift = comparison.found().and_then(|found| found.drift.clone()).expect("a change");
        let off_px = (drift.change_px.y - moved_px).abs();
        assert!(off_px < 5.0 * drift.sd_px.y.max(lens.sd()[2]), "{off_px}");
        page.state_mut().result.comparison = comparison;
        page.state_mut().result.chart = Chart::Change;
        page.run();
        page.get_by_label("Compared with sessions/before/calibration.json:");
        page.get_by_label_contains(verdict);
        page.get_by_label(action);
        for (_, value) in text::drift_lines(&drift) {
            page.get_by_label(&value);
        }
        page.get_by_label_contains("Change: enlarged");
    }
    let trouble = UserError { what: "could not read \"nowhere.json\"".into(), action: None };
    page.state_mut().result.comparison.outcome = Outcome::Done(Err(trouble));
    page.run();
    page.get_by_label("could not read \"nowhere.json\"");
    page.get_by_label("Change: Compare with an older calibration to see this.");
}

#[test]
fn the_picture_of_a_change_is_the_change() {
    let done = done();
    let drift = drift_from(&done.snapshot, Vector2::new(4.0, -3.0));
    let pp = drift.camera.pp_px;
    let there = drift.displacement_at(&(pp - drift.change_px.yz()));
    assert!((there - drift.change_px.yz()).norm() < 1e-12, "at the old principal point");
    let largest = boresight::geometry::cell_centres_px(crate::world::SIZE)
        .map(|px| drift.displacement_at(&px).norm())
        .fold(0.0, f64::max);
    assert!((largest - drift.shift.px).abs() < 1e-12);
}
