use std::{
    sync::{
        Arc, Condvar, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};

use super::{
    background::Background,
    detector_stage::{BoardFinder, detector, observe},
    latest::{LatestReceiver, latest},
    live_feed::{AcceptedPicture, LiveFeed, showing},
    session_stage::{Recorder, fold},
    worker::Worker,
};
use crate::{
    capture::{Arrival, FrameSource},
    detection::Track,
    device::Control,
    frame::{CaptureTime, Frame, FrameId},
    recording::{RecordingError, SessionFolder},
    session::{Command, Input, Observation, Session, Snapshot},
};

/// Longest a source may wait before it looks at the stop flag again.
pub const SOURCE_PATIENCE: Duration = Duration::from_millis(100);
/// Longest look at one frame of a live stream, unless the next one comes later. Far more than any picture
/// needs on an idle machine; on a busy one the next frame is worth more.
const LONGEST_LOOK: Duration = Duration::from_millis(250);
/// Small, so that a slow session holds back the detector and old frames are replaced upstream.
const INBOX_CAPACITY: usize = 4;
/// Wishes for the camera's controls on their way to it.
const WISHES_CAPACITY: usize = 16;
/// Pictures kept while one of them may still be accepted: longer than the longest chain from the
/// detector through the inbox to the session.
const FRAMES_KEPT: usize = INBOX_CAPACITY + 4;

/// What a pipeline is made of.
pub struct Setup {
    /// Where frames come from.
    pub source: Box<dyn FrameSource>,
    /// The state to start from.
    pub session: Session,
    /// Where to record; `None` records nothing.
    pub folder: Option<SessionFolder>,
    /// Whether every frame must be judged before the next is fetched. For sources that wait: files,
    /// recordings, the simulated camera. A live camera does not wait.
    pub lossless: bool,
    /// Whether to store every picture, not only the accepted ones.
    pub record_stream: bool,
    /// Added to the source's frame numbers, so that a resumed session never sees a number twice.
    pub first_frame: u64,
    /// Told of every judged frame: the source's own number and what is shown after it.
    pub judged: Box<dyn FnMut(FrameReport<'_>) + Send>,
}

/// A frame that the session has judged.
#[derive(Clone, Copy, Debug)]
pub struct FrameReport<'a> {
    /// The source's own number of the frame.
    pub source_frame: FrameId,
    /// What the session saw.
    pub observation: &'a Observation,
    /// What is shown now.
    pub snapshot: &'a Snapshot,
}

/// A pipeline failure.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// The operating system refused a thread.
    #[error("could not start the {worker} thread")]
    Spawn {
        /// Thread name.
        worker: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// A thread panicked.
    #[error("the {worker} thread failed")]
    WorkerPanicked {
        /// Thread name.
        worker: &'static str,
    },
    /// The session could not be recorded; what was acknowledged before is safe.
    #[error("the session could not be recorded")]
    Recording(#[from] RecordingError),
}

/// What a session run leaves behind.
#[derive(Debug)]
pub struct Finished {
    /// The state at the end.
    pub session: Session,
    /// Frames that newer ones replaced before the detector was free.
    pub frames_replaced: u64,
}

/// The running threads. Ends them when dropped.
pub struct Pipeline {
    stop: Arc<AtomicBool>,
    inbox: Sender<Input>,
    wishes: Sender<(Control, i64)>,
    replaced: Arc<AtomicU64>,
    workers: Option<Workers>,
}

struct Workers {
    capture: Worker<()>,
    detector: Worker<()>,
    session: Worker<Result<Session, RecordingError>>,
}

impl Pipeline {
    /// Starts the threads. `wake` is called after each new snapshot.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Spawn`].
    pub fn start(
        setup: Setup,
        wake: impl Fn() + Send + 'static,
    ) -> Result<(Self, LatestReceiver<Snapshot>), PipelineError> {
        Self::start_with(setup, detector(), wake, |_| (), |_| ())
    }

    /// Starts the threads and shows a window the newest picture before the detector has looked at it.
    /// `wake` is called after each new picture and snapshot.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Spawn`].
    pub fn start_shown(
        setup: Setup,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<(Self, LiveFeed), PipelineError> {
        Self::start_shown_looking(setup, detector(), wake)
    }

    /// As [`Pipeline::start_shown`], with something else in the detector's place.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Spawn`].
    pub fn start_shown_looking(
        setup: Setup,
        looks: Box<dyn BoardFinder>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<(Self, LiveFeed), PipelineError> {
        let wake = Arc::new(wake);
        let (frames, taken, frames_out, taken_out) = showing();
        let (pipeline, snapshots) = Self::start_with(
            setup,
            looks,
            {
                let wake = Arc::clone(&wake);
                move || wake()
            },
            move |frame| {
                if frames.publish(Arc::clone(frame)).is_ok() {
                    wake();
                }
            },
            // A window that does not read misses thumbnails, nothing else.
            move |view| drop(taken.try_send(view)),
        )?;
        Ok((pipeline, LiveFeed::new(frames_out, snapshots, taken_out)))
    }

    fn start_with(
        setup: Setup,
        mut looks: Box<dyn BoardFinder>,
        wake: impl Fn() + Send + 'static,
        look: impl Fn(&Arc<Frame>) + Send + 'static,
        taken: impl Fn(AcceptedPicture) + Send + 'static,
    ) -> Result<(Self, LatestReceiver<Snapshot>), PipelineError> {
        let Setup { source, session, folder, lossless, record_stream, first_frame, judged } = setup;
        let turnstile = Arc::new(JudgedGate::default());
        let stop = Arc::new(AtomicBool::new(false));
        let replaced = Arc::new(AtomicU64::new(0));
        let (frames_in, frames_out) = latest();
        let (snapshots_in, snapshots_out) = latest();
        let (inbox, inbox_out) = bounded(INBOX_CAPACITY);
        let (wishes, wishes_out) = bounded(WISHES_CAPACITY);
        // Pictures on their way to the recorder: as many as observations can be under way.
        let (pictures, pictures_out) = bounded(FRAMES_KEPT);

        let capture = Worker::spawn("capture", inbox.clone(), {
            let (stop, inbox) = (Arc::clone(&stop), inbox.clone());
            let turnstile = Arc::clone(&turnstile);
            move || {
                let mut published = 0;
                capture(source, &stop, (&inbox, &wishes_out), |frame| {
                    look(&frame);
                    let open = frames_in.publish(frame).is_ok();
                    published += 1;
                    if lossless {
                        turnstile.wait_for(published, &stop);
                    }
                    open
                });
            }
        })?;
        let board = session.setup().board;
        // A source that waits is also one whose results must not depend on the machine's speed.
        let longest_look = (!lossless).then_some(LONGEST_LOOK);
        let detector = Worker::spawn("detector", inbox.clone(), {
            let (inbox, replaced) = (inbox.clone(), Arc::clone(&replaced));
            move || {
                let mut track = Track::default();
                let mut last = None;
                while let Some(frame) = frames_out.recv() {
                    replaced.store(frames_out.replaced(), Ordering::Relaxed);
                    let observation = observe(
                        looks.as_mut(),
                        &mut track,
                        &board,
                        &frame,
                        (first_frame, longest_look.map(|least| least.max(interval(last, &frame)))),
                    );
                    last = Some((frame.id, frame.captured_at));
                    if pictures.send(frame).is_err()
                        || inbox.send(Input::Observed(observation)).is_err()
                    {
                        return;
                    }
                }
            }
        })?;
        let session = Worker::spawn("session", inbox.clone(), move || {
            let recorder = Recorder::new(folder, record_stream, pictures_out);
            fold(session, recorder, &inbox_out, first_frame, judged, |snapshot, new_view| {
                if let Some(view) = new_view {
                    taken(view);
                }
                if snapshot.decision.frame.is_some() {
                    turnstile.count_one();
                }
                if snapshots_in.publish(snapshot).is_ok() {
                    wake();
                }
            })
        })?;
        let workers = Some(Workers { capture, detector, session });
        Ok((Self { stop, inbox, wishes, replaced, workers }, snapshots_out))
    }

    /// Hands a command to the session without waiting; gives it back if the inbox is full.
    ///
    /// # Errors
    ///
    /// The command, if it could not be handed over.
    pub fn try_command(&self, command: Command) -> Result<(), Command> {
        self.inbox.try_send(Input::Command(command)).map_err(|err| match err {
            TrySendError::Full(Input::Command(command))
            | TrySendError::Disconnected(Input::Command(command)) => command,
            _ => command,
        })
    }

    /// Asks the source for a value of one of the camera's controls, before its next frame. Does nothing if
    /// too many wishes are under way; what came of it is in the camera's state.
    pub fn adjust(&self, control: Control, value: i64) {
        self.wishes.try_send((control, value)).ok();
    }

    /// Frames that newer ones replaced before the detector was free, so far.
    pub fn frames_replaced(&self) -> u64 {
        self.replaced.load(Ordering::Relaxed)
    }

    /// Ends the threads as [`Self::stop`] does, without waiting: `then` makes of the outcome what the
    /// window shows, on a thread of its own.
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

    /// Ends the threads in the order the data flows and returns what the session holds.
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
        // the views they have.
        capture.join().ok();
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
        // Whoever wants the outcome calls `stop`.
        self.end();
    }
}

fn capture(
    mut source: Box<dyn FrameSource>,
    stop: &AtomicBool,
    (inbox, wishes): (&Sender<Input>, &Receiver<(Control, i64)>),
    mut publish: impl FnMut(Arc<Frame>) -> bool,
) {
    while !stop.load(Ordering::Relaxed) {
        for (control, value) in wishes.try_iter() {
            source.adjust(control, value);
        }
        match source.next_frame(SOURCE_PATIENCE) {
            Ok(Arrival::Frame(frame)) => {
                if !publish(frame) {
                    return;
                }
            }
            Ok(Arrival::Event(event)) => {
                if inbox.send(Input::Camera(event)).is_err() {
                    return;
                }
            }
            Ok(Arrival::NothingYet) => {}
            Ok(Arrival::End) => {
                // The slot closes as this thread ends, and the detector after it; the session hears
                // of the end when the last frame is through, from whoever watches the snapshots.
                inbox.send(Input::SourceEnded).ok();
                return;
            }
            Err(err) => {
                let reason = with_causes(&err);
                inbox.send(Input::WorkerFailed { worker: "capture".into(), reason }).ok();
                return;
            }
        }
    }
}

/// Time from picture to picture of a stream, from the one before `frame`; zero before there is one.
fn interval(last: Option<(FrameId, CaptureTime)>, frame: &Frame) -> Duration {
    let Some((id, time)) = last else { return Duration::ZERO };
    let frames = frame.id.0.saturating_sub(id.0).max(1);
    Duration::from_nanos(frame.captured_at.nanos.saturating_sub(time.nanos) / frames)
}

fn with_causes(err: &dyn std::error::Error) -> String {
    let mut text = err.to_string();
    let mut cause = err.source();
    while let Some(err) = cause {
        text = format!("{text}: {err}");
        cause = err.source();
    }
    text
}

/// Counts judged frames, for sources that wait for them.
#[derive(Debug, Default)]
struct JudgedGate {
    judged: Mutex<u64>,
    changed: Condvar,
}

impl JudgedGate {
    fn count_one(&self) {
        *self.judged.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        self.changed.notify_all();
    }

    /// Waits until `count` frames are judged, or the pipeline stops.
    fn wait_for(&self, count: u64, stop: &AtomicBool) {
        let mut judged = self.judged.lock().unwrap_or_else(PoisonError::into_inner);
        while *judged < count && !stop.load(Ordering::Relaxed) {
            judged = self
                .changed
                .wait_timeout(judged, SOURCE_PATIENCE)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }
}
