//! The program around the window: sources, folders, settings, results.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use anyhow::{Context, bail};
use image::GrayImage;

use super::{
    Exit, camera, compare, export,
    guide::{Opening, new_session_path},
    recordings,
    run::{RESULT_FILE, Run, stop_flag},
    session_report,
};
use crate::{
    config::PlanName,
    guidance::Plan,
    pipeline::{Background, Paced, Pipeline},
    recording::{SessionFolder, Stored, stored_frame},
    session::{Session, ViewNumber},
    text,
    ui::{
        self, NoWindow,
        desk::{
            AppHost, Comparing, Ended, Loading, Opened, Recording, SessionRequest, UserError, Wake,
        },
    },
};

/// Runs sessions in a window until it is closed. The last session's result decides the exit code.
pub(super) fn run(opening: Opening, json: bool) -> anyhow::Result<Exit> {
    let program = Program::new(opening, json, true)?;
    let exit = Arc::clone(&program.exit);
    or_say_why(ui::run(Box::new(program)))?;
    Ok(*exit.lock().unwrap_or_else(PoisonError::into_inner))
}

/// The program around a window that somebody else shows.
pub(super) fn desk(opening: Opening, paced: bool) -> anyhow::Result<Box<dyn AppHost>> {
    Ok(Box::new(Program::new(opening, false, paced)?))
}

/// Turns the lack of a window into an error with its next action.
pub(super) fn or_say_why(outcome: Result<(), NoWindow>) -> anyhow::Result<()> {
    match outcome {
        Ok(()) => Ok(()),
        Err(err @ NoWindow::NoDisplay) => bail!("{err}\n{}", text::window::NO_DISPLAY_ACTION),
        Err(err @ NoWindow::Lost { .. }) => bail!("{err}\n{}", text::window::LOST_DISPLAY_ACTION),
        Err(err @ NoWindow::Refused { .. }) => bail!("{err}\n{}", text::window::NO_WINDOW_ACTION),
    }
}

struct Program {
    opening: Opening,
    json: bool,
    /// Whether sources that can wait keep to their own time.
    paced: bool,
    stop: Arc<AtomicBool>,
    /// Folders with sessions.
    shelves: BTreeSet<PathBuf>,
    exit: Arc<Mutex<Exit>>,
}

impl AppHost for Program {
    fn first_wish(&self) -> SessionRequest {
        let config = &self.opening.config;
        let plan = match config.guidance.plan {
            PlanName::Quick => Plan::Quick,
            PlanName::Full => Plan::Full,
            PlanName::Adaptive => Plan::Adaptive,
        };
        SessionRequest {
            source: self.opening.source.clone(),
            mode: config.camera.mode.clone(),
            board: [config.board.columns, config.board.rows],
            square_m: config.board.square_mm * 1e-3,
            plan,
            go_on_with: self.opening.session.clone(),
            first: None,
        }
    }

    fn open(&mut self, wish: &SessionRequest, wake: Wake) -> Result<Opened, UserError> {
        self.opened(wish, wake).map_err(|err| trouble(&err))
    }

    fn sources(&mut self) -> Vec<(String, String)> {
        let mut sources = vec![("auto".into(), text::window::SOURCE_AUTO.into())];
        sources.extend(camera::names());
        sources.push(("sim".into(), text::window::SOURCE_SIMULATED.into()));
        sources
    }

    fn modes(&mut self, source: &str) -> Vec<String> {
        camera::modes(source)
    }

