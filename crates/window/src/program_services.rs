//! The program behind the window: sources, folders, settings, results.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::{Arc, Mutex, PoisonError},
};

use image::GrayImage;

use crate::screen::FACES;
#[cfg(feature = "serve")]
use boresight_app::window::services::PhoneLink;
use boresight_app::{
    Announcer, Exit, Host, Opening, REPORT_FILE, RESULT_FILE, Voice,
    explain::{UserError, user_error},
    session::{
        camera, comparison, export,
        host::Started,
        opening::new_session_path,
        rig_run::{RigHand, RigNews, RigOpening, RigRun},
        run::{Concluded, FinishedRun},
    },
    window::{
        desktop,
        lookout::{Connected, Lookout, whole_board},
        memory, printed_board,
        recordings::{self, Dropped, Recording},
        services::{
            CameraView, Comparing, Ended, Loading, Memory, Opened, PrintedBoard, RigOpened,
            RigRequest, SeenBoard, SeenCode, Services, SessionRequest, SmallPictures, Storing,
            Wake,
        },
    },
};
use boresight_capture::{is_address, without_secrets};
use boresight_geometry::{board_code::BoardId, boards::BoardChoice};
use boresight_guide::session;
#[cfg(feature = "serve")]
use boresight_phone::{QrCode, session_page::Phone};
use boresight_present::text;
#[cfg(feature = "serve")]
use boresight_run::pipeline::Onlooker;
use boresight_run::{config::Config, pipeline::Background, recording::RigSessionCamera};
use boresight_terminal::print;

/// Answers the window: opens and concludes sessions, compares, exports and replays.
pub struct ProgramServices {
    opening: Opening,
    host: Host,
    /// True to print each result on stdout.
    as_json: bool,
    session_folders: BTreeSet<PathBuf>,
    exit: Arc<Mutex<Exit>>,
    /// True if the first session starts without asking.
    at_once: bool,
    /// File of the window's memory.
    memory: Option<PathBuf>,
    /// Last stored memory.
    kept: Option<Memory>,
    lookout: Option<Lookout>,
    /// ID of the boards printed from here: two prints are one board.
    board_id: BoardId,
    /// Last seen code beside a board.
    code: Option<SeenCode>,
    /// Folder named by the person for the first session.
    named: Option<PathBuf>,
    voice: Voice,
    /// True to speak from the beginning.
    speaks: bool,
    /// True if the person faces the camera; `None` for what is remembered.
    faces: Option<bool>,
    #[cfg(feature = "serve")]
    phone: Option<Arc<Phone>>,
}

impl Services for ProgramServices {
    fn first_wish(&self) -> SessionRequest {
        let config = &self.opening.config;
        let BoardChoice { columns, rows, pattern } = config.board.choice();
        let wish = SessionRequest {
            source: self.opening.source.clone(),
            mode: config.camera.mode.clone(),
            board: [columns, rows],
            pattern,
            square_m: config.board.square_mm * 1e-3,
            board_code: self.opening.board_code,
            plan: config.guidance.plan.into(),
            go_on_with: self.opening.session.clone(),
            first: None,
        };
        if self.at_once {
            return wish;
        }
        let Memory { source, mode, board, pattern, square_m, plan, .. } = self.remembered();
        let is_remembered = board.is_some();
        SessionRequest {
            source: source.unwrap_or(wish.source),
            mode: mode.unwrap_or(wish.mode),
            board: board.unwrap_or(wish.board),
            pattern: if is_remembered { pattern } else { wish.pattern },
            square_m: square_m.unwrap_or(wish.square_m),
            plan: plan.unwrap_or(wish.plan),
            ..wish
        }
    }

    fn starts_at_once(&self) -> bool {
        self.at_once
    }

    fn remembered(&self) -> Memory {
        let read = || self.memory.as_deref().map(memory::read).unwrap_or_default();
        let memory = self.kept.clone().unwrap_or_else(read);
        Memory {
            speech: self.speaks.then_some(true).or(memory.speech),
            mirrored: self.faces.or(memory.mirrored),
            ..memory
        }
    }

    fn remember(&mut self, memory: &Memory) -> Result<(), UserError> {
        // Passwords aren't kept.
        let plain =
            |name: &String| if is_address(name) { without_secrets(name) } else { name.clone() };
        let memory = Memory {
            source: memory.source.as_ref().map(plain),
            streams: memory.streams.iter().map(plain).collect(),
            ..memory.clone()
        };
        self.kept = Some(memory.clone());
        match &self.memory {
            Some(path) => memory::write(path, &memory).map_err(|err| user_error(&err.into())),
            None => Ok(()),
        }
    }

