//! A new or resumed session: source, folder and state.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use crate::{
    Announcer, Run, SavedSession,
    session::{
        board_from_code::{BoardFromCode, board_from_source},
        comparison,
        source::{OpenSource, SourceName},
    },
};
use boresight_capture::{is_address, is_command, is_topic};
use boresight_formats::import::OldCalibration;
use boresight_guide::session::{Command, Session};
use boresight_present::text;
use boresight_run::{
    config::{Backend, Config},
    recording::{Header, SessionFolder},
};

/// Settings to open a session with.
#[derive(Clone, Debug)]
pub struct Opening {
    /// Name of the source, for [`SourceName::parse`].
    pub source: String,
    /// Backend of a live camera; `None` takes the configured one.
    pub backend: Option<Backend>,
    /// Settings of a new session. A resumed session keeps its own.
    pub config: Config,
    /// The session to resume.
    pub session: Option<PathBuf>,
    /// True to ask a resumed session for two more views, even if the plan is complete.
    pub takes_more: bool,
    /// Older calibration to compare the result with.
    pub against: Option<PathBuf>,
    /// True to hold the new calibration to the older calibration, for an untouched lens.
    pub hold: bool,
    /// Folder of a new session; `None` for a new one in `sessions`.
    pub out: Option<PathBuf>,
    /// True to store every picture, not only of accepted views.
    pub record_stream: bool,
    /// Most frames that the source delivers. By default only a simulated camera has a limit.
    pub max_frames: Option<u64>,
    /// Properties of the board to take from a margin code in a new session.
    pub board_code: BoardFromCode,
}

impl Opening {
    /// A new session in a new folder in `sessions`.
    pub fn new(source: &str, config: Config) -> Self {
        Self {
            source: source.into(),
            backend: None,
            config,
            session: None,
            takes_more: false,
            against: None,
            hold: false,
            out: None,
            record_stream: false,
            max_frames: None,
            board_code: BoardFromCode::Nothing,
        }
    }

    /// Settings for two more views in the session that ended in `folder`.
    #[must_use]
    pub fn going_on(&self, folder: &Path) -> Self {
        let session = Some(folder.into());
        Self { session, takes_more: true, out: None, against: None, ..self.clone() }
    }

    /// Opens the source and the session folder.
    ///
    /// # Errors
    ///
    /// If the older calibration, the session or the source can't be opened, if the source doesn't
    /// state its picture size, or if its size differs from the session's pictures.
    pub fn open(&self, announcer: &Announcer) -> anyhow::Result<Run> {
        // Fail on an unreadable older calibration before the views are taken rather than after.
        let old = self.against.as_deref().map(comparison::read).transpose()?;
        if let Some(old) = &old {
            for doubt in text::doubts_of_old(old) {
                announcer.say(&format!("{doubt}."));
            }
            if let Some(reason) = comparison::not_comparable(old) {
                let (what, action) = comparison::words(&Err(reason));
                announcer.say(&format!("{what}. {action}"));
            }
        }
        match &self.session {
            Some(path) => self.resume(path, announcer),
            None => {
                let params = self.config.calibration();
                let far = params
                    .accept
                    .and_then(|goal| text::acceptance::out_of_reach(goal, params.board_scale_sd));
                if let Some(line) = far {
                    announcer.say(&line);
                }
                self.begin(old.as_ref().filter(|_| self.hold), announcer)
            }
        }
    }

    /// Begins a new session, held to the lens of `known`, if given.
    fn begin(&self, known: Option<&OldCalibration>, announcer: &Announcer) -> anyhow::Result<Run> {
        let mut config = self.with_backend(&self.config);
        if config.camera.set_camera_info && !is_topic(&self.source) {
            bail!("only a driver of ROS 2 takes a calibration: --source ros2:/TOPIC");
        }
        let name = SourceName::parse(&self.source, &config, announcer)?;
        let mut open = name.open(self.max_frames)?;
        if self.board_code != BoardFromCode::Nothing {
            open = board_from_source(open, &mut config, self.board_code, announcer)?;
        }
        if let Some(old) = known {
            let lens = comparison::known_lens(old, open.image_size()?);
            let against = self.against.as_deref().unwrap_or(Path::new(""));
            let lens =
                lens.with_context(|| format!("could not hold the calibration to {against:?}"))?;
            config.calibration.known_lens = Some(lens);
        }
        let run = self.begin_with(&name.stable_name(&self.source), open, config)?;
        Ok(Run { note: self.note(&name), ..run })
    }

