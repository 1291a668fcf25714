//! Live previews of every camera of the computer before a capture: thumbnails, cameras plugged and
//! unplugged, and a count of the board in front of a chosen camera.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{Builder, JoinHandle},
    time::{Duration, Instant},
};

use image::{GrayImage, imageops};
use nalgebra::Point2;

use crate::{
    explain::{UserError, user_error},
    session::camera::{self, ChosenCamera, Near, NearCamera, Unusable},
    window::services::{CameraView, OtherKind, SeenBoard, SeenCode, Wake},
};
use boresight_capture::{Arrival, FrameSource};
use boresight_detect::{Detector, DetectorParams, OtherBoard, read_code};
use boresight_geometry::{
    Corner, Homography,
    boards::{Board, MarkerSide, Pattern},
    device::CameraEvent,
    markers::Tags,
};
use boresight_present::text;
use boresight_run::config::Config;

/// Time between two listings of the cameras.
const LISTED_EVERY: Duration = Duration::from_millis(1000);
/// Time between two small pictures.
const SHOWN_EVERY: Duration = Duration::from_millis(100);
/// Time between two counts of a visible board.
const COUNTED_EVERY: Duration = Duration::from_millis(150);
/// Time between two searches for a board; a search costs as much as a count.
const SOUGHT_EVERY: Duration = Duration::from_millis(700);
/// Time until another attempt to open a failing camera.
const TRIED_EVERY: Duration = Duration::from_millis(2000);
/// Longest wait for a picture at the end.
const PATIENCE: Duration = Duration::from_millis(50);
/// Width of a small picture.
const WIDTH_PX: u32 = 960;
/// Consecutive pictures of the same whole board before it's reported.
const SAME_COUNTS: u32 = 5;

/// The cameras of a computer.
pub trait Cameras: Send + Sync {
    /// The connected cameras.
    fn near(&self) -> Near;

    /// Opens the camera `source`.
    ///
    /// # Errors
    ///
    /// If the camera is gone or can't be used.
    fn open(&self, source: &str) -> anyhow::Result<Box<dyn FrameSource>>;
}

/// Cameras of the computer, in the configured mode. Previews change none of their controls.
pub struct Connected(pub Config);

impl Cameras for Connected {
    fn near(&self) -> Near {
        camera::near(&self.0.camera.backend)
    }

    fn open(&self, source: &str) -> anyhow::Result<Box<dyn FrameSource>> {
        ChosenCamera::named(source, &self.0)?.preview()
    }
}

fn trouble(camera: &Unusable) -> UserError {
    let (what, action) = camera.said();
    UserError { what, action: Some(action) }
}

/// Preview threads. Dropping closes all cameras.
pub struct Lookout {
    shared: Arc<Shared>,
    lister: Option<JoinHandle<()>>,
}

struct Shared {
    cameras: Box<dyn Cameras>,
    wake: Wake,
    ends: AtomicBool,
    /// Source of the camera with the counted board.
    counted: Mutex<Option<String>>,
    /// Previewed cameras, by source.
    seen: Mutex<BTreeMap<String, CameraView>>,
}

impl Lookout {
    /// Starts the previews. `wake` is called on news.
    ///
    /// # Errors
    ///
    /// If the system refuses a thread.
    pub fn start(cameras: Box<dyn Cameras>, wake: Wake) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            cameras,
            wake,
            ends: AtomicBool::new(false),
            counted: Mutex::new(None),
            seen: Mutex::new(BTreeMap::new()),
        });
        let lister = Arc::clone(&shared);
        let lister = Builder::new().name("cameras".into()).spawn(move || lister.list())?;
        Ok(Self { shared, lister: Some(lister) })
    }

    /// Cameras connected now.
    pub fn cameras(&self) -> Vec<CameraView> {
        lock(&self.shared.seen).values().cloned().collect()
    }

    /// Counts the board in front of the camera called `source` from now on, or none.
    pub fn count_board(&self, source: Option<&str>) {
        *lock(&self.shared.counted) = source.map(Into::into);
        for view in lock(&self.shared.seen).values_mut() {
            (view.board, view.code, view.rim) = (None, None, None);
        }
    }
}

impl Drop for Lookout {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        if let Some(lister) = self.lister.take() {
            lister.thread().unpark();
            lister.join().ok();
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Preview thread of a camera.
struct Viewer {
    gone: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.gone.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            thread.join().ok();
        }
    }
}

impl Shared {
    fn ends(&self) -> bool {
        self.ends.load(Ordering::Relaxed)
    }

