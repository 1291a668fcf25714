//! A person who only sees the card: it's found in the pixels of the painted picture, by colour, and
//! the board is brought there. Nothing of the session is read but these pixels.
//!
//! `BORESIGHT_SESSIONS=20 cargo test --test window only_sees -- --nocapture` prints a line for each
//! session; people with card and sentence are in `one_instruction.rs` of `crates/present/tests`, and
//! those with the voice alone in `listener.rs`.

use boresight::{
    boards::Board,
    calibration::Verdict,
    frame::{CaptureTime, Frame, FrameId, FrameKind},
    guidance::Progress,
    session::{Input, Outcome, Session},
    simulation::{
        Scene,
        technician::{Cue, CueKind, Technician},
    },
    ui::{Placed, guide},
};
use boresight_testkit::eyes::{Look, Quad, Sight};
use egui::{Rect, Theme, Vec2, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable};
use nalgebra::{Point2, Vector2, Vector3};

use crate::{
    Page, Table,
    fixtures::{Moment, moments},
    harness_at,
    matrix::{picture, square_to},
    world::{SIZE, World, setup},
};

/// Size of the window: small, to be painted fast.
const WINDOW: Vec2 = Vec2::new(640.0, 400.0);
/// Number of the camera's pictures between two looks at the screen.
const LOOKS_EVERY: u64 = 6;
const PATIENCE_SECS: f64 = 120.0;
/// White around the outer squares of the board in the hands, in squares.
const MARGIN: f64 = 0.4;
/// Distance of corners, as a share of the picture's width, beyond which a card is another card.
const ANOTHER: f64 = 0.05;

/// Camera pixels of the board's inner corners with the sheet on the card.
fn on_card(card: &Quad, picture: Rect, board: &Board) -> Option<Vec<Point2<f64>>> {
    let scale = f64::from(SIZE.width_px) / f64::from(picture.width());
    let corner = Point2::new(f64::from(picture.left()), f64::from(picture.top()));
    let in_picture = card.map(|at| Point2::from((at - corner) * scale - Vector2::repeat(0.5)));
    let unit = square_to(in_picture)?;
    let half_m = board.target().size_m().map(|side_m| 0.5 * side_m + MARGIN * board.square_m());
    let px = |at: &Point2<f64>| {
        let [u, v] = [0, 1].map(|axis| 0.5 + 0.5 * at[axis] / half_m[axis]);
        let p = unit * Vector3::new(u, v, 1.0);
        Point2::new(p.x / p.z, p.y / p.z)
    };
    Some(board.corners_in_board_m().iter().map(px).collect())
}

/// A window in front of a person.
fn window(moments: &[Moment]) -> Harness<'static, Table> {
    let mut page = harness_at(Page::Guide, &moments[0], (Theme::Dark, 1.0), WINDOW);
    let screen = &mut page.state_mut().screen;
    screen.source = "HD Webcam".into();
    screen.preferences.panels = false;
    // The board in the air stands still at the requested pose.
    page.ctx.all_styles_mut(|style| style.animation_time = 0.0);
    page.run();
    page
}

