//! The instruction to a person after a decision, as one value. Window, phone, terminal, voice and
//! the simulated person show nothing else, so they can't contradict each other.

use boresight_guide::{
    guidance::Advice,
    session::{Edge, Gravity, Outcome, Prompt, Snapshot, ViewNumber},
};

use crate::{
    ghost::{Card, closeness},
    text::{self, window::Gauge},
};

/// Moment of a session, in a person's terms. Determines the content of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Moment {
    /// No usable board found: the card alone.
    Search,
    /// Board far from the requested pose: the card, and the board's outline.
    Approach,
    /// Board close to the requested pose: drawn as in `Approach`.
    Match,
    /// View about to be taken: the board's outline, traced in green as time passes.
    Hold,
    /// View taken: nothing.
    Taken,
    /// Paused: nothing.
    Rest,
    /// Camera or picture needs attention: nothing.
    Lost,
    /// Board differs from the chosen one: nothing.
    OtherBoard,
    /// Card leaves the picture, and the board is only followed: the card alone.
    BeyondEdge,
    /// No further view requested: nothing.
    Done,
}

/// Movement of the board, with its direction on the screen.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Movement {
    /// Tip the edge at this angle, clockwise from the right, away from the camera.
    Tip {
        /// Angle of the edge.
        towards_rad: f32,
    },
    /// Shift towards this angle, clockwise from the right.
    Shift {
        /// Angle of the shift.
        towards_rad: f32,
    },
    /// Towards the camera.
    Nearer,
    /// Away from the camera.
    Farther,
}

/// The next action, and everything needed to show it.
#[derive(Clone, Debug)]
pub struct Instruction {
    /// See [`Moment`].
    pub moment: Moment,
    /// Requested pose of the board; `None` without a request.
    pub card: Option<Card>,
    /// Board as seen, if it's shown.
    pub board: Option<Card>,
    /// Closeness of the board to the requested pose, see [`closeness`]; 1 in [`Moment::Hold`].
    pub close: Option<f32>,
    /// Elapsed share of the hold, 0 to 1; only in [`Moment::Hold`].
    pub hold: Option<f64>,
    /// Gauge out of range, if the sentence is about a gauge.
    pub lacks: Option<Gauge>,
    /// View taken with this decision.
    pub taken: Option<ViewNumber>,
    prompt: Prompt,
    has_picture: bool,
}

impl Instruction {
    /// Instruction after the decision of `snapshot`.
    pub fn of(snapshot: &Snapshot) -> Self {
        let prompt = snapshot.shown.prompt;
        let moment = moment(prompt);
        let board = &snapshot.setup.board;
        let live = snapshot.live.as_ref().and_then(|live| live.corners_px.as_ref().ok());
        let target = snapshot.target.as_ref().filter(|_| {
            use Moment::{Approach, BeyondEdge, Match, Search};
            matches!(moment, Search | Approach | Match | BeyondEdge)
        });
        let seen =
            live.filter(|_| matches!(moment, Moment::Approach | Moment::Match | Moment::Hold));
        let card = |corners_px: &[_]| Card::new(corners_px, board, &snapshot.lens);
        Self {
            moment,
            card: target.and_then(|target| card(&target.ghost_px)),
            board: seen.and_then(|corners| Card::seen(corners, board, &snapshot.lens)),
            close: match moment {
                // Whoever holds still is in the right place.
                Moment::Hold => Some(1.0),
                _ => target.zip(seen).and_then(|(t, live)| closeness(live, &t.ghost_px, board)),
            },
            hold: (moment == Moment::Hold).then(|| snapshot.hold.unwrap_or(0.0)),
            lacks: lacks(prompt, snapshot.shown.advice),
            taken: match snapshot.decision.outcome {
                Outcome::Accepted { view, .. } => Some(view),
                _ => None,
            },
            prompt,
            has_picture: true,
        }
    }

    /// The same instruction without pictures: earlier measurements no longer hold.
    #[must_use]
    pub fn without_picture(self) -> Self {
        Self {
            moment: Moment::Lost,
            card: None,
            board: None,
            close: None,
            hold: None,
            lacks: None,
            has_picture: false,
            ..self
        }
    }

