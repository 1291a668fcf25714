//! Prompts: one request to the person, as one idea without amounts.

use std::f64::consts::FRAC_PI_4;

use serde::Serialize;

use super::{
    camera::{CameraState, Stream},
    decision::{Decision, Outcome},
};
use crate::guidance::{Advice, Difference, Progress, Refusal, direction_difference_rad};
use boresight_detect::{Miss, OtherBoard, Side};
use boresight_geometry::{
    boards::BoardChoice,
    device::{Control, Fault},
};

/// An edge or a corner of the board, as seen in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// Right edge.
    Right,
    /// Bottom right corner.
    BottomRight,
    /// Bottom edge.
    Bottom,
    /// Bottom left corner.
    BottomLeft,
    /// Left edge.
    Left,
    /// Top left corner.
    TopLeft,
    /// Top edge.
    Top,
    /// Top right corner.
    TopRight,
}

impl Edge {
    /// All edges and corners, clockwise from the right.
    const ALL: [Self; 8] = [
        Self::Right,
        Self::BottomRight,
        Self::Bottom,
        Self::BottomLeft,
        Self::Left,
        Self::TopLeft,
        Self::Top,
        Self::TopRight,
    ];

    /// Edge or corner that points towards `direction_rad`, clockwise from the right.
    pub fn towards(direction_rad: f64) -> Self {
        let eighth = (direction_rad / FRAC_PI_4).round().rem_euclid(8.0);
        Self::ALL[eighth as usize % Self::ALL.len()]
    }

    /// Edge or corner with left and right exchanged.
    pub fn mirrored(self) -> Self {
        match self {
            Self::Right => Self::Left,
            Self::BottomRight => Self::BottomLeft,
            Self::Bottom => Self::Bottom,
            Self::BottomLeft => Self::BottomRight,
            Self::Left => Self::Right,
            Self::TopLeft => Self::TopRight,
            Self::Top => Self::Top,
            Self::TopRight => Self::TopLeft,
        }
    }
}

/// Left or right in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Across {
    /// Left in the picture.
    Left,
    /// Right in the picture.
    Right,
}

impl Across {
    fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

/// Up or down in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Upright {
    /// Up in the picture.
    Up,
    /// Down in the picture.
    Down,
}

/// Request to the person. Two prompts are equal if they ask for the same thing, in any amount.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prompt {
    /// The plan is complete.
    Complete,
    /// No further view would help.
    Exhausted,
    /// A worker failed.
    Failed,
    /// The camera is lost.
    CameraLost,
    /// The picture doesn't change.
    Frozen,
    /// A control of the lens isn't in place.
    LensMoved(Control),
    /// The person paused.
    Paused,
    /// The source has no more frames.
    SourceEnded,
    /// A view was taken.
    Taken,
    /// Bring the whole board into the picture.
    ShowBoard,
    /// Bring the whole board into the picture first, then onto the outline beyond the edge.
    ShowWholeFirst,
    /// Bring the board back into the picture; the picture's edge cuts it off on this side.
    CutOff(Side),
    /// Uncover the board.
    Uncover,
    /// Turn the board out of a reflection.
    Glare,
    /// Show the chosen board instead of a different one.
    OtherBoard(OtherBoard),
    /// Show the board itself, not its mirror image.
    Mirrored,
    /// Show the chosen board: the board in view has no markers, or different ones.
    OtherMarkers,
    /// Show the chosen board: the board in view has its markers in other places.
    OtherSquares,
    /// Bring the board nearer.
    Closer,
    /// Take the board farther away.
    Farther,
    /// Hold still or focus the lens.
    Blurred,
    /// Add light: the picture is too dark.
    Dark,
    /// The search takes too long: the background is busy, or the computer slow.
    Busy,
    /// Tip the edge away from the camera.
    Tip(Edge),
    /// Tip the edge away instead of the edge now away.
    TipInstead(Edge),
    /// Tip the edge farther away.
    TipFurther(Edge),
    /// Tip the board less.
    TipLess,
    /// Tip the board more, towards any edge.
    TipMore,
    /// Shift the board; in at least one direction.
    Shift(Option<Across>, Option<Upright>),
    /// Bring the board to the middle of the picture.
    ToTheMiddle,
    /// Show the drawn pose.
    FollowTheOutline,
    /// Tip the board more, or bring the board nearer: its direction is too uncertain.
    Clearer,
    /// Look for an error of the board or the lens: the view contradicts the others.
    Contradicts,
    /// Keep the board in place.
    HoldStill,
    /// Rest the arms or lean the board on something.
    SteadyTheBoard,
    /// Wait until the camera can be used.
    CameraNotReady,
    /// The pictures have another size than the session's.
    OtherSize,
}

