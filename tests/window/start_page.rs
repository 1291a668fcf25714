//! The start page, and every way away and back.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use boresight::{
    app::{
        BoardFromCode, Services,
        explain::UserError,
        session::camera::{Near, NearCamera},
        window::{
            lookout::{Cameras, Lookout, whole_board},
            recordings::{Dropped, Recording, within},
            services::{
                CameraView, Comparing, Loading, Memory, Opened, OtherKind, PrintedBoard, RigOpened,
                RigRequest, SeenBoard, SeenCode, SessionRequest, Storing, Wake,
            },
        },
    },
    boards::{Board, BoardChoice, MarkerSide, Pattern},
    capture::{FrameSource, Recorded, SourceIdentity},
    cli::services,
    detection::OtherBoard,
    frame::{CaptureTime, Frame, FrameId, FrameKind},
    guidance::Plan,
    markers::{CircleRows, Dictionary},
    session::Command,
    simulation::{Scene, render_view},
    text::{NO_VOICE, rig, settings, start as words},
    ui::{
        App, Page, SMALLEST, UiAction, apply_theme,
        start::{self, Choices, StartPage},
    },
};
use egui::{Theme, accesskit::Role};
use egui_kittest::{Harness, SnapshotResults, kittest::Queryable};
use image::{GrayImage, Luma};
use nalgebra::{Isometry3, Vector3};

use crate::{
    app::{Window, app, click, settle, until, window},
    draft, painter,
};

/// A camera that sees a ramp.
fn camera(source: &str, name: &str) -> CameraView {
    let picture = GrayImage::from_fn(160, 90, |x, y| Luma([(40 + x + y) as u8]));
    CameraView {
        mode: words::mode(1280, 720),
        picture: Some(Arc::new(picture)),
        number: 1,
        ..CameraView::new(source, name)
    }
}

pub(crate) fn choices() -> Choices {
    Choices {
        cameras: vec![camera("usb:046d:0825:1F3A", "HD Webcam")],
        modes: vec!["1280x720@30:MJPG".into()],
        streams: vec!["rtsp://10.0.0.7/front".into()],
        papers: vec!["A4", "Letter", "A3"],
        mirrored: None,
        full_screen: false,
    }
}

/// A session with the camera.
pub(crate) fn chosen() -> SessionRequest {
    SessionRequest { source: "usb:046d:0825:1F3A".into(), go_on_with: None, ..draft() }
}

type Table = (StartPage, Choices, Vec<UiAction>);

fn page(draft: SessionRequest, choices: Choices) -> Harness<'static, Table> {
    let mut page = Harness::builder()
        .with_size(SMALLEST)
        .with_context_setup(apply_theme)
        .renderer(painter())
        .build_ui_state(
            |ui, (page, choices, asks): &mut Table| {
                page.see(choices);
                start::show(ui, page, choices, asks);
            },
            (StartPage::new(draft), choices, Vec::new()),
        );
    page.run();
    page
}

/// Opens the sheet with all choices.
fn change(page: &mut Harness<'_, Table>) {
    press(page, Role::Button, words::CHANGE);
}

fn press(page: &mut Harness<'_, Table>, role: Role, label: &str) {
    // The sheet scrolls.
    page.get_by_role_and_label(role, label).scroll_to_me();
    page.run();
    page.get_by_role_and_label(role, label).click();
    page.run();
}

#[test]
fn the_only_camera_is_chosen_and_one_click_starts() {
    let any = SessionRequest { source: "auto".into(), go_on_with: None, ..draft() };
    let mut page = page(any, choices());
    page.get_by_label(words::HOLD_UP);
    assert!(page.query_by_role(Role::RadioButton).is_none(), "nothing is asked");
    change(&mut page);
    page.get_by_role_and_label(Role::Image, "10 × 7 squares, 9 × 6 inner corners");
    press(&mut page, Role::RadioButton, "Quick, about 20 s");
    press(&mut page, Role::Button, words::GO);
    let wanted = SessionRequest {
        source: "usb:046d:0825:1F3A".into(),
        plan: Plan::Quick,
        // The size of the squares is open: a code beside the board may set it.
        board_code: BoardFromCode::All,
        go_on_with: None,
        ..draft()
    };
    assert_eq!(page.state().2, [UiAction::Start(Box::new(wanted))]);
    press(&mut page, Role::Button, words::YES);
    assert_eq!(page.state().2.last(), Some(&UiAction::Mirror(true)));
    page.state_mut().1.mirrored = Some(true);
    page.run();
    assert!(page.query_by_label(words::MIRROR).is_none(), "asked once");
}

