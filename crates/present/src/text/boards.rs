//! Words of every kind of board.

use crate::sheet::Plan;
use boresight_formats::{BoardEntry, MarkersEntry};
use boresight_geometry::{
    boards::{BOARD_KINDS, Board, BoardChoice, Pattern},
    markers::{CircleRows, Tags},
};

/// Words about a kind of board, each label with an explanation.
#[derive(Clone, Copy, Debug)]
pub struct KindWords {
    /// Name.
    pub name: [&'static str; 2],
    /// Label of the counts.
    pub counts: [&'static str; 2],
    /// Label of the length to measure.
    pub length: [&'static str; 2],
}

const CHECKERBOARD: KindWords = KindWords {
    name: ["Checkerboard", "Dark and light squares, nothing else."],
    counts: [
        "Inner corners",
        "Where four squares meet: one fewer than squares in each direction. Or hold it up: it's counted.",
    ],
    length: ["Square", "Measure ten squares and divide by ten. Only distances depend on it."],
};

const CIRCLES: KindWords = KindWords {
    name: ["Circles", "Rows of circles below each other, dark on light or light on dark."],
    counts: ["Circles", "In a row, and rows."],
    length: [
        "Rows apart",
        "From the centres of one row to those of the next, shifted or not: squareSize in OpenCV. Measure it over the whole board.",
    ],
};

/// Words in the order of [`BOARD_KINDS`].
pub const KINDS: [KindWords; BOARD_KINDS.len()] = [
    CHECKERBOARD,
    KindWords {
        name: [
            "ChArUco",
            "A checkerboard with a marker in each light square. A part of it is enough: best for the corners of the picture and for wide lenses.",
        ],
        counts: ["Squares", "Dark and light ones, in each direction."],
        ..CHECKERBOARD
    },
    KindWords {
        name: [
            "AprilGrid",
            "Kalibr's board: tags with small dark squares at their corners. A part of it is enough.",
        ],
        counts: ["Tags", "The large ones with a code, in each direction."],
        length: ["Tag", "Side of a tag with its black frame: tagSize in Kalibr. Measure it."],
    },
    CIRCLES,
    KindWords {
        name: ["Asymmetric circles", "Rows of circles, every second one shifted by half a step."],
        ..CIRCLES
    },
];

/// Chosen board, with the dictionary of the markers.
pub fn board(BoardChoice { columns, rows, pattern }: BoardChoice) -> String {
    let squares = format!("{} × {} squares", columns + 1, rows + 1);
    match pattern {
        Pattern::Plain => format!("{squares}, {columns} × {rows} inner corners"),
        Pattern::Charuco { dictionary, .. } => format!("{squares}, {dictionary}"),
        Pattern::AprilGrid(_) => format!("{} × {} tags", columns / 2, rows / 2),
        Pattern::Circles(layout) => format!("{} {columns} × {rows}", circles(layout)),
    }
}

/// Sentence about the board to start with; with a question mark unless `is_known`.
pub fn board_to_use(choice: BoardChoice, length_m: f64, is_known: bool) -> String {
    let what = match choice.pattern {
        Pattern::Charuco { .. } => format!("ChArUco, {} × {}", choice.columns + 1, choice.rows + 1),
        Pattern::Plain => format!("{} × {} squares", choice.columns + 1, choice.rows + 1),
        _ => board(choice),
    };
    format!("{what}, {}{}", square(length_m), if is_known { "" } else { "?" })
}

/// Board chosen for a session that shows another board.
pub(super) fn expected(chosen: &Board) -> String {
    let [columns, rows] = chosen.target().grid();
    match chosen {
        Board::Plain(_) => format!("{} × {}", columns + 1, rows + 1),
        Board::Charuco(_) => format!("ChArUco, {} × {} squares", columns + 1, rows + 1),
        Board::AprilGrid(_) => format!("an AprilGrid of {} × {} tags", columns / 2, rows / 2),
        Board::Circles(_) => format!("{columns} × {rows} circles"),
    }
}

/// First line beside the ruler of a printed board, with the board's ID if there is an ID.
pub(super) fn printed(plan: &Plan, id: Option<&str>) -> String {
    let (Plan { columns, rows, .. }, square) = (plan, millimetres(plan.square_mm));
    match (id, plan.pattern) {
        (_, Pattern::AprilGrid(Tags { spacing, first })) => format!(
            "AprilGrid {}x{} tags of {square}, {} apart ({spacing}), from tag {first}",
            columns / 2,
            rows / 2,
            millimetres(plan.square_mm * spacing)
        ),
        (_, Pattern::Circles(layout)) => {
            format!("{} {columns}x{rows}, rows {square} apart", circles(layout))
        }
        (_, Pattern::Charuco { dictionary, side }) => format!(
            "ChArUco {}x{} squares of {square}, {dictionary}, markers {}",
            columns + 1,
            rows + 1,
            millimetres(plan.square_mm * side.in_squares_of(1e-3 * plan.square_mm))
        ),
        (Some(id), Pattern::Plain) => {
            format!("{columns}x{rows} inner corners, square {square}, ID {id}")
        }
        (None, Pattern::Plain) => {
            format!("Checkerboard {columns}x{rows} (inner corners), square {square}")
        }
    }
}

/// Width of the white margin around a printed board, in words.
pub(super) fn white(pattern: Pattern) -> &'static str {
    match pattern {
        Pattern::AprilGrid(_) => "between tags",
        Pattern::Circles(_) => "between rows",
        Pattern::Plain | Pattern::Charuco { .. } => "a square",
    }
}

/// Board of a calibration file.
pub fn board_in_file(board: &BoardEntry) -> String {
    let BoardEntry { columns, rows, square_mm, markers, circles, .. } = board;
    let tags = markers.as_ref().and_then(MarkersEntry::tags);
    if let Some(layout) = circles.as_deref().and_then(CircleRows::named) {
        let name = self::circles(layout);
        return format!("{name}, {columns} × {rows}, rows {square_mm} mm apart");
    }
    match (markers, tags) {
        (None, _) => format!("{columns} × {rows} inner corners, squares of {square_mm} mm"),
        (_, Some(Tags { spacing, first })) => format!(
            "AprilGrid, {} × {} tags of {square_mm} mm, {spacing} of a tag apart, from tag {first}",
            columns / 2,
            rows / 2,
        ),
        (Some(MarkersEntry { dictionary, side_mm, .. }), None) => format!(
            "ChArUco, {} × {} squares of {square_mm} mm, {dictionary}, markers of {} mm",
            columns + 1,
            rows + 1,
            (1000.0 * side_mm).round() / 1000.0
        ),
    }
}

/// Name of a grid of circles.
pub(super) fn circles(rows: CircleRows) -> &'static str {
    match rows {
        CircleRows::Symmetric => "Circles",
        CircleRows::Asymmetric => "Asymmetric circles",
    }
}

/// Side of a square, to a hundredth of a millimetre.
pub fn square(square_m: f64) -> String {
    rounded_mm(1e3 * square_m, 2)
}

/// Length to a micrometre, with the unit.
pub(super) fn millimetres(mm: f64) -> String {
    rounded_mm(mm, 3)
}

fn rounded_mm(mm: f64, decimals: usize) -> String {
    let text = format!("{mm:.decimals$}");
    format!("{} mm", text.trim_end_matches('0').trim_end_matches('.'))
}
