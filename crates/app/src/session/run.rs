//! A session from the first frame to the stored result.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::Context;
use image::GrayImage;

use crate::{
    Announcer, Exit, SavedSession,
    session::{
        comparison::{self, Compared},
        result::{Conclusion, conclude, save_result},
        scene,
        source::OpenSource,
        truth,
    },
};
use boresight_calibrate::Calibration;
use boresight_capture::renumbered;
use boresight_detect::Miss;
use boresight_formats::CalibrationFile;
use boresight_guide::{
    guidance::Refusal,
    session::{Command, Input, Outcome, Prompt, Session, Snapshot, ViewNumber},
};
use boresight_present::{instruction::Instruction, text};
use boresight_run::{
    pipeline::{Finished, FrameReport, OnFrame, Onlooker, Paced, PipelineError, Setup},
    recording::{Header, SessionFolder, Stored, stored_frame},
};
use boresight_sim::TruthLog;

/// A session ready to run.
pub struct Run {
    /// Folder of the session, locked.
    pub folder: SessionFolder,
    /// State of the session: empty, or as recorded.
    pub session: Session,
    /// Source of the frames.
    pub open: OpenSource,
    /// True to store every picture, not only of accepted views.
    pub record_stream: bool,
    /// First frame number unused by the journal.
    pub first_frame: u64,
    /// Stored pictures of a resumed session.
    pub stored: Vec<Stored>,
    /// True if the session was resumed.
    pub resumed: bool,
    /// Command before the first frame.
    pub first: Option<Command>,
    /// ID of the board, from a printed code or the settings; empty without one.
    pub board_id: String,
    /// Notice at the start, e.g. about a simulated camera.
    pub note: Option<String>,
}

/// State needed once the threads have ended.
pub struct RunContext {
    /// The session's folder.
    pub path: PathBuf,
    truth: Option<TruthLog>,
    first_frame: u64,
}

/// A finished session.
pub struct FinishedRun {
    /// The state at the end.
    pub session: Session,
    /// The session's folder.
    pub path: PathBuf,
    truth: Option<TruthLog>,
    first_frame: u64,
    /// Number of pictures that nobody looked at, since newer ones had come.
    unseen: u64,
}

/// A finished session, with the result on disk.
pub struct Concluded {
    /// The session's folder.
    pub path: PathBuf,
    /// Exit status of the result.
    pub exit: Exit,
    /// Contents of [`RESULT_FILE`](crate::RESULT_FILE).
    pub result: CalibrationFile,
    /// Result of the comparison with an older calibration, if requested. A failed comparison
    /// doesn't fail the session.
    pub compared: Option<anyhow::Result<Compared>>,
}

impl Run {
    /// Board in words, with the ID if known: "Board K7Q2: 9 × 6, 20 mm".
    pub fn board_in_words(&self) -> String {
        let board = self.session.setup().board;
        let corners = [board.columns(), board.rows()];
        text::start::named_board(&self.board_id, corners, board.measured_m())
    }

    /// The pictures of the views accepted so far, by view number.
    ///
    /// # Errors
    ///
    /// If a picture is missing or damaged.
    pub fn pictures(&self) -> anyhow::Result<Vec<(ViewNumber, GrayImage)>> {
        let mut pictures = Vec::new();
        for view in self.session.accepted() {
            let frame = view.view.frame_id.0;
            let Some(stored) = self.stored.iter().find(|stored| stored.frame == frame) else {
                continue;
            };
            let picture = stored_frame(self.folder.path(), stored).with_context(|| {
                format!("the picture of {} is missing", text::view_name(view.number))
            })?;
            pictures.push((view.number, picture));
        }
        Ok(pictures)
    }

    /// Paces a waiting source in real time, for onlookers.
    #[must_use]
    pub fn paced(mut self) -> Self {
        if self.open.source.waits() {
            self.open.source = Box::new(Paced::new(self.open.source));
        }
        self
    }

