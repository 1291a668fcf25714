//! The window's pages at every kind of moment, as read by eye and by a screen reader.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod adjust;
mod app;
mod blind_follow;
mod camera;
#[path = "../common/cameras.rs"]
mod cameras;
mod comparison;
mod contrast;
mod design;
mod engineer;
mod fits;
mod fixtures;
mod matrix;
mod paint_time;
#[cfg(feature = "serve")]
mod phone;
mod picker;
mod result_card;
mod rig;
mod screenshots;
mod start_page;

use std::path::Path;

use boresight::{
    app::{
        BoardFromCode,
        explain::UserError,
        window::{
            recordings::DecidedRecording,
            services::{Ended, Memory, SessionRequest},
        },
    },
    detection::OtherBoard,
    device::{Adjustable, Control, Fault},
    frame::{CaptureTime, Frame, FrameId, FrameKind},
    geometry::boards::{BoardChoice, Pattern},
    guidance::Plan,
    session::{Outcome, Prompt, Shown, Snapshot},
    text::{Act, charts::Chart},
    ui::{
        Preferences, SMALLEST, Screen, UiAction, apply_theme, guide,
        replay::{self, Replayed},
        result, settings,
        start::{self, StartPage},
        user_error,
    },
};
use boresight_testkit::{
    paint::Painter,
    world::{self, SIZE},
};
use egui::{
    Theme, Vec2,
    accesskit::{Live, Role},
};
use egui_kittest::{
    Harness, SnapshotResults,
    kittest::{NodeT, Queryable},
};
use fixtures::{Moment, moments};
use image::GrayImage;

/// Renderer without a graphics card.
fn painter() -> Painter {
    Painter::new(boresight::ui::theme::background)
}

/// Contents of a test's table.
struct Table {
    screen: Screen,
    page: Page,
    result: result::ResultPage,
    replayed: Option<Replayed>,
    start: StartPage,
    choices: start::Choices,
    memory: Memory,
    asks: Vec<UiAction>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Page {
    Start,
    Guide,
    Result,
    Replay,
    Settings,
}

impl Page {
    const ALL: [Self; 5] = [Self::Start, Self::Guide, Self::Result, Self::Replay, Self::Settings];
}

fn draft() -> SessionRequest {
    SessionRequest {
        source: "sim".into(),
        mode: "auto".into(),
        board: [9, 6],
        pattern: Pattern::Plain,
        square_m: 0.025,
        board_code: BoardFromCode::Nothing,
        plan: Plan::Adaptive,
        go_on_with: Some("sessions/one".into()),
        first: None,
    }
}

fn show(ui: &mut egui::Ui, table: &mut Table) {
    match &table.page {
        Page::Guide => guide::show(ui, &table.screen, &mut table.asks),
        Page::Result => {
            let ended = Ended {
                folder: "sessions/one".into(),
                files: ["calibration.json", "report.html"]
                    .map(|it| Path::new("sessions/one").join(it))
                    .into(),
                compared: None,
                trouble: None,
            };
            let context = result::Context {
                state: result::State::Ended(&ended),
                formats: &["OpenCV", "ROS"],
                exported: None,
            };
            result::show(ui, &table.screen, &context, &mut table.result, &mut table.asks);
        }
        Page::Replay => replay::show(ui, table.replayed.as_mut().expect("a recording")),
        Page::Settings => {
            let Table { screen, memory, asks, .. } = table;
            settings::show(ui, (&screen.preferences, 1.0), None, memory, asks);
        }
        Page::Start => start::show(ui, &mut table.start, &table.choices, &mut table.asks),
    }
}

/// Page at a moment in the smallest window; `scale` is of the display.
fn harness(page: Page, moment: &Moment, theme: Theme, scale: f32) -> Harness<'static, Table> {
    harness_at(page, moment, (theme, scale), SMALLEST)
}

