//! Starts the threads, and ends them in the order of the data flow.

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicU64, Ordering},
};

use crossbeam_channel::{Sender, TrySendError, bounded};

use super::{
    background::Background,
    capture_stage::capture,
    detector_stage::{BoardFinder, DetectorStage, default_finder},
    error::PipelineError,
    judged_gate::JudgedGate,
    latest::latest,
    live_feed::{FeedSenders, LiveFeed, feed_links},
    onlooker::{CommandLink, Onlookers},
    rest::Rest,
    session_stage::{OnFrame, Recorder, run_session},
    worker::Worker,
};
use crate::recording::{RecordingError, SessionFolder};
use boresight_capture::FrameSource;
use boresight_geometry::device::Control;
use boresight_guide::session::{Command, Input, Session};

/// Capacity of the session's inbox: small, so a slow session holds back the detector and old frames
/// are replaced upstream.
const INBOX_CAPACITY: usize = 4;
/// Most pending requests for the camera's controls.
const CONTROL_REQUESTS_CAPACITY: usize = 16;
/// Number of pictures kept while still acceptable: longer than the longest chain from the detector
/// through the inbox to the session.
const FRAMES_KEPT: usize = INBOX_CAPACITY + 4;

/// Parts of a pipeline.
pub struct Setup {
    /// Source of the frames. Frame numbers continue a resumed session's: see
    /// [`boresight_capture::renumbered`].
    pub source: Box<dyn FrameSource>,
    /// Initial state.
    pub session: Session,
    /// Folder of the recording; `None` records nothing.
    pub folder: Option<SessionFolder>,
    /// True if every frame must be judged before the next is fetched. For sources able to wait:
    /// files, recordings, the simulated camera. A live camera doesn't wait.
    pub lossless: bool,
    /// True if every picture is stored, not only the accepted views'.
    pub record_stream: bool,
    /// Called with every judged frame, on the session thread.
    pub on_frame: OnFrame,
    /// Onlookers, who may also command the session.
    pub onlookers: Onlookers,
    /// Search for the board.
    pub finder: Box<dyn BoardFinder>,
}

impl Setup {
    /// Parts of a session that records nothing and is watched by nobody.
    pub fn new(source: Box<dyn FrameSource>, session: Session) -> Self {
        Self {
            lossless: source.waits(),
            source,
            session,
            folder: None,
            record_stream: false,
            on_frame: Box::new(|_| ()),
            onlookers: Onlookers::new(),
            finder: default_finder(),
        }
    }
}

/// Result of a session run.
#[derive(Debug)]
pub struct Finished {
    /// State at the end.
    pub session: Session,
    /// Number of frames replaced before the detector was free.
    pub frames_replaced: u64,
}

/// The running threads. Ended on drop.
pub struct Pipeline {
    stop: Arc<AtomicBool>,
    inbox: Sender<Input>,
    control_requests: Sender<(Control, i64)>,
    replaced: Arc<AtomicU64>,
    rest: Arc<Rest>,
    workers: Option<Workers>,
}

struct Workers {
    capture: Worker<()>,
    detector: Worker<()>,
    session: Worker<Result<Session, RecordingError>>,
}