#[test]
fn without_a_camera_there_is_a_way_on() {
    let none = || Choices { cameras: Vec::new(), modes: Vec::new(), ..choices() };
    let any = SessionRequest { source: "auto".into(), ..draft() };
    let mut page = page(any, none());
    page.get_by_label(words::NO_CAMERA);
    press(&mut page, Role::Button, words::GO);
    assert_eq!(page.state().2, [], "nothing to start with");
    press(&mut page, Role::Link, words::SIMULATION);
    let started = |page: &Harness<'_, Table>| match page.state().2.last() {
        Some(UiAction::Start(wish)) => wish.source.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!(started(&page), "sim", "one press");
    change(&mut page);
    press(&mut page, Role::Button, "rtsp://10.0.0.7/front");
    press(&mut page, Role::Button, words::GO);
    assert_eq!(started(&page), "rtsp://10.0.0.7/front");
    page.get_by_role_and_label(Role::TextInput, words::OTHER).focus();
    page.run();
    page.get_by_role_and_label(Role::TextInput, words::OTHER).type_text("/2");
    page.run();
    press(&mut page, Role::Button, words::GO);
    assert_eq!(started(&page), "rtsp://10.0.0.7/front/2");
    // Names open sources even without being listed.
    for named in ["pipe:rpicam-vid -t 0 -o -", "ros2:/camera/image_raw", "gige:10.0.0.9"] {
        let field = page.get_by_role_and_label(Role::TextInput, words::OTHER);
        field.focus();
        page.run();
        page.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::A);
        page.get_by_role_and_label(Role::TextInput, words::OTHER).type_text(named);
        page.run();
        press(&mut page, Role::Button, words::GO);
        assert_eq!(started(&page), named);
    }
}

#[test]
fn cameras_come_and_go() {
    let any = SessionRequest { source: "auto".into(), ..draft() };
    let mut page = page(any, Choices { cameras: Vec::new(), ..choices() });
    page.get_by_label(words::NO_CAMERA);
    page.state_mut().1.cameras = choices().cameras;
    page.run();
    assert_eq!(page.state().0.draft.source, "usb:046d:0825:1F3A", "plugged in");
    page.state_mut().1.cameras.push(camera("usb:1:2:3", "Other"));
    page.run();
    change(&mut page);
    press(&mut page, Role::Button, "Other, 1280 × 720");
    assert_eq!(page.state().0.draft.source, "usb:1:2:3");
    page.state_mut().1.cameras.pop();
    page.run();
    assert_eq!(page.state().0.draft.source, "usb:046d:0825:1F3A", "the other was unplugged");
    change(&mut page);
    let busy = UserError {
        what: "Another program is using the camera".into(),
        action: Some("Close that program.".into()),
    };
    let camera = &mut page.state_mut().1.cameras[0];
    (camera.picture, camera.trouble) = (None, Some(busy));
    page.run();
    page.get_by_label("Close that program.");
    press(&mut page, Role::Button, words::GO);
    assert_eq!(page.state().2, []);
}

#[test]
fn several_cameras_are_chosen_together() {
    let any = SessionRequest { source: "auto".into(), ..draft() };
    let broken = CameraView {
        trouble: Some(UserError { what: "Another program uses it".into(), action: None }),
        ..camera("usb:9:9:9", "Broken")
    };
    let cameras = vec![camera("usb:1:2:3", "HD Webcam"), broken, camera("usb:1:2:4", "HD Webcam")];
    let mut page = page(any, Choices { cameras, ..choices() });
    change(&mut page);
    press(&mut page, Role::CheckBox, words::RIG);
    page.get_by_role_and_label(Role::Button, &words::rig(&["HD Webcam", "HD Webcam"]));
    press(&mut page, Role::Button, words::GO);
    let Some(UiAction::StartRig(request)) = page.state().2.last() else {
        unreachable!("{:?}", page.state().2)
    };
    let named = |name: &str, source: &str| (name.to_owned(), source.to_owned());
    let wanted = [named("HD-Webcam", "usb:1:2:3"), named("HD-Webcam-2", "usb:1:2:4")];
    assert_eq!(request.cameras, wanted, "names of folders differ");
    page.state_mut().1.cameras.pop();
    page.run();
    page.get_by_label(words::RIG_TROUBLE);
    press(&mut page, Role::Button, words::GO);
    assert_eq!(page.state().2.len(), 1, "one camera is no rig");
    press(&mut page, Role::CheckBox, words::RIG);
    press(&mut page, Role::Button, words::GO);
    assert!(matches!(page.state().2.last(), Some(UiAction::Start(_))));
}

