//! Choice of a board to print for a camera: the size of each paper's board in the picture, and its
//! achievable precision.
//!
//! A board should fill the picture at its distance, as guidance asks for. The precision of smaller
//! boards is forecast by the planner itself ([`reach()`]), with its expected errors of corners.

use std::ops::Range;

use serde::Serialize;

use crate::commands::board_sheet::BoardSheet;
use boresight_geometry::{Camera, boards::Board, boards::BoardChoice, frame::ImageSize};
use boresight_guide::guidance::{GuidanceParams, LensEstimate, reach};
use boresight_present::sheet::Paper;

/// Name and version of [`BoardPlan`].
pub const BOARD_PLAN_SCHEMA: &str = "boresight.board-plan/1";

/// A camera, and the place of the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Size of the picture.
    pub image_size: ImageSize,
    /// Focal length in pixels.
    pub f_px: f64,
    /// Distance between camera and board.
    pub distance_m: f64,
}

/// What `plan-board --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct BoardPlan {
    /// [`BOARD_PLAN_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.board-plan/1")))]
    pub schema: String,
    /// Width and height of the picture.
    pub image_size: [u32; 2],
    /// Focal length that was given, or follows from the field of view.
    pub f_px: f64,
    /// Distance between camera and board.
    pub distance_m: f64,
    /// Width and height of what the picture shows at that distance.
    pub seen_mm: [f64; 2],
    /// The board that fills the picture at that distance, on whatever it's printed.
    pub filling: PlannedBoard,
    /// The largest board on each paper, the smallest paper first.
    pub papers: Vec<PlannedBoard>,
    /// Name of the smallest paper whose board is expected to meet the goals of precision; null if none is: have one made
    /// of the size of `enough`.
    pub smallest: Option<String>,
    /// The smallest board that is expected to meet the goals, in whole millimetres a square, on whatever it's printed;
    /// null if none does that fits into the picture.
    pub enough: Option<PlannedBoard>,
}

/// A board, and what it's expected to measure.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct PlannedBoard {
    /// Name of the paper; null for the board that fills the picture.
    pub paper: Option<String>,
    /// The board by its name on the command line.
    pub board: String,
    /// Side of a square.
    pub square_mm: f64,
    /// Width and height of all squares.
    pub board_mm: [f64; 2],
    /// Side of a square in the picture, seen from ahead.
    pub square_px: f64,
    /// Share of the picture that the inner corners span, the larger one of width and height; above 1, the board is too
    /// large for that distance.
    pub share: f64,
    /// Distance at which it would fill the picture.
    pub filling_distance_m: f64,
    /// Expected standard deviation of the principal point after eight views; null if it can't be measured.
    pub pp_sigma_px: Option<f64>,
    /// Expected standard deviation of projection, mean over the picture.
    pub projection_sigma_px: Option<f64>,
    /// Whether both goals of precision are met: of a board that stays small, that of projection alone.
    pub meets_goals: bool,
}

/// Plans `board` for `place`, with the goals of `params`.
pub fn plan_board(board: BoardChoice, place: &Place, params: &GuidanceParams) -> BoardPlan {
    let ImageSize { width_px, height_px } = place.image_size;
    let seen_mm =
        [width_px, height_px].map(|side| f64::from(side) * place.distance_m / place.f_px * 1e3);
    // Whole millimetres, as a person orders them, of the larger orientation.
    let filling_mm = turned(board, |columns, rows| {
        let fits = |seen: f64, corners: f64| seen / (corners - 1.0).max(1.0);
        let inside = params.target_margin_fraction * 2.0 * seen_mm[0].min(seen_mm[1]);
        fits(seen_mm[0] - inside, columns).min(fits(seen_mm[1] - inside, rows))
    });
    let filling_mm = filling_mm.floor().max(1.0);
    let papers: Vec<PlannedBoard> = Paper::ALL
        .into_iter()
        .filter_map(|paper| {
            let sheet = BoardSheet::new(board, None, &paper.pages()).ok()?;
            let planned = planned(board, sheet.plan.square_mm, seen_mm, place, params);
            Some(PlannedBoard { paper: Some(paper.name().into()), ..planned })
        })
        .collect();
    let smallest = papers.iter().find(|paper| paper.meets_goals);
    let of_square = |square_mm: f64| planned(board, square_mm, seen_mm, place, params);
    let filling = of_square(filling_mm);
    BoardPlan {
        schema: BOARD_PLAN_SCHEMA.into(),
        image_size: [width_px, height_px],
        f_px: place.f_px,
        distance_m: place.distance_m,
        seen_mm,
        enough: enough(&filling, of_square, params),
        filling,
        smallest: smallest.and_then(|planned| planned.paper.clone()),
        papers,
    }
}

