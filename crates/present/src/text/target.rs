//! Words on a printed board, and instructions for use.

use super::boards::{millimetres, printed, white};
use crate::sheet::{DoesNotFit, LINES, Plan};
use boresight_geometry::{
    boards::{Board, Pattern},
    markers::Tags,
};

/// Board named by a code in its margin.
pub fn board_from_code(board: &Board, id: &str, square_mm: f64) -> String {
    let (columns, rows) = (board.columns(), board.rows());
    let printed_mm = board.square_m() * 1e3;
    let measured = if (square_mm - printed_mm).abs() > 5e-4 {
        format!(", measured {}", millimetres(square_mm))
    } else {
        String::new()
    };
    format!("Board from its code: {columns}x{rows}, {}{measured}, ID {id}", millimetres(printed_mm))
}

/// Note about a board printed with a code.
pub fn code_in_margin(id: &str) -> String {
    format!("Board ID {id}: you won't need to type its size. The code in its margin says it")
}

/// Reason why a board is printed without a code.
pub const NO_ROOM_FOR_CODE: &str =
    "No code in the margin: there's no room for it beside squares of this size";

/// Lines printed beside the ruler, with the board's ID if there is an ID.
pub fn target_lines(plan: &Plan, id: Option<&str>) -> [String; LINES] {
    let width = millimetres(plan.board_width_mm());
    let [show, mount] = if plan.page.pixels.is_some() {
        ["Show at 100 %, unscaled, full brightness.", "Clean the screen; keep reflections off it."]
    } else {
        [
            "Print at 100 % (actual size), not \"fit to page\".",
            "Glue it flat: no gap under a straight edge.",
        ]
    };
    [
        printed(plan, id),
        show.into(),
        format!("Measure: ruler {}, board {width} wide.", millimetres(plan.ruler_mm)),
        mount.into(),
        format!("boresight guide {}", arguments(plan)),
    ]
}

/// Instructions for the written file, step by step; with a code in the margin, the board needn't be
/// typed.
pub fn target_steps(plan: &Plan, has_code: bool) -> Vec<String> {
    let ruler = millimetres(plan.ruler_mm);
    let width = millimetres(plan.board_width_mm());
    let (across, divisor) = match plan.pattern.is_squares() {
        true => (format!("{} squares are", plan.columns + 1), f64::from(plan.columns + 1)),
        false => (String::from("pattern is"), plan.board_width_mm() / plan.square_mm),
    };
    let divisor = (1e6 * divisor).round() / 1e6;
    let measure = |again: &str| {
        format!(
            "Check with a steel ruler: the printed ruler is {ruler} long, and the board's {across} {width} wide. If not, {again}, or use the measured width ÷ {divisor} as the square."
        )
    };
    let mut steps = if plan.page.pixels.is_some() {
        vec![
            "Show it full screen at 100 %, one image pixel per screen pixel.".into(),
            measure("correct --dpi"),
            "Clean the screen, set full brightness, and keep reflections off it. Any screen that isn't curved is flat enough.".into(),
        ]
    } else {
        vec![
            "Print at 100 % (\"actual size\", not \"fit to page\") on matt paper.".into(),
            measure("print again"),
            "Glue the whole sheet to something stiff and flat (glass, aluminium, board of 5 mm or more). Lay a straight edge along both diagonals: no gap may be wider than 0.3 mm (three sheets of paper).".into(),
        ]
    };
    if plan.white_mm() < 0.999 * plan.wanted_white_mm() {
        let wanted = white(plan.pattern);
        steps.push(format!(
            "The white margin is {} wide, narrower than {wanted}: keep the background light, and don't cover the squares with your fingers.",
            millimetres((10.0 * plan.white_mm()).floor() / 10.0)
        ));
    }
    let arguments = arguments(plan);
    steps.push(if has_code {
        format!("Calibrate: boresight guide. The code in the margin says which board it is ({arguments}).")
    } else {
        format!("Calibrate: boresight guide {arguments}")
    });
    if let Pattern::AprilGrid(Tags { spacing, first: 0 }) = plan.pattern {
        steps.push(format!(
            "For Kalibr, in aprilgrid.yaml: target_type: 'aprilgrid', tagCols: {}, tagRows: {}, tagSize: {}, tagSpacing: {spacing}",
            plan.columns / 2,
            plan.rows / 2,
            (1e3 * plan.square_mm).round() / 1e6,
        ));
    }
    steps
}

/// Alternatives that fit.
pub fn does_not_fit(err: &DoesNotFit) -> String {
    match err {
        DoesNotFit::TooLarge { largest_mm, paper, .. } => {
            let largest = match largest_mm {
                Some(mm) => {
                    format!("the largest squares that fit are {}", millimetres(*mm))
                }
                None => "no squares fit: use fewer of them".into(),
            };
            let paper = match paper {
                Some(paper) => format!("the smallest paper that works is {}", paper.name()),
                None => "it doesn't fit on A4, Letter or A3".into(),
            };
            format!("{largest}; {paper}")
        }
        DoesNotFit::TooSmall { least_mm, .. } => {
            format!("the smallest are {}", millimetres(*least_mm))
        }
    }
}

/// Note about squares of another size than requested: a screen's squares are whole pixels.
pub fn other_square(plan: &Plan, asked_mm: f64) -> Option<String> {
    ((plan.square_mm - asked_mm).abs() > 5e-4).then(|| {
        format!(
            "Squares of {} instead of {}: whole pixels of the screen",
            millimetres(plan.square_mm),
            millimetres(asked_mm)
        )
    })
}

fn arguments(plan: &Plan) -> String {
    let square = millimetres(plan.square_mm).replace(' ', "");
    format!("--board {} --square {square}", plan.choice())
}