fn harness_at(
    page: Page,
    moment: &Moment,
    (theme, scale): (Theme, f32),
    size: egui::Vec2,
) -> Harness<'static, Table> {
    let mut screen = Screen {
        snapshot: Some(moment.snapshot.clone()),
        source: "sim:everyday".into(),
        now_secs: 10.0,
        taken_secs: moment.taken.then_some(9.4),
        preferences: Preferences { panels: true, ..Preferences::default() },
        ..Screen::default()
    };
    let captured_at =
        moment.snapshot.live.as_ref().map_or(CaptureTime { nanos: 0 }, |live| live.captured_at);
    let frame = Frame {
        id: FrameId(1),
        captured_at,
        kind: FrameKind::Video,
        name: String::new(),
        image: GrayImage::from_fn(320, 180, |x, _| image::Luma([if x < 160 { 90 } else { 150 }])),
    };
    let table = Table {
        screen: Screen::default(),
        page,
        result: result::ResultPage { engineer: true, ..result::ResultPage::default() },
        replayed: None,
        start: StartPage::new(start_page::chosen()),
        choices: start_page::choices(),
        memory: Memory::default(),
        asks: Vec::new(),
    };
    let mut table = table;
    if page == Page::Replay {
        let picture = |_| Some(GrayImage::new(64, 36));
        let steps = vec![moment.snapshot.clone()];
        let name = "sessions/one".into();
        table.replayed = Replayed::new(DecidedRecording {
            steps,
            different: vec![],
            name,
            load: Box::new(picture),
        });
    }
    let mut harness = Harness::builder()
        .with_size(size)
        .with_pixels_per_point(scale)
        .with_theme(theme)
        .renderer(painter())
        .with_context_setup(apply_theme)
        .build_ui_state(show, table);
    screen.picture.show_frame(&frame, 9.99);
    for view in moment.snapshot.views.iter() {
        screen.add_thumbnail(&harness.ctx, view.number, &frame.image);
    }
    if moment.snapshot.camera.stream != boresight::session::Stream::NotLive {
        screen.adjustables = [(Control::Focus, 255), (Control::Exposure, 500)]
            .map(|(control, max)| Adjustable { control, min: 0, max, step: 1 })
            .into();
        screen.show(moment.snapshot.clone());
    }
    harness.state_mut().screen = screen;
    harness.run();
    harness
}

#[test]
fn every_moment_is_read_on_every_page() {
    for moment in moments() {
        println!("{}", moment.name);
        let guide = harness(Page::Guide, &moment, Theme::Dark, 1.0);
        let sentence = guide.get_by_role_and_label(Role::Status, &moment.sentence);
        assert_eq!(sentence.accesskit_node().live(), Live::Assertive, "read when it changes");
        guide.get_by_role_and_label(Role::Image, "Live picture");
        let wheel = |node: &egui_kittest::Node<'_>| {
            node.accesskit_node().label().is_some_and(|l| l.starts_with("Directions: "))
        };
        assert_eq!(guide.get_all_by_role(Role::Image).filter(wheel).count(), 1, "{}", moment.name);
        // Without a request there is nothing to aim for.
        let has_gauges = moment.snapshot.target.is_some();
        for name in ["Tilt", "Direction", "Size", "Sideways", "Motion", "Blur"] {
            assert_eq!(guide.query_by_label(name).is_some(), has_gauges, "{name}");
        }
        for name in ["Principal point", "Views"] {
            guide.get_by_label(name);
        }
        for number in 1..=moment.snapshot.views.len() {
            guide.get_by_role_and_label(Role::Button, &format!("Remove view {number}"));
        }
        let mut result = harness(Page::Result, &moment, Theme::Dark, 1.0);
        match &moment.snapshot.calibration {
            Some(calibration) => {
                let verdict = boresight::text::verdict_on(calibration);
                result.get_by_label(&boresight::text::of_source("sim:everyday", verdict));
                result.get_by_label("Principal point by method").scroll_to_me();
                result.run();
                result.get_by_label("Principal point by method").click();
                result.run();
                result.get_by_label("Bundle adjustment");
                for finding in &calibration.findings {
                    let (what, action) = boresight::text::finding(finding, &[]);
                    result.get_by_label(&format!("{what}."));
                    result.get_all_by_label(action).next().expect("the next action");
                }
            }
            None => {
                result.get_by_label(boresight::text::window::NO_RESULT);
            }
        }
        result.get_by_role_and_label(Role::Button, "OpenCV");
        result.get_by_role_and_label(Role::Button, "calibration.json");
        replay_is_read(&moment);
        settings_are_read(&harness(Page::Settings, &moment, Theme::Dark, 1.0));
    }
}

