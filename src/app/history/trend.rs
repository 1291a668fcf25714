//! One camera over time.

use super::entry::Entry;
use crate::{
    calibration::{DriftVerdict, LensDifference},
    frame::ImageSize,
};

/// A calibration, and what has changed.
#[derive(Clone, Debug)]
pub struct Step {
    /// The calibration.
    pub entry: Entry,
    /// The change since the first usable calibration; `None` for that one and for those that can't be used.
    pub since_first: Option<LensDifference>,
    /// The change since the usable calibration before.
    pub since_last: Option<LensDifference>,
}

/// The calibrations of one camera in one size of picture, by time.
#[derive(Clone, Debug)]
pub struct CameraHistory {
    /// The camera.
    pub camera: String,
    /// Its own name.
    pub model: String,
    /// Width and height of the picture.
    pub image_size: [u32; 2],
    /// Its calibrations; at least one.
    pub steps: Vec<Step>,
}

impl CameraHistory {
    fn of(entries: &[Entry]) -> Option<Self> {
        let Entry { camera, model, image_size, .. } = entries.last()?.clone();
        let size = ImageSize { width_px: image_size[0], height_px: image_size[1] };
        let (mut first, mut last) = (None, None);
        let mut steps = Vec::with_capacity(entries.len());
        for entry in entries {
            let lens = entry.lens.filter(|_| entry.is_usable());
            let since = |old| LensDifference::of(&old?, &lens?, size);
            let (since_first, since_last) = (since(first), since(last));
            first = first.or(lens);
            last = lens.or(last);
            steps.push(Step { entry: entry.clone(), since_first, since_last });
        }
        Some(Self { camera, model, image_size, steps })
    }

    /// The newest change since the first calibration; `None` with fewer than two.
    pub fn change(&self) -> Option<&LensDifference> {
        self.steps.iter().rev().find_map(|step| step.since_first.as_ref())
    }

    /// Whether the newest calibration differs from the first by more than chance.
    pub fn drifts(&self) -> bool {
        self.change().is_some_and(|change| change.verdict != DriftVerdict::Ok)
    }

    /// When the newest usable calibration was made, UTC.
    pub fn newest(&self) -> Option<&str> {
        let usable = self.steps.iter().rev().find(|step| step.entry.is_usable());
        usable.map(|step| step.entry.created.as_str())
    }
}

/// The histories in `entries`, which are in the order of an index.
pub fn histories(entries: &[Entry]) -> Vec<CameraHistory> {
    let same = |a: &Entry, b: &Entry| a.camera == b.camera && a.image_size == b.image_size;
    entries.chunk_by(same).filter_map(CameraHistory::of).collect()
}