/// Smallest of the boards from `of_square`, up to the `filling` board, to meet the goals. Boards
/// that stay small have goals of their own and are searched first.
fn enough(
    filling: &PlannedBoard,
    of_square: impl Fn(f64) -> PlannedBoard,
    params: &GuidanceParams,
) -> Option<PlannedBoard> {
    let filling_mm = filling.square_mm as u32;
    let is_far = |square_mm: u32| {
        let share = filling.share * f64::from(square_mm) / filling.square_mm;
        GuidanceParams { target_span_fraction: share, ..*params }.is_far()
    };
    let first_near_mm = first(1..filling_mm, |square_mm| !is_far(square_mm)).unwrap_or(filling_mm);
    let meets = |square_mm: u32| of_square(f64::from(square_mm)).meets_goals;
    let square_mm =
        first(1..first_near_mm, meets).or_else(|| first(first_near_mm..filling_mm + 1, meets))?;
    Some(of_square(f64::from(square_mm)))
}

/// First number in `range` with `is_enough`, a monotonic predicate; `None` if false for the last
/// number.
fn first(range: Range<u32>, is_enough: impl Fn(u32) -> bool) -> Option<u32> {
    let (mut from, mut to) = (range.start, range.end.checked_sub(1)?);
    if from > to || !is_enough(to) {
        return None;
    }
    while from < to {
        let middle = from + (to - from) / 2;
        if is_enough(middle) { to = middle } else { from = middle + 1 }
    }
    Some(to)
}

/// Larger value of `of` over both orientations of the board's inner corners.
fn turned(board: BoardChoice, of: impl Fn(f64, f64) -> f64) -> f64 {
    let (columns, rows) = (f64::from(board.columns), f64::from(board.rows));
    of(columns, rows).max(of(rows, columns))
}

fn planned(
    choice: BoardChoice,
    square_mm: f64,
    seen_mm: [f64; 2],
    place: &Place,
    params: &GuidanceParams,
) -> PlannedBoard {
    // As held: the orientation with the larger share before the board leaves the picture.
    let share = -turned(choice, |columns, rows| {
        -((columns - 1.0) * square_mm / seen_mm[0]).max((rows - 1.0) * square_mm / seen_mm[1])
    });
    let guess = LensEstimate {
        camera: Camera::pinhole(place.f_px, place.image_size.centre_px()),
        ..LensEstimate::guess(place.image_size)
    };
    let limits =
        GuidanceParams { target_span_fraction: params.target_span_fraction.min(share), ..*params };
    let board = Board::new(choice.columns, choice.rows, square_mm * 1e-3).ok();
    let reached = board.and_then(|board| reach(&[], &board, &guess, None, &limits));
    let meets = |goal: f64, sigma: f64| sigma <= goal;
    let meets_goals = reached.is_some_and(|reached| {
        let pp_goal = limits.pp_goal_px(guess.f_to_width());
        meets(limits.stop_projection_sigma_px, reached.projection_sigma_px)
            && (limits.is_far() || meets(pp_goal, reached.pp_sigma_px))
    });
    PlannedBoard {
        paper: None,
        board: choice.to_string(),
        square_mm,
        board_mm: [choice.columns, choice.rows].map(|corners| f64::from(corners + 1) * square_mm),
        square_px: square_mm * 1e-3 * place.f_px / place.distance_m,
        share,
        filling_distance_m: place.distance_m * share,
        pp_sigma_px: reached.map(|reached| reached.pp_sigma_px),
        projection_sigma_px: reached.map(|reached| reached.projection_sigma_px),
        meets_goals,
    }
}