    /// Prepares the threads, and the state needed afterwards. Announces the folder.
    ///
    /// # Errors
    ///
    /// [`boresight_run::recording::RecordingError`] if a resumed session's journal can't be
    /// written.
    pub fn setup(self, announcer: &Announcer) -> anyhow::Result<(Setup, RunContext)> {
        let path = self.folder.path().to_path_buf();
        let Self {
            mut folder, mut session, open, record_stream, first_frame, resumed, first, ..
        } = self;
        let camera = if open.truth.is_some() { " (SIMULATED camera)" } else { "" };
        announcer.say(&format!("Session: {}{camera}", path.display()));
        let OpenSource { source, on_frame, truth } = open;
        let resumed = resumed.then_some(Input::Resumed);
        for input in resumed.into_iter().chain(first.map(Input::Command)) {
            let decision = session.handle(&input);
            folder.journal_mut().append(&input, &decision, None, true)?;
        }
        let setup = Setup {
            folder: Some(folder),
            record_stream,
            on_frame: Box::new(announced(on_frame, announcer.clone())),
            ..Setup::new(Box::new(renumbered(source, first_frame)), session)
        };
        Ok((setup, RunContext { path, truth, first_frame }))
    }
}

impl RunContext {
    /// Turns the ended threads into a finished session.
    ///
    /// # Errors
    ///
    /// The error that ended the threads.
    pub fn finished(
        self,
        finished: Result<Finished, PipelineError>,
    ) -> anyhow::Result<FinishedRun> {
        let Self { path, truth, first_frame } = self;
        let Finished { session, frames_replaced } = finished?;
        let unseen = frames_replaced + session.camera().dropped;
        Ok(FinishedRun { session, path, truth, first_frame, unseen })
    }
}

impl FinishedRun {
    /// The stored session in `path` after `command`, without its camera.
    ///
    /// # Errors
    ///
    /// As [`SavedSession::resume`], and if the journal can't be written.
    pub fn corrected(path: &Path, command: Command) -> anyhow::Result<Self> {
        let (mut folder, SavedSession { mut session, first_frame, .. }) =
            SavedSession::resume(path)?;
        for input in [Input::Resumed, Input::Command(command), Input::Stop] {
            let decision = session.handle(&input);
            folder.journal_mut().append(&input, &decision, None, true)?;
        }
        Ok(Self { session, path: path.to_path_buf(), truth: None, first_frame, unseen: 0 })
    }

    /// Announces the result, and writes result, comparison and report into the session's folder.
    ///
    /// # Errors
    ///
    /// If the result, or finally a simulation's truth, can't be written. An unwritable report or
    /// comparison is announced.
    pub fn conclude(self, announcer: &Announcer) -> anyhow::Result<Concluded> {
        let Self { session, path, truth, first_frame, unseen } = self;
        let session = scene::asked(&path, session, announcer)?;
        let header = SessionFolder::header(&path)?;
        let Conclusion { exit, result } = conclude(&session, &header, announcer);
        if session.accepted().is_empty() && unseen > 0 {
            announcer.say(&text::session_news::unseen(unseen));
        }
        if !session.failures().is_empty() {
            announcer.say(&text::views_are_safe(&path));
        }
        let truth = truth.map(|log| log.snapshot());
        if let (Some(truth), Some(calibration)) = (&truth, session.calibration()) {
            truth::announce(truth, calibration, announcer);
        }
        let file = save_result(&path, &session, &result)?;
        announcer.say(&format!("Result: {}", file.display()));
        say_how_to_leave_out(&path, &header, session.calibration().map(Arc::as_ref), announcer);
        let compared = header.against.as_deref().map(|against| {
            let against = Path::new(against);
            let (compared, found) =
                comparison::of_session(&path, &session, &header.source, against)?;
            announcer.say(&text::compared_with(against));
            comparison::announce(&found, &compared.action, &header.source, announcer);
            Ok(compared)
        });
        if let Some(Err(err)) = &compared {
            announcer.say(&format!("{} ({err:#})", text::NOT_COMPARED));
        }
        if header.config.camera.set_camera_info {
            let told = crate::set_camera_info(&path, &header.source, announcer);
            if let Err(err) = told {
                announcer.say(&text::source::driver_lacks_it(&format!("{err:#}"), &path));
            }
        }
        #[cfg(feature = "report")]
        crate::session::session_report::write_and_announce(&path, &session, announcer);
        // Last: the result counts more than the simulation's truth.
        if let Some(truth) = truth {
            truth::write(&path, &truth, first_frame)?;
        }
        Ok(Concluded { path, exit, result, compared })
    }
}

