//! The result as one card: what it says, what it offers, and that nothing praises a result that
//! isn't trustworthy.

use std::sync::Arc;

use boresight::{
    calibration::{Calibration, Finding, FindingCode, FocusMotion, Severity},
    text::Act,
    ui::{SMALLEST, UiAction},
};
use boresight_present::result_card::ResultCard;
use egui::{Theme, Vec2, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};

use crate::{
    Page, Table,
    fixtures::{Moment, moments},
    harness_at,
    matrix::moment_of,
};

fn card(name: &str, size: Vec2) -> Harness<'static, Table> {
    let moment = moment_of(&moments(), name);
    let mut page = harness_at(Page::Result, &moment, (Theme::Dark, 1.0), size);
    page.state_mut().result.engineer = false;
    page.run();
    page
}

fn click(page: &mut Harness<'static, Table>, role: Role, label: &str) {
    page.get_by_role_and_label(role, label).click();
    page.run();
}

#[test]
fn a_good_result_is_a_word_a_number_and_a_certificate() {
    let mut page = card("done good", SMALLEST);
    for words in ["Good", "SIMULATED", "Typical error", "Goal: 0.3 px", "4 photos"] {
        page.get_by_label(words);
    }
    page.get_by_label("Use it where the picture is bright.");
    click(&mut page, Role::Button, "Sample certificate");
    assert_eq!(page.state().asks, [UiAction::Show("sessions/one/report.html".into())]);
    click(&mut page, Role::Link, "Take two more");
    click(&mut page, Role::Button, "Use in…");
    click(&mut page, Role::Button, "ROS");
    assert_eq!(page.state().asks[1..], [UiAction::TakeMore, UiAction::Export(1)]);
    click(&mut page, Role::Link, "Engineer's view");
    page.get_by_label("Principal point by method");
    click(&mut page, Role::Button, "Back to the result");
    page.get_by_label("Typical error");
}

#[test]
fn the_main_action_is_the_remedy_that_the_sentence_names() {
    let mut page = card("done care", SMALLEST);
    click(&mut page, Role::Button, "Start again");
    let snapshot = page.state_mut().screen.snapshot.as_mut().expect("there");
    let calibration = snapshot.calibration.as_deref().expect("there").clone();
    let few = FindingCode::FewViews { distinct: 3, wanted: 4 };
    let findings = vec![Finding { code: few, severity: Severity::Care }];
    snapshot.calibration = Some(Arc::new(Calibration { findings, ..calibration }));
    page.run();
    click(&mut page, Role::Button, "Take two more");
    assert_eq!(page.state().asks, [UiAction::Act(Act::New), UiAction::TakeMore]);
}

#[test]
fn nothing_praises_a_result_that_is_not_trustworthy() {
    let mut page = card("done untrustworthy", SMALLEST);
    page.get_by_label("Not trustworthy");
    let labels = |page: &Harness<'static, Table>| -> Vec<String> {
        let all = page.get_all_by(|_| true);
        all.filter_map(|node| node.accesskit_node().label().or(node.accesskit_node().value()))
            .collect()
    };
    for is_engineers in [false, true] {
        page.state_mut().result.engineer = is_engineers;
        page.run();
        let said = labels(&page).join("\n").to_lowercase();
        for word in ["certificate", "ready to use", "goal is reached", "✓"] {
            assert!(!said.contains(word), "{word}: {said}");
        }
        let painted = page.render().expect("painted");
        let is_green = |pixel: &image::Rgba<u8>| {
            let [r, g, b, _] = pixel.0.map(i16::from);
            g > r + 30 && g > b + 10
        };
        let green = painted.pixels().filter(|pixel| is_green(pixel)).count();
        assert_eq!(green, 0, "pixels, engineer's view: {is_engineers}");
    }
    page.state_mut().result.engineer = false;
    page.run();
    click(&mut page, Role::Button, "Start again");
    assert_eq!(page.state().asks, [UiAction::Act(Act::New)]);
    page.get_by_role_and_label(Role::Button, "Export anyway…");
}

/// Each cause that can make a result untrustworthy: the names of its two lines, and the size of the
/// second in the first, as drawn.
#[test]
fn the_cause_is_drawn_from_its_own_numbers_with_the_enlargement_stated() {
    let moment = moment_of(&moments(), "done untrustworthy");
    let focus = |motion| FindingCode::FocusMoved {
        sigmas: 9.0,
        relative_sd: 0.01,
        motion,
        in_scene: false,
    };
    let mixed = FindingCode::ViewsMixed {
        odd_views: 1,
        view: 2,
        f_ratio: 1.5,
        shift_px: 9.0,
        sigmas: 50.0,
    };
    let jump = FocusMotion::Jump { view: 2, change: 0.02 };
    for (code, names, ratio, caption) in [
        (focus(jump), ["view 2", "view 3"], 1.2, "2.0 % larger, drawn 10 times as much"),
        (
            focus(FocusMotion::Drift { change: -0.005 }),
            ["view 1", "view 4"],
            0.75,
            "0.5 % smaller, drawn 50 times as much",
        ),
        (
            focus(FocusMotion::Breathes { change: 0.2 }),
            ["farthest board", "nearest board"],
            1.2,
            "20.0 % larger",
        ),
        (
            focus(FocusMotion::Scattered),
            ["some views", "others"],
            1.2,
            "1.0 % larger, drawn 20 times as much",
        ),
        (mixed, ["the other views", "view 3"], 1.5, "50.0 % larger"),
    ] {
        let mut snapshot = moment.snapshot.clone();
        let calibration = snapshot.calibration.as_deref().expect("there").clone();
        let findings = vec![Finding { code, severity: Severity::Bad }];
        snapshot.calibration = Some(Arc::new(Calibration { findings, ..calibration }));
        let cause = ResultCard::of(&snapshot).and_then(|card| card.cause).expect("a picture");
        assert_eq!(cause.parts.each_ref().map(|(name, _)| name.as_str()), names);
        assert_eq!(cause.caption, caption);
        let [first, second] = cause.parts.each_ref().map(|(_, px)| px[1].x - px[0].x);
        assert!((second / first - ratio).abs() < 1e-9, "{caption}: {}", second / first);
        let size = snapshot.setup.image_size;
        let (width, height) = (f64::from(size.width_px), f64::from(size.height_px));
        let mut all = cause.parts.iter().flat_map(|(_, corners_px)| corners_px);
        assert!(all.all(|px| px.x > 0.0 && px.y > 0.0 && px.x < width && px.y < height));
        assert!(cause.svg(size, None).contains(&format!(">{}</text>", names[1])));
        let moment = Moment { snapshot, ..moment_of(&moments(), "done untrustworthy") };
        let mut page = harness_at(Page::Result, &moment, (Theme::Dark, 1.0), SMALLEST);
        page.state_mut().result.engineer = false;
        page.run();
        page.get_by_role_and_label(Role::Image, caption);
    }
    let care = moment_of(&moments(), "done care");
    assert_eq!(ResultCard::of(&care.snapshot).and_then(|card| card.cause), None);
}

#[test]
fn the_card_fits_into_every_window() {
    for (width, height) in [(1024.0, 600.0), (1366.0, 768.0), (1280.0, 960.0), (1920.0, 1080.0)] {
        for name in ["done good", "done care", "done untrustworthy"] {
            let size = Vec2::new(width, height);
            let page = card(name, size);
            assert_eq!(crate::fits::outside(&page, size), Vec::<String>::new(), "{name} {size}");
        }
    }
}
