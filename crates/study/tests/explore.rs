//! The page to play with, read through the accessibility tree.
#![cfg(feature = "window")]

use boresight::ui::{SMALLEST, apply_theme};
use boresight_study::window::{self, Explored};
use egui::{Theme, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable};

fn page() -> Harness<'static, Explored> {
    let mut harness =
        Harness::builder().with_size(SMALLEST).build_ui_state(window::show, Explored::default());
    apply_theme(&harness.ctx);
    harness.ctx.set_theme(Theme::Dark);
    harness.run();
    harness
}

#[test]
fn a_dragged_board_deflects_its_line_and_a_partner_cancels_it() {
    let mut page = page();
    page.get_by_label("0.303°");
    page.get_by_label("With its partner").click();
    page.run();
    page.get_by_label("0 px");
    let picture = page.get_by_role(Role::Image).rect();
    let middle = picture.center();
    page.drag_at(middle + egui::vec2(40.0, 0.0));
    page.step();
    page.hover_at(middle + egui::vec2(120.0, 0.0));
    page.step();
    page.drop_at(middle + egui::vec2(120.0, 0.0));
    page.run();
    let seen = page.state().seen();
    let offset_px = seen.deflection.expect("a line").offset_px.abs();
    assert!(offset_px > 20.0, "dragged across its line: {offset_px}");
    page.get_by_label("0 px");
    page.get_by_label("As in the paper").click();
    page.run();
    page.get_by_label("8.47 px");
}