#[test]
fn a_board_in_view_is_counted_and_used() {
    let mut page = page(chosen(), choices());
    page.get_by_label(words::HOLD_UP);
    page.state_mut().1.cameras[0].rim = Some([[0.3, 0.3], [0.7, 0.3], [0.7, 0.7], [0.3, 0.7]]);
    page.run();
    page.get_by_label(words::HOLD_UP);
    page.state_mut().1.cameras[0].board = Some([7, 5]);
    page.run();
    page.get_by_label("8 × 6 squares, 25 mm?");
    page.get_by_label(words::SIZE_OPEN);
    assert_eq!(page.state().0.draft.board, [7, 5]);
    // A count by the person stays, though the board stays in view.
    page.state_mut().0.draft.board = [8, 5];
    page.run();
    page.get_by_label("9 × 6 squares, 25 mm?");
    // Another board is counted, of another kind than the chosen one, too.
    page.state_mut().0.draft.pattern = Pattern::Circles(CircleRows::Symmetric);
    page.state_mut().1.cameras[0].board = Some([6, 4]);
    page.run();
    page.get_by_label("7 × 5 squares, 25 mm?");
    page.key_press(egui::Key::Enter);
    page.run();
    match page.state().2.last() {
        Some(UiAction::Start(wish)) => {
            assert_eq!((wish.board, wish.pattern), ([6, 4], Pattern::Plain));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn whoever_has_no_board_prints_one() {
    let mut page = page(chosen(), choices());
    press(&mut page, Role::Link, words::PRINT_ONE);
    let board = BoardChoice::of([9, 6], Pattern::Plain);
    assert_eq!(page.state().2, [UiAction::Print { board, paper: 0 }]);
    page.get_by_role_and_label(Role::Button, words::PRINT);
}

#[test]
fn a_board_of_another_kind_in_view_is_named_and_used() {
    let mut page = page(chosen(), choices());
    let family = "DICT_5X5_1000".parse().expect("known");
    let said =
        words::detected_other(OtherBoard::Charuco { dictionary: family, is_usual_side: true });
    let pattern = Pattern::Charuco { dictionary: family, side: MarkerSide::Usual };
    page.state_mut().1.cameras[0].other =
        Some(OtherKind { said: said.clone(), pattern, board: None });
    page.run();
    page.get_by_label(&said);
    press(&mut page, Role::Link, words::TAKE_OTHER);
    assert_eq!(page.state().0.draft.pattern.dictionary(), Some(family));
    page.get_by_label("ChArUco, 10 × 7, 25 mm");
    // Its squares are to be counted by the person.
    page.get_by_role_and_label(Role::ComboBox, words::DICTIONARY);
    // Circles are counted, too.
    let pattern = Pattern::Circles(CircleRows::Asymmetric);
    let circles = OtherKind { said: "Asymmetric circles".into(), pattern, board: Some([4, 11]) };
    page.state_mut().1.cameras[0].other = Some(circles);
    page.run();
    press(&mut page, Role::Link, words::TAKE_OTHER);
    let draft = &page.state().0.draft;
    assert_eq!((draft.board, draft.pattern), ([4, 11], pattern));
}

#[test]
fn a_code_beside_the_board_fills_everything_in_and_a_board_without_is_asked_for() {
    let mut page = page(chosen(), choices());
    let code = SeenCode { id: "ZX5N".into(), board: [8, 5], square_m: 0.0305 };
    page.state_mut().1.cameras[0].code = Some(code);
    page.run();
    page.get_by_label("9 × 6 squares, 30.5 mm");
    page.get_by_label(words::FROM_CODE);
    let draft = &page.state().0.draft;
    assert_eq!((draft.board, draft.square_m), ([8, 5], 0.0305));
    // The person's measurement wins, though the code stays in view.
    page.state_mut().0.draft.square_m = 0.0304;
    page.run();
    assert_eq!(page.state().0.draft.square_m, 0.0304);
    assert!(page.query_by_label(words::FROM_CODE).is_none());
}

#[test]
fn a_board_with_markers_is_chosen_by_its_squares() {
    let mut page = page(chosen(), choices());
    change(&mut page);
    press(&mut page, Role::RadioButton, "ChArUco");
    page.get_by_role_and_label(Role::Image, "10 × 7 squares, DICT_4X4_50");
    press(&mut page, Role::ComboBox, words::DICTIONARY);
    press(&mut page, Role::Button, "5X5_100");
    press(&mut page, Role::Button, words::PRINT);
    let dictionary = "DICT_5X5_100".parse().expect("known");
    let chosen = Pattern::Charuco { dictionary, side: MarkerSide::Usual };
    let board = BoardChoice::of([9, 6], chosen.in_squares_of(1.0));
    let print = UiAction::Print { board, paper: 0 };
    assert_eq!(page.state().2, [print]);
    press(&mut page, Role::Button, words::GO);
    let wish = |page: &Harness<'_, Table>| match page.state().2.last() {
        Some(UiAction::Start(wish)) => wish.pattern,
        other => panic!("{other:?}"),
    };
    assert_eq!(wish(&page), chosen);
    press(&mut page, Role::RadioButton, "Checkerboard");
    press(&mut page, Role::Button, words::GO);
    assert_eq!(wish(&page), Pattern::Plain);
    press(&mut page, Role::RadioButton, "ChArUco");
    press(&mut page, Role::Button, words::GO);
    assert_eq!(wish(&page), chosen, "as it was");
}

#[test]
fn a_board_that_cant_be_is_told_before_it_starts() {
    let dictionary = "APRILTAG_16h5".parse().expect("known");
    let pattern = Pattern::Charuco { dictionary, side: MarkerSide::Usual };
    let mut page = page(SessionRequest { pattern, ..chosen() }, choices());
    change(&mut page);
    page.get_by_label("This board has 35 markers, and DICT_APRILTAG_16h5 has 30");
    page.get_by_label("Choose a larger dictionary, or fewer squares.");
    page.get_by_label(words::NO_BOARD);
    press(&mut page, Role::Button, words::GO);
    press(&mut page, Role::Button, words::PRINT);
    assert_eq!(page.state().2, [], "neither started nor printed");
    let (dictionary, side) = (Dictionary::default(), MarkerSide::Metres(0.025));
    page.state_mut().0.draft.pattern = Pattern::Charuco { dictionary, side };
    page.run();
    page.get_by_label("Markers in these squares have sides of 7.5 mm to 23.75 mm");
    press(&mut page, Role::RadioButton, "Checkerboard");
    press(&mut page, Role::Button, words::GO);
    assert!(matches!(page.state().2[..], [UiAction::Start(_)]));
}

#[test]
fn a_board_with_markers_looks_as_it_did() {
    let dictionary = Dictionary::default();
    let pattern = Pattern::Charuco { dictionary, side: MarkerSide::Metres(0.015) };
    let fits = SessionRequest { board: [7, 10], pattern, square_m: 0.02, ..chosen() };
    let small = "APRILTAG_16h5".parse().expect("known");
    let pattern = Pattern::Charuco { dictionary: small, side: MarkerSide::Usual };
    let cannot_be = SessionRequest { pattern, ..fits.clone() };
    let mut results = SnapshotResults::new();
    for (file, draft, size, scale, theme) in [
        ("start_charuco", fits.clone(), SMALLEST, 1.0, Theme::Dark),
        ("start_charuco_large", fits, SMALLEST, 1.5, Theme::Light),
        ("start_charuco_wrong", cannot_be, egui::vec2(1280.0, 800.0), 1.0, Theme::Dark),
    ] {
        let mut page = Harness::builder()
            .with_size(size)
            .with_pixels_per_point(scale)
            .with_theme(theme)
            .with_context_setup(apply_theme)
            .renderer(painter())
            .build_ui_state(
                |ui, (page, choices, asks): &mut Table| start::show(ui, page, choices, asks),
                (StartPage::new(draft), choices(), Vec::new()),
            );
        page.state_mut().0.is_changing = true;
        page.run();
        // The overflow comes into view by scrolling.
        assert_eq!(beyond_the_sides(&page, size), Vec::<String>::new(), "{file}");
        page.snapshot(file);
        results.extend_harness(&mut page);
    }
}

/// Contents beyond the sides of the window, where nothing scrolls.
fn beyond_the_sides(page: &Harness<'_, Table>, size: egui::Vec2) -> Vec<String> {
    let high = egui::vec2(size.x, f32::INFINITY);
    crate::fits::outside(page, high)
}

#[test]
fn the_board_is_shown_in_a_window_of_its_own() {
    let mut page = Harness::builder().with_size(SMALLEST).renderer(painter()).build_ui(|ui| {
        start::show_board(ui.ctx(), BoardChoice::of([7, 5], Pattern::Plain));
    });
    page.run();
    let picture = page.render().expect("painted");
    let share = |is: &dyn Fn(u8) -> bool| {
        let count = picture.pixels().filter(|pixel| pixel.0[..3].iter().all(|l| is(*l))).count();
        count as f64 / f64::from(picture.width() * picture.height())
    };
    assert!(share(&|level| level == 0) > 0.1, "squares: {}", share(&|level| level == 0));
    assert!(share(&|level| level == 255) > 0.1);
}

/// A window services with one camera: a simulated one, with a board in front.
struct WithCamera {
    inner: Box<dyn Services>,
    source: String,
    /// Name of a second camera, with the same source.
    second: Option<&'static str>,
    remembered: Arc<Mutex<Memory>>,
    opened: Arc<Mutex<Vec<SessionRequest>>>,
    /// Picture of the preview.
    seen: Option<GrayImage>,
    lookout: Option<Lookout>,
}

/// A camera that sees one picture before a session.
struct Still {
    source: String,
    picture: GrayImage,
}

impl Cameras for Still {
    fn near(&self) -> Near {
        let (source, name) = (self.source.clone(), "Webcam".into());
        Near { cameras: vec![NearCamera { source, name, is_ordinary: true }], unusable: Vec::new() }
    }

    fn open(&self, source: &str) -> anyhow::Result<Box<dyn FrameSource>> {
        let (picture, mut number) = (self.picture.clone(), 0);
        let frames = std::iter::repeat_with(move || {
            std::thread::sleep(Duration::from_millis(33));
            number += 1;
            Ok(Frame {
                id: FrameId(number),
                captured_at: CaptureTime { nanos: number * 33_000_000 },
                kind: FrameKind::Video,
                name: String::new(),
                image: picture.clone(),
            })
        });
        let identity = SourceIdentity { name: source.into(), image_size: None };
        Ok(Box::new(Recorded::new(identity, frames)))
    }
}

impl Services for WithCamera {
    fn first_wish(&self) -> SessionRequest {
        self.inner.first_wish()
    }

    fn starts_at_once(&self) -> bool {
        // The folder is named only to leave nothing behind.
        false
    }

    fn remembered(&self) -> Memory {
        self.remembered.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn remember(&mut self, memory: &Memory) -> Result<(), UserError> {
        *self.remembered.lock().unwrap_or_else(PoisonError::into_inner) = memory.clone();
        Ok(())
    }

    fn cameras(&mut self, wake: &Wake) -> Vec<CameraView> {
        let Some(scene) = &self.seen else {
            let names = std::iter::once("Webcam").chain(self.second);
            return names.map(|name| camera(&self.source, name)).collect();
        };
        let lookout = self.lookout.get_or_insert_with(|| {
            let still = Still { source: self.source.clone(), picture: scene.clone() };
            Lookout::start(Box::new(still), Arc::clone(wake)).expect("threads")
        });
        lookout.cameras()
    }

    fn count_board(&mut self, source: Option<&str>) {
        if let Some(lookout) = &self.lookout {
            lookout.count_board(source);
        }
    }

    fn stop_looking(&mut self) {
        self.lookout = None;
    }

    fn whole_board(&mut self, image: &image::GrayImage, board: [u16; 2]) -> Option<SeenBoard> {
        assert_eq!(image.dimensions(), (640, 480), "the picture in which another board was seen");
        let code = SeenCode { id: "ZX5N".into(), board, square_m: 0.032 };
        Some(SeenBoard { code: Some(code), ..whole_board(image, board)? })
    }

    fn papers(&self) -> Vec<&'static str> {
        self.inner.papers()
    }

    fn print_board(&mut self, board: BoardChoice, paper: usize) -> Result<PrintedBoard, UserError> {
        self.inner.print_board(board, paper)
    }

    fn open(&mut self, wish: &SessionRequest, wake: Wake) -> Result<Opened, UserError> {
        self.opened.lock().unwrap_or_else(PoisonError::into_inner).push(wish.clone());
        self.inner.open(wish, wake)
    }

    fn open_rig(&mut self, request: &RigRequest) -> Result<RigOpened, UserError> {
        self.inner.open_rig(request)
    }

    fn modes(&mut self, _source: &str) -> Vec<String> {
        Vec::new()
    }

    fn formats(&self, is_rig: bool) -> Vec<&'static str> {
        self.inner.formats(is_rig)
    }

    fn export(&mut self, folder: &Path, format: usize) -> Result<PathBuf, UserError> {
        self.inner.export(folder, format)
    }

    fn older(&self, folder: &Path) -> Vec<PathBuf> {
        self.inner.older(folder)
    }

    fn compare(&mut self, folder: &Path, old: &Path, wake: Wake) -> Result<Comparing, UserError> {
        self.inner.compare(folder, old, wake)
    }

    fn recordings(&self) -> Vec<Recording> {
        self.inner.recordings()
    }

    fn replay(&mut self, folder: &Path, wake: Wake) -> Result<Loading, UserError> {
        self.inner.replay(folder, wake)
    }

    fn dropped(&self, path: &Path) -> Dropped {
        self.inner.dropped(path)
    }

    fn stored(&mut self, folder: &Path, wake: Wake) -> Result<Storing, UserError> {
        self.inner.stored(folder, wake)
    }

    fn correct(
        &mut self,
        folder: &Path,
        command: Command,
        wake: Wake,
    ) -> Result<Storing, UserError> {
        self.inner.correct(folder, command, wake)
    }

    fn delete(&mut self, folder: &Path) -> Result<(), UserError> {
        std::fs::remove_dir_all(folder).expect("a session");
        Ok(())
    }

    fn show(&mut self, file: &Path) -> Result<(), UserError> {
        self.inner.show(file)
    }

    fn interrupted(&self) -> bool {
        self.inner.interrupted()
    }

    fn speak(&mut self, on: bool, _mirrored: bool) -> Result<(), UserError> {
        if on { Err(silent()) } else { Ok(()) }
    }

    fn test_voice(&mut self) -> Result<(), UserError> {
        Err(silent())
    }
}

/// Error of a computer without a speech program.
fn silent() -> UserError {
    UserError { what: NO_VOICE.into(), action: None }
}

/// A small camera, with a 7×5 board in front of it.
const SCENE: &str = r#"
name = "small"
seed = 3
board = [7, 5]
image_size_px = [640, 480]
f_px = 520
pp_px = [322, 238]
distortion = [-0.1, 0.02, 0, 0, 0]
[technician]
person = "tripod"
"#;

fn views(window: &Window) -> usize {
    app(window).screen().snapshot.as_ref().map_or(0, |snapshot| snapshot.views.len())
}

#[test]
fn a_computer_that_cant_speak_says_so_beside_the_button() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("one").display().to_string();
    let services = WithCamera {
        inner: services(&["--out", &out], false).expect("arguments"),
        source: "sim".into(),
        second: None,
        remembered: Arc::default(),
        opened: Arc::default(),
        seen: None,
        lookout: None,
    };
    let mut window = window(|ctx| App::new(ctx, Box::new(services)));
    click(&mut window, Role::Button, "Settings");
    assert!(window.query_by_label(NO_VOICE).is_none());
    click(&mut window, Role::Button, settings::TEST_VOICE);
    assert_eq!(window.query_all_by_label(NO_VOICE).count(), 2, "beside the button, and in the bar");
    assert!(!app(&window).screen().preferences.speech, "it's off");
}

