//! A session from its first frame to its stored result.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use super::{
    Exit,
    camera_words::CameraWords,
    compare,
    conclusion::{Conclusion, conclude},
    print, say, session_report, truth,
};
use crate::{
    capture::FrameSource,
    guidance::{Progress, Refusal},
    pipeline::{Finished, FrameReport, Pipeline, PipelineError, SOURCE_PATIENCE, Setup},
    recording::{
        SessionFolder,
        save::{Overwrite, save},
    },
    session::{Input, Outcome, Session, Snapshot},
    simulation::TruthLog,
    text,
    ui::desk::Compared,
};

/// What the result is called in the session's folder.
pub(super) const RESULT_FILE: &str = "calibration.json";

/// Called with every frame's result; the simulated technician listens here.
pub(super) type Listener = Box<dyn FnMut(FrameReport<'_>) + Send>;

/// A session that can be run.
pub(super) struct Run {
    pub(super) folder: SessionFolder,
    pub(super) session: Session,
    pub(super) source: Box<dyn FrameSource>,
    pub(super) judged: Listener,
    pub(super) truth: Option<TruthLog>,
    pub(super) record_stream: bool,
    pub(super) first_frame: u64,
    pub(super) resumed: bool,
}

/// A session that has run.
pub(super) struct FinishedRun {
    /// As it ended.
    pub(super) session: Session,
    /// Its folder.
    pub(super) path: PathBuf,
    truth: Option<TruthLog>,
    first_frame: u64,
}

impl Run {
    /// Runs until the plan is complete, the source ends, or Ctrl-C; then tells the result.
    pub(super) fn finish(self, json: bool) -> anyhow::Result<Exit> {
        Ok(self.carry_out()?.conclude(json)?.0)
    }

    /// Runs until the plan is complete, the source ends, or Ctrl-C.
    pub(super) fn carry_out(self) -> anyhow::Result<FinishedRun> {
        let stop = stop_flag()?;
        let (setup, rest) = self.setup()?;
        let (pipeline, snapshots) = Pipeline::start(setup, || ())?;
        // Ends when the session thread does, too: a full disk closes the link.
        let mut camera_words = CameraWords::default();
        // A camera that is lost sends no snapshots; Ctrl-C must be heard nevertheless.
        while let Ok(snapshot) = snapshots.recv_within(SOURCE_PATIENCE) {
            let ended = snapshot.as_ref().is_some_and(ended);
            if let Some(snapshot) = snapshot {
                camera_words.tell(&snapshot.camera);
            }
            if stop.load(Ordering::Relaxed) || ended {
                break;
            }
        }
        rest.ran(pipeline.stop())
    }

    /// What the threads are started with, and what is needed once they have ended.
    pub(super) fn setup(self) -> anyhow::Result<(Setup, RunContext)> {
        let path = self.folder.path().to_path_buf();
        say(&format!("Session: {}", path.display()));
        let Self {
            mut folder,
            mut session,
            source,
            judged,
            truth,
            record_stream,
            first_frame,
            resumed,
        } = self;
        if resumed {
            let decision = session.handle(&Input::Resumed);
            folder.journal_mut().append(&Input::Resumed, &decision, None, true)?;
        }
        let lossless = source.waits();
        let setup = Setup {
            source,
            session,
            folder: Some(folder),
            lossless,
            record_stream,
            first_frame,
            judged: Box::new(told(judged)),
        };
        Ok((setup, RunContext { path, truth, first_frame }))
    }
}

/// A flag that Ctrl-C and a polite kill set.
pub(super) fn stop_flag() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    Ok(stop)
}

/// What is needed once the threads have ended.
pub(super) struct RunContext {
    pub(super) path: PathBuf,
    truth: Option<TruthLog>,
    first_frame: u64,
}

impl RunContext {
    /// The session that has run.
    pub(super) fn ran(
        self,
        finished: Result<Finished, PipelineError>,
    ) -> anyhow::Result<FinishedRun> {
        let Self { path, truth, first_frame } = self;
        Ok(FinishedRun { session: finished?.session, path, truth, first_frame })
    }
}

impl FinishedRun {
    /// Tells the result and writes it into the session's folder. Returns what a comparison found, too, if one
    /// was asked for: that it fails is no failure of the session.
    pub(super) fn conclude(
        self,
        json: bool,
    ) -> anyhow::Result<(Exit, Option<anyhow::Result<Compared>>)> {
        let Self { session, path, truth, first_frame } = self;
        let header = SessionFolder::header(&path)?;
        let Conclusion { exit, report } = conclude(&session, &header);
        if !session.failures().is_empty() {
            say(&format!(
                "Every view that was shown as taken is safe; go on with: boresight guide --session {}",
                path.display()
            ));
        }
        if let Some(log) = truth {
            let truth = log.snapshot();
            if let Some(calibration) = session.calibration() {
                truth::tell(&truth, calibration);
            }
            truth::write(&path, &truth, first_frame)?;
        }
        let file = path.join(RESULT_FILE);
        // The session's own result; it follows from the journal and may be replaced.
        save(&file, serde_json::to_string_pretty(&report)?.as_bytes(), Overwrite::Allowed)?;
        say(&format!("Result: {}", file.display()));
        let compared = header.against.as_deref().map(|against| {
            let against = Path::new(against);
            let (compared, found) = compare::of_session(&path, &session, &header.source, against)?;
            say(&text::compared_with(against));
            compare::tell(&found, &compared.action);
            Ok(compared)
        });
        if let Some(Err(err)) = &compared {
            say(&format!("{} ({err:#})", text::NOT_COMPARED));
        }
        session_report::write_and_tell(&path, &session);
        if json {
            print(&report.to_string())?;
        }
        Ok((exit, compared))
    }
}

/// Prints each change of advice and every view taken, then passes the frame on.
fn told(mut judged: Listener) -> impl FnMut(FrameReport<'_>) + Send {
    let mut last = String::new();
    move |frame| {
        let snapshot = frame.snapshot;
        if let Some(outcome) = text::outcome(&snapshot.decision.outcome, snapshot) {
            say(&outcome);
        }
        // Nothing that the person does with the board would change this.
        if let Outcome::Refused { refusal: refusal @ Refusal::OtherSize { .. } } =
            &snapshot.decision.outcome
        {
            say(&format!("  Left out: {}", text::refusal(refusal)));
        }
        let advice = text::advice(&snapshot.decision.advice, frame.observation.seen.as_ref().err());
        // The same advice with another number is not news on a terminal.
        let gist: String = advice.chars().filter(|c| !c.is_ascii_digit()).collect();
        if gist != last {
            say(&format!("  {advice}"));
            last = gist;
        }
        judged(frame);
    }
}

fn ended(snapshot: &Snapshot) -> bool {
    snapshot.decision.progress != Progress::Collecting
        || snapshot.source_ended
        || !snapshot.failures.is_empty()
}