    /// Lists the cameras until the end, and starts a viewer for each.
    fn list(self: Arc<Self>) {
        let mut viewers: BTreeMap<String, Viewer> = BTreeMap::new();
        while !self.ends() {
            let Near { cameras, unusable } = self.cameras.near();
            let is_here = |source: &String| cameras.iter().any(|here| here.source == *source);
            let is_known = |source: &String| {
                is_here(source) || unusable.iter().any(|other| other.source == *source)
            };
            viewers.retain(|source, _| is_here(source));
            {
                let mut seen = lock(&self.seen);
                let before = seen.len();
                seen.retain(|source, _| is_known(source));
                let mut changed = seen.len() != before;
                for NearCamera { source, name, .. } in &cameras {
                    changed |= !seen.contains_key(source);
                    seen.entry(source.clone()).or_insert_with(|| CameraView::new(source, name));
                }
                for other in unusable {
                    let view = CameraView::new(&other.source, &other.source);
                    let view = CameraView { trouble: Some(trouble(&other)), ..view };
                    changed |= seen.get(&other.source) != Some(&view);
                    seen.insert(other.source, view);
                }
                drop(seen);
                if changed {
                    (self.wake)();
                }
            }
            for NearCamera { source, .. } in cameras {
                viewers.entry(source.clone()).or_insert_with(|| {
                    let gone = Arc::new(AtomicBool::new(false));
                    let (shared, flag) = (Arc::clone(&self), Arc::clone(&gone));
                    let look = move || shared.look_through(&source, &flag);
                    // Without a thread the camera stays listed, without a picture.
                    let thread = Builder::new().name("preview".into()).spawn(look).ok();
                    Viewer { gone, thread }
                });
            }
            std::thread::park_timeout(LISTED_EVERY);
        }
        for viewer in viewers.values() {
            viewer.gone.store(true, Ordering::Relaxed);
        }
    }

    /// Previews the camera `source` until it's gone.
    fn look_through(&self, source: &str, gone: &AtomicBool) {
        let is_over = || self.ends() || gone.load(Ordering::Relaxed);
        while !is_over() {
            let trouble = match self.cameras.open(source) {
                Ok(camera) => self.follow(source, camera, &is_over),
                Err(err) => Some(user_error(&err)),
            };
            self.change(source, |view| {
                (view.picture, view.board, view.code, view.rim) = (None, None, None, None);
                view.trouble = trouble;
            });
            if !is_over() {
                std::thread::park_timeout(TRIED_EVERY);
            }
        }
    }

    /// Shows the pictures of an open camera. Returns the reason for a stop, unless asked to stop.
    fn follow(
        &self,
        source: &str,
        mut camera: Box<dyn FrameSource>,
        is_over: &dyn Fn() -> bool,
    ) -> Option<UserError> {
        let mut detector = Detector::new(DetectorParams::default());
        let (mut shown, mut looked): (Option<Instant>, Option<Instant>) = (None, None);
        let mut same = (None, 0);
        let is_due = |last: Option<Instant>, every| last.is_none_or(|at| at.elapsed() >= every);
        while !is_over() {
            let frame = match camera.next_frame(PATIENCE) {
                Ok(Arrival::Frame(frame)) => frame,
                Ok(Arrival::NothingYet) => continue,
                Ok(Arrival::Event(CameraEvent::Lost { fault, .. })) => {
                    let (what, action) = text::camera::fault(fault);
                    return Some(UserError { what: what.into(), action: Some(action.into()) });
                }
                Ok(Arrival::Event(_)) => continue,
                Ok(Arrival::End) => return None,
                Err(err) => return Some(user_error(&err.into())),
            };
            let counts = lock(&self.counted).as_deref() == Some(source);
            let every = if same.0.is_some() { COUNTED_EVERY } else { SOUGHT_EVERY };
            if counts && is_due(looked, every) {
                looked = Some(Instant::now());
                let counted = detector.count(&frame.image);
                let side = |corners: usize| u16::try_from(corners).unwrap_or(u16::MAX);
                let counted = counted.map(|(columns, rows)| [side(columns), side(rows)]);
                let seen = counted.and_then(|board| seen_by(&mut detector, &frame.image, board));
                let board = counted.filter(|_| seen.is_some());
                same = if board == same.0 { (board, same.1 + 1) } else { (board, 1) };
                let other = match counted {
                    Some(_) => None,
                    None => {
                        detector.recognise(&frame.image, None, &|| !is_over()).and_then(other_kind)
                    }
                };
                self.change(source, |view| {
                    view.board = board.filter(|_| same.1 >= SAME_COUNTS);
                    view.rim = seen.as_ref().map(|seen| seen.rim);
                    view.other = other;
                    // A code has a checksum: once is enough. The board stays the same while in
                    // view, though its code may be covered.
                    let code = seen.and_then(|seen| seen.code);
                    if code.is_some() || board != view.code.as_ref().map(|code| code.board) {
                        view.code = code;
                    }
                });
            }
            if is_due(shown, SHOWN_EVERY) {
                shown = Some(Instant::now());
                let (width, height) = frame.image.dimensions();
                let picture = Arc::new(small(&frame.image));
                self.change(source, |view| {
                    view.trouble = None;
                    view.mode = text::start::mode(width, height);
                    view.picture = Some(picture);
                    view.number += 1;
                });
            }
        }
        None
    }

