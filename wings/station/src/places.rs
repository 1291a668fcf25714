//! Places seen by a camera: a single one, or several presets. Each place is watched separately, in
//! a store of its own.

use std::path::{Path, PathBuf};

use anyhow::bail;
use image::GrayImage;

use super::{
    camera::{WatchedCamera, check_size, preset, reference_lens},
    feed::Taken,
    shelf::PictureShelf,
    store::Store,
};
use boresight_geometry::frame::ImageSize;
use boresight_watch::{DAY_SECS, Decision, Lens, NoAnswer, Reference, Shelf, View, agreeing};

/// The places of a camera.
#[derive(Debug)]
pub struct Places {
    cameras: Vec<WatchedCamera>,
    presets: Option<Presets>,
}

/// Presets still to be found.
#[derive(Debug)]
struct Presets {
    most: usize,
    folder: PathBuf,
    name: String,
    reference: Option<PathBuf>,
    lens: Lens,
    patches_only: bool,
    /// Pictures of unknown places, on a shelf: the second picture of a place makes it a preset.
    waiting: Vec<(u64, Reference)>,
    shelf: PictureShelf,
}

/// Listener for decisions, on any of the threads.
pub(super) type Hear<'a> = &'a (dyn Fn(&WatchedCamera, &Decision) + Sync);

impl Places {
    /// A camera with a single place.
    pub fn one(camera: WatchedCamera) -> Self {
        Self { cameras: vec![camera], presets: None }
    }

    /// A camera with up to `most` presets; those found so far are in folders below `folder`.
    ///
    /// # Errors
    ///
    /// As [`WatchedCamera::open`], with cut lines reported to `was_cut`; and if presets may still
    /// be found but the camera's lens is unknown.
    pub fn presets(
        (folder, name): (&Path, &str),
        reference: Option<&Path>,
        (own_lens, patches_only): (Option<Lens>, bool),
        most: usize,
        was_cut: impl Fn(&str),
    ) -> anyhow::Result<Self> {
        if Store::read(folder)?.is_some() {
            bail!("{folder:?} watches one place: give presets a --store of their own");
        }
        let mut cameras = Vec::new();
        while Store::read(&folder.join(preset(cameras.len() + 1)))?.is_some() {
            let below = folder.join(preset(cameras.len() + 1));
            let (camera, cut) = WatchedCamera::open(&below, name, reference, (None, patches_only))?;
            if cut {
                was_cut(camera.name());
            }
            cameras.push(camera);
        }
        let lens = match (own_lens, reference) {
            (Some(lens), _) => lens,
            (None, Some(reference)) => reference_lens(reference)?.0,
            (None, None) => match cameras.first() {
                Some(camera) if cameras.len() >= most => camera.lens().clone(),
                _ => bail!(
                    "name the camera's calibration with --reference: a preset may still be found"
                ),
            },
        };
        let mut shelf = PictureShelf::at(folder, patches_only);
        let kept = shelf.kept();
        let waits = |(number, at_secs)| {
            let view = View::of(shelf.take(number)?);
            Some((number, Reference::of(&view, at_secs, &lens, |_, _| false)))
        };
        let waiting = kept.into_iter().filter_map(waits).collect();
        let (folder, name) = (folder.to_path_buf(), name.to_owned());
        let reference = reference.map(Path::to_path_buf);
        let presets = Presets { most, folder, name, reference, lens, patches_only, waiting, shelf };
        Ok(Self { cameras, presets: Some(presets) })
    }

    /// True for the first looks at a camera still to be pinned.
    pub(super) fn is_to_be_pinned(&self) -> bool {
        self.cameras.iter().any(WatchedCamera::is_to_be_pinned)
    }

    /// Each place as a separate camera.
    pub fn cameras(&self) -> &[WatchedCamera] {
        &self.cameras
    }

    /// Time of the newest picture, seconds since 1970, as [`WatchedCamera::newest_picture_secs`].
    pub fn newest_picture_secs(&self) -> Option<f64> {
        let waiting = self.presets.iter().flat_map(|p| &p.waiting).map(|(_, w)| w.taken_secs);
        let seen = self.cameras.iter().filter_map(WatchedCamera::newest_picture_secs);
        seen.chain(waiting).reduce(f64::max)
    }

    /// True if the picture taken at second `at`, since 1970, needs no look. While presets may still
    /// be found, only pictures newer than all before are looked at: those of unknown places leave
    /// no line.
    pub(super) fn knows(&self, at: i64) -> bool {
        if self.presets.as_ref().is_some_and(|presets| self.cameras.len() < presets.most) {
            return self.newest_picture_secs().is_some_and(|newest| at as f64 <= newest);
        }
        self.cameras.iter().any(|camera| camera.knows(at))
    }