    /// The request, with left and right exchanged if `mirrored`, for a person facing the camera.
    pub fn prompt(&self, mirrored: bool) -> Prompt {
        if mirrored { self.prompt.mirrored() } else { self.prompt }
    }

    /// Sentence to read.
    pub fn sentence(&self, mirrored: bool) -> String {
        if self.has_picture { text::prompt(self.prompt(mirrored)) } else { text::NO_PICTURE.into() }
    }

    /// Gravity of the sentence.
    pub fn gravity(&self) -> Gravity {
        if self.has_picture { self.prompt.gravity() } else { Gravity::Bad }
    }

    /// Movement requested by the sentence, if any: the sign beside it.
    pub fn movement(&self, mirrored: bool) -> Option<Movement> {
        let prompt = self.has_picture.then(|| self.prompt(mirrored))?;
        match prompt {
            Prompt::Tip(edge) | Prompt::TipInstead(edge) | Prompt::TipFurther(edge) => {
                Some(Movement::Tip { towards_rad: angle_rad(edge) })
            }
            Prompt::Closer => Some(Movement::Nearer),
            Prompt::Farther => Some(Movement::Farther),
            _ => prompt.shift().map(|[right, down]| Movement::Shift {
                towards_rad: libm::atan2f(f32::from(down), f32::from(right)),
            }),
        }
    }
}

fn moment(prompt: Prompt) -> Moment {
    match prompt {
        Prompt::Complete | Prompt::Exhausted | Prompt::SourceEnded => Moment::Done,
        Prompt::Failed
        | Prompt::CameraLost
        | Prompt::Frozen
        | Prompt::LensMoved(_)
        | Prompt::CameraNotReady
        | Prompt::OtherSize => Moment::Lost,
        Prompt::Paused => Moment::Rest,
        Prompt::Taken => Moment::Taken,
        Prompt::HoldStill => Moment::Hold,
        Prompt::OtherBoard(_) | Prompt::Mirrored | Prompt::OtherMarkers | Prompt::OtherSquares => {
            Moment::OtherBoard
        }
        Prompt::ShowWholeFirst => Moment::BeyondEdge,
        Prompt::ShowBoard
        | Prompt::CutOff(_)
        | Prompt::Uncover
        | Prompt::Glare
        | Prompt::Blurred
        | Prompt::Dark
        | Prompt::Busy => Moment::Search,
        Prompt::FollowTheOutline
        | Prompt::Contradicts
        | Prompt::Clearer
        | Prompt::SteadyTheBoard => Moment::Match,
        Prompt::Closer
        | Prompt::Farther
        | Prompt::Tip(_)
        | Prompt::TipInstead(_)
        | Prompt::TipFurther(_)
        | Prompt::TipLess
        | Prompt::TipMore
        | Prompt::Shift(..)
        | Prompt::ToTheMiddle => Moment::Approach,
    }
}

fn lacks(prompt: Prompt, advice: Option<Advice>) -> Option<Gauge> {
    match prompt {
        Prompt::TipInstead(_) => Some(Gauge::Direction),
        Prompt::Tip(_) => match advice {
            Some(Advice::TipTowards { tilt_azimuth_rad: Some(_), .. }) => Some(Gauge::Direction),
            _ => Some(Gauge::Tilt),
        },
        Prompt::TipFurther(_) | Prompt::TipLess | Prompt::TipMore | Prompt::Clearer => {
            Some(Gauge::Tilt)
        }
        Prompt::Closer | Prompt::Farther => Some(Gauge::Size),
        Prompt::Shift(..) | Prompt::ToTheMiddle | Prompt::CutOff(_) => Some(Gauge::Across),
        Prompt::SteadyTheBoard => Some(Gauge::Still),
        Prompt::Blurred => Some(Gauge::Sharp),
        _ => None,
    }
}

fn angle_rad(edge: Edge) -> f32 {
    let eighths = match edge {
        Edge::Right => 0.0,
        Edge::BottomRight => 1.0,
        Edge::Bottom => 2.0,
        Edge::BottomLeft => 3.0,
        Edge::Left => 4.0,
        Edge::TopLeft => 5.0,
        Edge::Top => 6.0,
        Edge::TopRight => 7.0,
    };
    eighths * std::f32::consts::FRAC_PI_4
}