impl BoardPlan {
    /// Plan in sentences.
    pub fn lines(&self) -> Vec<String> {
        let [across_mm, down_mm] = self.seen_mm;
        let mut lines = vec![format!(
            "At {:.2} m, the picture shows {across_mm:.0} x {down_mm:.0} mm.",
            self.distance_m
        )];
        let every = self.papers.iter().chain([&self.filling]);
        lines.extend(every.map(PlannedBoard::line));
        let enough = self.enough.as_ref().map(|enough| {
            let ([width_mm, height_mm], square_mm) = (enough.board_mm, enough.square_mm);
            format!("{width_mm:.0} x {height_mm:.0} mm ({square_mm:.0} mm squares)")
        });
        lines.extend(enough.as_ref().map(|size| format!("You need about {size}.")));
        let board = &self.filling.board;
        lines.push(match (&self.smallest, enough) {
            (Some(paper), _) => format!(
                "{paper} is enough: boresight target --board {board} --paper {}",
                paper.to_ascii_lowercase()
            ),
            (None, Some(size)) => {
                format!("No paper is large enough. Have a board of {size} made, or come nearer.")
            }
            (None, None) => "No board that fits into the picture is expected to be enough: accept less, or use a camera with more pixels.".into(),
        });
        lines
    }
}

impl PlannedBoard {
    fn line(&self) -> String {
        let name = self.paper.as_deref().unwrap_or("Filling");
        let Self { square_mm, square_px, share, .. } = self;
        let looks = if *share > 1.0 {
            format!("too large here, fills the picture at {:.2} m", self.filling_distance_m)
        } else {
            format!("{:.0} % of the picture, {square_px:.0} px a square", 100.0 * share)
        };
        let reached = self.pp_sigma_px.zip(self.projection_sigma_px);
        let reached =
            reached.map_or("too small to measure with".to_owned(), |(pp_px, projection_px)| {
                format!(
                    "principal point to about {pp_px:.1} px, typical error {projection_px:.2} px"
                )
            });
        format!("{name:8} {square_mm:6} mm squares: {looks}; {reached}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::boards::Pattern;

    fn plan(distance_m: f64) -> BoardPlan {
        let image_size = ImageSize { width_px: 1280, height_px: 720 };
        let place = Place { image_size, f_px: 1000.0, distance_m };
        let board = BoardChoice::of([9, 6], Pattern::Plain);
        plan_board(board, &place, &GuidanceParams::default())
    }

    #[test]
    fn the_board_that_fills_the_picture_grows_with_the_distance() {
        let (near, far) = (plan(0.5), plan(5.0));
        assert_eq!(near.seen_mm, [640.0, 360.0]);
        // 5 squares in 360 mm less the margins.
        assert!((60.0..70.0).contains(&near.filling.square_mm), "{near:?}");
        assert!((far.filling.square_mm / near.filling.square_mm - 10.0).abs() < 0.2);
        for plan in [&near, &far] {
            assert!((0.85..1.0).contains(&plan.filling.share) && plan.filling.meets_goals);
            let enough = plan.enough.as_ref().expect("the filling one is");
            assert!(enough.meets_goals && enough.square_mm < plan.filling.square_mm, "{plan:#?}");
        }
        let enough = |plan: &BoardPlan| plan.enough.as_ref().expect("one").square_mm;
        assert!((enough(&far) / enough(&near) - 10.0).abs() < 1.0, "{near:#?} {far:#?}");
    }

    #[test]
    fn a_small_board_far_away_measures_less() {
        let (near, far) = (plan(0.3), plan(5.0));
        assert_eq!(near.papers.len(), 3);
        assert_eq!(near.smallest.as_deref(), Some("A4"), "{near:#?}");
        assert_eq!(far.smallest, None, "{far:#?}");
        for (near, far) in near.papers.iter().zip(&far.papers) {
            assert!(near.meets_goals && !far.meets_goals);
            assert!((near.square_px / far.square_px - 5.0 / 0.3).abs() < 1e-9);
        }
        // A board smaller by one millimetre isn't enough.
        let (image_size, f_px, distance_m) =
            (ImageSize { width_px: 1280, height_px: 720 }, 1000.0, 5.0);
        let place = Place { image_size, f_px, distance_m };
        let board = BoardChoice::of([9, 6], Pattern::Plain);
        let square_mm = far.enough.expect("one").square_mm - 1.0;
        let less = planned(board, square_mm, far.seen_mm, &place, &GuidanceParams::default());
        assert!(!less.meets_goals, "{less:#?}");
        // Larger paper, larger squares.
        assert!(far.papers.windows(2).all(|pair| pair[0].square_mm <= pair[1].square_mm));
    }
}
