//! Records of pictures: the inputs of the fold, as lines of text.

use nalgebra::{Matrix4, Vector4};
use serde::{Deserialize, Serialize};

use crate::{glass::Glass, no_answer::NoAnswer};
use boresight_scene::{Causes, Measured, Turn};

/// Bounds of times and turns: the year 2200, and millionths that fill a circle.
const LATEST_SECS: f64 = 7.3e9;
const LARGEST_TURN: f64 = 7e6;

/// Something that happened. A store is a list of these, and its states follow from them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub enum Input {
    /// A picture was measured, or couldn't be.
    Picture(Box<Picture>),
    /// References were learned; the estimates of the learning pictures by them replace those so far.
    Learned {
        /// When, seconds since 1970 (UTC).
        at: f64,
        /// References.
        references: u32,
        /// The learning pictures.
        samples: Vec<LearnedSample>,
        /// True if the camera is pinned: compared with these pictures until it's learned.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        pinned: bool,
    },
    /// A person accepted the camera as it stands, so learning starts again.
    Accepted {
        /// When, seconds since 1970 (UTC).
        at: f64,
        /// Why, in the person's words.
        reason: String,
    },
}

/// One picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct Picture {
    /// When it was taken, seconds since 1970 (UTC).
    pub at: f64,
    /// True if a picture taken later had been looked at before it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub late: bool,
    /// What was measured.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub answer: Option<Answer>,
    /// Why nothing was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub none: Option<NoAnswer>,
}

/// An estimate of a learning picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct LearnedSample {
    /// When it was taken, seconds since 1970 (UTC).
    pub at: f64,
    /// Pan, tilt, roll in microradians; focal ratio in parts per million.
    pub turn: [f64; 4],
}

/// A credible estimate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct Answer {
    /// Pan, tilt, roll in microradians; logarithm of the focal ratio in millionths.
    pub turn: [f64; 4],
    /// Their covariance, upper triangle row by row, in the squares of these units, with the lens's own error.
    pub cov: [f64; 10],
    /// Patches found, and those that agree.
    pub patches: [u32; 2],
    /// Patches looked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sought: Option<u32>,
    /// Logarithm of sharpness against the references.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sharp: Option<f64>,
    /// Logarithm of contrast against the references.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contrast: Option<f64>,
    /// How much the camera shakes within a burst, px.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shake: Option<f64>,
    /// Whether a turn or a shift of the picture explains a move, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub causes: Option<Causes>,
}

/// Rounded to `decimals` decimals: short, and unchanged by writing and reading.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10_f64.powi(decimals);
    (value * scale).round() / scale
}

/// Rounded to three significant digits.
fn short(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    rounded(value, 2 - libm::log10(value.abs()).floor() as i32)
}

/// Turn in the units of a line.
pub(crate) fn line_turn(turn: &Turn) -> [f64; 4] {
    let v = turn.vector() * 1e6;
    [0, 1, 2, 3].map(|i| rounded(v[i], 2))
}

/// Turn of a line.
pub fn turn_of(line: &[f64; 4]) -> Turn {
    Turn::from_vector(&(Vector4::from(*line) * 1e-6))
}

impl Input {
    /// True if every number is one that a picture can give.
    pub fn is_sound(&self) -> bool {
        let is_time = |at: f64| (0.0..LATEST_SECS).contains(&at);
        let is_turn = |turn: &[f64; 4]| turn.iter().all(|part| part.abs() < LARGEST_TURN);
        match self {
            Self::Picture(picture) => {
                let is_answer = |answer: &Answer| {
                    let variance = answer.covariance().diagonal();
                    is_turn(&answer.turn) && variance.iter().all(|v| *v > 0.0 && v.is_finite())
                };
                is_time(picture.at) && picture.answer.as_ref().is_none_or(is_answer)
            }
            Self::Learned { at, samples, .. } => {
                is_time(*at) && samples.iter().all(|s| is_time(s.at) && is_turn(&s.turn))
            }
            Self::Accepted { at, .. } => is_time(*at),
        }
    }
}

impl Answer {
    /// Record of a measured picture.
    pub fn of(measured: &Measured, glass: Option<&Glass>, causes: Option<Causes>) -> Self {
        let cov = &measured.covariance;
        let mut upper = [0.0; 10];
        for (at, (i, j)) in (0..4).flat_map(|i| (i..4).map(move |j| (i, j))).enumerate() {
            upper[at] = short(cov[(i, j)] * 1e12);
        }
        Self {
            turn: line_turn(&measured.turn),
            cov: upper,
            patches: [measured.found as u32, measured.inliers as u32],
            sought: Some(measured.sought as u32),
            sharp: glass.map(|g| rounded(g.sharpness, 3)),
            contrast: glass.map(|g| rounded(g.contrast, 3)),
            shake: None,
            causes: causes.map(|c| Causes {
                turned_px: rounded(c.turned_px, 3),
                shifted_px: rounded(c.shifted_px, 3),
                ..c
            }),
        }
    }

    /// Turn of the answer.
    pub fn turn(&self) -> Turn {
        turn_of(&self.turn)
    }

    /// Covariance of pan, tilt, roll (rad) and log focal ratio.
    pub fn covariance(&self) -> Matrix4<f64> {
        let mut out = Matrix4::zeros();
        for (at, (i, j)) in (0..4).flat_map(|i| (i..4).map(move |j| (i, j))).enumerate() {
            out[(i, j)] = self.cov[at] * 1e-12;
            out[(j, i)] = out[(i, j)];
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer() -> Answer {
        Answer {
            turn: line_turn(&Turn {
                pan_rad: 1.234_567e-3,
                tilt_rad: -2e-9,
                roll_rad: 0.1,
                log_focal: 3e-3,
            }),
            cov: [1.23, 0.0, 0.0, 0.0, 4.5, 0.0, 0.0, 7.0, 0.0, 8.0],
            patches: [150, 120],
            sought: Some(170),
            sharp: Some(-0.02),
            contrast: None,
            shake: None,
            causes: None,
        }
    }

    #[test]
    fn a_line_is_read_as_it_was_written() {
        let none = Picture {
            at: 1.0,
            late: true,
            answer: None,
            none: Some(NoAnswer::FewFound { found: 7, of: 70 }),
        };
        for picture in
            [Picture { at: 1.7e9, late: false, answer: Some(answer()), none: None }, none]
        {
            let input = Input::Picture(Box::new(picture));
            let line = serde_json::to_string(&input).expect("a line");
            assert_eq!(serde_json::from_str::<Input>(&line).expect("an input"), input, "{line}");
        }
        assert!((answer().turn().roll_rad - 0.1).abs() < 1e-8);
        assert_eq!(answer().covariance()[(1, 1)], 4.5e-12);
    }
}
