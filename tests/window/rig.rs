//! The page of several cameras: pictures as nodes, links between them, one sentence.

use boresight::{
    app::{
        Exit,
        session::{rig_result::RigEnded, rig_run::RigLink},
    },
    session::Snapshot,
    text::Act,
    ui::{
        UiAction, apply_theme,
        rig::{RigScreen, show},
    },
};
use boresight_guide::rig::RigPrompt;
use boresight_present::grade::Grade;
use egui::{Rect, Vec2, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT, Queryable},
};
use image::GrayImage;

use crate::{fixtures::moments, matrix::moment_of};

struct Page {
    screen: RigScreen,
    asks: Vec<UiAction>,
}

const NAMES: [&str; 8] = ["door", "window", "shelf", "ceiling", "east", "west", "north", "south"];

fn snapshot() -> Snapshot {
    moment_of(&moments(), "match").snapshot
}

fn screen(snapshot: &Snapshot, cameras: usize) -> RigScreen {
    let mut screen = RigScreen::new(NAMES[..cameras].iter().map(|name| (*name).into()).collect());
    for camera in &mut screen.cameras {
        camera.snapshot = Some(snapshot.clone());
        camera.picture.show_image(&GrayImage::from_pixel(320, 180, image::Luma([120])));
    }
    screen.prompt = Some(RigPrompt::Unseen { camera: 1 });
    screen.sentence = "Now where window sees the whole board, too".into();
    let link = |of, words: &str, is_met| RigLink { of, words: words.into(), is_met };
    screen.links =
        [link([0, 1], "4.1 mm, goal 2 mm", false), link([0, cameras - 1], "1.6 mm", true)].into();
    screen.places = 3;
    screen
}

fn page(screen: RigScreen, size: Vec2) -> Harness<'static, Page> {
    Harness::builder().with_size(size).build_ui_state(
        |ui, page: &mut Page| {
            apply_theme(ui.ctx());
            show(ui, &page.screen, &mut page.asks);
        },
        Page { screen, asks: Vec::new() },
    )
}

#[test]
fn each_camera_has_a_picture_each_link_its_error_and_the_person_one_sentence() {
    let mut page = page(screen(&snapshot(), 3), Vec2::new(1280.0, 800.0));
    for name in &NAMES[..3] {
        page.get_by_role_and_label(Role::Image, name);
    }
    page.get_by_label("door to window: 4.1 mm, goal 2 mm");
    page.get_by_label("door to shelf: 1.6 mm");
    page.get_by_label("3 places");
    page.get_by_role_and_label(Role::Status, "Now where window sees the whole board, too");
    for (name, act) in [("Undo", Act::Undo), ("Finish", Act::Finish)] {
        page.get_by_role_and_label(Role::Button, name).click();
        page.run();
        assert_eq!(page.state_mut().asks.pop(), Some(UiAction::Act(act)));
    }
    page.state_mut().screen.ended = Some(RigEnded {
        exit: Exit::Good,
        grade: Some(Grade::Good),
        lines: ["Good: every pair meets the goal", "  door to window: 119.99 mm"]
            .map(Into::into)
            .into(),
        file: None,
        json: String::new(),
    });
    page.run();
    page.get_by_label("Good: every pair meets the goal");
    page.get_by_label("door to window: 119.99 mm");
    assert!(page.query_by_role_and_label(Role::Button, "Undo").is_none());
    page.get_by_role_and_label(Role::Button, "Close").click();
    page.run();
    assert_eq!(page.state().asks, [UiAction::Act(Act::Finish)]);
}

#[test]
fn pictures_of_two_to_eight_cameras_cover_neither_each_other_nor_the_sentence() {
    let snapshot = snapshot();
    for size in [[640.0, 400.0], [1024.0, 600.0], [1920.0, 1080.0], [700.0, 1000.0]] {
        for cameras in 2..=8 {
            let page = page(screen(&snapshot, cameras), size.into());
            let rect = |role, label: &str| -> Rect {
                let node = page.get_by_role_and_label(role, label);
                let bounds = node.accesskit_node().bounding_box().expect("a place");
                let [x0, y0, x1, y1] =
                    [bounds.x0, bounds.y0, bounds.x1, bounds.y1].map(|at| at as f32);
                Rect::from_min_max([x0, y0].into(), [x1, y1].into())
            };
            let mut rects: Vec<Rect> =
                NAMES[..cameras].iter().map(|name| rect(Role::Image, name)).collect();
            let shown: f32 = rects.iter().map(Rect::area).sum();
            let least = if size[0] < size[1] { 0.12 } else { 0.2 };
            assert!(shown > least * size[0] * size[1], "{cameras} in {size:?}: {shown}");
            rects.push(rect(Role::Status, "Now where window sees the whole board, too"));
            for (index, one) in rects.iter().enumerate() {
                for other in &rects[..index] {
                    assert!(
                        !one.shrink(1.0).intersects(*other),
                        "{cameras} in {size:?}: {rects:?}"
                    );
                }
            }
        }
    }
}
