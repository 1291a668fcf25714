//! A session folder, read back.
//!
//! ```
//! use std::path::Path;
//!
//! use boresight_app::SavedSession;
//!
//! let saved = SavedSession::open(Path::new("../../fixtures/recordings/v1/good"))?;
//! // An earlier version recorded it with its own rules of guidance; the views are the ones it took.
//! assert!(saved.header.guidance_rules < boresight_guide::guidance::RULES);
//! assert_eq!(saved.session.accepted().len(), 8);
//! let calibration = saved.session.calibration().ok_or("no calibration")?;
//! assert!(calibration.camera.f_px.x > 100.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use serde_json::{Value, json};

use crate::Announcer;
use boresight_detect::{Detection, Miss};
use boresight_formats::CalibrationFile;
use boresight_guide::{
    guidance::RULES,
    session::{Command, Decision, Input, Observation, Session},
};
use boresight_present::text;
use boresight_run::{
    config::Config,
    recording::{
        Header, JournalContents, Line, RecordedOutcome, RecordingError, Replayed, SessionFolder,
        replay,
    },
};

/// Header and journal of a session folder, not yet decided. The journal's lines stay on disk.
#[derive(Clone, Debug)]
pub struct JournalReading {
    /// Path of the session's folder.
    pub path: PathBuf,
    /// Contents of `session.toml`.
    pub header: Header,
    /// Contents of the journal.
    pub contents: JournalContents,
    /// Detections from another search of stored pictures, by frame number; override the recorded
    /// ones.
    pub seen_again: BTreeMap<u64, Result<Detection, Miss>>,
}

impl DecidedAgain {
    /// Output of `replay --json`: `result`, and the comparison of the `count` decisions of the
    /// session at `path` with the recorded ones. `crc32` is their checksum.
    ///
    /// # Errors
    ///
    /// If a number can't be written.
    pub fn to_json(
        &self,
        result: &CalibrationFile,
        path: &Path,
        count: usize,
        crc32: &str,
    ) -> serde_json::Result<Value> {
        let Replayed { different_lines, differences, rounding, .. } = &self.replayed;
        let mut value = result.to_json()?;
        value["session"] = json!(path.display().to_string());
        value["decisions"] = json!({
            "count": count,
            "crc32": crc32,
            "different_count": different_lines.len(),
            "different": differences,
            "rounded": rounding.count,
        });
        Ok(value)
    }
}

/// A session as recorded in the folder.
#[derive(Clone, Debug)]
pub struct SavedSession {
    /// Path of the session's folder.
    pub path: PathBuf,
    /// Contents of `session.toml`.
    pub header: Header,
    /// State after the last line. The accepted views are those recorded as accepted.
    pub session: Session,
    /// Decisions made differently by the build.
    pub replayed: Replayed,
    /// True if the accepted views had to be restored from the recorded outcomes, because the build
    /// would have accepted others.
    pub restored: bool,
    /// Contents of the journal, without a cut last line.
    pub contents: JournalContents,
    /// First frame number unused by the journal.
    pub first_frame: u64,
}

/// A journal decided again, perhaps with other settings.
#[derive(Clone, Debug)]
pub struct DecidedAgain {
    /// The state after the last line.
    pub session: Session,
    /// Comparison of the decisions with the recorded decisions.
    pub replayed: Replayed,
}

impl JournalReading {
    /// Reads header and journal of the session at `path`.
    ///
    /// # Errors
    ///
    /// [`boresight_run::recording::RecordingError`] if the folder can't be read, is newer, or has a
    /// damaged line.
    pub fn of(path: &Path) -> anyhow::Result<Self> {
        let (header, contents) = SessionFolder::read(path)?;
        Ok(Self::new(path, header, contents))
    }

    pub(crate) fn new(path: &Path, header: Header, contents: JournalContents) -> Self {
        Self { path: path.to_path_buf(), header, contents, seen_again: BTreeMap::new() }
    }