    fn cameras(&mut self, wake: &Wake) -> Vec<CameraView> {
        if self.lookout.is_none() {
            let config = self.opening.with_backend(&self.opening.config);
            // Without a thread there are no pictures; the cameras are still found by name.
            self.lookout = Lookout::start(Box::new(Connected(config)), Arc::clone(wake)).ok();
        }
        let mut cameras = self.lookout.as_ref().map(Lookout::cameras).unwrap_or_default();
        for code in cameras.iter_mut().filter_map(|camera| camera.code.as_mut()) {
            self.measured(code);
            self.code = Some(code.clone());
        }
        cameras
    }

    fn count_board(&mut self, source: Option<&str>) {
        if let Some(lookout) = &self.lookout {
            lookout.count_board(source);
        }
    }

    fn whole_board(&mut self, image: &GrayImage, board: [u16; 2]) -> Option<SeenBoard> {
        let mut seen = whole_board(image, board)?;
        if let Some(code) = &mut seen.code {
            self.measured(code);
            self.code = Some(code.clone());
        }
        Some(seen)
    }

    fn stop_looking(&mut self) {
        self.lookout = None;
    }

    fn papers(&self) -> Vec<&'static str> {
        printed_board::papers()
    }

    fn print_board(&mut self, board: BoardChoice, paper: usize) -> Result<PrintedBoard, UserError> {
        let here = std::path::absolute(".").unwrap_or_else(|_| ".".into());
        let printed = printed_board::print(&here, board, paper, self.board_id);
        let printed = printed.map_err(|err| user_error(&err))?;
        // Without a viewer, the person still reads the name of the file.
        self.show(&printed.file).ok();
        Ok(printed)
    }

    fn open(&mut self, wish: &SessionRequest, wake: Wake) -> Result<Opened, UserError> {
        self.opened(wish, wake).map_err(|err| user_error(&err))
    }

    fn open_rig(&mut self, request: &RigRequest) -> Result<RigOpened, UserError> {
        self.rig_opened(request).map_err(|err| user_error(&err))
    }

    fn modes(&mut self, source: &str) -> Vec<String> {
        camera::modes(source)
    }

    fn formats(&self, is_rig: bool) -> Vec<&'static str> {
        export::offered(is_rig).iter().map(|format| format.label()).collect()
    }

    fn export(&mut self, folder: &Path, format: usize) -> Result<PathBuf, UserError> {
        export::beside(folder, format, self.host.announcer()).map_err(|err| user_error(&err))
    }

    fn older(&self, folder: &Path) -> Vec<PathBuf> {
        comparison::older(folder)
    }

    fn compare(&mut self, folder: &Path, old: &Path, wake: Wake) -> Result<Comparing, UserError> {
        let (folder, old) = (folder.to_path_buf(), old.to_path_buf());
        let announcer = self.host.announcer().clone();
        let work = move || {
            let compared =
                comparison::of_folder(&folder, &old, &announcer).map_err(|err| user_error(&err));
            wake();
            compared
        };
        Background::start(work).map_err(|err| user_error(&err.into()))
    }

    fn recordings(&self) -> Vec<Recording> {
        recordings::within(&self.session_folders)
    }

    fn replay(&mut self, folder: &Path, wake: Wake) -> Result<Loading, UserError> {
        let folder = folder.to_path_buf();
        let work = move || {
            let replayed = recordings::open(&folder).map_err(|err| user_error(&err));
            wake();
            replayed
        };
        Background::start(work).map_err(|err| user_error(&err.into()))
    }

    fn small_pictures(&self, folders: Vec<PathBuf>, wake: Wake) -> Option<SmallPictures> {
        let work = move || {
            let small = |folder: PathBuf| Some((recordings::small_picture(&folder)?, folder));
            let pictures = folders.into_iter().filter_map(small);
            let pictures = pictures.map(|(picture, folder)| (folder, picture)).collect();
            wake();
            pictures
        };
        Background::start(work).ok()
    }

    fn stored(&mut self, folder: &Path, wake: Wake) -> Result<Storing, UserError> {
        let folder = folder.to_path_buf();
        let work = move || {
            let stored = recordings::stored(&folder).map_err(|err| user_error(&err));
            wake();
            stored
        };
        Background::start(work).map_err(|err| user_error(&err.into()))
    }

    fn correct(
        &mut self,
        folder: &Path,
        command: session::Command,
        wake: Wake,
    ) -> Result<Storing, UserError> {
        let folder = folder.to_path_buf();
        let conclude = self.concluding();
        let work = move || {
            let ended = conclude(FinishedRun::corrected(&folder, command), &folder);
            let stored = match ended.trouble {
                Some(trouble) => Err(trouble),
                None => recordings::stored(&folder).map_err(|err| user_error(&err)),
            };
            wake();
            stored
        };
        Background::start(work).map_err(|err| user_error(&err.into()))
    }

    fn delete(&mut self, folder: &Path) -> Result<(), UserError> {
        let failed = |why: &str| UserError {
            what: format!("{}: {why}", folder.display()),
            action: Some(text::sessions::DELETE_BY_HAND.into()),
        };
        // The desktop's own program knows the bin of every disk.
        let mut gio = Command::new("gio");
        let moved = gio.args(["trash", "--"]).arg(folder).stdin(Stdio::null()).output();
        let moved = moved.map_err(|err| failed(&format!("gio: {err}")))?;
        if moved.status.success() {
            Ok(())
        } else {
            Err(failed(String::from_utf8_lossy(&moved.stderr).trim()))
        }
    }

    fn dropped(&self, path: &Path) -> Dropped {
        recordings::dropped(path)
    }

    fn show(&mut self, file: &Path) -> Result<(), UserError> {
        desktop::show(file).map_err(|_| UserError {
            what: text::window::NO_VIEWER.into(),
            action: Some(text::window::written(file)),
        })
    }

    fn interrupted(&self) -> bool {
        self.host.is_stopped()
    }

    fn speak(&mut self, on: bool, mirrored: bool) -> Result<(), UserError> {
        self.voice.switch(on, mirrored).map_err(|err| user_error(&err.into()))
    }

    fn test_voice(&mut self) -> Result<(), UserError> {
        self.voice.test().map_err(|err| user_error(&err.into()))
    }

    #[cfg(feature = "serve")]
    fn phone(&self) -> Option<PhoneLink> {
        let links = self.phone.as_ref()?.links().into_iter().next()?;
        let code = QrCode::of(&links.owner)?;
        let row = |y| (0..code.side()).map(|x| code.is_dark(x, y)).collect();
        Some(PhoneLink {
            link: links.owner,
            watcher: links.watcher,
            code: (0..code.side()).map(row).collect(),
        })
    }

    #[cfg(feature = "serve")]
    fn phones(&self) -> usize {
        self.phone.as_ref().map_or(0, |phone| phone.hub().pages())
    }

    #[cfg(feature = "serve")]
    fn phone_wants_more(&self) -> bool {
        self.phone.as_ref().is_some_and(|phone| phone.hub().take_more())
    }

    #[cfg(feature = "serve")]
    fn phone_ends_session(&self) -> bool {
        self.phone.as_ref().is_some_and(|phone| phone.hub().wants_end())
    }
}