/// Two cameras with the same view are no rig, but their places, sentences and folders are real.
#[test]
fn cameras_chosen_together_are_guided_together_and_the_window_stays() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, SCENE).expect("written");
    let out = folder.path().join("rig");
    let named = out.display().to_string();
    let services = WithCamera {
        inner: services(&["--board", "7x5", "--out", &named], false).expect("arguments"),
        source: format!("sim:{}", scene.display()),
        second: Some("Door camera"),
        remembered: Arc::default(),
        opened: Arc::default(),
        seen: None,
        lookout: None,
    };
    let mut window = window(|ctx| App::new(ctx, Box::new(services)));
    click(&mut window, Role::Button, words::CHANGE);
    window.get_by_role_and_label(Role::CheckBox, words::RIG).scroll_to_me();
    settle(&mut window);
    click(&mut window, Role::CheckBox, words::RIG);
    click(&mut window, Role::Button, words::GO);
    for name in ["Webcam", "Door-camera"] {
        until(&mut window, "the picture of each camera", |window| {
            window.query_by_role_and_label(Role::Image, name).is_some()
        });
    }
    until(&mut window, "a place", |window| window.query_by_label("1 place").is_some());
    click(&mut window, Role::Button, "Finish");
    until(&mut window, "the end", |window| window.query_by_label(rig::CLOSE).is_some());
    for file in
        ["rig.json", "rig-session.json", "Webcam/journal.jsonl", "Door-camera/journal.jsonl"]
    {
        assert!(out.join(file).is_file(), "{file}");
    }
    click(&mut window, Role::Button, rig::CLOSE);
    window.get_by_role_and_label(Role::Button, words::GO);
    // The session is in the list, with its report.
    let listed = within(&[folder.path().to_path_buf()].into());
    let [session] = &listed[..] else { unreachable!("{listed:?}") };
    assert!(session.camera.starts_with("Webcam, Door-camera: "), "{session:?}");
    assert_eq!((session.is_rig, session.report.clone()), (true, Some(out.join("rig.html"))));
}