#[test]
fn what_stands_on_the_picture_is_read_too() {
    let all = moments();
    for (name, distance, wanted) in [
        ("paused", true, Some("Press P to resume.")),
        ("paused", false, None),
        ("searching", true, None),
    ] {
        let moment = matrix::moment_of(&all, name);
        let size = Vec2::new(1024.0, 640.0);
        let mut page = matrix::page_at(Page::Guide, &moment, (Theme::Dark, 1.0), size, distance);
        page.state_mut().screen.source = "sim:webcam".into();
        page.run();
        let picture = page.get_by_role_and_label(Role::Image, "Live picture");
        let told = picture.accesskit_node().description().unwrap_or_default();
        assert!(told.starts_with("SIMULATED."), "{told}");
        assert_eq!(told.contains("resume"), wanted.is_some(), "{name}: {told}");
        assert!(told.contains(wanted.unwrap_or_default()), "{told}");
    }
}

fn replay_is_read(moment: &Moment) {
    let page = harness(Page::Replay, moment, Theme::Dark, 1.0);
    page.get_by_role_and_label(Role::Status, &moment.sentence);
    page.get_by_label(&boresight::text::replay::why(&moment.snapshot, false));
    page.get_by_label_contains("Decision 1 of 1");
    page.get_by_role_and_label(Role::Image, boresight::text::replay::STRIP);
    page.get_by_role_and_label(Role::Slider, boresight::text::replay::SCRUBBER);
    for name in ["Previous view", "Back", "Play", "Next", "Next view"] {
        page.get_by_role_and_label(Role::Button, name);
    }
}

fn settings_are_read(page: &Harness<'_, Table>) {
    for name in ["Mirror", "Speak", "Tone", "Colours", "Start"] {
        page.get_by_role_and_label(Role::Button, name);
    }
    page.get_by_role_and_label(Role::CheckBox, boresight::text::start::FULL_SCREEN);
    page.get_by_role_and_label(Role::Slider, "Interface size");
}

#[test]
fn every_chart_says_what_it_shows() {
    let moments = moments();
    let done = moments.iter().find(|m| m.name == "done good").expect("there");
    let mut result = harness(Page::Result, done, Theme::Dark, 1.0);
    result.get_by_label(boresight::text::charts::MORE).click();
    result.run();
    for chart in Chart::PLAIN.into_iter().chain(Chart::EXPERT) {
        result.get_by_role_and_label(Role::Button, chart.name()).click();
        result.run();
        let described = |label: Option<String>| {
            label.is_some_and(|label| label.starts_with(&format!("{}: ", chart.name())))
        };
        let images = result.get_all_by_role(Role::Image);
        assert_eq!(
            images.filter(|n| described(n.accesskit_node().label())).count(),
            1,
            "{chart:?}"
        );
    }
}

#[test]
fn faults_come_with_their_next_action() {
    let moments = moments();
    let at = |name: &str| moments.iter().find(|m| m.name == name).expect("a moment of that name");
    let lost = harness(Page::Guide, at("camera lost"), Theme::Dark, 1.0);
    lost.get_by_label("Plug it back into any port to continue. Your views are safe.");
    let moved = harness(Page::Guide, at("focus moved"), Theme::Dark, 1.0);
    moved.get_by_label("Switch off autofocus and automatic framing in the camera's own program.");
    moved.get_by_label("locked at 30");
    // A doubt keeps nobody from taking views: it's a line beside the picture, which stays free.
    let doubt = harness(Page::Guide, at("camera in doubt"), Theme::Dark, 1.0);
    let (what, action) = boresight::text::camera::fault(Fault::Unwatched);
    doubt.get_by_label(what);
    assert!(doubt.query_by_label(action).is_none());
    let failed = harness(Page::Guide, at("worker failed"), Theme::Dark, 1.0);
    failed.get_by_label("The detector failed: out of memory");
}

