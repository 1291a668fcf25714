//! The open recording, or the choice of one.

use std::path::Path;

use egui::Ui;

use super::{
    super::{keys::UiAction, screen::Preferences},
    Picker, Replayed, pick, show,
};
use boresight_app::{
    host::{AppHost, Loading, UserError, Wake},
    recordings::DecidedRecording,
};
use boresight_present::text::replay as words;

#[derive(Default)]
pub(in super::super) struct RecordingBrowser {
    picker: Picker,
    loading: Option<Loading>,
    recording: Option<Box<Replayed>>,
}

impl RecordingBrowser {
    /// True if a recording is open.
    pub(in super::super) fn is_open(&self) -> bool {
        self.recording.is_some()
    }

    /// Sees what there is to choose from.
    pub(in super::super) fn browse(&mut self, host: &dyn AppHost) {
        self.picker.recordings = host.recordings();
    }

    pub(in super::super) fn close(&mut self) {
        self.recording = None;
    }

    /// Begins to open the recording in `folder`, unless another one is being opened.
    pub(in super::super) fn open(&mut self, host: &mut dyn AppHost, folder: &Path, wake: Wake) {
        if self.loading.is_some() {
            return;
        }
        self.close();
        self.picker.path = folder.display().to_string();
        match host.replay(folder, wake) {
            Ok(loading) => {
                self.picker.opening = Some(folder.to_path_buf());
                self.picker.trouble = None;
                self.loading = Some(loading);
            }
            Err(trouble) => self.opened(Err(trouble)),
        }
    }

    /// Takes the opened recording. Never waits.
    pub(in super::super) fn look(&mut self) {
        let Some(loading) = &self.loading else { return };
        let nobody_knows = || UserError { what: words::NOT_OPENED.into(), action: None };
        let opened = match loading.outcome() {
            Some(opened) => opened,
            None if loading.is_over() => Err(nobody_knows()),
            None => return,
        };
        self.loading = None;
        self.opened(opened);
    }

    fn opened(&mut self, outcome: Result<DecidedRecording, UserError>) {
        self.picker.opening = None;
        match outcome {
            Ok(recording) => self.recording = Replayed::new(recording).map(Box::new),
            Err(trouble) => self.picker.trouble = Some(trouble),
        }
    }

    /// Shows the recording, or the choice of one.
    pub(in super::super) fn show(
        &mut self,
        ui: &mut Ui,
        preferences: Preferences,
        asks: &mut Vec<UiAction>,
    ) {
        match &mut self.recording {
            Some(recording) => {
                recording.prefer(preferences);
                show(ui, recording);
            }
            None => pick(ui, &mut self.picker, asks),
        }
    }
}
