//! Duration of the window's work: pictures of 1920×1080 at 30 fps, the detector running, in a real
//! window.
//!
//! `cargo bench --bench window` needs a display (Xvfb will do). Prints the time between two
//! paintings, the times from a picture's arrival to the snapshot with its sentence and to its
//! painting, and the growth of the program's memory. `BORESIGHT_SECS` sets the duration; with
//! `BORESIGHT_HIDDEN` the window is hidden once warm, and the program continues behind it.

#![expect(clippy::expect_used, reason = "a benchmark that cannot go on has failed")]

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
    time::{Duration, Instant},
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
    capture::{Arrival, CaptureError, FrameSource, SourceIdentity},
    config::Config,
    frame::{CaptureTime, Frame, FrameId, ImageSize},
    geometry::Camera,
    guidance::Plan,
    pipeline::{FrameReport, Pipeline, Setup},
    session::{Command, Session},
    simulation::{NoCues, Scene, SyntheticSource},
    ui::{App, options},
};
use eframe::egui;
use nalgebra::{Point2, Vector2};

const SIZE: ImageSize = ImageSize { width_px: 1920, height_px: 1080 };
const INTERVAL: Duration = Duration::from_nanos(33_333_333);
/// Pictures drawn before the clock starts; played again and again.
const PICTURES: u64 = 45;

/// Arrival of each picture, and time until the snapshot.
#[derive(Default)]
struct Times {
    came: BTreeMap<u64, Instant>,
    to_snapshot: Vec<Duration>,
}

/// Plays drawn pictures like a live camera.
struct Camera30 {
    pictures: Vec<Arc<Frame>>,
    next: u64,
    started: Option<Instant>,
    times: Arc<Mutex<Times>>,
}

impl FrameSource for Camera30 {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: "1920x1080 at 30 fps".into(), image_size: Some(SIZE) }
    }

    fn waits(&self) -> bool {
        false
    }

    fn next_frame(&mut self, _patience: Duration) -> Result<Arrival, CaptureError> {
        let started = *self.started.get_or_insert_with(Instant::now);
        let due = started + INTERVAL * u32::try_from(self.next).expect("a short run");
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        // There and back, to avoid a jump of the board.
        let swing = self.next % (2 * PICTURES - 2);
        let index = swing.min(2 * PICTURES - 2 - swing);
        let image = self.pictures[index as usize].image.clone();
        let template = &self.pictures[0];
        let captured_at = CaptureTime { nanos: (INTERVAL.as_nanos() as u64) * (self.next + 1) };
        let (kind, name) = (template.kind, String::new());
        let frame = Frame { id: FrameId(self.next), captured_at, kind, name, image };
        self.times.lock().expect("whole").came.insert(self.next, Instant::now());
        self.next += 1;
        Ok(Arrival::Frame(Arc::new(frame)))
    }
}

fn pictures() -> Vec<Arc<Frame>> {
    let mut scene = Scene::default_720p(1);
    scene.image_size = SIZE;
    scene.camera = Camera {
        f_px: Vector2::new(1470.0, 1470.0),
        pp_px: Point2::new(980.0, 522.0),
        ..scene.camera
    };
    let mut source = SyntheticSource::new(scene, Box::new(NoCues), Some(PICTURES), 0);
    (0..PICTURES)
        .map(|_| match source.next_frame(Duration::from_secs(1)).expect("drawn") {
            Arrival::Frame(frame) => frame,
            other => unreachable!("{other:?}"),
        })
        .collect()
}

struct Bench {
    pictures: Vec<Arc<Frame>>,
    times: Arc<Mutex<Times>>,
}

impl Services for Bench {
    fn first_wish(&self) -> SessionRequest {
        SessionRequest {
            source: String::new(),
            mode: "auto".into(),
            board: [9, 6],
            pattern: Pattern::Plain,
            square_m: 0.025,
            board_code: BoardFromCode::Nothing,
            plan: Plan::Adaptive,
            go_on_with: None,
            first: None,
        }
    }

    fn open_rig(&mut self, _request: &RigRequest) -> Result<RigOpened, UserError> {
        unreachable!("one camera")
    }