    fn change(&self, source: &str, change: impl FnOnce(&mut CameraView)) {
        if let Some(view) = lock(&self.seen).get_mut(source) {
            change(view);
        }
        (self.wake)();
    }
}

/// Board with markers, tags or circles, as a choice.
fn other_kind(seen: OtherBoard) -> Option<OtherKind> {
    let choice = seen.choice();
    let pattern = match seen {
        OtherBoard::Charuco { dictionary, .. } => {
            Pattern::Charuco { dictionary, side: MarkerSide::Usual }
        }
        OtherBoard::AprilGrid => Pattern::AprilGrid(Tags::default()),
        OtherBoard::Circles { .. } => choice?.pattern,
        OtherBoard::Plain { .. } | OtherBoard::Larger { .. } => return None,
    };
    let board = choice.map(|choice| [choice.columns, choice.rows]);
    Some(OtherKind { said: text::start::detected_other(seen), pattern, board })
}

/// Looks for a board of `board` inner corners in `image`. `None` unless its whole rim is inside.
pub fn whole_board(image: &GrayImage, board: [u16; 2]) -> Option<SeenBoard> {
    seen_by(&mut Detector::new(DetectorParams::default()), image, board)
}

fn seen_by(
    detector: &mut Detector,
    image: &GrayImage,
    [columns, rows]: [u16; 2],
) -> Option<SeenBoard> {
    let board = Board::new(columns, rows, 1.0).ok()?;
    let seen = detector.detect(image, &board).ok()?;
    if !seen.corners.iter().all(Corner::is_seen) {
        return None;
    }
    let points = board.corners_in_board_m();
    let pairs = points.iter().copied().zip(seen.corners.iter().map(|corner| corner.px));
    let image_from_board = Homography::fit_unweighted(pairs).ok()?;
    let half = [columns, rows].map(|corners| 0.5 * f64::from(corners + 1));
    let size = [image.width(), image.height()].map(f64::from);
    let rim = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| {
        let px = image_from_board.map(&Point2::new(x * half[0], y * half[1]))?;
        let share = [(px.x + 0.5) / size[0], (px.y + 0.5) / size[1]];
        let is_inside = share.iter().all(|share| (0.0..=1.0).contains(share));
        is_inside.then_some(share.map(|share| share as f32))
    });
    let [Some(a), Some(b), Some(c), Some(d)] = rim else { return None };
    let code = read_code(image, &board, &seen.corners).and_then(|code| {
        let printed = code.board()?;
        let side = |corners: usize| u16::try_from(corners).unwrap_or(u16::MAX);
        Some(SeenCode {
            id: code.id().to_string(),
            board: [side(printed.columns()), side(printed.rows())],
            // Micrometres, as printed.
            square_m: (printed.square_m() * 1e6).round() / 1e6,
        })
    });
    Some(SeenBoard { rim: [a, b, c, d], code })
}