#[test]
fn a_window_speaks_from_the_beginning_if_it_is_asked_to() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("one").display().to_string();
    let asked = |more: &[&str]| {
        let arguments: Vec<&str> = ["--out", &out].iter().chain(more).copied().collect();
        let memory = services(&arguments, false).expect("arguments").remembered();
        (memory.speech, memory.mirrored)
    };
    assert_eq!(asked(&[]), (None, None));
    assert_eq!(asked(&["--speak"]), (Some(true), None), "as in the window the last time");
    assert_eq!(asked(&["--speak", "facing"]), (Some(true), Some(true)));
    assert_eq!(asked(&["--speak", "behind"]), (Some(true), Some(false)));
}

#[test]
fn a_recorded_stream_stays_when_another_board_is_used() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, SCENE).expect("written");
    let first = folder.path().join("one");
    let opened = Arc::new(Mutex::new(Vec::new()));
    let out = first.display().to_string();
    let services = WithCamera {
        inner: services(&["--record-stream", "--out", &out], false).expect("arguments"),
        source: format!("sim:{}", scene.display()),
        second: None,
        remembered: Arc::default(),
        opened: Arc::clone(&opened),
        seen: None,
        lookout: None,
    };
    let mut window = window(|ctx| App::new(ctx, Box::new(services)));
    until(&mut window, "the camera", |window| {
        window.query_by_role_and_label(Role::Button, "Webcam, 1280 × 720").is_some()
    });
    click(&mut window, Role::Button, words::GO);
    until(&mut window, "another board", |_| {
        opened.lock().unwrap_or_else(PoisonError::into_inner).len() > 1
    });
    assert!(first.join("journal.jsonl").is_file(), "the stream was to be kept");
    let second = app(&window).screen().folder.clone().expect("a folder");
    assert_eq!(second, folder.path().join("one-7x5"), "beside the first");
}