impl ProgramServices {
    /// Window with `opening` as the first session, and `host` for every session.
    pub fn new(opening: Opening, host: Host) -> Self {
        let path = new_session_path();
        let sessions = path.parent().unwrap_or(Path::new("."));
        let voice = Voice::new();
        Self {
            opening,
            host: host.beside(voice.companion()),
            as_json: false,
            session_folders: BTreeSet::from([sessions.into()]),
            exit: Arc::new(Mutex::new(Exit::Good)),
            at_once: true,
            memory: None,
            kept: None,
            lookout: None,
            board_id: printed_board::new_id(),
            code: None,
            named: None,
            voice,
            speaks: false,
            faces: None,
            #[cfg(feature = "serve")]
            phone: None,
        }
    }

    /// Shows every session on the phone's page, too.
    #[cfg(feature = "serve")]
    #[must_use]
    pub fn with_phone(mut self, phone: Option<Phone>) -> Self {
        self.phone = phone.map(Arc::new);
        if let Some(phone) = &self.phone {
            self.host = self.host.beside(Arc::clone(phone) as _);
        }
        self
    }

    /// Prints each result on stdout, if `as_json`.
    #[must_use]
    pub fn printing(self, as_json: bool) -> Self {
        Self { as_json, ..self }
    }

    /// Keeps choices in the file at `path`.
    #[must_use]
    pub fn remembering(self, path: Option<PathBuf>) -> Self {
        Self { memory: path, ..self }
    }

    /// Speaks from the beginning, if `speaks`.
    #[must_use]
    pub fn speaking(self, speaks: bool) -> Self {
        Self { speaks, ..self }
    }

