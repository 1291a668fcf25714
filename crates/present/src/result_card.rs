//! A result as one value: grade, one number against the goal, and two sentences. Every surface
//! shows nothing else first, so none can contradict another.

use boresight_calibrate::{Calibration, Severity};
use boresight_guide::{
    guidance::GuidanceParams,
    session::{Snapshot, ViewNumber},
};

use crate::{
    cause_picture::CausePicture,
    goal::Goal,
    grade::Grade,
    text::{self, acceptance, result as words},
};

/// What a result page states first.
#[derive(Clone, Debug, PartialEq)]
pub struct ResultCard {
    /// The grade.
    pub grade: Grade,
    /// Error of the result; `None` while unknown.
    pub error: Option<Error>,
    /// Largest accepted error, with its unit.
    pub goal: String,
    /// What was found, or where to use the result.
    pub what: String,
    /// What to do.
    pub action: String,
    /// The cause as a picture, if the result isn't trustworthy and a picture can show it.
    pub cause: Option<CausePicture>,
}

/// Error of a result, in the unit of the person's goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Error {
    /// The number, with two digits.
    pub number: String,
    /// The unit.
    pub unit: &'static str,
    /// Error as a share of the goal.
    pub of_goal: f64,
    /// What the number is.
    pub name: &'static str,
}

impl ResultCard {
    /// Card of the session's result. `None` without one.
    pub fn of(snapshot: &Snapshot) -> Option<Self> {
        let number = |place: usize| snapshot.views.get(place).map(|view| view.number);
        Some(Self::of_result(snapshot.calibration.as_deref()?, &snapshot.limits, &number))
    }

    /// True if the action is to start over, so that more views of this session won't help.
    pub fn starts_over(&self) -> bool {
        ["start over.", "take the views again."].iter().any(|end| self.action.ends_with(end))
    }

    /// Card of `calibration`; `number` is that of the view at a place.
    pub fn of_result(
        calibration: &Calibration,
        guidance: &GuidanceParams,
        number: &impl Fn(usize) -> Option<ViewNumber>,
    ) -> Self {
        let grade = Grade::of(calibration);
        let goal = Goal::of(calibration, guidance.stop_projection_sigma_px);
        let error = goal.reached.map(|reached| Error {
            number: acceptance::small(reached),
            unit: goal.unit,
            of_goal: reached / goal.limit,
            name: if goal.is_bound { words::BOUND_95 } else { text::window::TYPICAL_ERROR },
        });
        let wanted = match grade {
            Grade::Good => None,
            Grade::Care => Some(Severity::Care),
            Grade::Unfinished | Grade::NotTrustworthy => Some(Severity::Bad),
        };
        let finding = calibration.findings.iter().find(|it| Some(it.severity) == wanted);
        let (what, action) = match finding {
            Some(finding) => {
                let (what, action) = text::finding_in_session(finding, number);
                (format!("{what}."), action)
            }
            None if !goal.is_met() => (words::MISSES[0].into(), words::MISSES[1]),
            None => (words::USE_WHERE_BRIGHT.into(), words::KEEP_THE_LENS),
        };
        let called = |place: usize| {
            number(place).map_or_else(|| (place + 1).to_string(), |number| number.to_string())
        };
        let cause = CausePicture::of(calibration, &called);
        Self { grade, error, goal: goal.said(), what, action: action.into(), cause }
    }
}
