//! Glass and focus over days: blur, dirt, haze.

use std::collections::VecDeque;

use crate::{
    fit::{SIGMA_OF_MEDIAN, median},
    glass::CELLS,
    input::Answer,
    measure::FEWEST_FOUND,
    slot::{DAY_SECS, SLOT_SECS},
};

/// Log sharpness of blur, unless the camera's own pictures scatter more.
const BLUR: f64 = -0.15;
/// Log contrast of a significant loss, two fifths: in a cell for a day and a night it's dirt,
/// everywhere for two days it's haze.
const LOST: f64 = -0.5;
/// Minimum time covered by a day's answers.
const LEAST_SECS: f64 = DAY_SECS - SLOT_SECS;

#[derive(Clone, Debug)]
struct Look {
    at_secs: f64,
    sharp: f64,
    contrast: f64,
    cells: Vec<Option<f64>>,
}

/// Glass in the last two days, and usual glass.
#[derive(Clone, Debug, Default)]
pub(crate) struct Condition {
    looks: VecDeque<Look>,
    usual: Option<Look>,
    /// Threshold of blur: log sharpness against the usual value.
    blur: f64,
}

impl Condition {
    pub(crate) fn note(&mut self, at_secs: f64, answer: &Answer) {
        if let (Some(sharp), Some(contrast)) = (answer.sharp, answer.contrast) {
            self.looks.push_back(Look { at_secs, sharp, contrast, cells: answer.cell_values() });
        }
        self.looks.retain(|look| at_secs - look.at_secs <= 2.0 * DAY_SECS);
    }

    /// Takes everything seen so far as the usual look of the camera.
    pub(crate) fn set_usual(&mut self) {
        if self.looks.is_empty() {
            return;
        }
        let all: Vec<&Look> = self.looks.iter().collect();
        let cells = (0..CELLS[0] * CELLS[1]).map(|cell| of_cell(&all, cell));
        let of =
            |value: fn(&Look) -> f64| median(&mut all.iter().map(|l| value(l)).collect::<Vec<_>>());
        let sharp = of(|l| l.sharp).unwrap_or(0.0);
        let mut away: Vec<f64> = all.iter().map(|l| (l.sharp - sharp).abs()).collect();
        let scatter = SIGMA_OF_MEDIAN * median(&mut away).unwrap_or(0.0);
        self.blur = BLUR.min(-3.0 * scatter);
        self.usual = Some(Look {
            at_secs: all.last().map_or(0.0, |look| look.at_secs),
            sharp,
            contrast: of(|l| l.contrast).unwrap_or(0.0),
            cells: cells.collect(),
        });
    }

    /// Looks of the last `secs`, if numerous and spread enough.
    fn last(&self, secs: f64, least_secs: f64) -> Option<Vec<&Look>> {
        let newest = self.looks.back()?.at_secs;
        let looks: Vec<&Look> = self.looks.iter().filter(|l| newest - l.at_secs <= secs).collect();
        let is_long = newest - looks.first()?.at_secs >= least_secs;
        (looks.len() >= FEWEST_FOUND && is_long).then_some(looks)
    }

    pub(crate) fn is_blurred(&self) -> bool {
        let (Some(usual), Some(looks)) = (&self.usual, self.last(DAY_SECS, LEAST_SECS)) else {
            return false;
        };
        let sharp = median(&mut looks.iter().map(|l| l.sharp - usual.sharp).collect::<Vec<_>>());
        let contrast =
            median(&mut looks.iter().map(|l| l.contrast - usual.contrast).collect::<Vec<_>>());
        // Fog blurs, too, but takes more of the contrast.
        sharp.zip(contrast).is_some_and(|(s, c)| s < self.blur && s < c)
    }

    /// Start of the current run of blurred looks.
    pub(crate) fn blurred_since(&self) -> Option<f64> {
        let usual = self.usual.as_ref()?;
        let blurred = self.looks.iter().rev().take_while(|l| l.sharp - usual.sharp < self.blur);
        blurred.last().map(|look| look.at_secs)
    }

    pub(crate) fn is_hazy(&self) -> bool {
        let (Some(usual), Some(looks)) =
            (&self.usual, self.last(2.0 * DAY_SECS, DAY_SECS + LEAST_SECS))
        else {
            return false;
        };
        let contrast =
            median(&mut looks.iter().map(|l| l.contrast - usual.contrast).collect::<Vec<_>>());
        contrast.is_some_and(|c| c < LOST)
    }

    /// Cell with the largest loss of contrast in both halves of the last day.
    pub(crate) fn dirt(&self) -> Option<[usize; 2]> {
        let (usual, looks) = (self.usual.as_ref()?, self.last(DAY_SECS, LEAST_SECS)?);
        let middle = looks.last()?.at_secs - DAY_SECS / 2.0;
        let (before, after): (Vec<&Look>, Vec<&Look>) =
            looks.into_iter().partition(|l| l.at_secs < middle);
        let lost = |cell: usize| -> Option<f64> {
            let usual = usual.cells.get(cell).copied().flatten()?;
            let of = |looks: &[&Look]| of_cell(looks, cell).map(|now| now - usual);
            Some(of(&before)?.max(of(&after)?))
        };
        let cells = (0..CELLS[0] * CELLS[1]).filter_map(|cell| Some((cell, lost(cell)?)));
        let darkest = cells.filter(|(_, lost)| *lost < LOST).min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some([darkest.0 % CELLS[0], darkest.0 / CELLS[0]])
    }
}

/// Median of a cell, if known in half of the looks.
fn of_cell(looks: &[&Look], cell: usize) -> Option<f64> {
    let mut known: Vec<f64> =
        looks.iter().filter_map(|l| l.cells.get(cell).copied().flatten()).collect();
    (2 * known.len() >= looks.len()).then(|| median(&mut known)).flatten()
}