/// Gravity of a prompt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Gravity {
    /// The session goes as planned.
    Plain,
    /// Something succeeded, or is about to.
    Good,
    /// Something keeps views from being taken.
    Careful,
    /// The session can't continue in this state.
    Bad,
}

/// Difference of direction above which the edge now away is wrong.
const OTHER_EDGE_RAD: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// Shift along an axis, in pixels, below which only a larger shift along the other axis is
/// requested.
const SMALL_SHIFT_PX: f64 = 10.0;

impl Prompt {
    /// Gravity of the prompt.
    pub fn gravity(self) -> Gravity {
        match self {
            Self::Failed | Self::CameraLost | Self::Frozen | Self::LensMoved(_) => Gravity::Bad,
            Self::Complete | Self::Taken | Self::HoldStill => Gravity::Good,
            Self::Exhausted
            | Self::CameraNotReady
            | Self::Uncover
            | Self::Glare
            | Self::OtherBoard(_)
            | Self::Mirrored
            | Self::OtherMarkers
            | Self::OtherSquares
            | Self::Blurred
            | Self::Dark
            | Self::Busy
            | Self::Contradicts
            | Self::OtherSize => Gravity::Careful,
            _ => Gravity::Plain,
        }
    }

    /// True if the prompt asks for a move of the board that the camera sees.
    pub fn asks_for_a_move(self) -> bool {
        matches!(
            self,
            Self::Closer
                | Self::Farther
                | Self::Tip(_)
                | Self::TipInstead(_)
                | Self::TipFurther(_)
                | Self::TipLess
                | Self::TipMore
                | Self::Shift(..)
                | Self::ToTheMiddle
                | Self::FollowTheOutline
                | Self::Clearer
        )
    }

    /// The board in view, if not the chosen board and possible to choose.
    pub fn other_board(self) -> Option<BoardChoice> {
        match self {
            Self::OtherBoard(other) => other.choice(),
            _ => None,
        }
    }

    /// The most important state, if any, in which no views are taken.
    pub(super) fn of_state(
        progress: Progress,
        has_failed: bool,
        camera: &CameraState,
        (paused, source_ended): (bool, bool),
    ) -> Option<Self> {
        let lens_moved = || camera.changed.keys().find(|control| control.moves_geometry());
        Some(match progress {
            Progress::Complete => Self::Complete,
            Progress::Exhausted => Self::Exhausted,
            Progress::Collecting if has_failed => Self::Failed,
            Progress::Collecting if matches!(camera.stream, Stream::Lost { .. }) => {
                Self::CameraLost
            }
            Progress::Collecting => match lens_moved() {
                Some(control) => Self::LensMoved(*control),
                None if camera.doubts.contains_key(&Fault::Frozen) => Self::Frozen,
                None if paused => Self::Paused,
                None if source_ended => Self::SourceEnded,
                None => return None,
            },
        })
    }

    /// Prompt for a frame's decision; `no_board` is the reason for a missing board.
    pub fn of_decision(decision: &Decision, no_board: Option<&Miss>) -> Self {
        match decision.outcome {
            Outcome::Accepted { .. } => Self::Taken,
            _ => Self::of_advice(&decision.advice, no_board),
        }
    }