impl Pipeline {
    /// Starts the threads. `wake` is called after each new frame and snapshot in the feed.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Spawn`].
    pub fn start(
        setup: Setup,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<(Self, LiveFeed), PipelineError> {
        let Setup { source, session, folder, lossless, record_stream, on_frame, onlookers, finder } =
            setup;
        let wake = Arc::new(wake);
        let (FeedSenders { frames, snapshots, accepted }, feed) = feed_links();
        let gate = Arc::new(JudgedGate::default());
        let rest = Arc::new(Rest::default());
        let stop = Arc::new(AtomicBool::new(false));
        let replaced = Arc::new(AtomicU64::new(0));
        let (frames_in, frames_out) = latest();
        let (inbox, inbox_out) = bounded(INBOX_CAPACITY);
        let (control_requests, control_requests_out) = bounded(CONTROL_REQUESTS_CAPACITY);
        // Pictures on their way to the recorder: as many as there can be observations on their way.
        let (pictures, pictures_out) = bounded(FRAMES_KEPT);
        for onlooker in &onlookers {
            onlooker.began(CommandLink::new(inbox.clone()));
        }

        let capture = Worker::spawn("capture", inbox.clone(), {
            let (stop, inbox, gate) = (Arc::clone(&stop), inbox.clone(), Arc::clone(&gate));
            let (onlookers, wake) = (onlookers.clone(), Arc::clone(&wake));
            move || {
                let mut published = 0;
                capture(source, &stop, &inbox, &control_requests_out, |frame| {
                    // Shown before the search.
                    if frames.publish(Arc::clone(&frame)).is_ok() {
                        wake();
                    }
                    for onlooker in &onlookers {
                        onlooker.captured(&frame);
                    }
                    let open = frames_in.publish(frame).is_ok();
                    published += 1;
                    if lossless {
                        gate.wait_for(published, &stop);
                    }
                    open
                });
            }
        })?;
        let board = session.setup().board;
        let stage = DetectorStage {
            finder,
            board,
            unhurried: lossless,
            pictures,
            inbox: inbox.clone(),
            rest: Arc::clone(&rest),
            saw_nothing: false,
        };
        let detector = Worker::spawn("detector", inbox.clone(), {
            let replaced = Arc::clone(&replaced);
            move || {
                stage.run(&frames_out, |frames| {
                    replaced.store(frames.replaced(), Ordering::Relaxed);
                });
            }
        })?;
        let rests = Arc::clone(&rest);
        let session = Worker::spawn("session", inbox.clone(), move || {
            let recorder = Recorder::new(folder, record_stream, pictures_out);
            run_session(session, recorder, &inbox_out, on_frame, |snapshot, picture| {
                if let Some(picture) = picture {
                    // A window that doesn't read misses thumbnails, nothing else.
                    accepted.try_send(picture).ok();
                }
                for onlooker in &onlookers {
                    onlooker.decided(&snapshot);
                }
                if snapshot.decision.frame.is_some() {
                    gate.count_one();
                }
                // The end of a session ends a pause: the last frames are still searched.
                let is_over = snapshot.source_ended || !snapshot.failures.is_empty();
                rests.set(snapshot.paused && !is_over);
                if snapshots.publish(snapshot).is_ok() {
                    wake();
                }
            })
        })?;
        let workers = Some(Workers { capture, detector, session });
        Ok((Self { stop, inbox, control_requests, replaced, rest, workers }, feed))
    }

    /// Hands a command to the session without waiting.
    ///
    /// # Errors
    ///
    /// The command, if the inbox is full or the session has ended.
    pub fn try_command(&self, command: Command) -> Result<(), Command> {
        self.try_give(Input::Command(command)).map_err(|_| command)
    }

    /// Hands an input of a rig to the session without waiting.
    ///
    /// # Errors
    ///
    /// The input, if the inbox is full or the session has ended.
    pub fn try_give(&self, input: Input) -> Result<(), Input> {
        self.inbox.try_send(input).map_err(TrySendError::into_inner)
    }

    /// Asks the source to set a camera control before the next frame. Ignored if 16 requests are
    /// pending; the result appears in [`boresight_guide::session::CameraState`].
    pub fn adjust(&self, control: Control, value: i64) {
        self.control_requests.try_send((control, value)).ok();
    }

    /// Number of frames replaced before the detector was free.
    pub fn frames_replaced(&self) -> u64 {
        self.replaced.load(Ordering::Relaxed)
    }

    /// Ends the threads like [`Self::stop`], without waiting: `then` turns the outcome, on a
    /// background thread, into a value for the window.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Spawn`]; the threads have ended then, too.
    pub fn stop_then<T: Send + 'static>(
        self,
        then: impl FnOnce(Result<Finished, PipelineError>) -> T + Send + 'static,
    ) -> Result<Background<T>, PipelineError> {
        Background::start(move || then(self.stop()))
    }

    /// Ends the threads in the order of the data flow, and returns the session's contents.
    ///
    /// # Errors
    ///
    /// [`PipelineError`] if the session could not be recorded or its thread panicked.
    pub fn stop(mut self) -> Result<Finished, PipelineError> {
        // `workers` is `None` only in `drop`, after this.
        self.end().unwrap_or(Err(PipelineError::WorkerPanicked { worker: "pipeline" }))
    }

    fn end(&mut self) -> Option<Result<Finished, PipelineError>> {
        let Workers { capture, detector, session } = self.workers.take()?;
        self.stop.store(true, Ordering::Relaxed);
        // A panic upstream is already in the session as `WorkerFailed`; it must not cost the person
        // the accepted views.
        capture.join().ok();
        self.rest.set(false);
        detector.join().ok();
        // Both senders upstream are gone, so every observation is already in the inbox.
        self.inbox.send(Input::Stop).ok();
        Some(session.join().and_then(|session| {
            let frames_replaced = self.replaced.load(Ordering::Relaxed);
            Ok(Finished { session: session?, frames_replaced })
        }))
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // The outcome is only available from `stop`.
        self.end();
    }
}