fn small(image: &GrayImage) -> GrayImage {
    let (width, height) = image.dimensions();
    if width <= WIDTH_PX {
        return image.clone();
    }
    imageops::thumbnail(image, WIDTH_PX, (height * WIDTH_PX / width).max(1))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use boresight_capture::{CaptureError, Recorded, SourceIdentity};
    use boresight_geometry::{
        device::Fault,
        frame::{CaptureTime, Frame, FrameId, FrameKind},
    };
    use boresight_sim::{Scene, render_view};

    /// Cameras plugged in by a test; each delivers the same picture repeatedly, or is in use.
    #[derive(Clone)]
    struct Plugged {
        sources: Arc<Mutex<Vec<String>>>,
        picture: GrayImage,
    }

    impl Cameras for Plugged {
        fn near(&self) -> Near {
            let camera = |source: &String| {
                let (source, name) = (source.clone(), source.clone());
                NearCamera { source, name, is_ordinary: true }
            };
            let cameras = lock(&self.sources).iter().map(camera).collect();
            Near { cameras, unusable: Vec::new() }
        }

        fn open(&self, source: &str) -> anyhow::Result<Box<dyn FrameSource>> {
            if source == "busy" {
                let detail = String::new();
                return Err(CaptureError::Camera { fault: Fault::Busy, detail }.into());
            }
            let (picture, mut number) = (self.picture.clone(), 0);
            let frames = std::iter::repeat_with(move || {
                std::thread::sleep(Duration::from_millis(5));
                number += 1;
                Ok(Frame {
                    id: FrameId(number),
                    captured_at: CaptureTime { nanos: number * 5_000_000 },
                    kind: FrameKind::Video,
                    name: String::new(),
                    image: picture.clone(),
                })
            });
            let identity = SourceIdentity { name: source.into(), image_size: None };
            Ok(Box::new(Recorded::new(identity, frames)))
        }
    }

    fn until(lookout: &Lookout, seen: impl Fn(&[CameraView]) -> bool) -> Vec<CameraView> {
        loop {
            let cameras = lookout.cameras();
            if seen(&cameras) {
                return cameras;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn cameras_come_and_go_and_the_board_is_counted() -> Result<(), Box<dyn std::error::Error>> {
        let board = Board::new(7, 5, 0.025)?;
        let board_id = "ZX5N".parse().ok();
        let scene = Scene { board, board_id, clutter: 0.0, ..Scene::default_720p(1) };
        let pose = Isometry3::new(Vector3::new(0.0, 0.0, 0.45), Vector3::new(0.3, 0.2, 0.0));
        let sources = Arc::new(Mutex::new(Vec::new()));
        let cameras =
            Plugged { sources: Arc::clone(&sources), picture: render_view(&scene, &pose) };
        let lookout = Lookout::start(Box::new(cameras), Arc::new(|| ()))?;
        assert_eq!(lookout.cameras(), []);
        lock(&sources).extend(["one".into(), "busy".into()]);
        let seen = until(&lookout, |cameras| {
            cameras.len() == 2
                && cameras.iter().all(|camera| camera.picture.is_some() || camera.trouble.is_some())
        });
        let [busy, one] = seen.as_slice() else { unreachable!("two") };
        assert_eq!(
            busy.trouble.as_ref().and_then(|t| t.action.as_deref()),
            Some("Close that program.")
        );
        assert_eq!((one.mode.as_str(), one.board), ("1280 × 720", None));
        assert_eq!(one.picture.as_ref().map(|picture| picture.width()), Some(WIDTH_PX));
        lookout.count_board(Some("one"));
        let seen = until(&lookout, |cameras| cameras.iter().any(|camera| camera.board.is_some()));
        assert_eq!(seen[1].board, Some([7, 5]));
        let code = SeenCode { id: "ZX5N".into(), board: [7, 5], square_m: 0.025 };
        assert_eq!(seen[1].code, Some(code));
        lock(&sources).clear();
        until(&lookout, <[CameraView]>::is_empty);
        Ok(())
    }

    #[test]
    fn a_board_of_another_kind_is_named() -> Result<(), Box<dyn std::error::Error>> {
        let charuco = |dictionary| Pattern::Charuco { dictionary, side: MarkerSide::Usual };
        let board = Board::new(8, 6, 0.025)?.with(charuco("DICT_6X6_250".parse()?))?;
        let pose = Isometry3::new(Vector3::new(0.0, 0.0, 0.45), Vector3::new(0.3, 0.2, 0.0));
        let picture = render_view(&Scene { board, ..Scene::default_720p(1) }, &pose);
        let sources = Arc::new(Mutex::new(vec!["one".into()]));
        let lookout = Lookout::start(Box::new(Plugged { sources, picture }), Arc::new(|| ()))?;
        lookout.count_board(Some("one"));
        let seen = until(&lookout, |cameras| cameras.iter().any(|camera| camera.other.is_some()));
        let other = seen[0].other.as_ref().ok_or("another kind")?;
        let family = charuco("DICT_6X6_1000".parse()?);
        assert_eq!((other.pattern, other.board, seen[0].board), (family, None, None));
        Ok(())
    }
}