    /// Prompt for `advice`; `no_board` is the reason for a missing board in the newest frame.
    pub fn of_advice(advice: &Advice, no_board: Option<&Miss>) -> Self {
        match *advice {
            Advice::ShowBoard => no_board.map_or(Self::ShowBoard, Self::of_miss),
            Advice::ShowWholeFirst => match no_board {
                None | Some(Miss::NoBoard | Miss::PartialBoard { .. }) => Self::ShowWholeFirst,
                Some(miss) => Self::of_miss(miss),
            },
            Advice::TipTowards { tilt_azimuth_rad: None, wanted_rad } => {
                Self::Tip(Edge::towards(wanted_rad))
            }
            Advice::TipTowards { tilt_azimuth_rad: Some(now_rad), wanted_rad } => {
                let turn_rad = direction_difference_rad(wanted_rad, now_rad);
                if turn_rad.abs() > OTHER_EDGE_RAD {
                    Self::TipInstead(Edge::towards(wanted_rad))
                } else {
                    Self::Tip(Edge::towards(wanted_rad))
                }
            }
            Advice::Tilt { tilt_rad, wanted_rad, tilt_azimuth_rad } => {
                if tilt_rad < wanted_rad {
                    Self::TipFurther(Edge::towards(tilt_azimuth_rad))
                } else {
                    Self::TipLess
                }
            }
            Advice::Distance { span_fraction, wanted } => {
                if span_fraction < wanted {
                    Self::Closer
                } else {
                    Self::Farther
                }
            }
            Advice::Shift { right_px, down_px } => {
                let across = if right_px < 0.0 { Across::Left } else { Across::Right };
                let upright = if down_px < 0.0 { Upright::Up } else { Upright::Down };
                let least_px = SMALL_SHIFT_PX.max(0.4 * right_px.abs().max(down_px.abs()));
                match (right_px.abs() >= least_px, down_px.abs() >= least_px) {
                    (true, true) => Self::Shift(Some(across), Some(upright)),
                    (false, true) => Self::Shift(None, Some(upright)),
                    _ => Self::Shift(Some(across), None),
                }
            }
            Advice::HoldStill { .. } | Advice::Holding { .. } => Self::HoldStill,
            Advice::SteadyTheBoard => Self::SteadyTheBoard,
            Advice::Mend { refusal } => Self::of_refusal(&refusal),
            Advice::Finished => Self::Complete,
        }
    }

    /// Prompt for a frame without the board.
    ///
    /// ```
    /// # use boresight_detect::{Miss, OtherBoard};
    /// # use boresight_guide::session::Prompt;
    /// let seen = OtherBoard::Plain { columns: 7, rows: 5 };
    /// let prompt = Prompt::of_miss(&Miss::OtherBoard(seen));
    /// assert_eq!(prompt.other_board(), seen.choice());
    /// ```
    pub fn of_miss(miss: &Miss) -> Self {
        match *miss {
            Miss::NoBoard => Self::ShowBoard,
            Miss::PartialBoard { cut_off_by: Some(side), .. } => Self::CutOff(side),
            Miss::PartialBoard { cut_off_by: None, .. } => Self::Uncover,
            Miss::Glare { .. } => Self::Glare,
            Miss::OtherBoard(other) => Self::OtherBoard(other),
            Miss::Mirrored => Self::Mirrored,
            Miss::OtherMarkers { .. } => Self::OtherMarkers,
            Miss::OtherSquares { .. } => Self::OtherSquares,
            Miss::TooSmall { .. } => Self::Closer,
            Miss::Blurred { .. } => Self::Blurred,
            Miss::LowContrast { .. } => Self::Dark,
            Miss::OutOfTime => Self::Busy,
        }
    }

    fn of_refusal(refusal: &Refusal) -> Self {
        match refusal {
            Refusal::NotFound => Self::ShowBoard,
            Refusal::NoLine | Refusal::TooFlat { .. } => Self::TipMore,
            Refusal::OutsideLens { .. } => Self::ToTheMiddle,
            Refusal::Unclear { .. } => Self::Clearer,
            // The view in this direction may be the one just taken: ask for the next pose.
            Refusal::AlreadyCovered { .. } | Refusal::TellsLittle { .. } => Self::FollowTheOutline,
            Refusal::Inconsistent { .. } => Self::Contradicts,
            Refusal::Moving { .. } | Refusal::Holding { .. } => Self::HoldStill,
            Refusal::OtherSize { .. } => Self::OtherSize,
            Refusal::CameraNotReady => Self::CameraNotReady,
            Refusal::NotCollecting => Self::Paused,
        }
    }

    /// Prompt with left and right exchanged, as in a mirror.
    pub fn mirrored(self) -> Self {
        match self {
            Self::CutOff(Side::Left) => Self::CutOff(Side::Right),
            Self::CutOff(Side::Right) => Self::CutOff(Side::Left),
            Self::Tip(edge) => Self::Tip(edge.mirrored()),
            Self::TipInstead(edge) => Self::TipInstead(edge.mirrored()),
            Self::TipFurther(edge) => Self::TipFurther(edge.mirrored()),
            Self::Shift(across, upright) => Self::Shift(across.map(Across::mirrored), upright),
            other => other,
        }
    }

