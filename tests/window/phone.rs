//! Card with the QR code of the phone's page. `BORESIGHT_MATRIX=FOLDER` keeps pictures of it.

use boresight::{cli::services, serve::QrCode, text::phone as words, ui::App};
use egui::accesskit::Role;
use egui_kittest::kittest::{NodeT, Queryable};

use crate::app::{Window, app, until, window};

fn card(window: &Window) -> Option<(egui::Rect, String)> {
    let node = window
        .query_all_by_role(Role::Image)
        .find(|node| node.accesskit_node().label().is_some_and(|label| label.contains("/#")))?;
    Some((node.rect(), node.accesskit_node().label()?.to_string()))
}

#[test]
fn the_code_is_whole_and_dark_on_light_in_the_smallest_window() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("one").display().to_string();
    let arguments = ["--serve", "127.0.0.1:0", "--source", "sim", "--out", &out];
    let services = services(&arguments, false).expect("arguments");
    let mut window = window(|ctx| App::new(ctx, services));
    until(&mut window, "a picture", |window| app(window).screen().snapshot.is_some());
    window.step();
    let (rect, label) = card(&window).expect("the card is open");
    let link = label.strip_prefix(&format!("{}: ", words::PHONE)).expect("a link");
    let code = QrCode::of(link).expect("short enough");
    assert!(window.query_all_by_label(words::SCAN).count() == 1);
    let picture = window.render().expect("painted");
    if let Some(folder) = std::env::var_os("BORESIGHT_MATRIX") {
        picture.save(std::path::Path::new(&folder).join("phone-card.png")).expect("written");
    }
    let whole = egui::Rect::from_min_size(egui::Pos2::ZERO, boresight::ui::SMALLEST);
    assert!(whole.contains_rect(rect), "{rect:?} leaves the window");
    // Every module has its colour in its middle.
    let side = rect.width() / code.side() as f32;
    for y in 0..code.side() {
        for x in 0..code.side() {
            let at = rect.min + side * egui::vec2(x as f32 + 0.5, y as f32 + 0.5);
            let light = picture.get_pixel(at.x as u32, at.y as u32).0[1];
            assert_eq!(light < 128, code.is_dark(x, y), "module {x}, {y}: {light}");
            // Without a border of four light modules, phones may not find the code.
            let is_border = [x, y].iter().any(|at| *at < 4 || *at >= code.side() - 4);
            assert!(!is_border || light >= 128, "module {x}, {y}");
        }
    }
}