    /// Mirrors the picture and swaps left and right for a person facing the camera, if `faces`; as
    /// remembered, if `None`.
    #[must_use]
    pub fn facing(self, faces: Option<bool>) -> Self {
        Self { faces, ..self }
    }

    /// Host with left and right as in the window.
    fn session_host(&self) -> Host {
        let faces = self.remembered().mirrored.unwrap_or(FACES);
        if faces { self.host.clone() } else { self.host_from_behind() }
    }

    fn host_from_behind(&self) -> Host {
        self.host.announced_by(self.host.announcer().clone().from_behind())
    }

    /// Asks about the first session instead of a start.
    #[must_use]
    pub fn asking(self) -> Self {
        Self { at_once: false, ..self }
    }

    /// Exit status of the last session.
    pub fn exit(&self) -> Arc<Mutex<Exit>> {
        Arc::clone(&self.exit)
    }

    /// Folder for `wish`: the named folder, if without a session; a sibling for the next board;
    /// then a folder in `sessions`.
    fn folder_for(&self, wish: &SessionRequest) -> Option<PathBuf> {
        if wish.go_on_with.is_some() {
            return None;
        }
        if let Some(out) = &self.opening.out {
            return Some(out.clone());
        }
        let [columns, rows] = wish.board;
        let mut named = self.named.as_ref().into_iter().flat_map(|named| {
            let mut beside = named.clone().into_os_string();
            beside.push(format!("-{columns}x{rows}"));
            [named.clone(), PathBuf::from(beside)]
        });
        named.find(|folder| !folder.exists()).or_else(|| {
            let folder = self.remembered().folder;
            let name = new_session_path().file_name()?.to_owned();
            (!folder.trim().is_empty()).then(|| Path::new(folder.trim()).join(name))
        })
    }

    /// Sets the measured square of the board in `code`, if the settings name a size.
    fn measured(&self, code: &mut SeenCode) {
        let id = code.id.parse::<BoardId>().ok();
        let named = |key: &str| id.is_some() && key.parse::<BoardId>().ok() == id;
        let mut boards = self.opening.config.boards.iter();
        if let Some((_, measured)) = boards.find(|(key, _)| named(key)) {
            code.square_m = measured.square_mm * 1e-3;
        }
    }

    /// Settings for `wish`.
    fn config_for(&self, wish: &SessionRequest) -> anyhow::Result<Config> {
        let mut config = self.opening.config.clone();
        config.board = config.board.chosen(BoardChoice::of(wish.board, wish.pattern));
        config.board.square_mm = wish.square_m * 1e3;
        config.camera.mode.clone_from(&wish.mode);
        self.remembered().apply(&mut config);
        // Typed text is checked like a settings file.
        let mut config = config.with(&[])?;
        config.guidance.plan = wish.plan.into();
        let is_seen = |code: &&SeenCode| {
            code.board == wish.board && (code.square_m - wish.square_m).abs() < 1e-7
        };
        if let Some(code) = self.code.as_ref().filter(is_seen) {
            config.certificate.board_id.clone_from(&code.id);
        }
        Ok(config)
    }

    fn rig_opened(
        &mut self,
        RigRequest { cameras, wish }: &RigRequest,
    ) -> anyhow::Result<RigOpened> {
        // Previewed cameras must be free.
        self.stop_looking();
        let config = self.config_for(wish)?;
        let of = |(name, source): &(String, String)| {
            let opening = Opening {
                backend: self.opening.backend.clone(),
                ..Opening::new(source, config.clone())
            };
            (RigSessionCamera { name: name.clone(), known_lens: None }, opening)
        };
        // The rig's pictures aren't mirrored.
        let host = self.host_from_behind();
        let announcer = host.announcer();
        let run = match &wish.go_on_with {
            Some(folder) => RigRun::resume(folder, &self.opening, |_| None, announcer)?,
            None => RigOpening {
                cameras: cameras.iter().map(of).collect(),
                is_synchronised: false,
                out: self.folder_for(wish),
            }
            .open(announcer)?,
        };
        self.note_sessions(run.folder());
        let (names, hand) = (run.names(), RigHand::new(Arc::default()));
        let (exit, orders) = (Arc::clone(&self.exit), hand.clone());
        let work = Box::new(move |show: &mut dyn FnMut(&RigNews<'_>)| {
            let ended = host.rig(run, &orders, show);
            let code = ended.as_ref().map_or(Exit::Failed, |ended| ended.exit);
            *exit.lock().unwrap_or_else(PoisonError::into_inner) = code;
            ended
        });
        Ok(RigOpened { names, hand, work })
    }

