//! The camera's controls in the window.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use boresight::{
    app::{
        BoardFromCode,
        explain::UserError,
        window::{
            recordings::{Dropped, Recording},
            services::{
                Comparing, Ended, Loading, Opened, PrintedBoard, RigOpened, RigRequest, Services,
                SessionRequest, Storing, Wake,
            },
        },
    },
    boards::{BoardChoice, Pattern},
    capture::{FrameSource, v4l2::LiveCamera},
    config::Config,
    device::{Adjustable, CameraEvent, Control},
    frame::ImageSize,
    guidance::Plan,
    pipeline::{Pipeline, Setup},
    recording::{Header, SessionFolder},
    session::{Command, Input, Session},
    simulation::kernel::SimKernel,
    ui::{App, UiAction},
};
use egui::{Theme, accesskit::Role};
use egui_kittest::kittest::Queryable;

use crate::{
    Page, app,
    cameras::{SIZE, grey, open},
    fixtures::moments,
    harness,
};

#[test]
fn a_control_is_set_by_its_number_and_undone() {
    let moments = moments();
    let moment =
        moments.iter().find(|moment| moment.name == "camera with controls").expect("there");
    let mut page = harness(Page::Guide, moment, Theme::Dark, 1.0);
    page.get_by_label("locked at 156");
    let number = page.get_by_role_and_label(Role::SpinButton, "Exposure");
    number.focus();
    page.run();
    page.get_by_role_and_label(Role::SpinButton, "Exposure").type_text("80");
    page.run();
    page.key_press(egui::Key::Enter);
    page.run();
    let asked = UiAction::Adjust { control: Control::Exposure, value: 80 };
    assert_eq!(page.state().asks, [asked]);
    page.state_mut().screen.adjust(Control::Exposure, 80);
    page.run();
    page.get_by_label("setting to 80");
    let mut after = moment.snapshot.clone();
    after.camera.locks.exposure = boresight::device::Lock::Locked { value: 79 };
    page.state_mut().screen.show(after);
    page.run();
    page.get_by_label("locked at 79");
    page.get_by_role_and_label(Role::Button, "reset to 156").scroll_to_me();
    page.run();
    page.get_by_role_and_label(Role::Button, "reset to 156").click();
    page.run();
    let undone = UiAction::Adjust { control: Control::Exposure, value: 156 };
    assert_eq!(page.state().asks.last(), Some(&undone));
}

#[test]
fn a_focus_set_between_views_is_set_back_where_it_is_told() {
    let moments = moments();
    let moment = moments.iter().find(|moment| moment.name == "focus set by hand").expect("there");
    let mut page = harness(Page::Guide, moment, Theme::Dark, 1.0);
    page.get_by_label_contains("The views were taken at 30. Set it back to 30");
    page.get_by_role_and_label(Role::Button, "Set the focus back to 30").click();
    page.run();
    assert_eq!(page.state().asks, [UiAction::Adjust { control: Control::Focus, value: 30 }]);
}

/// The program around a window, with a simulated camera.
struct OneCamera {
    kernel: SimKernel,
    folder: PathBuf,
    opened: Arc<Mutex<u32>>,
}

impl Services for OneCamera {
    fn first_wish(&self) -> SessionRequest {
        SessionRequest {
            source: "/dev/video0".into(),
            mode: "auto".into(),
            board: [9, 6],
            pattern: Pattern::Plain,
            square_m: 0.025,
            board_code: BoardFromCode::Nothing,
            plan: Plan::Quick,
            go_on_with: None,
            first: None,
        }
    }

    fn open_rig(&mut self, _request: &RigRequest) -> Result<RigOpened, UserError> {
        unreachable!("one camera")
    }

    fn open(&mut self, wish: &SessionRequest, wake: Wake) -> Result<Opened, UserError> {
        let mut opened = self.opened.lock().expect("whole");
        *opened += 1;
        let folder = self.folder.join(opened.to_string());
        let config = Config::load(None, &[]).expect("defaults");
        let size = ImageSize { width_px: SIZE.0, height_px: SIZE.1 };
        let header = Header::new(&wish.source, size, config.clone());
        let mut source: LiveCamera<SimKernel> = open(&self.kernel, &wish.source).expect("opens");
        let adjustables: Vec<Adjustable> = source.adjustables();
        let session = Session::new(config.session(size).expect("valid"));
        let setup = Setup {
            folder: Some(SessionFolder::create(&folder, &header).expect("created")),
            ..Setup::new(Box::new(source), session)
        };
        let (pipeline, showing) = Pipeline::start(setup, move || wake()).expect("threads");
        let at = folder.clone();
        let conclude =
            Box::new(|_| Ended { folder: at, files: Vec::new(), compared: None, trouble: None });
        Ok(Opened {
            pipeline,
            showing,
            source: wish.source.clone(),
            folder,
            pictures: Vec::new(),
            adjustables,
            note: None,
            conclude,
        })
    }