#[test]
fn a_view_is_removed_by_its_own_button() {
    let moments = moments();
    let done = moments.iter().find(|m| m.name == "done good").expect("there");
    let mut guide = harness(Page::Guide, done, Theme::Dark, 1.0);
    guide.get_by_label("Remove view 2").click();
    guide.run();
    let id = done.snapshot.views[1].number;
    assert_eq!(guide.state().asks, [UiAction::Remove(id)]);
}

#[test]
fn another_board_is_offered_on_the_picture_and_no_photo_is_lost() {
    let moments = moments();
    let with_board = |name: &str| {
        let moment = moments.iter().find(|moment| moment.name == name).expect("there");
        let mut snapshot = moment.snapshot.clone();
        let other = OtherBoard::Plain { columns: 7, rows: 5 };
        snapshot.shown = Shown { prompt: Prompt::OtherBoard(other), advice: None };
        let moment = Moment { snapshot, sentence: String::new(), name: name.into(), taken: false };
        harness(Page::Guide, &moment, Theme::Dark, 1.0)
    };
    let mut without_views = with_board("searching");
    without_views.get_by_role_and_label(Role::Button, "Use 8 × 6").click();
    without_views.run();
    let board = BoardChoice::of([7, 5], Pattern::Plain);
    assert_eq!(without_views.state().asks, [UiAction::UseBoard(board)]);
    let with_views = with_board("partner wanted");
    with_views.get_by_label("This board has 8 × 6 squares. Expected: 10 × 7");
    with_views.get_by_label_contains("Your photos are kept");
    with_views.get_by_role_and_label(Role::Button, "Use 8 × 6");
}

#[test]
fn a_mirror_speaks_from_the_technicians_side() {
    let moments = moments();
    let cut = moments.iter().find(|m| m.name == "cut off").expect("there");
    let mut guide = harness(Page::Guide, cut, Theme::Dark, 1.0);
    guide.state_mut().screen.preferences.mirrored = true;
    guide.run();
    let words = "Move left. It's cut off";
    guide.get_by_role_and_label(Role::Status, words);
}

#[test]
fn a_session_that_cannot_start_says_what_to_do() {
    let trouble = UserError {
        what: "No permission to use the camera".into(),
        action: Some("Run: sudo usermod -aG video $USER, then log out and in".into()),
    };
    let wish = SessionRequest {
        source: "/dev/video0".into(),
        mode: "auto".into(),
        board: [9, 6],
        pattern: Pattern::Plain,
        square_m: 0.025,
        board_code: BoardFromCode::Nothing,
        plan: Plan::Adaptive,
        go_on_with: None,
        first: None,
    };
    let asked = wish.clone();
    let mut harness = Harness::builder().with_size(SMALLEST).renderer(painter()).build_ui_state(
        move |ui, asks: &mut Vec<UiAction>| user_error::show(ui, &trouble, &asked, asks),
        Vec::new(),
    );
    harness.get_by_label("No permission to use the camera");
    harness.get_by_label("Try again").click();
    harness.run();
    assert_eq!(*harness.state(), [UiAction::Open(Box::new(wish))]);
    harness.get_by_label("Choose another source").click();
    harness.run();
    assert_eq!(harness.state().last(), Some(&UiAction::Act(Act::StartPage)));
}