    /// Remembers where the session in `folder` lies, for the list of sessions.
    fn note_sessions(&mut self, folder: &Path) {
        let sessions = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
        self.session_folders.insert(sessions.unwrap_or(Path::new(".")).into());
    }

    fn opened(&mut self, wish: &SessionRequest, wake: Wake) -> anyhow::Result<Opened> {
        // Previewed cameras must be free.
        self.stop_looking();
        let config = self.config_for(wish)?;
        let opening = Opening {
            source: wish.source.clone(),
            config,
            session: wish.go_on_with.clone(),
            against: self.opening.against.clone().filter(|_| wish.go_on_with.is_none()),
            out: self.folder_for(wish),
            backend: self.opening.backend.clone(),
            board_code: wish.board_code,
            ..self.opening
        };
        let asks_square = opening.board_code.has_square();
        let host = self.session_host();
        let mut run = host.open(&opening)?;
        if opening.out.is_some() && opening.out == self.opening.out {
            self.named = self.opening.out.take();
        }
        let (pictures, note) = (run.pictures()?, run.note.take());
        let note = note.or_else(|| match run.board_id.as_str() {
            "" if asks_square && run.open.truth.is_none() && !run.resumed => {
                Some(text::start::assumed_square(run.session.setup().board.measured_m()))
            }
            "" => None,
            _ => Some(run.board_in_words()),
        });
        let source = run.open.source.identity().name;
        let folder = run.folder.path().to_path_buf();
        self.note_sessions(&folder);
        let Started { pipeline, feed: showing, adjustables, context } =
            host.start(run, move || wake())?;
        let concluding = self.concluding();
        let conclude = Box::new(move |finished| {
            let folder = context.path.clone();
            concluding(context.finished(finished), &folder)
        });
        Ok(Opened { pipeline, showing, source, folder, pictures, adjustables, note, conclude })
    }

    /// Stores the result of a session in its folder, and tells everybody.
    fn concluding(
        &self,
    ) -> impl FnOnce(anyhow::Result<FinishedRun>, &Path) -> Ended + Send + 'static {
        let host = self.session_host();
        let (exit, as_json) = (Arc::clone(&self.exit), self.as_json);
        move |run, folder| {
            // The window says why there is no view, and its folder may be binned.
            let is_empty = run.as_ref().is_ok_and(|run| run.session.accepted().is_empty());
            let host = if is_empty { host.announced_by(Announcer::silent()) } else { host };
            let outcome = host.conclude(run);
            let code = outcome.as_ref().map_or(Exit::Failed, |concluded| concluded.exit);
            *exit.lock().unwrap_or_else(PoisonError::into_inner) = code;
            let files = [folder.join(REPORT_FILE), folder.join(RESULT_FILE)]
                .into_iter()
                .filter(|file| outcome.is_ok() && file.is_file())
                .collect();
            let (compared, trouble) = match outcome {
                Ok(Concluded { result, compared, .. }) => {
                    if as_json {
                        // An unprintable result is in the session's folder all the same.
                        let _ = result.to_json().map(|json| print(&json.to_string()));
                    }
                    (compared, None)
                }
                Err(err) => (None, Some(user_error(&err))),
            };
            let compared = compared.map(|outcome| outcome.map_err(|err| user_error(&err)));
            Ended { folder: folder.into(), files, compared, trouble }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_app::BoardFromCode;
    use boresight_run::config::Config;

    #[test]
    fn a_named_folder_stays_the_next_sessions_until_one_is_opened() {
        let place = tempfile::tempdir().expect("a folder");
        let out = place.path().join("named");
        let config = Config::load(None, &[]).expect("settings");
        let opening = Opening { out: Some(out.clone()), ..Opening::new("sim", config) };
        let mut host = ProgramServices::new(opening, Host::silent());
        let wish = |go_on_with| SessionRequest {
            source: "sim".into(),
            mode: String::new(),
            board: [9, 6],
            pattern: boresight_geometry::boards::Pattern::Plain,
            square_m: 0.02,
            board_code: BoardFromCode::Nothing,
            plan: boresight_guide::guidance::Plan::Quick,
            go_on_with,
            first: None,
        };
        let missing = wish(Some(place.path().join("missing")));
        assert!(host.opened(&missing, Arc::new(|| ())).is_err());
        assert_eq!(host.folder_for(&wish(None)), Some(out.clone()));
        let nowhere = SessionRequest { source: "no-such-source".into(), ..wish(None) };
        assert!(host.opened(&nowhere, Arc::new(|| ())).is_err());
        assert_eq!(host.folder_for(&wish(None)), Some(out));
    }
}
