use std::path::PathBuf;

use super::comparison::{Comparison, Outcome};
use boresight_app::window::services::Ended;
use boresight_guide::session::ViewNumber;
use boresight_present::text::charts::Chart;

/// The person's choices on the page.
#[derive(Debug)]
pub struct ResultPage {
    /// True for the evidence behind the result, false for the result as one card.
    pub engineer: bool,
    /// Visible chart.
    pub chart: Chart,
    /// Comparison with an older calibration.
    pub comparison: Comparison,
    /// Share of the distortion removed from the picture, 0 to 1.
    pub undistorted: f32,
    /// View chosen in every chart; `None` for the one that fits worst.
    pub chosen: Option<ViewNumber>,
    /// Viewing angle of the poses.
    pub turn_rad: f32,
}

impl Default for ResultPage {
    fn default() -> Self {
        let (chart, comparison) = (Chart::default(), Comparison::default());
        // From the side, to show distances and tilts.
        let (engineer, chosen) = (false, None);
        Self { engineer, chart, comparison, undistorted: 1.0, chosen, turn_rad: 0.9 }
    }
}

impl ResultPage {
    /// Takes and shows the result of a comparison. Never waits.
    pub(crate) fn look(&mut self) {
        if self.comparison.look() {
            self.show_change();
        }
    }

    /// Shows the result of an ended session, comparable with `older`.
    pub(crate) fn begin(&mut self, ended: &Ended, older: Vec<PathBuf>) {
        self.comparison = Comparison::with(older);
        if let Some(compared) = ended.compared.clone() {
            self.comparison.outcome = Outcome::Done(compared);
            self.show_change();
        }
    }

    /// Shows what has changed, or why nobody can tell.
    fn show_change(&mut self) {
        self.engineer = true;
        if self.comparison.found().is_some_and(|compared| compared.drift.is_some()) {
            self.chart = Chart::Change;
        }
    }
}