    fn formats(&self) -> Vec<&'static str> {
        export::format_names()
    }

    fn export(&mut self, folder: &Path, format: usize) -> Result<PathBuf, UserError> {
        export::beside(folder, format).map_err(|err| trouble(&err))
    }

    fn older(&self, folder: &Path) -> Vec<PathBuf> {
        compare::older(folder)
    }

    fn compare(&mut self, folder: &Path, old: &Path, wake: Wake) -> Result<Comparing, UserError> {
        let (folder, old) = (folder.to_path_buf(), old.to_path_buf());
        let work = move || {
            let compared = compare::of_folder(&folder, &old).map_err(|err| trouble(&err));
            wake();
            compared
        };
        Background::start(work).map_err(|err| trouble(&err.into()))
    }

    fn recordings(&self) -> Vec<Recording> {
        recordings::within(&self.shelves)
    }

    fn replay(&mut self, folder: &Path, wake: Wake) -> Result<Loading, UserError> {
        let folder = folder.to_path_buf();
        let work = move || {
            let replayed = recordings::open(&folder).map_err(|err| trouble(&err));
            wake();
            replayed
        };
        Background::start(work).map_err(|err| trouble(&err.into()))
    }

    fn show(&mut self, file: &Path) -> Result<(), UserError> {
        let shown = Command::new("xdg-open")
            .arg(file)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        shown.map(drop).map_err(|_| UserError {
            what: text::window::NO_VIEWER.into(),
            action: Some(text::window::written(file)),
        })
    }

    fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl Program {
    fn new(opening: Opening, json: bool, paced: bool) -> anyhow::Result<Self> {
        let path = new_session_path();
        let shelf = path.parent().unwrap_or(Path::new("."));
        Ok(Self {
            opening,
            json,
            paced,
            stop: stop_flag()?,
            shelves: BTreeSet::from([shelf.into()]),
            exit: Arc::new(Mutex::new(Exit::Good)),
        })
    }

    fn opened(&mut self, wish: &SessionRequest, wake: Wake) -> anyhow::Result<Opened> {
        let mut config = self.opening.config.clone();
        [config.board.columns, config.board.rows] = wish.board;
        config.board.square_mm = wish.square_m * 1e3;
        config.camera.mode.clone_from(&wish.mode);
        // What was typed is checked as a settings file is.
        let mut config = config.with(&[])?;
        config.guidance.plan = match wish.plan {
            Plan::Quick => PlanName::Quick,
            Plan::Full => PlanName::Full,
            Plan::Adaptive => PlanName::Adaptive,
        };
        let opening = Opening {
            source: wish.source.clone(),
            config,
            session: wish.go_on_with.clone(),
            against: self.opening.against.clone().filter(|_| wish.go_on_with.is_none()),
            // A folder named for the first session is that session's; the next gets its own.
            out: self.opening.out.take().filter(|_| wish.go_on_with.is_none()),
            ..self.opening
        };
        let (run, note) = opening.open().inspect_err(|_| {
            self.opening.out.clone_from(&opening.out);
        })?;
        let pictures = pictures(&run)?;
        let source = run.source.identity().name;
        let (mut setup, rest) = run.setup()?;
        let adjustables = setup.source.adjustables();
        if setup.lossless && self.paced {
            setup.source = Box::new(Paced::new(setup.source));
        }
        let folder = rest.path.clone();
        let shelf = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
        self.shelves.insert(shelf.unwrap_or(Path::new(".")).into());
        let (pipeline, showing) = Pipeline::start_shown(setup, move || wake())?;
        let (json, exit) = (self.json, Arc::clone(&self.exit));
        let conclude = Box::new(move |finished| {
            let folder = rest.path.clone();
            let outcome = rest.ran(finished).and_then(|ran| ran.conclude(json));
            let code = outcome.as_ref().map_or(Exit::Failed, |(code, _)| *code);
            *exit.lock().unwrap_or_else(PoisonError::into_inner) = code;
            let files = [session_report::page_path(&folder), folder.join(RESULT_FILE)]
                .into_iter()
                .filter(|file| outcome.is_ok() && file.is_file())
                .collect();
            let (compared, trouble) = match outcome {
                Ok((_, compared)) => (compared, None),
                Err(err) => (None, Some(trouble(&err))),
            };
            let compared = compared.map(|outcome| outcome.map_err(|err| self::trouble(&err)));
            Ended { folder, files, compared, trouble }
        });
        Ok(Opened { pipeline, showing, source, folder, pictures, adjustables, note, conclude })
    }
}

/// The stored pictures of the views that are there already.
fn pictures(run: &Run) -> anyhow::Result<Vec<(ViewNumber, GrayImage)>> {
    let session: &Session = &run.session;
    if session.accepted().is_empty() {
        return Ok(Vec::new());
    }
    let path = run.folder.path();
    let lines = SessionFolder::journal(path)?.lines;
    let stored: Vec<Stored> = lines.into_iter().filter_map(|line| line.stored).collect();
    session
        .accepted()
        .iter()
        .filter_map(|view| {
            let frame = view.view.frame_id.0;
            let stored = stored.iter().find(|stored| stored.frame == frame)?;
            Some((view.number, stored))
        })
        .map(|(number, stored)| {
            let picture = stored_frame(path, stored).context("a view's picture is gone")?;
            Ok((number, picture))
        })
        .collect()
}

fn trouble(err: &anyhow::Error) -> UserError {
    UserError { what: format!("{err:#}"), action: text::explain(err) }
}
