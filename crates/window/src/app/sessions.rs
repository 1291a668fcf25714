//! Stored sessions: results, resumption, and dropped paths.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use egui::Context;

use super::{
    super::{result, screen::Screen, session_state::SessionState},
    App, Page,
};
use boresight_app::{
    explain::UserError,
    window::{
        recordings::{Dropped, StoredSession},
        services::{Ended, SessionRequest, Storing},
    },
};
use boresight_guide::session::Command;
use boresight_present::text::sessions as words;

/// Source name for the recorded source of a resumed session.
const RECORDED: &str = "auto";

impl App {
    /// True if a session runs or is being stored.
    fn has_session(&self) -> bool {
        matches!(self.stage, SessionState::Running(_) | SessionState::Ending(_))
    }

    /// Starts showing the result of the session in `folder`.
    pub(super) fn show_stored(&mut self, folder: PathBuf) {
        if self.has_session() {
            self.note = Some(words::FINISH_FIRST.into());
            return;
        }
        self.result = result::ResultPage::default();
        let storing = self.services.stored(&folder, Arc::clone(&self.wake));
        self.store(folder, storing, words::OPENING);
    }

    /// Starts carrying out `command` on the ended session in `folder`, and shows its new result.
    pub(super) fn correct(&mut self, folder: PathBuf, command: Command) {
        if self.storing.is_none() {
            let storing = self.services.correct(&folder, command, Arc::clone(&self.wake));
            self.store(folder, storing, words::CORRECTING);
        }
    }

    fn store(&mut self, folder: PathBuf, storing: Result<Storing, UserError>, note: &str) {
        match storing {
            Ok(storing) => {
                self.note = Some(note.into());
                self.storing = Some((folder, storing));
            }
            Err(trouble) => self.note = Some(trouble.what),
        }
    }

    /// Takes the loaded session. Never waits.
    pub(super) fn look_at_stored(&mut self, ctx: &Context) {
        let Some((_, storing)) = &self.storing else { return };
        let stored = match storing.outcome() {
            Some(stored) => stored,
            None if storing.is_over() => {
                self.note = Some(words::NOT_OPENED.into());
                self.storing = None;
                return;
            }
            None => return,
        };
        let Some((folder, _)) = self.storing.take() else { return };
        match stored {
            // A session started meanwhile continues.
            Ok(stored) if !self.has_session() => self.show_ended(ctx, folder, stored),
            Ok(_) => self.note = Some(words::FINISH_FIRST.into()),
            Err(trouble) => {
                let action = trouble.action.map(|action| format!(". {action}"));
                self.note = Some(trouble.what + &action.unwrap_or_default());
            }
        }
    }

    fn show_ended(&mut self, ctx: &Context, folder: PathBuf, stored: StoredSession) {
        let StoredSession { snapshot, pictures, source, files } = stored;
        let preferences = self.screen.preferences;
        let is_same = self.ended().is_some_and(|ended| ended.folder == folder);
        self.screen = Screen { preferences, now_secs: ctx.time(), source, ..Screen::default() };
        self.screen.folder = Some(folder.clone());
        if let Some((_, picture)) = pictures.last() {
            self.screen.picture.show_image(picture);
        }
        for (view, picture) in &pictures {
            self.screen.add_thumbnail(ctx, *view, picture);
        }
        self.screen.snapshot = Some(snapshot);
        // Sessions started from here reuse the board and source.
        let board = self.screen.snapshot.as_ref().map(|snapshot| snapshot.setup.board);
        if let Some(board) = board.filter(|_| !is_same) {
            let side = |corners: usize| u16::try_from(corners).unwrap_or(u16::MAX);
            self.wish.board = [side(board.columns()), side(board.rows())];
            self.wish.source = RECORDED.into();
        }
        let ended = Ended { folder, files, compared: None, trouble: None };
        self.result.begin(&ended, self.services.older(&ended.folder));
        (self.exported, self.note, self.page) = (None, None, Page::Result);
        self.stage = SessionState::Ended(ended);
        if let Some(old) = self.compare_later.take() {
            self.compare(&old);
        }
    }

    /// Resumes the session in `folder` with recorded source and settings.
    pub(super) fn go_on_with(&mut self, ctx: &Context, folder: PathBuf) {
        if self.has_session() {
            self.note = Some(words::FINISH_FIRST.into());
            return;
        }
        let wish = SessionRequest {
            source: RECORDED.into(),
            go_on_with: Some(folder),
            first: None,
            ..self.wish.clone()
        };
        self.open(ctx, wish);
    }

    pub(super) fn export_of(&mut self, folder: &Path, format: usize) {
        self.note = Some(match self.services.export(folder, format) {
            Ok(file) => boresight_present::text::result::written(&file),
            Err(trouble) => trouble.what,
        });
    }

    /// Moves the session in `folder` to the bin, unless it's running.
    pub(super) fn delete(&mut self, folder: &Path) {
        if self.has_session() && self.screen.folder.as_deref() == Some(folder) {
            self.note = Some(words::RUNS.into());
            return;
        }
        self.note = Some(match self.services.delete(folder) {
            Ok(()) => words::deleted(folder),
            Err(trouble) => trouble.what,
        });
        // Its result can't be shown any more.
        if self.ended().is_some_and(|ended| ended.folder == folder) {
            self.stage = SessionState::Idle;
            self.screen = Screen {
                preferences: self.screen.preferences,
                now_secs: self.screen.now_secs,
                ..Screen::default()
            };
        }
        self.shelf.browse(&*self.services, Arc::clone(&self.wake));
    }

    /// Handles a dropped file or folder.
    pub(super) fn dropped(&mut self, path: &Path) {
        match self.services.dropped(path) {
            Dropped::Session => self.show_stored(path.to_path_buf()),
            Dropped::Source if self.has_session() => self.note = Some(words::FINISH_FIRST.into()),
            Dropped::Source => {
                let source = path.display().to_string();
                self.note = Some(words::source_chosen(&source));
                self.start.draft.source = source;
                self.page = Page::Start;
            }
            Dropped::File if matches!(self.stage, SessionState::Ended(_)) => {
                self.page = Page::Result;
                self.compare(path);
            }
            Dropped::File => {
                self.note = Some(words::compared_later(path));
                self.compare_later = Some(path.to_path_buf());
            }
        }
    }
}
