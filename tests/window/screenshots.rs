//! Makes the pictures in `fixtures/screenshots` from a session recorded with all pictures:
//! `BORESIGHT_SCREENSHOTS=SESSION cargo test --test window screenshots`.
//! `tests/window/moving_picture.sh` makes the moving one.

use std::{path::Path, sync::Arc};

use boresight::{
    app::window::recordings::{self, DecidedRecording},
    frame::{CaptureTime, Frame, FrameId, FrameKind},
    guidance::Advice,
    session::{Outcome, Prompt, Snapshot},
    ui::replay::Replayed,
};
use egui::{Theme, Vec2, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable};
use image::{
    RgbaImage,
    imageops::{self, FilterType},
};

use crate::{Page, Table, adjust::pushed_street, fixtures::Moment, harness_at};

type Picked = (&'static str, Page, fn(&Snapshot) -> bool);

const PICTURES: [Picked; 7] = [
    ("start", Page::Start, sees_a_board),
    ("settings", Page::Settings, |_| true),
    ("replay", Page::Replay, |step| matches!(step.decision.outcome, Outcome::Accepted { .. })),
    ("guide_tilting", Page::Guide, |step| is_about_the_pose(step) && sees_a_board(step)),
    (
        "guide_holding",
        Page::Guide,
        |step| matches!(step.decision.advice, Advice::Holding { progress } if progress > 0.5),
    ),
    ("guide_taken", Page::Guide, |step| matches!(step.decision.outcome, Outcome::Accepted { .. })),
    ("result", Page::Result, |step| step.shown.prompt == Prompt::Complete),
];

fn is_about_the_pose(step: &Snapshot) -> bool {
    use Prompt::{Shift, Tip, TipFurther, TipInstead};
    matches!(step.shown.prompt, Tip(_) | TipInstead(_) | TipFurther(_) | Shift(..))
}

fn sees_a_board(step: &Snapshot) -> bool {
    step.live.as_ref().is_some_and(|live| live.corners_px.is_ok())
}

#[test]
fn the_pictures_of_the_documents_are_painted() {
    let Some(folder) = std::env::var_os("BORESIGHT_SCREENSHOTS") else { return };
    let recording = recordings::open(Path::new(&folder)).expect("a session");
    let into = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/screenshots");
    for (name, page, is_it) in PICTURES {
        let step = recording.steps.iter().find(|step| is_it(step)).expect("a moment like this");
        let mut painted = shown(&recording, page, name, step);
        if page == Page::Replay {
            let again = recordings::open(Path::new(&folder)).expect("a session");
            painted.state_mut().replayed = Replayed::new(again);
            painted.run();
            painted.get_by_role_and_label(Role::Button, "Next view").click();
        }
        painted.run();
        save(&painted.render().expect("painted"), &into, name);
    }
    save(&pushed_street().render().expect("painted"), &into, "watch_adjust");
}

fn save(picture: &RgbaImage, into: &Path, name: &str) {
    let small = imageops::resize(picture, 800, 500, FilterType::Lanczos3);
    small.save(into.join(format!("{name}.png"))).expect("written");
}

/// Pictures a second of the moving picture.
const MOVING_HZ: f64 = 5.0;
/// Length of the moving picture: the first views of a session.
const MOVING_SECS: f64 = 18.0;

/// The moving guide page, a file for each picture: `tests/window/moving_picture.sh` combines them.
#[test]
fn the_moving_picture_is_painted() {
    let (Some(folder), Some(into)) =
        (std::env::var_os("BORESIGHT_SCREENSHOTS"), std::env::var_os("BORESIGHT_MOVING"))
    else {
        return;
    };
    let recording = recordings::open(Path::new(&folder)).expect("a session");
    let (mut due_secs, mut count) = (0.0, 0);
    let mut first = None;
    for step in recording.steps.iter() {
        let Some(live) = step.live.as_ref() else { continue };
        let secs = live.captured_at.secs_since(*first.get_or_insert(live.captured_at));
        if secs < due_secs || secs > MOVING_SECS {
            continue;
        }
        due_secs += 1.0 / MOVING_HZ;
        let mut painted = shown(&recording, Page::Guide, "moving", step);
        painted.run();
        let picture = painted.render().expect("painted");
        let small = imageops::resize(&picture, 800, 500, FilterType::Triangle);
        small.save(Path::new(&into).join(format!("{count:03}.png"))).expect("written");
        count += 1;
    }
    assert!(count > 50, "{count} pictures");
}

/// `page` at `step`, with picture and those of the views.
fn shown(
    recording: &DecidedRecording,
    page: Page,
    name: &str,
    step: &Snapshot,
) -> Harness<'static, Table> {
    let moment =
        Moment { name: name.into(), snapshot: step.clone(), sentence: String::new(), taken: false };
    let mut painted = harness_at(page, &moment, (Theme::Dark, 1.0), Vec2::new(1280.0, 800.0));
    let table = painted.state_mut();
    (table.result.engineer, table.screen.preferences.panels) = (false, page == Page::Replay);
    table.screen.now_secs =
        step.live.as_ref().map_or(0.0, |live| 1e-9 * live.captured_at.nanos as f64);
    let frame = step.live.as_ref().and_then(|live| (recording.load)(live.frame_id.0));
    if let Some(image) = frame {
        let captured_at =
            step.live.as_ref().map_or(CaptureTime { nanos: 0 }, |live| live.captured_at);
        let frame = Frame {
            id: FrameId(2),
            captured_at,
            kind: FrameKind::Video,
            name: String::new(),
            image,
        };
        let table = painted.state_mut();
        table.screen.picture.show_frame(&frame, 9.99);
        // A single picture has no rate.
        table.screen.picture.came_secs = None;
        let camera = &mut table.choices.cameras[0];
        camera.picture = Some(Arc::new(imageops::thumbnail(&frame.image, 480, 270)));
        camera.number += 1;
    }
    for view in step.views.iter() {
        if let Some(image) = (recording.load)(view.frame_id.0) {
            let ctx = painted.ctx.clone();
            painted.state_mut().screen.add_thumbnail(&ctx, view.number, &image);
        }
    }
    painted
}
