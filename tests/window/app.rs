//! The whole window with the program around.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use boresight::{
    calibration::files::import,
    cli::services,
    ui::{App, Page, SMALLEST},
};
use egui::{Key, Order, Pos2, Rect, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};

use crate::painter;

pub(crate) type Window = Harness<'static, Option<App>>;

/// A window of the smallest size.
pub(crate) fn window(app: impl FnOnce(&egui::Context) -> App) -> Window {
    window_of(SMALLEST, app)
}

fn window_of(size: egui::Vec2, app: impl FnOnce(&egui::Context) -> App) -> Window {
    let mut window = Harness::builder().with_size(size).renderer(painter()).build_ui_state(
        |ui, app: &mut Option<App>| {
            let Some(app) = app else { return };
            app.look(&ui.ctx().clone());
            app.paint(ui);
        },
        None,
    );
    let app = app(&window.ctx);
    *window.state_mut() = Some(app);
    window.step();
    window
}

/// Runs the window up to the expected state.
pub(crate) fn until(window: &mut Window, what: &str, mut seen: impl FnMut(&Window) -> bool) {
    // Far more than needed; a longer wait would be endless.
    for _ in 0..40_000 {
        if seen(window) {
            return;
        }
        std::thread::sleep(Duration::from_millis(5));
        window.step();
    }
    unreachable!("never seen: {what}");
}

pub(crate) fn app(window: &Window) -> &App {
    window.state().as_ref().expect("open")
}

pub(crate) fn click(window: &mut Window, role: Role, label: &str) {
    window.get_by_role_and_label(role, label).click();
    settle(window);
}

/// Paints until manual changes are visible.
pub(crate) fn settle(window: &mut Window) {
    for _ in 0..8 {
        window.step();
    }
}

/// A small camera, quick to render.
const SCENE: &str = r#"
name = "small"
seed = 3
image_size_px = [640, 480]
f_px = 520
pp_px = [322, 238]
distortion = [-0.1, 0.02, 0, 0, 0]
[technician]
person = "tripod"
"#;

/// A path dragged onto the window.
#[derive(Debug)]
struct Dragged(PathBuf);

impl egui::DroppedFile for Dragged {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        fs::read(&self.0).map_err(|err| err.to_string())
    }
}

pub(crate) fn drop_onto(window: &mut Window, path: &Path) {
    window.input_mut().dropped_files.push(Arc::new(Dragged(path.into())));
    window.step();
}

fn says(window: &Window, role: Role, start: &str) -> bool {
    window.get_all_by_role(role).any(|node| {
        let node = node.accesskit_node();
        node.label().or(node.value()).is_some_and(|label| label.starts_with(start))
    })
}

pub(crate) fn text(path: &Path) -> String {
    fs::read_to_string(path).expect("readable")
}

/// A laptop of 1920×1080 doubled pixels, less bars; and a screen of 3840×2160 undoubled pixels.
#[test]
fn everything_is_smaller_in_a_small_window_and_larger_in_a_very_large_one() {
    for (size, zoom) in [
        (egui::vec2(960.0, 500.0), 500.0 / SMALLEST.y),
        (egui::vec2(1920.0, 1080.0), 1.0),
        (egui::vec2(3840.0, 2160.0), 2160.0 / 1200.0),
    ] {
        let services = services(&[], false).expect("arguments");
        let mut window = window_of(size, |ctx| App::new(ctx, services));
        // As many points as in the same window.
        let points = size / zoom;
        window.set_size(points);
        for _ in 0..3 {
            window.step();
            assert!((window.ctx.zoom_factor() - zoom).abs() < 1e-3, "{}", window.ctx.zoom_factor());
        }
        assert_eq!(crate::fits::outside(&window, points), Vec::<String>::new());
        let name = window.root().accesskit_node().label();
        assert_eq!(name.as_deref(), Some("boresight"), "for a screen reader");
        // The page for looks and sounds doesn't change it either.
        window.key_press(Key::F4);
        for _ in 0..4 {
            window.step();
        }
        let slider = window.get_all_by_role(Role::Slider).next().expect("Interface size");
        assert_eq!(slider.accesskit_node().numeric_value(), Some(1.0));
        assert!((window.ctx.zoom_factor() - zoom).abs() < 1e-3, "{}", window.ctx.zoom_factor());
        // The list of keys is whole, or scrolls.
        window.key_press(Key::F12);
        for _ in 0..4 {
            window.step();
        }
        let keys = window.ctx.memory(|memory| {
            let mut layers = memory.areas().visible_layer_ids().into_iter();
            let list = layers.find(|layer| layer.order == Order::Middle);
            list.and_then(|layer| memory.area_rect(layer.id)).expect("shown")
        });
        let all = Rect::from_min_size(Pos2::ZERO, points).expand(1.0);
        assert!(all.contains_rect(keys), "{keys:?} in {points:?}");
    }
}