    /// Direction in the picture in which to shift the board: right and down, each -1, 0 or 1.
    /// `None` if the prompt asks for no shift.
    pub fn shift(self) -> Option<[i8; 2]> {
        match self {
            Self::CutOff(Side::Left) => Some([1, 0]),
            Self::CutOff(Side::Right) => Some([-1, 0]),
            Self::CutOff(Side::Top) => Some([0, 1]),
            Self::CutOff(Side::Bottom) => Some([0, -1]),
            Self::Shift(across, upright) => {
                let right = across.map_or(0, |across| if across == Across::Left { -1 } else { 1 });
                let down = upright.map_or(0, |upright| if upright == Upright::Up { -1 } else { 1 });
                Some([right, down])
            }
            _ => None,
        }
    }

    /// True if the requested movement has been made, or more: any more would lead away from the
    /// requested pose. `off` is the difference from that pose.
    pub(super) fn is_done(self, off: &Difference) -> bool {
        match self {
            Self::Closer => off.size_ratio <= 1.0,
            Self::Farther => off.size_ratio >= 1.0,
            Self::Shift(..) => self.shift().is_some_and(|[right, down]| {
                off.shift_px.x * f64::from(right) + off.shift_px.y * f64::from(down) <= 0.0
            }),
            Self::Tip(_) | Self::TipInstead(_) => {
                off.turn_rad.abs() <= 0.5 * FRAC_PI_4 && off.tilt_rad >= off.wanted_tilt_rad
            }
            Self::TipFurther(_) => off.tilt_rad >= off.wanted_tilt_rad,
            Self::TipLess => off.tilt_rad <= off.wanted_tilt_rad,
            _ => false,
        }
    }

    /// True if the prompt is about the session's or the camera's state, not the board.
    pub fn is_state(self) -> bool {
        matches!(
            self,
            Self::Complete
                | Self::Exhausted
                | Self::Failed
                | Self::CameraLost
                | Self::Frozen
                | Self::LensMoved(_)
                | Self::Paused
                | Self::SourceEnded
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_go_clockwise_from_the_right() {
        let towards = |degrees: f64| Edge::towards(degrees.to_radians());
        assert_eq!(towards(0.0), Edge::Right);
        assert_eq!(towards(90.0), Edge::Bottom);
        assert_eq!(towards(-5.0), Edge::Right);
        assert_eq!(towards(359.0), Edge::Right);
        assert_eq!(towards(315.0), Edge::TopRight);
        for edge in Edge::ALL {
            assert_eq!(edge.mirrored().mirrored(), edge);
        }
    }

    #[test]
    fn another_edge_replaces_the_one_that_is_away_only_when_far_from_it() {
        let off = |from: f64, to: f64| {
            let tilt_azimuth_rad = Some(from.to_radians());
            Prompt::of_advice(
                &Advice::TipTowards { tilt_azimuth_rad, wanted_rad: to.to_radians() },
                None,
            )
        };
        assert_eq!(off(0.0, 180.0), Prompt::TipInstead(Edge::Left));
        assert_eq!(off(95.0, 138.0), Prompt::Tip(Edge::BottomLeft));
        assert_eq!(off(5.0, 325.0), Prompt::Tip(Edge::TopRight));
    }

    #[test]
    fn a_mirror_exchanges_left_and_right_only() {
        assert_eq!(Prompt::Tip(Edge::Right).mirrored(), Prompt::Tip(Edge::Left));
        assert_eq!(Prompt::TipFurther(Edge::Top).mirrored(), Prompt::TipFurther(Edge::Top));
        let shift = Prompt::Shift(Some(Across::Right), Some(Upright::Up));
        assert_eq!(shift.mirrored(), Prompt::Shift(Some(Across::Left), Some(Upright::Up)));
        assert_eq!(Prompt::CutOff(Side::Top).mirrored(), Prompt::CutOff(Side::Top));
        assert_eq!(Prompt::HoldStill.mirrored(), Prompt::HoldStill);
    }

    #[test]
    fn a_shift_names_the_directions_that_matter() {
        let shift =
            |right_px, down_px| Prompt::of_advice(&Advice::Shift { right_px, down_px }, None);
        assert_eq!(shift(-60.0, 5.0), Prompt::Shift(Some(Across::Left), None));
        assert_eq!(shift(-60.0, 5.0).shift(), Some([-1, 0]));
        assert_eq!(Prompt::CutOff(Side::Left).shift(), Some([1, 0]), "away from the edge");
        assert_eq!(Prompt::HoldStill.shift(), None);
        assert_eq!(shift(4.0, -40.0), Prompt::Shift(None, Some(Upright::Up)));
        assert_eq!(shift(50.0, 40.0), Prompt::Shift(Some(Across::Right), Some(Upright::Down)));
    }
}
