//! A single watched camera: its store, its references, and its state.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use hmac_sha256::Hash;
use image::GrayImage;

use super::{
    burst::{of_burst, seen},
    feed::Taken,
    store::{Access, Named, Store, Stored, inputs},
};
use boresight_app::{RESULT_FILE, session::comparison};
use boresight_files::{Links, TEXT_LIMIT, read};
use boresight_geometry::frame::ImageSize;
use boresight_watch::{Answer, Decision, Input, Lens, NoAnswer, Picture, Station, Watch};

/// Maximum number of looks for a pin: then it's too dark or too empty for one.
const PIN_LOOKS: u64 = 12;

/// A watched camera.
#[derive(Debug)]
pub struct WatchedCamera {
    store: Store,
    station: Station,
    watch: Watch,
    pictures: [u64; 2],
    newest_secs: Option<f64>,
    newest_picture_secs: Option<f64>,
    newest_answer: Option<Answer>,
    /// Seconds of the pictures already looked at.
    looked_at: BTreeSet<i64>,
    /// Seconds of unreadable pictures: perhaps still being written, until a newer one comes.
    unread: BTreeSet<i64>,
    /// Newest second before the camera was accepted in the present pose.
    before_accepted: Option<i64>,
    /// True for a question: nothing is learned or recorded.
    is_asked: bool,
}