#[test]
fn a_session_goes_from_the_first_page_to_its_report_without_a_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, SCENE).expect("written");
    let session = folder.path().join("one");
    let name = session.display().to_string();
    let source = format!("sim:{}", scene.display());
    let services = services(&["--source", &source, "--out", &name], false).expect("arguments");
    let mut window = window(|ctx| App::new(ctx, services));
    assert_eq!(app(&window).page(), Page::Guide);
    let mut sentences = Vec::new();
    let mut checked = 0;
    let mut nodes = Vec::new();
    until(&mut window, "the result", |window| {
        if app(window).page() == Page::Guide {
            let status = window.get_all_by_role(Role::Status).next().expect("the sentence");
            let sentence = status.accesskit_node().label().unwrap_or_default();
            nodes.push((app(window).screen().distance, status.accesskit_node().id()));
            // The row of views scrolls.
            if sentences.len() == 3 && checked == 0 {
                assert_eq!(crate::fits::outside(window, SMALLEST), Vec::<String>::new());
                checked += 1;
            }
            if sentences.last() != Some(&sentence) {
                sentences.push(sentence);
                if sentences.len() == 4 {
                    window.key_press(Key::B);
                }
            }
        }
        app(window).ended().is_some()
    });
    assert_eq!(checked, 1);
    // The picture alone has the same sentence, not read twice by a screen reader.
    nodes.sort();
    nodes.dedup();
    assert!(matches!(nodes[..], [(false, near), (true, far)] if near == far), "{nodes:?}");
    for word in [" back", "Hold still", "Got it!"] {
        assert!(sentences.iter().any(|words| words.contains(word)), "{word}: {sentences:?}");
    }
    window.step();
    assert_eq!(app(&window).page(), Page::Result);
    window.get_by_label("Good");
    click(&mut window, Role::Link, "Engineer's view");
    window.get_by_label("Good (SIMULATED): ready to use");
    assert!(text(&session.join("report.html")).ends_with("</html>\n"));
    let result = import::read(&text(&session.join("calibration.json"))).expect("a calibration");
    let off_px = (result.camera.pp_px - nalgebra::Point2::new(322.0, 238.0)).norm();
    assert!(off_px < 3.0, "{off_px}");
    window.get_by_role_and_label(Role::Button, "report.html");

    for (format, file) in [
        ("OpenCV", "opencv.yaml"),
        ("ROS", "ros.yaml"),
        ("Kalibr", "kalibr.yaml"),
        ("mrcal", "camera.cameramodel"),
        ("JSON", "camera.json"),
    ] {
        click(&mut window, Role::Button, format);
        let path = session.join(file);
        window.get_by_label(&format!("Written: {}", path.display()));
        let read = import::read(&text(&path)).expect("a calibration");
        assert_eq!(read.camera, result.camera, "{format}");
    }
    for (format, file) in [
        ("COLMAP", "cameras.txt"),
        ("MATLAB", "camera.m"),
        ("Photos (CSV)", "views.csv"),
        ("Corners (VNL)", "corners.vnl"),
    ] {
        click(&mut window, Role::Button, format);
        assert!(text(&session.join(file)).lines().count() > 1, "{format}");
    }

    // A file without its uncertainty is no evidence of a change, nor of none.
    let field = "Compare with an older calibration:";
    window.get_by_role_and_label(Role::TextInput, field).focus();
    window.step();
    let older = session.join("opencv.yaml").display().to_string();
    window.get_by_role_and_label(Role::TextInput, field).type_text(&older);
    window.step();
    click(&mut window, Role::Button, "Compare");
    until(&mut window, "the refusal", |window| {
        says(window, Role::Label, "NO VERDICT: the file states no uncertainty")
    });
    let older = session.join("camera.json");
    drop_onto(&mut window, &older);
    until(&mut window, "the comparison", |window| says(window, Role::Image, "Change: enlarged"));
    assert!(text(&session.join("check.json")).contains("\"verdict\": \"ok\""));
    assert!(text(&session.join("report.html")).contains("id=\"drift\""));

    // Recordings can be seen again.
    click(&mut window, Role::Button, "Sessions");
    click(&mut window, Role::Button, "Replay");
    until(&mut window, "the recording", |window| says(window, Role::Label, "Decision 1 of "));
    // A panel is as large as its contents from its second painting on.
    settle(&mut window);
    click(&mut window, Role::Button, "Next view");
    assert!(says(&window, Role::Label, "Taken: view 1"));
    // Its keys are not those of a session.
    window.key_press(egui::Key::G);
    window.step();
    assert!(app(&window).ended().is_some());
    click(&mut window, Role::Button, "Open another");
    window.get_by_label("Open a session");

    // Its result is there again, from the list or dragged onto the window, and is compared with the
    // next dragged file.
    click(&mut window, Role::Button, "Show result");
    until(&mut window, "the result", |window| app(window).page() == Page::Result);
    window.get_by_label("Good");
    click(&mut window, Role::Button, "Sessions");
    drop_onto(&mut window, &session);
    until(&mut window, "the result", |window| app(window).page() == Page::Result);
    fs::remove_file(session.join("check.json")).expect("is there");
    drop_onto(&mut window, &older);
    assert_eq!(app(&window).page(), Page::Result);
    until(&mut window, "the comparison", |window| {
        window.query_by_label("Good (SIMULATED): ready to use").is_some()
    });
    assert!(session.join("check.json").exists());
}