#[test]
fn a_replay_steps_through_decisions_and_says_why() {
    let story = fixtures::story();
    let (steps, taken) = (
        story.len(),
        story.iter().position(|s| matches!(s.decision.outcome, Outcome::Accepted { .. })),
    );
    let taken = taken.expect("a session takes views");
    let picture = |frame: u64| frame.is_multiple_of(2).then(|| GrayImage::new(64, 36));
    let replayed = Replayed::new(DecidedRecording {
        steps: story,
        different: vec![2],
        name: "sessions/one".into(),
        load: Box::new(picture),
    });
    let mut page = Harness::builder()
        .with_size(SMALLEST)
        .renderer(painter())
        .with_context_setup(apply_theme)
        .build_ui_state(replay::show, replayed.expect("there are steps"));
    let says = |page: &Harness<'_, Replayed>, words: &str| {
        let labels = page.get_all_by_role(Role::Label);
        let found = labels.filter_map(|n| n.accesskit_node().value()).any(|l| l.starts_with(words));
        assert!(found, "{words}");
    };
    says(&page, &format!("Decision 1 of {steps}"));
    page.get_by_role_and_label(Role::Button, "Next view").click();
    page.run();
    assert_eq!(page.state().at(), taken);
    says(&page, "Taken: view 1, a new direction");
    // The past cannot be changed.
    assert!(page.query_by_role_and_label(Role::Button, "Remove view 1").is_none());
    page.get_by_role_and_label(Role::Button, "Back").click();
    page.run();
    says(&page, "Not taken: Hold still");
    page.get_by_role_and_label(Role::Button, "Previous view").click();
    page.run();
    assert_eq!(page.state().at(), 0);
    for _ in 0..2 {
        page.key_press(egui::Key::ArrowRight);
        page.run();
    }
    assert_eq!(page.state().at(), 2);
    page.get_by_label("The recording has a different decision here");
}

#[test]
fn pages_look_as_they_did() {
    let moments = moments();
    let mut results = SnapshotResults::new();
    for (file, page, name, theme) in [
        ("guide_partner", Page::Guide, "partner wanted", Theme::Dark),
        ("guide_beyond_edge", Page::Guide, "beyond the edge", Theme::Dark),
        ("guide_holding", Page::Guide, "holding", Theme::Dark),
        ("guide_searching", Page::Guide, "searching", Theme::Light),
        ("guide_lost", Page::Guide, "camera lost", Theme::Dark),
        ("result_unfinished", Page::Result, "partner wanted", Theme::Light),
        ("result_engineer", Page::Result, "done good", Theme::Dark),
        ("replay", Page::Replay, "accepted", Theme::Dark),
        ("start", Page::Start, "fresh", Theme::Dark),
        ("start_light", Page::Start, "fresh", Theme::Light),
        ("settings_light", Page::Settings, "fresh", Theme::Light),
    ] {
        let moment = moments.iter().find(|m| m.name == name).expect("a moment of that name");
        let mut harness = harness(page, moment, theme, 1.0);
        harness.snapshot(file);
        results.extend_harness(&mut harness);
    }
    for (file, name, theme) in [
        ("result_good", "done good", Theme::Dark),
        ("result_care", "done care", Theme::Light),
        ("result_untrustworthy", "done untrustworthy", Theme::Dark),
    ] {
        let moment = moments.iter().find(|m| m.name == name).expect("a moment of that name");
        let mut card = harness(Page::Result, moment, theme, 1.0);
        card.state_mut().result.engineer = false;
        card.run();
        card.snapshot(file);
        results.extend_harness(&mut card);
    }
    let partner = moments.iter().find(|m| m.name == "partner wanted").expect("there");
    let size = egui::vec2(1920.0, 1080.0);
    let mut afar = harness_at(Page::Guide, partner, (Theme::Dark, 1.0), size);
    afar.state_mut().screen.distance = true;
    afar.run();
    afar.snapshot("guide_distance");
    results.extend_harness(&mut afar);
}

#[test]
fn snapshots_are_cheap_to_clone() {
    let done: Snapshot = fixtures::story().pop().expect("a session has an end");
    let info = allocation_counter::measure(|| drop(done.clone()));
    // The target's ghost, the names of failures and changed controls; nothing per view.
    assert!(info.count_total <= 8, "{} allocations", info.count_total);
    assert_eq!(done.setup.image_size, SIZE);
}
