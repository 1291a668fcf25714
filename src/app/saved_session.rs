//! A session folder, read back.
//!
//! ```
//! use std::path::Path;
//!
//! use boresight::app::SavedSession;
//!
//! let saved = SavedSession::open(Path::new("fixtures/recordings/v1/good"))?;
//! // An earlier version recorded it with its own rules of guidance; the views are the ones it took.
//! assert!(saved.header.guidance_rules < boresight::guidance::RULES);
//! assert_eq!(saved.session.accepted().len(), 8);
//! let calibration = saved.session.calibration().ok_or("no calibration")?;
//! assert!(calibration.camera.f_px.x > 100.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::Announcer;
use crate::{
    config::Config,
    guidance::RULES,
    recording::{
        Difference, Header, JournalContents, Line, RecordedOutcome, Rounding, SessionFolder,
        Stored, replay, take_rounding,
    },
    session::{Command, Decision, Input, Observation, Session},
    text,
};

/// Header and journal of a session folder, not yet decided.
#[derive(Clone, Debug)]
pub struct JournalReading {
    /// The folder.
    pub path: PathBuf,
    /// What `session.toml` says.
    pub header: Header,
    /// The whole lines of the journal, oldest first.
    pub lines: Vec<Line>,
    /// Whether the last line was cut by a crash, and is therefore left out.
    pub cut: bool,
}

/// A session as its folder records it.
#[derive(Clone, Debug)]
pub struct SavedSession {
    /// The folder.
    pub path: PathBuf,
    /// What `session.toml` says.
    pub header: Header,
    /// The state after the last line. Its accepted views are those that were recorded as accepted.
    pub session: Session,
    /// Decisions that this build makes differently, rounding apart.
    pub differences: Vec<Difference>,
    /// Decisions that differ by rounding only.
    pub rounding: Rounding,
    /// Whether the accepted views had to be restored from the recorded outcomes, because this build would
    /// have accepted others.
    pub restored: bool,
    /// The whole lines of the journal, oldest first.
    pub lines: Vec<Line>,
    /// Whether the last line was cut by a crash, and is therefore left out.
    pub cut: bool,
    /// The first frame number that the journal has not used.
    pub first_frame: u64,
}

/// A journal decided again, perhaps with other settings.
#[derive(Clone, Debug)]
pub struct DecidedAgain {
    /// The state after the last line.
    pub session: Session,
    /// Decisions that came out differently, rounding apart.
    pub differences: Vec<Difference>,
    /// Decisions that differ by rounding only.
    pub rounding: Rounding,
}

impl JournalReading {
    /// Reads header and journal of the session at `path`.
    ///
    /// # Errors
    ///
    /// [`crate::recording::RecordingError`] if the folder can't be read, is newer, or has a damaged line.
    pub fn of(path: &Path) -> anyhow::Result<Self> {
        let (header, contents) = SessionFolder::read(path)?;
        Ok(Self::new(path, header, contents))
    }

    pub(super) fn new(path: &Path, header: Header, contents: JournalContents) -> Self {
        let JournalContents { lines, cut, .. } = contents;
        Self { path: path.to_path_buf(), header, lines, cut }
    }

    /// The stored pictures, in journal order.
    pub fn stored(&self) -> Vec<Stored> {
        self.lines.iter().filter_map(|line| line.stored.clone()).collect()
    }

    /// Decides every line again with the settings of `config`, and calls `each` after each decision.
    ///
    /// # Errors
    ///
    /// If `config` names no usable board.
    pub fn decide_again(
        &self,
        config: &Config,
        each: impl FnMut(&Session, &Decision),
    ) -> anyhow::Result<DecidedAgain> {
        let mut session = Session::new(config.session(self.header.image_size())?);
        let mut differences = replay(&mut session, self.lines.clone(), each);
        let rounding = take_rounding(&mut differences);
        Ok(DecidedAgain { session, differences, rounding })
    }

    /// The session that the journal records: which views are accepted is a recorded fact, and stands even
    /// where this build would decide otherwise.
    ///
    /// # Errors
    ///
    /// If a recorded view can't be restored because its observation is missing or has no board.
    pub fn session(self) -> anyhow::Result<SavedSession> {
        let mut first_frame = 0;
        let DecidedAgain { mut session, differences, rounding } =
            self.decide_again(&self.header.config, |_, decision| {
                first_frame =
                    first_frame.max(decision.frame.map_or(0, |frame| frame.saturating_add(1)));
            })?;
        let restored = differences.iter().any(Difference::changes_views);
        if restored {
            session = self.restore()?;
        }
        let Self { path, header, lines, cut } = self;
        Ok(SavedSession {
            path,
            header,
            session,
            differences,
            rounding,
            restored,
            lines,
            cut,
            first_frame,
        })
    }

    fn restore(&self) -> anyhow::Result<Session> {
        let mut session = Session::new(self.header.config.session(self.header.image_size())?);
        for (index, line) in self.lines.iter().enumerate() {
            let outcome = line.outcome().with_context(|| {
                format!("line {} of the journal holds no decision that can be read", index + 1)
            })?;
            match (Input::from(line.input.clone()), outcome) {
                (Input::Observed(_), RecordedOutcome::Accepted { view, frame, role }) => {
                    let Some(observation) = self.observation(frame) else {
                        bail!("the journal has no frame {frame}, from which view {view} was taken");
                    };
                    session.accept_recorded(&observation, view, role).map_err(|refusal| {
                        anyhow::anyhow!("{}", text::refusal(&refusal))
                            .context(format!("could not restore view {view} from frame {frame}"))
                    })?;
                }
                (Input::Observed(_), _) => {}
                (Input::Command(_), RecordedOutcome::Removed { view }) => {
                    session.handle(&Input::Command(Command::Remove { view }));
                }
                // It forced a view that is recorded as accepted.
                (Input::Command(Command::ForceNext), _) => {}
                (input, _) => {
                    session.handle(&input);
                }
            }
        }
        Ok(session)
    }

    fn observation(&self, frame: u64) -> Option<Observation> {
        self.lines.iter().find_map(|line| match Input::from(line.input.clone()) {
            Input::Observed(observation) if observation.frame_id.0 == frame => Some(observation),
            _ => None,
        })
    }
}

impl SavedSession {
    /// Reads the session at `path` and restores the state that its journal records.
    ///
    /// # Errors
    ///
    /// [`crate::recording::RecordingError`] if the folder can't be read, is newer, or is damaged; or if a
    /// recorded view can't be restored.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        JournalReading::of(path)?.session()
    }

    /// Opens the session at `path` to continue it. The folder stays locked until it's dropped.
    ///
    /// # Errors
    ///
    /// As [`Self::open`], and if another process has the session open.
    pub fn resume(path: &Path) -> anyhow::Result<(SessionFolder, Self)> {
        let (folder, header, contents) = SessionFolder::open(path)?;
        Ok((folder, JournalReading::new(path, header, contents).session()?))
    }

    /// Announces a cut last line, and that this build decides differently.
    pub fn announce(&self, announcer: &Announcer) {
        if self.cut {
            announcer.say(text::replay::CUT);
        }
        if self.header.guidance_rules < RULES && !self.differences.is_empty() {
            announcer.say(text::replay::EARLIER_RULES);
        }
        if self.restored {
            announcer.say(&text::replay::restored(self.session.accepted().len()));
        }
    }
}