#[test]
fn from_an_empty_home_one_press_leads_to_the_first_view() {
    let began = Instant::now();
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, SCENE).expect("written");
    let board = Board::new(7, 5, 0.025).expect("a board");
    let preview = Scene { board, clutter: 0.0, ..Scene::default_720p(1) };
    let pose = Isometry3::new(Vector3::new(0.0, 0.0, 0.45), Vector3::new(0.3, 0.2, 0.0));
    let opened = Arc::new(Mutex::new(Vec::new()));
    let out = folder.path().join("one").display().to_string();
    let services = WithCamera {
        inner: services(&["--out", &out], true).expect("arguments"),
        source: format!("sim:{}", scene.display()),
        second: None,
        remembered: Arc::default(),
        opened: Arc::clone(&opened),
        seen: Some(render_view(&preview, &pose)),
        lookout: None,
    };
    let mut window = window(|ctx| App::new(ctx, Box::new(services)));
    until(&mut window, "the board", |window| {
        window.query_by_label("8 × 6 squares, 25 mm?").is_some()
    });
    let counted_secs = began.elapsed().as_secs_f64();
    window.key_press(egui::Key::Enter);
    until(&mut window, "a view", |window| views(window) >= 1);
    let boards: Vec<[u16; 2]> = {
        let opened = opened.lock().unwrap_or_else(PoisonError::into_inner);
        opened.iter().map(|wish| wish.board).collect()
    };
    assert_eq!(boards, [[7, 5]], "no other board was tried");
    let secs = began.elapsed().as_secs_f64();
    println!("board counted after {counted_secs:.1} s, first view after {secs:.1} s, one press");
}

