//! History of a camera over time.

use super::entry::Entry;
use boresight_calibrate::{LensDifference, StatedLens};
use boresight_geometry::frame::ImageSize;

/// χ² quantile at 99.5 % with 3 degrees of freedom: two comparisons together have the 1 % false
/// alarms of a single check.
const LIMIT_OF_TWO: f64 = 12.838;

/// A calibration with changes.
#[derive(Clone, Debug)]
pub struct Step<'a> {
    /// The calibration of this step.
    pub entry: &'a Entry,
    /// Change since the first usable calibration; `None` for the first and for unusable ones.
    pub since_first: Option<LensDifference>,
    /// Change since the previous usable calibration.
    pub since_last: Option<LensDifference>,
}

/// A change over a camera's whole history.
#[derive(Clone, Copy, Debug)]
pub struct Trend {
    /// Change from the mean of the oldest calibrations to the mean of the newest.
    pub change: LensDifference,
    /// Number of calibrations in the mean of the oldest.
    pub oldest: usize,
    /// Number of calibrations in the mean of the newest.
    pub newest: usize,
    /// True if the change is significant: beyond chance for both comparisons together.
    pub drifts: bool,
}

/// Calibrations of a camera of a picture size, by time.
#[derive(Clone, Debug)]
pub struct CameraHistory {
    /// Identity of the camera.
    pub camera: String,
    /// Model name stated by the camera.
    pub model: String,
    /// Width and height of the picture.
    pub image_size: [u32; 2],
    /// Calibrations by time; at least one.
    pub entries: Vec<Entry>,
    /// Change over time; `None` with fewer than two usable calibrations.
    pub trend: Option<Trend>,
}

impl CameraHistory {
    fn of(entries: &[Entry]) -> Option<Self> {
        let Entry { camera, model, image_size, .. } = entries.last()?.clone();
        let usable = entries.iter().filter(|entry| entry.is_usable());
        let lenses: Vec<StatedLens> = usable.filter_map(|entry| entry.lens).collect();
        let trend = Trend::of(&lenses, size(image_size));
        Some(Self { camera, model, image_size, entries: entries.to_vec(), trend })
    }

    /// Calibrations, each with changes.
    pub fn steps(&self) -> Vec<Step<'_>> {
        let (mut first, mut last) = (None, None);
        let mut steps = Vec::with_capacity(self.entries.len());
        for entry in &self.entries {
            let lens = entry.lens.filter(|_| entry.is_usable());
            let since = |old| LensDifference::of(&old?, &lens?, size(self.image_size));
            let (since_first, since_last) = (since(first), since(last));
            first = first.or(lens);
            last = lens.or(last);
            steps.push(Step { entry, since_first, since_last });
        }
        steps
    }

    /// True if the newest calibrations differ from the oldest by more than chance.
    pub fn drifts(&self) -> bool {
        self.trend.is_some_and(|trend| trend.drifts)
    }

    /// Time of the newest usable calibration, UTC.
    pub fn newest(&self) -> Option<&str> {
        let usable = self.entries.iter().rev().find(|entry| entry.is_usable());
        usable.map(|entry| entry.created.as_str())
    }
}

impl Trend {
    /// Compares the oldest quarter of `lenses` (in the order of time) with the newest quarter, to
    /// show a slow drift, and with the newest alone, to show a jump; keeps the clearer of the two
    /// changes. `None` if incomparable.
    fn of(lenses: &[StatedLens], size: ImageSize) -> Option<Self> {
        let quarter = (lenses.len() / 4).max(1);
        let (oldest, rest) = lenses.split_at_checked(quarter)?;
        let old = StatedLens::mean(oldest)?;
        let compared = |newest: usize| {
            let new = StatedLens::mean(&rest[rest.len().checked_sub(newest)?..])?;
            Some((newest, LensDifference::of(&old, &new, size)?))
        };
        let (slow, jump) = (compared(quarter)?, compared(1)?);
        let (newest, change) = if jump.1.statistic > slow.1.statistic { jump } else { slow };
        // The limit keeps the false alarms of two comparisons as rare as a check's single one.
        let is_clear = quarter == 1 || change.statistic > LIMIT_OF_TWO;
        let drifts = is_clear && change.is_significant;
        Some(Self { change, oldest: quarter, newest, drifts })
    }
}

fn size([width_px, height_px]: [u32; 2]) -> ImageSize {
    ImageSize { width_px, height_px }
}

/// Histories in `entries`, sorted as in an index.
pub fn histories(entries: &[Entry]) -> Vec<CameraHistory> {
    let same = |a: &Entry, b: &Entry| a.camera == b.camera && a.image_size == b.image_size;
    entries.chunk_by(same).filter_map(CameraHistory::of).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

    fn trend(f_px: impl Iterator<Item = f64>) -> Option<Trend> {
        let lens = |f_px| StatedLens {
            f_pp_px: Vector3::new(f_px, 640.0, 360.0),
            covariance_px2: Matrix3::identity() * 0.25,
        };
        Trend::of(&f_px.map(lens).collect::<Vec<_>>(), SIZE)
    }

    #[test]
    fn a_slow_drift_shows_in_the_mean_of_many() {
        // 1.2 px, less than two standard deviations of a difference of single calibrations.
        let found = trend((0..40).map(|i| 1000.0 + 0.03 * f64::from(i))).expect("compared");
        assert_eq!((found.oldest, found.newest, found.drifts), (10, 10, true));
        assert!((found.change.change_px.x - 0.9).abs() < 1e-9);
        let found = trend([1000.0, 1000.0, 1001.2, 1001.2].into_iter()).expect("compared");
        assert_eq!((found.oldest, found.newest, found.drifts), (1, 1, false));
    }

    #[test]
    fn a_jump_shows_at_once() {
        let jump = |px| (0..40).map(move |i| if i == 39 { 1000.0 + px } else { 1000.0 });
        let found = trend(jump(3.0)).expect("compared");
        assert_eq!((found.oldest, found.newest, found.drifts), (10, 1, true));
        assert!(!trend(jump(1.5)).expect("compared").drifts);
    }

    #[test]
    fn one_calibration_has_no_trend() {
        assert!(trend(std::iter::empty()).is_none());
        assert!(trend(std::iter::once(1000.0)).is_none());
        assert!(!trend([1000.0, 1000.5].into_iter()).expect("compared").drifts);
    }
}