    fn papers(&self) -> Vec<&'static str> {
        Vec::new()
    }

    fn print_board(
        &mut self,
        _board: BoardChoice,
        _paper: usize,
    ) -> Result<PrintedBoard, UserError> {
        Err(UserError { what: "no printer".into(), action: None })
    }

    fn modes(&mut self, source: &str) -> Vec<String> {
        let mode = "96x64@30:GREY".to_owned();
        if source == "/dev/video0" { vec![mode] } else { Vec::new() }
    }

    fn formats(&self, _: bool) -> Vec<&'static str> {
        Vec::new()
    }

    fn export(&mut self, _: &Path, _: usize) -> Result<PathBuf, UserError> {
        unreachable!("there is no format")
    }

    fn older(&self, _: &Path) -> Vec<PathBuf> {
        Vec::new()
    }

    fn compare(&mut self, _: &Path, _: &Path, _: Wake) -> Result<Comparing, UserError> {
        unreachable!("there is no result")
    }

    fn recordings(&self) -> Vec<Recording> {
        Vec::new()
    }

    fn replay(&mut self, _: &Path, _: Wake) -> Result<Loading, UserError> {
        unreachable!("there is no recording")
    }

    fn dropped(&self, _: &Path) -> Dropped {
        Dropped::File
    }

    fn stored(&mut self, _: &Path, _: Wake) -> Result<Storing, UserError> {
        unreachable!("there is no session")
    }

    fn correct(&mut self, _: &Path, _: Command, _: Wake) -> Result<Storing, UserError> {
        unreachable!("there is no session")
    }

    fn delete(&mut self, _: &Path) -> Result<(), UserError> {
        unreachable!("there is no session")
    }

    fn show(&mut self, _: &Path) -> Result<(), UserError> {
        unreachable!("there is no file")
    }

    fn interrupted(&self) -> bool {
        false
    }
}

#[test]
fn a_control_is_set_on_the_camera_and_recorded_and_kept_for_the_next_session() {
    let folder = tempfile::tempdir().expect("a folder");
    let kernel = SimKernel::new(vec![grey(0)]);
    let services =
        OneCamera { kernel: kernel.clone(), folder: folder.path().into(), opened: Arc::default() };
    let mut window = app::window(|ctx| App::new(ctx, Box::new(services)));
    let reads = |window: &app::Window, words: &str| window.query_by_label(words).is_some();
    window.key_press(egui::Key::H);
    app::until(&mut window, "the locked exposure", |window| reads(window, "locked at 156"));
    window.get_by_role_and_label(Role::SpinButton, "Exposure").focus();
    window.step();
    window.get_by_role_and_label(Role::SpinButton, "Exposure").type_text("80");
    window.step();
    window.key_press(egui::Key::Enter);
    window.step();
    app::until(&mut window, "what the camera granted", |window| reads(window, "locked at 80"));
    let exposure =
        |kernel: &SimKernel| kernel.world().cameras[0].controls[&crate::cameras::EXPOSURE].value;
    assert_eq!(exposure(&kernel), 80);
    window.get_by_role_and_label(Role::Button, "reset to 156").scroll_to_me();
    app::settle(&mut window);
    window.get_by_role_and_label(Role::Button, "reset to 156").click();
    app::until(&mut window, "the first value", |window| reads(window, "locked at 156"));
    assert_eq!(exposure(&kernel), 156);
    window.get_by_role_and_label(Role::SpinButton, "Exposure").focus();
    window.step();
    window.get_by_role_and_label(Role::SpinButton, "Exposure").type_text("90");
    window.step();
    window.key_press(egui::Key::Enter);
    app::until(&mut window, "the third value", |window| reads(window, "locked at 90"));

    // The next session with the same camera begins with it.
    window.get_by_role_and_label(Role::Button, "Finish").click();
    app::until(&mut window, "the end", |window| app::app(window).ended().is_some());
    let before = [80, 156, 90].map(|value| boresight::device::Lock::Locked { value });
    let lines = SessionFolder::journal(&folder.path().join("1")).expect("whole").lines;
    let set: Vec<_> = lines
        .iter()
        .filter_map(|line| match Input::from(line.expect("readable").input) {
            Input::Camera(CameraEvent::ControlSet { control: Control::Exposure, lock, .. }) => {
                Some(lock)
            }
            _ => None,
        })
        .collect();
    assert_eq!(set, before, "recorded");
    assert_eq!(exposure(&kernel), 156, "put back as it was before the session");
    window.get_by_role_and_label(Role::Button, "New session").click();
    app::until(&mut window, "the second session", |window| reads(window, "locked at 90"));
    // The camera is in use: the start page doesn't open it a second time.
    window.get_by_role_and_label(Role::Button, "Start").click();
    app::settle(&mut window);
    window.get_by_label(boresight::text::start::RUNNING);
}
