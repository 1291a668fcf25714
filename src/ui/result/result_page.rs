use std::path::PathBuf;

use super::comparison::{Comparison, Outcome};
use boresight_app::host::Ended;
use boresight_present::text::charts::Chart;

/// The person's choices on the page.
#[derive(Debug)]
pub struct ResultPage {
    /// The chart that is seen.
    pub chart: Chart,
    /// The comparison with an older calibration.
    pub comparison: Comparison,
    /// Share of the distortion that is removed from the picture, 0 to 1.
    pub undistorted: f32,
    /// Angle from which the poses are seen.
    pub turn_rad: f32,
}

impl Default for ResultPage {
    fn default() -> Self {
        let (chart, comparison) = (Chart::default(), Comparison::default());
        // From the side, where distances and tilts are seen.
        Self { chart, comparison, undistorted: 1.0, turn_rad: 0.9 }
    }
}

impl ResultPage {
    /// Takes what a comparison found, and shows it. Never waits.
    pub(in crate::ui) fn look(&mut self) {
        if self.comparison.look() {
            self.show_change();
        }
    }

    /// Shows the result of a session that has ended and may be compared with one of `older`.
    pub(in crate::ui) fn begin(&mut self, ended: &Ended, older: Vec<PathBuf>) {
        self.comparison = Comparison::with(older);
        if let Some(compared) = ended.compared.clone() {
            self.comparison.outcome = Outcome::Done(compared);
            self.show_change();
        }
    }

    fn show_change(&mut self) {
        if self.comparison.found().is_some_and(|compared| compared.drift.is_some()) {
            self.chart = Chart::Change;
        }
    }
}