    fn open(&mut self, _wish: &SessionRequest, wake: Wake) -> Result<Opened, UserError> {
        let config = Config::load(None, &[]).expect("valid");
        let (pictures, times) = (self.pictures.clone(), Arc::clone(&self.times));
        let source = Camera30 { pictures, next: 0, started: None, times: Arc::clone(&times) };
        let session = Session::new(config.session(SIZE).expect("valid"));
        let setup = Setup {
            lossless: false,
            on_frame: Box::new(move |judged: FrameReport<'_>| {
                let mut times = times.lock().expect("whole");
                if let Some(came) = times.came.get(&judged.observation.frame_id.0) {
                    let took = came.elapsed();
                    times.to_snapshot.push(took);
                }
            }),
            ..Setup::new(Box::new(source), session)
        };
        let (pipeline, showing) = Pipeline::start(setup, move || wake()).expect("threads");
        let conclude = Box::new(|_| Ended {
            folder: PathBuf::new(),
            files: Vec::new(),
            compared: None,
            trouble: None,
        });
        Ok(Opened {
            pipeline,
            showing,
            source: "bench".into(),
            folder: PathBuf::new(),
            pictures: Vec::new(),
            adjustables: Vec::new(),
            note: None,
            conclude,
        })
    }

    fn papers(&self) -> Vec<&'static str> {
        Vec::new()
    }

    fn print_board(&mut self, _: BoardChoice, _: usize) -> Result<PrintedBoard, UserError> {
        unreachable!("there is no paper")
    }

    fn formats(&self, _: bool) -> Vec<&'static str> {
        Vec::new()
    }

    fn export(&mut self, _folder: &Path, _format: usize) -> Result<PathBuf, UserError> {
        Err(UserError { what: "nothing to export".into(), action: None })
    }

    fn older(&self, _folder: &Path) -> Vec<PathBuf> {
        Vec::new()
    }

    fn compare(&mut self, _: &Path, _: &Path, _: Wake) -> Result<Comparing, UserError> {
        Err(UserError { what: "nothing to compare".into(), action: None })
    }

    fn recordings(&self) -> Vec<Recording> {
        Vec::new()
    }

    fn replay(&mut self, _: &Path, _: Wake) -> Result<Loading, UserError> {
        Err(UserError { what: "nothing to replay".into(), action: None })
    }

    fn modes(&mut self, _source: &str) -> Vec<String> {
        Vec::new()
    }

    fn dropped(&self, _: &Path) -> Dropped {
        Dropped::File
    }

    fn stored(&mut self, _: &Path, _: Wake) -> Result<Storing, UserError> {
        unreachable!("no session is opened")
    }

    fn correct(&mut self, _: &Path, _: Command, _: Wake) -> Result<Storing, UserError> {
        unreachable!("no session is opened")
    }

    fn delete(&mut self, _: &Path) -> Result<(), UserError> {
        unreachable!("no session is deleted")
    }

    fn show(&mut self, _file: &Path) -> Result<(), UserError> {
        Ok(())
    }

    fn interrupted(&self) -> bool {
        false
    }
}

/// The window with a stopwatch.
struct Watched {
    app: App,
    started: Instant,
    last: Option<Instant>,
    shown: Option<u64>,
    between: Vec<Duration>,
    inside: Vec<Duration>,
    to_paint: Vec<Duration>,
    kib: Vec<u64>,
    times: Arc<Mutex<Times>>,
    length: Duration,
    hidden: bool,
}

/// The first seconds are spent on fonts, shaders and caches.
const WARM: Duration = Duration::from_secs(3);

impl eframe::App for Watched {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.app.look(ctx);
        if self.started.elapsed() > self.length {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        }
        if self.hidden && self.started.elapsed() > WARM {
            self.hidden = false;
            ctx.send_viewport_cmd(egui::ViewportCommand::Visible(false));
        }
        let secs = self.started.elapsed().as_secs();
        while (self.kib.len() as u64) < secs {
            self.kib.push(resident_kib());
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let now = Instant::now();
        let is_warm = self.started.elapsed() > WARM;
        if let Some(last) = self.last.replace(now).filter(|_| is_warm) {
            self.between.push(now - last);
        }
        let live = self.app.screen().snapshot.as_ref().and_then(|s| s.live.as_ref());
        let newest = live.map(|live| live.frame_id.0);
        self.app.paint(ui);
        if is_warm {
            self.inside.push(now.elapsed());
        }
        if newest != self.shown {
            self.shown = newest;
            let times = self.times.lock().expect("whole");
            let came = newest.and_then(|frame| times.came.get(&frame));
            self.to_paint.extend(came.filter(|_| is_warm).map(Instant::elapsed));
        }
        // As often as it can.
        ui.ctx().request_repaint();
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        self.app.clear_color(visuals)
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.app.close();
        let told = |what: &str, times: &mut Vec<Duration>| {
            times.sort_unstable();
            let at = |share: f64| {
                let index = ((times.len() - 1) as f64 * share) as usize;
                times[index].as_secs_f64() * 1e3
            };
            println!(
                "{what:44} p50 {:6.1} ms  p95 {:6.1} ms  max {:6.1} ms  ({} times)",
                at(0.5),
                at(0.95),
                at(1.0),
                times.len()
            );
        };
        told("from painting to painting", &mut self.between);
        told("of that, laying out the page", &mut self.inside);
        let mut times = self.times.lock().expect("whole");
        told("picture to snapshot with its sentence", &mut times.to_snapshot);
        told("picture to page with its sentence", &mut self.to_paint);
        println!("pictures that came {}, looked at {}", times.came.len(), times.to_snapshot.len());
        if let (Some(early), Some(late)) = (self.kib.get(9), self.kib.last()) {
            let grown = *late as f64 - *early as f64;
            println!(
                "memory after 10 s {early} KiB, at the end {late} KiB: {:+.1} MiB",
                grown / 1024.0
            );
        }
    }
}

/// Resident memory of the program; 0 if unknown.
fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().split(' ').next()?.parse().ok()).unwrap_or(0)
}

fn main() {
    let secs =
        std::env::var("BORESIGHT_SECS").ok().and_then(|secs| secs.parse().ok()).unwrap_or(20);
    let times = Arc::new(Mutex::new(Times::default()));
    let bench = Bench { pictures: pictures(), times: Arc::clone(&times) };
    let mut options = options();
    options.glow_options.vsync = false;
    let outcome = eframe::run_native(
        "boresight",
        options,
        Box::new(move |creation| {
            Ok(Box::new(Watched {
                app: App::new(&creation.egui_ctx, Box::new(bench)),
                started: Instant::now(),
                last: None,
                shown: None,
                between: Vec::new(),
                inside: Vec::new(),
                to_paint: Vec::new(),
                kib: Vec::new(),
                times,
                length: Duration::from_secs(secs),
                hidden: std::env::var_os("BORESIGHT_HIDDEN").is_some(),
            }))
        }),
    );
    if let Err(err) = outcome {
        println!("no window to measure: {err}");
    }
}
