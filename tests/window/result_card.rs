//! The result as one card: what it says, what it offers, and that nothing praises a result that
//! isn't trustworthy.

use boresight::{
    text::Act,
    ui::{SMALLEST, UiAction},
};
use egui::{Theme, Vec2, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};

use crate::{Page, Table, fixtures::moments, harness_at, matrix::moment_of};

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