    /// Begins a new session with an open source, recorded as `source`.
    ///
    /// # Errors
    ///
    /// If the source doesn't state its picture size, or the folder can't be created.
    pub fn begin_with(
        &self,
        source: &str,
        open: OpenSource,
        config: Config,
    ) -> anyhow::Result<Run> {
        let image_size = open.image_size()?;
        let session = Session::new(config.session(image_size)?);
        let board_id = config.certificate.board_id.clone();
        let header = Header::new(source, image_size, config).of_camera(open.source.camera_facts());
        let header = match &self.against {
            Some(old) => header.against(old),
            None => header,
        };
        let path = self.out.clone().unwrap_or_else(new_session_path);
        Ok(Run {
            folder: SessionFolder::create(&path, &header)?,
            session,
            open,
            record_stream: self.record_stream,
            first_frame: 0,
            stored: Vec::new(),
            resumed: false,
            first: None,
            board_id,
            note: None,
        })
    }

    fn resume(&self, path: &Path, announcer: &Announcer) -> anyhow::Result<Run> {
        let (folder, saved) = SavedSession::resume(path)?;
        let config = self.with_backend(&saved.header.config);
        let given = if self.source == "auto" { &saved.header.source } else { &self.source };
        if self.source == "auto" && is_address(given) {
            // The password isn't recorded, and a session from elsewhere may name any address.
            bail!("{}", text::source::address_is_asked_for(given, path));
        }
        if self.source == "auto" && is_command(given) {
            // A session from elsewhere may name any command.
            bail!("{}", text::source::command_is_asked_for(given, path));
        }
        let opened = SourceName::parse(given, &config, announcer)
            .and_then(|name| name.open(self.max_frames));
        let mut open = match self.source.as_str() {
            "auto" => opened.with_context(|| text::source::source_is_asked_for(given, path))?,
            _ => opened?,
        };
        if let Some(camera) = &saved.header.camera
            && open.source.identity().name == saved.header.source
        {
            open.source.put_back_at_end(&camera.controls_before());
        }
        let image_size = open.image_size()?;
        if saved.header.image_size() != image_size {
            bail!(
                "the session's pictures are {}, this source's are {image_size}: a calibration holds for one size",
                saved.header.image_size()
            );
        }
        saved.announce(announcer);
        announcer.say(&text::resuming(saved.session.accepted().len()));
        Ok(Run {
            folder,
            session: saved.session,
            board_id: saved.header.config.certificate.board_id,
            // The session names its source; no camera was searched.
            note: None,
            open,
            record_stream: self.record_stream,
            first_frame: saved.first_frame,
            stored: saved.contents.stored,
            resumed: true,
            first: self.takes_more.then_some(Command::TakeMore),
        })
    }

    /// `config` with the requested backend.
    pub fn with_backend(&self, config: &Config) -> Config {
        let mut config = config.clone();
        if let Some(backend) = &self.backend {
            config.camera.backend.clone_from(backend);
        }
        config
    }

    /// Note about a missing camera, if `auto` chose the simulation.
    fn note(&self, name: &SourceName) -> Option<String> {
        matches!(name, SourceName::Simulated(_) if self.source == "auto")
            .then(|| text::window::NO_CAMERA.to_owned())
    }
}

/// Folder of new sessions, in the working directory.
pub const SESSIONS: &str = "sessions";

/// A free folder name in [`SESSIONS`], from the time.
pub fn new_session_path() -> PathBuf {
    let stamp = jiff::Timestamp::now().strftime("%Y-%m-%dT%H-%M-%SZ").to_string();
    let plain = Path::new(SESSIONS).join(&stamp);
    (2..1000)
        .map(|n| Path::new(SESSIONS).join(format!("{stamp}-{n}")))
        .fold(plain, |free, next| if free.exists() { next } else { free })
}