#[test]
fn a_newcomer_with_another_board_gets_views_after_one_click() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, SCENE).expect("written");
    let first = folder.path().join("one");
    let remembered = Arc::new(Mutex::new(Memory::default()));
    let opened = Arc::new(Mutex::new(Vec::new()));
    let services = WithCamera {
        inner: services(&["--out", &first.display().to_string()], false).expect("arguments"),
        source: format!("sim:{}", scene.display()),
        second: None,
        remembered: Arc::clone(&remembered),
        opened: Arc::clone(&opened),
        seen: None,
        lookout: None,
    };
    let mut window = window(|ctx| App::new(ctx, Box::new(services)));
    assert_eq!(app(&window).page(), Page::Start, "nothing runs before it's chosen");
    assert!(app(&window).screen().snapshot.is_none());
    until(&mut window, "the camera", |window| {
        window.query_by_role_and_label(Role::Button, "Webcam, 1280 × 720").is_some()
    });
    click(&mut window, Role::Button, words::GO);
    assert_eq!(app(&window).page(), Page::Guide);
    assert!(app(&window).screen().preferences.hint, "a word on how the guide works");
    until(&mut window, "three views", |window| views(window) >= 3);
    assert!(!app(&window).screen().preferences.hint, "it goes with the first view");
    let boards: Vec<[u16; 2]> = {
        let opened = opened.lock().unwrap_or_else(PoisonError::into_inner);
        opened.iter().map(|wish| wish.board).collect()
    };
    assert_eq!(boards, [[9, 6], [7, 5]], "the board in view is used");
    let setup = app(&window).screen().snapshot.as_ref().map(|s| s.setup.board).expect("runs");
    assert_eq!((setup.columns(), setup.rows(), setup.square_m()), (7, 5, 0.032), "by its code");

    // Away and back: the session continues.
    click(&mut window, Role::Button, "Start");
    assert_eq!(app(&window).page(), Page::Start);
    window.get_by_label(words::RUNNING);
    click(&mut window, Role::Button, words::BACK);
    assert_eq!(app(&window).page(), Page::Guide);
    click(&mut window, Role::Button, "Start");
    until(&mut window, "the finish", |window| {
        window.query_all_by_role_and_label(Role::Button, "Finish").count() > 0
    });
    let finish = window.get_all_by_role_and_label(Role::Button, "Finish").next();
    finish.expect("a button").click();
    until(&mut window, "the result", |window| app(window).ended().is_some());
    assert_eq!(app(&window).page(), Page::Result);

    // And again, without another program.
    click(&mut window, Role::Button, "Start");
    until(&mut window, "the board", |window| {
        window.query_by_label("8 × 6 squares, 32 mm").is_some()
    });
    click(&mut window, Role::Button, words::GO);
    until(&mut window, "another session", |window| {
        app(window).page() == Page::Guide && app(window).ended().is_none() && views(window) >= 1
    });
    let memory = remembered.lock().unwrap_or_else(PoisonError::into_inner).clone();
    assert_eq!(memory.board, Some([7, 5]), "remembered");
    assert_eq!(memory.knows_guide, Some(true), "it doesn't come again");
    assert!(first.join("report.html").is_file(), "in the place of the one without a view");
    let third = app(&window).screen().folder.clone().expect("a folder");
    assert_eq!(third, folder.path().join("one-7x5"), "beside the first");
}