    /// Reads the lines of the journal, oldest first.
    fn lines(&self) -> impl Iterator<Item = Result<Line, RecordingError>> + '_ {
        self.contents.lines.iter().map(|line| {
            let mut line = line?;
            if let Some(observed) = line.input.observed_mut()
                && let Some(seen) = self.seen_again.get(&observed.frame())
            {
                observed.see(seen);
            }
            Ok(line)
        })
    }

    /// Decides every line again with the settings of `config`, and calls `each` after each
    /// decision.
    ///
    /// # Errors
    ///
    /// If `config` names no usable board, or a line can't be read.
    pub fn decide_again(
        &self,
        config: &Config,
        each: impl FnMut(&Session, &Decision),
    ) -> anyhow::Result<DecidedAgain> {
        let mut session = Session::new(config.session(self.header.image_size())?);
        let replayed = replay(&mut session, self.lines(), each)?;
        Ok(DecidedAgain { session, replayed })
    }

    /// Decides every line again as [`Self::decide_again`] does, with a checksum of all decisions:
    /// equal ones mean equal decisions.
    ///
    /// # Errors
    ///
    /// As [`Self::decide_again`].
    pub fn decide_again_summed(
        &self,
        config: &Config,
        mut each: impl FnMut(&Session, &Decision),
    ) -> anyhow::Result<(DecidedAgain, String)> {
        let mut checksum = crc32fast::Hasher::new();
        let again = self.decide_again(config, |session, decision| {
            // Same text as in a recording.
            checksum.update(serde_json::to_string(decision).unwrap_or_default().as_bytes());
            checksum.update(b"\n");
            each(session, decision);
        })?;
        Ok((again, format!("{:08x}", checksum.finalize())))
    }

    /// Session recorded by the journal: accepted views are recorded facts, kept even where this
    /// build would decide otherwise.
    ///
    /// # Errors
    ///
    /// If a line can't be read, or a recorded view can't be restored because its observation is
    /// missing or has no board.
    pub fn session(self) -> anyhow::Result<SavedSession> {
        let mut first_frame = 0;
        let DecidedAgain { mut session, replayed } =
            self.decide_again(&self.header.config, |_, decision| {
                first_frame =
                    first_frame.max(decision.frame.map_or(0, |frame| frame.saturating_add(1)));
            })?;
        let restored = replayed.changes_views;
        if restored {
            session = self.restore()?;
        }
        let Self { path, header, contents, .. } = self;
        Ok(SavedSession { path, header, session, replayed, restored, contents, first_frame })
    }

    fn restore(&self) -> anyhow::Result<Session> {
        let observations = self.observations_of_views()?;
        let mut session = Session::new(self.header.config.session(self.header.image_size())?);
        for (index, line) in self.lines().enumerate() {
            let line = line?;
            let outcome = line.outcome().with_context(|| {
                format!("line {} of the journal holds no decision that can be read", index + 1)
            })?;
            match (Input::from(line.input), outcome) {
                (Input::Observed(_), RecordedOutcome::Accepted { view, frame, role }) => {
                    let Some(observation) = observations.get(&frame) else {
                        bail!("the journal has no frame {frame}, from which view {view} was taken");
                    };
                    session.accept_recorded(observation, view, role).map_err(|refusal| {
                        anyhow::anyhow!("{}", text::refusal(&refusal))
                            .context(format!("could not restore view {view} from frame {frame}"))
                    })?;
                }
                (Input::Observed(_), _) => {}
                (Input::Command(_), RecordedOutcome::Removed { view }) => {
                    session.handle(&Input::Command(Command::Remove { view }));
                }
                // The command forced a view recorded as accepted.
                (Input::Command(Command::ForceNext), _) => {}
                (input, _) => {
                    session.handle(&input);
                }
            }
        }
        Ok(session)
    }

    /// Observations in the frames of accepted views, by frame number.
    fn observations_of_views(&self) -> Result<BTreeMap<u64, Observation>, RecordingError> {
        let mut wanted = BTreeSet::new();
        for line in self.lines() {
            if let Some(RecordedOutcome::Accepted { frame, .. }) = line?.outcome() {
                wanted.insert(frame);
            }
        }
        let mut found = BTreeMap::new();
        for line in self.lines() {
            if let Input::Observed(observation) = Input::from(line?.input)
                && wanted.remove(&observation.frame_id.0)
            {
                found.insert(observation.frame_id.0, observation);
            }
        }
        Ok(found)
    }
}

impl SavedSession {
    /// Reads the session at `path` and restores the recorded state.
    ///
    /// # Errors
    ///
    /// [`boresight_run::recording::RecordingError`] if the folder can't be read, is newer, or is
    /// damaged; or if a recorded view can't be restored.
    pub fn open(path: &Path) -> anyhow::Result<Self> {
        JournalReading::of(path)?.session()
    }

    /// Opens the session at `path` for resuming. The folder stays locked until dropped.
    ///
    /// # Errors
    ///
    /// As [`Self::open`], and if another process has the session open.
    pub fn resume(path: &Path) -> anyhow::Result<(SessionFolder, Self)> {
        let (folder, header, contents) = SessionFolder::open(path)?;
        Ok((folder, JournalReading::new(path, header, contents).session()?))
    }

    /// Announces a cut last line, and different decisions of the build.
    pub fn announce(&self, announcer: &Announcer) {
        if self.contents.cut {
            announcer.say(text::replay::CUT);
        }
        let rules = self.header.guidance_rules;
        let differs = !self.replayed.different_lines.is_empty();
        if let Some(other) = text::replay::other_rules(rules, RULES).filter(|_| differs) {
            announcer.say(other);
        }
        if self.restored {
            let count = self.session.accepted().len();
            announcer.say(&text::replay::restored(count, rules == RULES));
        }
    }
}
