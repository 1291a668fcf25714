//! Sharpness over days: focus, and wet glass.

use std::collections::VecDeque;

use crate::{
    input::Answer,
    slot::{DAY_SECS, SLOT_SECS},
};
use boresight_scene::{FEWEST_FOUND, SIGMA_OF_MEDIAN, median};

/// Log sharpness of blur, unless the camera's own pictures scatter more.
const BLUR: f64 = -0.15;
/// Minimum time covered by a day's answers.
const LEAST_SECS: f64 = DAY_SECS - SLOT_SECS;

#[derive(Clone, Copy, Debug)]
struct Look {
    at_secs: f64,
    sharp: f64,
    contrast: f64,
}

/// Sharpness and contrast in the last day, and usual ones.
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
            self.looks.push_back(Look { at_secs, sharp, contrast });
        }
        self.looks.retain(|look| at_secs - look.at_secs <= DAY_SECS);
    }

    /// Takes everything seen so far as the usual look of the camera.
    pub(crate) fn set_usual(&mut self) {
        let Some(sharp) = self.median(|look| look.sharp) else { return };
        let scatter = self.median(|look| (look.sharp - sharp).abs()).unwrap_or(0.0);
        self.blur = BLUR.min(-3.0 * SIGMA_OF_MEDIAN * scatter);
        let contrast = self.median(|look| look.contrast).unwrap_or(0.0);
        self.usual = Some(Look { at_secs: 0.0, sharp, contrast });
    }

    fn median(&self, of: impl Fn(&Look) -> f64) -> Option<f64> {
        median(&mut self.looks.iter().map(of).collect::<Vec<_>>())
    }

    pub(crate) fn is_blurred(&self) -> bool {
        let (Some(usual), Some(first), Some(newest)) =
            (&self.usual, self.looks.front(), self.looks.back())
        else {
            return false;
        };
        let is_long = newest.at_secs - first.at_secs >= LEAST_SECS;
        if self.looks.len() < FEWEST_FOUND || !is_long {
            return false;
        }
        let sharp = self.median(|look| look.sharp - usual.sharp);
        let contrast = self.median(|look| look.contrast - usual.contrast);
        // Fog blurs, too, but takes more of the contrast.
        sharp.zip(contrast).is_some_and(|(s, c)| s < self.blur && s < c)
    }

    /// Start of the current run of blurred looks.
    pub(crate) fn blurred_since(&self) -> Option<f64> {
        let usual = self.usual.as_ref()?;
        let blurred = self.looks.iter().rev().take_while(|l| l.sharp - usual.sharp < self.blur);
        blurred.last().map(|look| look.at_secs)
    }
}
