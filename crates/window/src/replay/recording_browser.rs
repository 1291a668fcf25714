//! Open recording, or the choice of a recording.

use std::path::Path;

use egui::{ColorImage, Context, TextureOptions, Ui};

use super::{
    super::{keys::UiAction, screen::Preferences},
    Picker, Replayed, pick, show,
};
use boresight_app::{
    explain::UserError,
    window::{
        recordings::{DecidedRecording, folders_in},
        services::{Loading, Services, SmallPictures, Wake},
    },
};
use boresight_present::text::replay as words;

#[derive(Default)]
pub(in super::super) struct RecordingBrowser {
    picker: Picker,
    loading: Option<Loading>,
    pictures: Option<SmallPictures>,
    recording: Option<Box<Replayed>>,
}

impl RecordingBrowser {
    /// True if a recording is open.
    pub(in super::super) fn is_open(&self) -> bool {
        self.recording.is_some()
    }

    /// Lists the recordings to choose from.
    pub(in super::super) fn browse(&mut self, services: &dyn Services, wake: Wake) {
        self.picker.recordings = services.recordings();
        self.picker.formats = [false, true].map(|is_rig| services.formats(is_rig));
        let folders = self.picker.recordings.iter().map(|recording| recording.folder.clone());
        let unseen = folders.filter(|folder| !self.picker.pictures.contains_key(folder)).collect();
        self.pictures = services.small_pictures(unseen, wake);
    }

    /// Lists the folders in `folder` beside the recordings.
    pub(in super::super) fn look_into(&mut self, folder: &Path) {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        self.picker.path = folder.display().to_string();
        self.picker.inside = Some(folders_in(&folder));
    }

    /// Notes a running session.
    pub(in super::super) fn note_busy(&mut self, busy: bool) {
        self.picker.busy = busy;
    }

    pub(in super::super) fn close(&mut self) {
        self.recording = None;
    }

    /// Starts opening the recording in `folder`, unless another recording is being opened.
    pub(in super::super) fn open(
        &mut self,
        services: &mut dyn Services,
        folder: &Path,
        wake: Wake,
    ) {
        if self.loading.is_some() {
            return;
        }
        self.close();
        self.picker.path = folder.display().to_string();
        match services.replay(folder, wake) {
            Ok(loading) => {
                self.picker.opening = Some(folder.to_path_buf());
                self.picker.trouble = None;
                self.loading = Some(loading);
            }
            Err(trouble) => self.opened(Err(trouble)),
        }
    }

    /// Takes the opened recording, and the pictures. Never waits.
    pub(in super::super) fn look(&mut self, ctx: &Context) {
        for (folder, picture) in self.pictures.iter().filter_map(SmallPictures::outcome).flatten() {
            let size = [picture.width() as usize, picture.height() as usize];
            let pixels = ColorImage::from_gray(size, picture.as_raw());
            let name = folder.display().to_string();
            let texture = ctx.load_texture(name, pixels, TextureOptions::LINEAR);
            self.picker.pictures.insert(folder, texture);
        }
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

    /// Shows the recording, or the choice of recordings.
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
