//! A program waiting for a phone: sessions are started, ended and restarted on the page.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use super::Phone;
use crate::{Offer, OfferedCamera, Request, Stage};
use anyhow::bail;
use boresight_app::{
    BoardFromCode, Exit, Host, Opening,
    explain::user_error,
    session::{
        camera::{self, Near, NearCamera},
        opening::new_session_path,
    },
};

use boresight_capture::{is_command, without_secrets};
use boresight_geometry::{boards::BoardChoice, markers::Dictionary};
use boresight_present::text::{self, phone as words};
use boresight_run::{
    config::{Config, PlanName},
    pipeline::Onlooker,
};

const LOOK: Duration = Duration::from_millis(50);
/// Time between two searches for cameras.
const CAMERAS_EVERY: Duration = Duration::from_secs(3);
/// Source offered always.
const SIMULATION: &str = "sim";

/// Sessions started on the phone's page.
pub struct Head {
    phone: Arc<Phone>,
    /// Settings of every session; the page chooses source, board and plan.
    opening: Opening,
    host: Host,
    last: Request,
    trouble: Option<(String, String)>,
}

impl Head {
    /// Serves `phone`, with `host` for every session.
    pub fn new(phone: Phone, opening: Opening, host: Host) -> Self {
        let board = opening.config.board.choice();
        let last = Request {
            source: without_secrets(&opening.source),
            board: [board.columns, board.rows],
            pattern: board.pattern,
            square_m: opening.config.board.square_mm * 1e-3,
            plan: plan_name(opening.config.guidance.plan).into(),
        };
        let phone = Arc::new(phone.restarting());
        let host = host.paced(true).beside(Arc::clone(&phone) as _);
        Self { phone, opening, host, last, trouble: None }
    }

    /// Waits for sessions and runs them until the host is stopped. Returns the end of the last
    /// session.
    pub fn run(mut self) -> Exit {
        let mut exit = Exit::Good;
        self.host.announcer().say(words::WAITING);
        while let Some(request) = self.wait() {
            self.last = request.clone();
            self.trouble = None;
            let ended =
                self.opening_of(&request).and_then(|opening| self.session_with_more(opening));
            match ended {
                Ok(ended) => exit = ended,
                Err(err) => {
                    exit = Exit::Failed;
                    self.host.announcer().say(&format!("boresight: {err:#}"));
                    let trouble = user_error(&err);
                    self.trouble = Some((trouble.what, trouble.action.unwrap_or_default()));
                }
            }
        }
        exit
    }

    /// Runs a session, and adds two views as often as requested by the page.
    fn session_with_more(&self, mut opening: Opening) -> anyhow::Result<Exit> {
        loop {
            let concluded = self.host.session(&opening)?;
            if !self.until_left() {
                return Ok(concluded.exit);
            }
            opening = opening.going_on(&concluded.path);
        }
    }

    /// Next session requested by a page; `None` once the host is stopped.
    fn wait(&self) -> Option<Request> {
        let (mut looked, mut shown) = (None::<Instant>, None);
        // Drop a second tap on Start made while the session was being opened.
        drop(self.phone.hub().take_request());
        while !self.host.is_stopped() {
            if looked.is_none_or(|looked| looked.elapsed() >= CAMERAS_EVERY) {
                let offer = self.offer();
                if shown.as_ref() != Some(&offer) {
                    self.phone.hub().show(Stage::Waiting(Arc::new(offer.clone())));
                    shown = Some(offer);
                }
                looked = Some(Instant::now());
            }
            if let Some(request) = self.phone.hub().take_request() {
                return Some(request);
            }
            std::thread::sleep(LOOK);
        }
        None
    }

    fn offer(&self) -> Offer {
        let config = self.opening.with_backend(&self.opening.config);
        let Near { cameras: near, unusable } = camera::near(&config.camera.backend);
        let named = |NearCamera { source, name, .. }| OfferedCamera { source, name };
        let mut cameras: Vec<OfferedCamera> = near.into_iter().map(named).collect();
        let given = self.given();
        let has_given = cameras.iter().any(|camera| camera.source == given);
        if given != "auto" && !has_given {
            let source = given;
            cameras.insert(0, OfferedCamera { name: source.clone(), source });
        }
        let no_camera = || Some((words::NO_CAMERA.to_owned(), words::NO_CAMERA_ACTION.to_owned()));
        let trouble = self
            .trouble
            .clone()
            .or_else(|| {
                let other = unusable.first()?;
                let (what, action) = other.said();
                Some((format!("{}: {what}", other.source), action))
            })
            .or_else(|| cameras.is_empty().then(no_camera).flatten());
        if self.opening.source != SIMULATION {
            let (source, name) = (SIMULATION.to_owned(), words::SIMULATION.to_owned());
            cameras.push(OfferedCamera { source, name });
        }
        let dictionaries = Dictionary::all().map(|it| (it.name(), it.count())).collect();
        Offer { cameras, dictionaries, last: Some(self.last.clone()), trouble }
    }

    /// Source on the command line, without a camera's password, for phones.
    fn given(&self) -> String {
        without_secrets(&self.opening.source)
    }

    /// Opening for `request`, checked like a settings file.
    fn opening_of(&self, request: &Request) -> anyhow::Result<Opening> {
        let mut config: Config = self.opening.config.clone();
        config.board = config.board.chosen(BoardChoice::of(request.board, request.pattern));
        config.board.square_mm = request.square_m * 1e3;
        let mut config = config.with(&[])?;
        let plans = [PlanName::Quick, PlanName::Full, PlanName::Adaptive];
        if let Some(plan) = plans.into_iter().find(|plan| plan_name(*plan) == request.plan) {
            config.guidance.plan = plan;
        }
        let is_given = request.source == self.given();
        if !is_given && is_command(&request.source) {
            bail!(text::source::NO_COMMAND_BY_PHONE);
        }
        let source = if is_given { &self.opening.source } else { &request.source }.clone();
        // A board's code needs no typing.
        let board_code = BoardFromCode::All;
        let out = Some(new_session_path());
        Ok(Opening { source, config, out, board_code, ..self.opening.clone() })
    }

    /// Waits until the page leaves the result. True if two more views are requested.
    fn until_left(&self) -> bool {
        while !self.phone.hub().wants_end() && !self.host.is_stopped() {
            if self.phone.hub().take_more() {
                return true;
            }
            std::thread::sleep(LOOK);
        }
        false
    }
}

/// Name of a plan on the page.
fn plan_name(plan: PlanName) -> &'static str {
    match plan {
        PlanName::Quick => "quick",
        PlanName::Full => "full",
        PlanName::Adaptive => "adaptive",
    }
}