/// Announces how to leave out a view of the session in `folder`, if advised by the findings.
pub fn say_how_to_leave_out(
    folder: &Path,
    header: &Header,
    calibration: Option<&Calibration>,
    announcer: &Announcer,
) {
    let board = &header.config.board;
    let board = format!("--board {} --square {}mm", board.choice(), board.square_mm);
    let findings = calibration.map_or(&[][..], |calibration| &calibration.findings);
    if let Some(said) = text::leaving_out(findings, &folder.join("frames"), &board) {
        announcer.say(&said);
    }
}

/// Minimum number of views for the calibration's noise to equal that of the camera's corners.
const LEAST_FOR_NOISE: usize = 4;

/// Wraps `on_frame`: announces each new request and every accepted view first.
fn announced(mut on_frame: OnFrame, announcer: Announcer) -> impl FnMut(FrameReport<'_>) + Send {
    let mut last = None;
    let mut is_far = false;
    let mut knows_noise = false;
    let mirrored = announcer.is_mirrored();
    move |report| {
        let snapshot = report.snapshot;
        if let Some(outcome) = text::outcome(&snapshot.decision.outcome, snapshot, mirrored) {
            announcer.say(&outcome);
        }
        if snapshot.far.is_some() != is_far {
            is_far = !is_far;
            if let Some(board) = &snapshot.far {
                announcer.say(&text::session_news::far_board(board));
            }
        }
        if matches!(snapshot.decision.outcome, Outcome::Accepted { .. })
            && let Some(pair) = &snapshot.held_out
            && let Some(sentence) = text::session_news::held_out(pair, snapshot)
        {
            announcer.say(&sentence);
        }
        if !knows_noise
            && snapshot.views.len() >= LEAST_FOR_NOISE
            && let Some(sentence) = text::session_news::coarse_corners(snapshot)
        {
            knows_noise = true;
            announcer.say(&sentence);
        }
        // No action with the board would change this.
        if let Outcome::Refused { refusal: refusal @ Refusal::OtherSize { .. } } =
            &snapshot.decision.outcome
        {
            announcer.say(&format!("  Left out: {}", text::refusal(refusal)));
        }
        let now = Instruction::of(snapshot);
        let prompt = now.prompt(mirrored);
        // Views taken and the end of the session are announced with more words elsewhere.
        if last != Some(prompt) && prompt != Prompt::Taken && !prompt.is_state() {
            announcer.ask(&match prompt {
                // No choice here.
                Prompt::OtherBoard(other) => text::miss(&Miss::OtherBoard(other)),
                Prompt::Mirrored => text::miss(&Miss::Mirrored),
                Prompt::OtherSquares => text::miss(&Miss::OtherSquares { markers: 0 }),
                _ => now.sentence(mirrored),
            });
        }
        last = Some(prompt);
        on_frame(report);
    }
}

/// Onlooker for views removed or restored between frames, by a person or the camera.
pub(super) fn announcing(announcer: &Announcer) -> Arc<dyn Onlooker> {
    Arc::new(BetweenFrames(announcer.clone()))
}

struct BetweenFrames(Announcer);

impl Onlooker for BetweenFrames {
    fn decided(&self, snapshot: &Snapshot) {
        let Self(announcer) = self;
        let decision = &snapshot.decision;
        // Outcomes of frames are announced with the frame.
        if decision.frame.is_none()
            && let Some(sentence) =
                text::outcome(&decision.outcome, snapshot, announcer.is_mirrored())
        {
            announcer.say(&sentence);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Opening, RESULT_FILE, session::host::Host};
    use boresight_run::config::Config;

    #[test]
    fn a_result_is_written_even_if_the_truth_of_a_simulation_cannot_be() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = place.path().join("session");
        let config = Config::load(None, &[]).expect("settings");
        let opening = Opening {
            out: Some(folder.clone()),
            max_frames: Some(3),
            ..Opening::new("sim", config)
        };
        let host = Host::silent();
        let finished = host.finish(host.open(&opening).expect("a session")).expect("it runs");
        std::fs::create_dir(folder.join("truth.json")).expect("made");
        assert!(host.conclude(Ok(finished)).is_err(), "and it's said");
        assert!(folder.join(RESULT_FILE).is_file());
    }
}