/// A session with a person looking at the window's pixels, the length, and the errors of the read
/// cards.
fn sitting(seed: u64, page: &mut Harness<'static, Table>) -> (Session, f64, Vec<f64>) {
    let scene = Scene::random(seed);
    let mut world = World::new(seed);
    (world.camera, world.board, world.noise_px) = (scene.camera, scene.board, 0.1);
    let mut person = Technician::new(&scene);
    let mut session = Session::new(setup(scene.board));
    let (mut last, mut target, mut off_px) = (None::<Quad>, 0, Vec::new());
    let step_secs = 1e-9 * world.step_nanos as f64;
    let mut secs = 0.0;
    page.state_mut().screen.taken_secs = None;
    for number in 1.. {
        if session.progress() != Progress::Collecting || secs > PATIENCE_SECS {
            break;
        }
        let seen_at = CaptureTime { nanos: (1e9 * secs) as u64 };
        let observation = world.observe(&person.pose_at(seen_at));
        let captured_at = observation.captured_at;
        let decision = session.handle(&Input::Observed(observation));
        let screen = &mut page.state_mut().screen;
        screen.now_secs = 10.0 + secs;
        if matches!(decision.outcome, Outcome::Accepted { .. }) {
            screen.taken_secs = Some(screen.now_secs);
        }
        secs += step_secs;
        if number % LOOKS_EVERY != 0 {
            continue;
        }
        let snapshot = session.snapshot(decision);
        let image = picture(&snapshot, 4);
        let (id, kind, name) = (FrameId(number), FrameKind::Video, String::new());
        let wanted = snapshot.target.clone();
        let screen = &mut page.state_mut().screen;
        screen.show(snapshot);
        let frame = Frame { id, captured_at, kind, name, image };
        screen.picture.show_frame(&frame, screen.now_secs);
        page.step();
        let painted = page.render().expect("painted");
        let page_rect = page.get_by_role_and_label(Role::Image, "Live picture").rect();
        let whole = Placed::within(page_rect, SIZE, false).rect;
        let said = page.get_by_role(Role::Status).rect();
        let picture = whole.with_max_y(said.top().min(whole.bottom()));
        let (middle, radius) = guide::air::disc(page_rect);
        let disc = Rect::from_center_size(middle, Vec2::splat(2.2 * radius));
        let look = Look { painted: &painted, picture, disc };
        match look.sees() {
            Sight::Flash if last.is_some() => {
                last = None;
                person.read(Cue { seen_at, kind: CueKind::Taken });
            }
            Sight::Card(card) => {
                let apart = |other: &Quad| {
                    let ways = card.iter().zip(other).map(|(a, b)| (a - b).norm());
                    ways.fold(0.0, f64::max) / f64::from(look.picture.width())
                };
                if last.as_ref().is_some_and(|last| apart(last) < ANOTHER) {
                    continue;
                }
                let Some(ghost_px) = on_card(&card, whole, &scene.board) else { continue };
                if let Some(wanted) = &wanted {
                    let off = ghost_px.iter().zip(&wanted.ghost_px).map(|(a, b)| (a - b).norm());
                    off_px.push(off.sum::<f64>() / ghost_px.len() as f64);
                }
                (last, target) = (Some(card), target + 1);
                person.read(Cue { seen_at, kind: CueKind::Show { ghost_px, target } });
            }
            Sight::Flash | Sight::Nothing => {}
        }
    }
    off_px.sort_by(f64::total_cmp);
    (session, secs, off_px)
}

#[test]
fn who_only_sees_the_card_gets_there() {
    let asked = std::env::var("BORESIGHT_SESSIONS").ok().and_then(|number| number.parse().ok());
    card_is_enough(asked.unwrap_or(1));
}

#[test]
#[ignore = "takes minutes"]
fn long_who_only_sees_the_card_gets_there_20_times() {
    card_is_enough(20);
}

fn card_is_enough(sessions: u64) {
    let mut page = window(&moments());
    let (mut good, mut times) = (0, Vec::new());
    for seed in 1..=sessions {
        let (session, secs, off_px) = sitting(seed, &mut page);
        let verdict = session.calibration().map(|calibration| calibration.verdict);
        println!(
            "{seed}: {verdict:?}, {} views, {secs:.0} s, {} cards read to {:.0} px of {}",
            session.accepted().len(),
            off_px.len(),
            off_px.get(off_px.len() / 2).copied().unwrap_or(f64::NAN),
            SIZE.width_px
        );
        good += u64::from(verdict == Some(Verdict::Good));
        times.push(secs);
    }
    times.sort_by(f64::total_cmp);
    let (median, longest) = (times[times.len() / 2], times[times.len() - 1]);
    println!("{good} of {sessions} GOOD, median {median:.0} s, longest {longest:.0} s");
    assert_eq!(good, sessions);
}
