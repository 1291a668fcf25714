use std::path::PathBuf;

use super::comparison::{Comparison, Outcome};
use boresight_app::host::Ended;
use boresight_present::text::charts::Chart;

/// The person's choices on the page.
#[derive(Debug, Default)]
pub struct ResultPage {
    /// The chart that is seen.
    pub chart: Chart,
    /// The comparison with an older calibration.
    pub comparison: Comparison,
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