    /// Looks at the pictures of a moment; records decisions before handing them to `hear`.
    ///
    /// # Errors
    ///
    /// If a decision can't be recorded.
    pub(super) fn look(
        &mut self,
        burst: Vec<GrayImage>,
        taken: Taken,
        hear: Hear<'_>,
    ) -> anyhow::Result<()> {
        let (Some(presets), Some(middle)) = (&mut self.presets, burst.get(burst.len() / 2)) else {
            return self.look_at(0, burst, taken, hear);
        };
        let view = View::of(middle.clone());
        if !view.shows_something() {
            return self.no_picture(NoAnswer::TooDark, taken, hear);
        }
        let best = |agreeing: &dyn Fn(&WatchedCamera) -> Option<usize>| {
            let all = self.cameras.iter().enumerate();
            all.filter_map(|(index, camera)| Some((agreeing(camera)?, index))).max()
        };
        // Moved places are searched only when every preset is known: two may overlap.
        let all_known = self.cameras.len() >= presets.most;
        let moved = |camera: &WatchedCamera| Some(camera.station().measure(&view).ok()?.inliers);
        let known = best(&|camera| camera.station().agreeing(&view))
            .or_else(|| all_known.then(|| best(&moved)).flatten());
        if let Some((_, index)) = known {
            self.look_at(index, burst, taken, hear)?;
            return self.note_silence(taken.at_secs, hear);
        }
        if all_known {
            return self.no_picture(NoAnswer::BetweenPresets, taken, hear);
        }
        if let Some((first_secs, first)) = presets.second_of_a_place(&view, taken.at_secs) {
            let camera = presets.open(self.cameras.len() + 1)?;
            self.cameras.push(camera);
            let index = self.cameras.len() - 1;
            self.look_at(index, vec![first], Taken::at(first_secs), hear)?;
            self.look_at(index, burst, taken, hear)?;
        }
        if let Some(presets) = &mut self.presets {
            presets.shelf.clear_dropped();
        }
        Ok(())
    }

    fn look_at(
        &mut self,
        index: usize,
        burst: Vec<GrayImage>,
        taken: Taken,
        hear: Hear<'_>,
    ) -> anyhow::Result<()> {
        if let Some(camera) = self.cameras.get_mut(index) {
            let decision = camera.look(burst, taken)?;
            hear(camera, &decision);
        }
        Ok(())
    }

    /// Notes a missing or unusable picture at every place.
    ///
    /// # Errors
    ///
    /// If the note can't be recorded.
    pub(super) fn no_picture(
        &mut self,
        reason: NoAnswer,
        taken: Taken,
        hear: Hear<'_>,
    ) -> anyhow::Result<()> {
        for camera in &mut self.cameras {
            let decision = camera.no_picture(reason, taken)?;
            hear(camera, &decision);
        }
        Ok(())
    }

    /// Notes a day without visit at each preset.
    fn note_silence(&mut self, at_secs: f64, hear: Hear<'_>) -> anyhow::Result<()> {
        for camera in &mut self.cameras {
            if camera.newest_secs().is_some_and(|newest| at_secs - newest > DAY_SECS) {
                let decision = camera.no_picture(NoAnswer::BetweenPresets, Taken::at(at_secs))?;
                hear(camera, &decision);
            }
        }
        Ok(())
    }

    /// Checks the size of the camera's pictures.
    ///
    /// # Errors
    ///
    /// If the calibration is for another size.
    pub(super) fn check_size(&self, size: ImageSize) -> anyhow::Result<()> {
        let known = self.cameras.first().map(WatchedCamera::lens);
        known.or(self.presets.as_ref().map(|p| &p.lens)).map_or(Ok(()), |l| check_size(l, size))
    }
}

impl Presets {
    /// First picture of the place in `view`, with time. At a new place, `view` waits for its second
    /// picture.
    fn second_of_a_place(&mut self, view: &View, at_secs: f64) -> Option<(f64, GrayImage)> {
        let is_it = |(_, w): &(u64, Reference)| agreeing(w, view, &self.lens).is_some();
        if let Some(index) = self.waiting.iter().position(is_it) {
            let (number, first) = self.waiting.remove(index);
            self.shelf.drop(number);
            return Some((first.taken_secs, self.shelf.take(number)?));
        }
        let number = self.waiting.last().map_or(0, |(number, _)| number + 1);
        let at_secs = at_secs.round();
        self.shelf.put(number, at_secs, &view.grey);
        self.waiting.push((number, Reference::of(view, at_secs, &self.lens, |_, _| false)));
        // Pictures of a camera under way never come again.
        let surplus = self.waiting.len().saturating_sub(2 * self.most);
        for (number, _) in self.waiting.drain(..surplus) {
            self.shelf.drop(number);
        }
        None
    }

    /// Opens the store of a preset by number.
    fn open(&self, number: usize) -> anyhow::Result<WatchedCamera> {
        let lens = self.reference.is_none().then(|| self.lens.clone());
        let (camera, _) = WatchedCamera::open(
            &self.folder.join(preset(number)),
            &format!("{} {}", self.name, preset(number)),
            self.reference.as_deref(),
            (lens, self.patches_only),
        )?;
        Ok(camera)
    }
}
