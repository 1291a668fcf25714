//! A session in the window, from the start to the stored result.

use std::collections::VecDeque;

use egui::Context;

use super::screen::Screen;
use boresight_app::{
    explain::UserError,
    window::services::{Ended, Opened, Wake},
};
use boresight_geometry::device::Control;
use boresight_guide::{
    guidance::Progress,
    session::{Command, Snapshot},
};
use boresight_run::pipeline::Background;

pub(super) enum SessionState {
    /// No session yet.
    Idle,
    /// The session could not be started.
    NotStarted(UserError),
    /// Views are being taken.
    Running(Box<Running>),
    /// The result is being computed and stored.
    Ending(Background<Ended>),
    /// The result is stored.
    Ended(Ended),
}

/// A session under way.
pub(super) struct Running {
    opened: Opened,
    /// Commands waiting for room in the session's inbox.
    unsent: VecDeque<Command>,
    /// True if views were collected at some time: a resumed session may be complete already, and is
    /// then ended by hand, or by an action on it.
    has_collected: bool,
}

/// News since the last look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct News {
    /// A view was taken.
    pub(super) taken: bool,
    /// The session takes nothing more.
    pub(super) over: bool,
}

impl Running {
    pub(super) fn new(opened: Opened, first: Option<Command>) -> Self {
        Self { opened, unsent: first.into_iter().collect(), has_collected: false }
    }

    pub(super) fn adjust(&self, control: Control, value: i64) {
        self.opened.pipeline.adjust(control, value);
    }

    pub(super) fn command(&mut self, command: Command) {
        self.unsent.push_back(command);
    }

    /// Brings the news onto the screen. Never waits.
    pub(super) fn look(&mut self, ctx: &Context, screen: &mut Screen) -> News {
        while let Some(command) = self.unsent.pop_front() {
            if let Err(command) = self.opened.pipeline.try_command(command) {
                self.unsent.push_front(command);
                break;
            }
        }
        let mut news = News::default();
        let showing = &self.opened.showing;
        if let Some(frame) = showing.newest_frame() {
            screen.picture.show_frame(&frame, screen.now_secs);
        }
        while let Some(taken) = showing.next_accepted() {
            screen.add_thumbnail(ctx, taken.view, &taken.frame.image);
            screen.taken_secs = Some(screen.now_secs);
            news.taken = true;
        }
        screen.frames_replaced = self.opened.pipeline.frames_replaced();
        if let Some(snapshot) = showing.newest_snapshot() {
            let collecting = snapshot.decision.progress == Progress::Collecting;
            self.has_collected |= collecting;
            news.over = (self.has_collected && !collecting) || has_stopped(&snapshot);
            screen.show(snapshot);
        }
        // The session thread ends early if nothing can be stored any more.
        news.over |= showing.has_ended();
        news
    }

    /// Ends the session in the background.
    pub(super) fn end(self, wake: Wake) -> SessionState {
        let Opened { pipeline, showing, folder, conclude, .. } = self.opened;
        // Its last pictures are of no interest.
        drop(showing);
        let ending = pipeline.stop_then(move |finished| {
            let ended = conclude(finished);
            wake();
            ended
        });
        match ending {
            Ok(ending) => SessionState::Ending(ending),
            Err(err) => {
                let trouble = Some(UserError { what: err.to_string(), action: None });
                SessionState::Ended(Ended { folder, files: Vec::new(), compared: None, trouble })
            }
        }
    }
}

fn has_stopped(snapshot: &Snapshot) -> bool {
    snapshot.source_ended || !snapshot.failures.is_empty()
}