/// Lens of a calibration file, or of the session in a folder, and the file's name.
///
/// # Errors
///
/// If there is no calibration with a single lens.
pub fn reference_lens(path: &Path) -> anyhow::Result<(Lens, Named)> {
    let file: PathBuf = if path.is_dir() { path.join(RESULT_FILE) } else { path.to_path_buf() };
    let old = comparison::read(&file)?;
    if old.focal_varies {
        bail!(
            "{file:?} has a focal length for each view; a camera whose focus moves can't be watched"
        );
    }
    let bytes = read(&file, TEXT_LIMIT, Links::Followed)?;
    let sha256 = Hash::hash(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    let named = Named { path: file.display().to_string(), sha256 };
    Ok((Lens::new(old.camera, old.covariance, old.image_size), named))
}

impl WatchedCamera {
    /// Opens the store in `folder`, or creates it from the calibration `reference` or the source's
    /// lens.
    ///
    /// # Errors
    ///
    /// If there is no store and no reference, if the reference is another calibration than the
    /// store's, or if files can't be read or written.
    pub fn open(
        folder: &Path,
        name: &str,
        reference: Option<&Path>,
        (own_lens, patches_only): (Option<Lens>, bool),
    ) -> anyhow::Result<(Self, bool)> {
        let known = Store::read(folder)?;
        if known.is_none() && folder.join(preset(1)).is_dir() {
            bail!(
                "{folder:?} holds a camera's presets: watch it with --presets, or name one, such as {:?}",
                folder.join(preset(1))
            );
        }
        match (&known, reference) {
            (None, None) => {
                let Some(lens) = own_lens else {
                    bail!(
                        "{folder:?} holds no watched camera yet: name its calibration with --reference"
                    );
                };
                let simulated = Named { path: "simulated".into(), sha256: String::new() };
                Store::create(folder, name, simulated, &lens, patches_only)?;
            }
            (None, Some(reference)) => {
                let (lens, named) = reference_lens(reference)?;
                Store::create(folder, name, named, &lens, patches_only)?;
            }
            (Some(file), Some(reference)) => {
                let (_, named) = reference_lens(reference)?;
                if named.sha256 != file.calibration.sha256 {
                    bail!(
                        "{folder:?} is watched by another calibration, {:?}: give the new one a new --store",
                        file.calibration.path
                    );
                }
            }
            (Some(_), None) => {}
        }
        let (store, stored) = Store::open(folder, Access::Watch)?;
        let was_cut = stored.was_cut;
        Ok((Self::of(store, stored), was_cut))
    }

    /// Opens the store in `folder` to look at, also while it's watched. Nothing is changed.
    ///
    /// # Errors
    ///
    /// If there is no store, or it's damaged.
    pub fn look_at(folder: &Path) -> anyhow::Result<Self> {
        let (store, stored) = Store::open(folder, Access::Look)?;
        Ok(Self::of(store, stored))
    }

    /// Opens the store in `folder` for a question about the present, also while it's watched:
    /// pictures are looked at, and nothing is changed.
    ///
    /// # Errors
    ///
    /// If there is no store, or it's damaged.
    pub fn ask(folder: &Path, at_secs: f64) -> anyhow::Result<Self> {
        let mut camera = Self::look_at(folder)?;
        camera.watch.ask(at_secs);
        camera.is_asked = true;
        Ok(camera)
    }

    /// Makes the next references a pin, unless the camera is learned.
    pub fn pin(&mut self) {
        self.station.is_pinned = true;
    }

    /// True for the first looks at a camera still to be pinned.
    pub fn is_to_be_pinned(&self) -> bool {
        let is_known = !self.station.gallery.references.is_empty() || self.is_asked;
        self.station.is_pinned && !is_known && self.pictures.iter().sum::<u64>() < PIN_LOOKS
    }

    fn of(store: Store, stored: Stored) -> Self {
        let mut camera = Self {
            store,
            watch: Watch::new(&stored.station.lens),
            station: stored.station,
            pictures: [0, 0],
            newest_secs: None,
            newest_picture_secs: None,
            newest_answer: None,
            looked_at: BTreeSet::new(),
            unread: BTreeSet::new(),
            is_asked: false,
            before_accepted: None,
        };
        camera.handle_all(&stored.inputs);
        camera.station.is_pinned = camera.watch.is_pinned();
        camera
    }

    /// Name of the camera.
    pub fn name(&self) -> &str {
        &self.store.file().name
    }

    /// Folder of the store.
    pub fn folder(&self) -> &Path {
        self.store.folder()
    }

    /// Lens of the camera.
    pub fn lens(&self) -> &Lens {
        &self.station.lens
    }

    /// References of the camera.
    pub fn station(&self) -> &Station {
        &self.station
    }

    /// State so far.
    pub fn watch(&self) -> &Watch {
        &self.watch
    }

    /// Pictures with and without an answer.
    pub fn pictures(&self) -> [u64; 2] {
        self.pictures
    }

    /// Time of the reported state, seconds since 1970: that of the newest picture, or of a missing
    /// one.
    pub fn newest_secs(&self) -> Option<f64> {
        self.newest_secs
    }

    /// Time of the newest picture, seconds since 1970. Missing and unreadable pictures don't count:
    /// they are read when they come.
    pub fn newest_picture_secs(&self) -> Option<f64> {
        self.newest_picture_secs
    }

    /// True if the picture taken at second `at`, since 1970, needs no look: already looked at, or
    /// older than the acceptance of the present pose.
    pub(super) fn knows(&self, at: i64) -> bool {
        self.looked_at.contains(&at) || self.before_accepted.is_some_and(|newest| at <= newest)
    }

    /// The newest answer.
    pub fn newest_answer(&self) -> Option<&Answer> {
        self.newest_answer.as_ref()
    }

    /// Looks at the pictures of a moment, in order; records the decision before returning it.
    ///
    /// # Errors
    ///
    /// If the decision can't be recorded.
    pub fn look(&mut self, burst: Vec<GrayImage>, taken: Taken) -> anyhow::Result<Decision> {
        if self.is_asked {
            // Each picture of a burst is a look of its own.
            let looks =
                burst.into_iter().filter_map(|p| seen(&self.station, vec![p], taken.at_secs));
            let inputs: Vec<Input> = looks.map(|l| Input::Picture(Box::new(l.picture))).collect();
            return Ok(self.handle_all(&inputs));
        }
        self.take_accepted()?;
        let (station, shelf) = (&mut self.station, self.store.shelf());
        let mut looked = of_burst(station, burst, taken.at_secs.round(), &self.watch, shelf);
        for input in &mut looked.inputs {
            if let Input::Picture(picture) = input {
                picture.late = taken.is_late;
            }
        }
        let changed = looked.references_changed.then_some(&self.station);
        self.store.record(&looked.inputs, changed)?;
        self.store.shelf().clear_dropped();
        Ok(self.handle_all(&looked.inputs))
    }

    /// Notes a missing or unusable picture.
    ///
    /// # Errors
    ///
    /// If the note can't be recorded.
    pub fn no_picture(&mut self, reason: NoAnswer, taken: Taken) -> anyhow::Result<Decision> {
        if !self.is_asked {
            self.take_accepted()?;
        }
        let (at, late) = (taken.at_secs.round(), taken.is_late);
        let picture = Picture { at, late, answer: None, none: Some(reason) };
        let inputs = [Input::Picture(Box::new(picture))];
        if !self.is_asked {
            self.store.record(&inputs, None)?;
        }
        Ok(self.handle_all(&inputs))
    }

    fn handle_all(&mut self, inputs: &[Input]) -> Decision {
        for input in inputs {
            self.watch.handle(input);
            self.count(input);
        }
        self.newest_answer = newest_answer(inputs).or(self.newest_answer.take());
        self.watch.decision().clone()
    }

    fn count(&mut self, input: &Input) {
        let picture = match input {
            Input::Picture(picture) => picture,
            Input::Accepted { at, .. } => {
                // A time to come was wrong.
                self.before_accepted = self.looked_at.range(..=*at as i64).next_back().copied();
                self.newest_picture_secs = self.before_accepted.map(|at| at as f64);
                return;
            }
            Input::Learned { .. } => return,
        };
        self.pictures[usize::from(picture.answer.is_none())] += 1;
        if !picture.late {
            self.newest_secs = Some(picture.at);
        }
        let at = picture.at as i64;
        if picture.none.is_some_and(|none| !none.is_of_a_picture()) {
            self.unread.insert(at);
            return;
        }
        let newest = self.newest_picture_secs.map_or(picture.at, |at| at.max(picture.at));
        self.newest_picture_secs = Some(newest);
        self.looked_at.insert(at);
        let newer = self.unread.split_off(&at);
        self.looked_at.append(&mut std::mem::replace(&mut self.unread, newer));
    }

    /// Learns again if a person has accepted the present pose.
    fn take_accepted(&mut self) -> anyhow::Result<()> {
        let accepted = self.store.newly_accepted()?;
        if accepted.is_empty() {
            return Ok(());
        }
        self.station.forget(self.store.shelf());
        self.store.record(&accepted, Some(&self.station))?;
        self.store.shelf().clear_dropped();
        self.handle_all(&accepted);
        Ok(())
    }
}

/// Folder name of a preset.
pub(super) fn preset(number: usize) -> String {
    format!("preset-{number}")
}

/// Checks the picture size of a camera with the given lens.
///
/// # Errors
///
/// If the calibration is for another size.
pub(super) fn check_size(lens: &Lens, size: ImageSize) -> anyhow::Result<()> {
    let wanted = lens.image_size;
    if size == wanted {
        return Ok(());
    }
    bail!("its pictures have {size} px and the calibration is for {wanted} px");
}

fn newest_answer(inputs: &[Input]) -> Option<Answer> {
    inputs.iter().rev().find_map(|input| match input {
        Input::Picture(picture) if picture.late => None,
        Input::Picture(picture) => picture.answer.clone(),
        Input::Learned { .. } | Input::Accepted { .. } => None,
    })
}

/// Decisions of the store in `folder` with times, from recorded inputs alone.
///
/// # Errors
///
/// If there is no store, or a line is damaged.
pub fn replayed(folder: &Path) -> anyhow::Result<(Lens, Vec<(f64, Decision)>)> {
    let (lens, inputs) = inputs(folder).context("could not replay")?;
    let mut watch = Watch::new(&lens);
    let decisions = inputs.iter().map(|input| {
        let at = match input {
            Input::Picture(picture) => picture.at,
            Input::Learned { at, .. } | Input::Accepted { at, .. } => *at,
        };
        (at, watch.handle(input))
    });
    let decisions = decisions.collect();
    Ok((lens, decisions))
}
