use super::{
    Page, Paper,
    footer::{FOOTER_GAP_MM, footer_height_mm, ruler_mm},
};

use boresight_geometry::{
    board_code::{Edge, FAR},
    boards::{Board, BoardChoice, MarkerSide, Pattern},
};

/// Size of the squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Square {
    /// Squares of exactly the given side.
    Exactly {
        /// Side of a square.
        mm: f64,
    },
    /// Squares as large as fit with a white margin of one square around the board.
    Largest,
}

/// Place of the board on a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Inner corners in a row.
    pub columns: u16,
    /// Inner corners in a column.
    pub rows: u16,
    /// Side of a square or tag, or distance between rows of circles. On a screen, a whole number of
    /// pixels.
    pub square_mm: f64,
    /// Print of the board.
    pub pattern: Pattern,
    /// Left edge of the board.
    pub left_mm: f64,
    /// Upper edge of the board.
    pub top_mm: f64,
    /// Page, in the orientation that fits best.
    pub page: Page,
    /// Length of the ruler: 100 mm if the page is wide enough.
    pub ruler_mm: f64,
}

/// Reason why a board doesn't fit on a page.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DoesNotFit {
    /// Board larger than the page.
    #[error("{columns}x{rows} inner corners do not fit")]
    TooLarge {
        /// Inner corners in a row.
        columns: u16,
        /// Inner corners in a column.
        rows: u16,
        /// Largest squares that fit, if any.
        largest_mm: Option<f64>,
        /// Smallest paper for the requested board.
        paper: Option<Paper>,
    },
    /// Squares too small for any camera: less than a millimetre or, on a screen, eight pixels.
    #[error("squares of {square_mm} mm are too small")]
    TooSmall {
        /// Requested side of a square.
        square_mm: f64,
        /// Side of the smallest allowed squares.
        least_mm: f64,
    },
}

/// Places a board of `columns` × `rows` inner corners on the one of `pages` with most white around
/// it.
///
/// # Errors
///
/// [`DoesNotFit`].
pub fn plan(columns: u16, rows: u16, square: Square, pages: &[Page]) -> Result<Plan, DoesNotFit> {
    plan_of(&BoardChoice { columns, rows, pattern: Pattern::Plain }, square, pages)
}

/// Places a board with unchecked markers on the one of `pages` with most white around it.
///
/// # Errors
///
/// [`DoesNotFit`].
pub fn plan_of(board: &BoardChoice, square: Square, pages: &[Page]) -> Result<Plan, DoesNotFit> {
    let squares = Squares::of(*board);
    let least_mm = pages.iter().map(least_mm).fold(f64::INFINITY, f64::min);
    if let Square::Exactly { mm } = square
        && mm < 0.999 * least_mm
    {
        return Err(DoesNotFit::TooSmall { square_mm: mm, least_mm });
    }
    let plans = pages.iter().filter_map(|page| {
        let square_mm = match square {
            Square::Exactly { mm } => on_pixels(page, mm, f64::round),
            Square::Largest => squares.largest_mm(page, White::Wanted)?,
        };
        squares.place(page, square_mm)
    });
    let best = plans.max_by(|a, b| {
        let rank = |plan: &Plan| (plan.square_mm, plan.white_mm());
        // Of equals, the first one (landscape) wins.
        rank(a)
            .partial_cmp(&rank(b))
            .unwrap_or(std::cmp::Ordering::Equal)
            .then(std::cmp::Ordering::Greater)
    });
    best.ok_or_else(|| {
        let largest = pages.iter().filter_map(|page| squares.largest_mm(page, White::Margin));
        let holds = |paper: &Paper| match square {
            Square::Exactly { mm } => {
                paper.pages().iter().any(|page| squares.place(page, mm).is_some())
            }
            Square::Largest => {
                paper.pages().iter().any(|page| squares.largest_mm(page, White::Wanted).is_some())
            }
        };
        DoesNotFit::TooLarge {
            columns: board.columns,
            rows: board.rows,
            largest_mm: largest.max_by(f64::total_cmp),
            paper: Paper::ALL.into_iter().find(holds),
        }
    })
}

impl Plan {
    /// File name stem with the numbers needed to detect the board.
    pub fn file_stem(&self) -> String {
        let (choice, square_mm) = (self.choice(), (1000.0 * self.square_mm).round() / 1000.0);
        let [across, down] = choice.counted();
        let dictionary = self.pattern.dictionary().map(|dictionary| format!("-{dictionary}"));
        let dictionary = dictionary.unwrap_or_default();
        format!("{}-{across}x{down}-{square_mm}mm{dictionary}", choice.kind().name)
    }

    /// Board as on a command line, with the side of the markers to a micrometre.
    pub fn choice(&self) -> BoardChoice {
        let mut choice = BoardChoice::of([self.columns, self.rows], self.pattern);
        if let Pattern::Charuco { side, .. } = &mut choice.pattern {
            let square_m = 1e-3 * self.square_mm;
            let side_m = side.in_squares_of(square_m) * square_m;
            *side = MarkerSide::Metres((1e6 * side_m).round() * 1e-6);
        }
        choice
    }

    /// Board in metres, unchecked; `None` with invalid counts.
    pub fn drawn(&self) -> Option<Board> {
        let choice = BoardChoice::of([self.columns, self.rows], self.pattern);
        choice.drawn(self.square_mm * 1e-3)
    }

    /// Board in metres; `None` if it's invalid.
    pub fn board(&self) -> Option<Board> {
        self.drawn().filter(|board| board.target().check().is_ok())
    }

    /// Width of the whole board.
    pub fn board_width_mm(&self) -> f64 {
        self.squares().sides[0] * self.square_mm
    }

    /// Height of the whole board.
    pub fn board_height_mm(&self) -> f64 {
        self.squares().sides[1] * self.square_mm
    }

    fn squares(&self) -> Squares {
        Squares::of(BoardChoice::of([self.columns, self.rows], self.pattern))
    }

    /// White margin for best detection: one square, or the space between tags.
    pub fn wanted_white_mm(&self) -> f64 {
        self.squares().white * self.square_mm
    }

    /// Edges of the board with room for a code in the margin: long edges first, at most two.
    pub fn edges_with_room(&self) -> Vec<Edge> {
        let needed_mm = FAR * self.square_mm + self.page.margin_mm;
        let pairs =
            [(Edge::Top, Edge::Bottom, self.top_mm), (Edge::Left, Edge::Right, self.left_mm)];
        let [upright, level] = pairs;
        let in_order = if self.columns >= self.rows { [upright, level] } else { [level, upright] };
        let with_room = in_order.into_iter().find(|(_, _, white_mm)| *white_mm >= needed_mm);
        with_room.map_or_else(Vec::new, |(one, other, _)| vec![one, other])
    }

    /// Narrowest white margin around the board.
    pub fn white_mm(&self) -> f64 {
        self.left_mm.min(self.top_mm)
    }
}

/// White space needed on each side of the board.
#[derive(Clone, Copy)]
enum White {
    Wanted,
    /// The printer's margin alone.
    Margin,
}

#[derive(Clone, Copy)]
struct Squares {
    board: BoardChoice,
    /// Width and height of the pattern, in squares.
    sides: [f64; 2],
    /// Wanted white margin around the pattern, in squares.
    white: f64,
}

impl Squares {
    fn of(board: BoardChoice) -> Self {
        let drawn = board.drawn(1.0);
        // Treat invalid counts as squares.
        let plain = [board.columns, board.rows].map(|corners| f64::from(corners) + 1.0);
        let sides = drawn.map_or(plain, |drawn| drawn.target().size_m());
        let white = drawn.map_or(1.0, |drawn| drawn.target().steps_m()[1]);
        Self { board, sides, white }
    }

    fn largest_mm(self, page: &Page, white: White) -> Option<f64> {
        let (width_mm, height_mm) = room_mm(page)?;
        let side = |room_mm: f64, squares: f64| {
            let within_margins = (room_mm - 2.0 * page.margin_mm) / squares;
            match white {
                White::Wanted => within_margins.min(room_mm / (squares + 2.0 * self.white)),
                White::Margin => within_margins,
            }
        };
        let most_mm = side(width_mm, self.sides[0]).min(side(height_mm, self.sides[1]));
        let round_mm = match page.pixels {
            Some(_) => on_pixels(page, most_mm, f64::floor),
            // Rounding must not lose an exactly fitting square.
            None if most_mm < 5.0 => (2.0 * most_mm + 1e-9).floor() / 2.0,
            None => (most_mm + 1e-9).floor(),
        };
        (round_mm > 0.999 * least_mm(page)).then_some(round_mm)
    }

    /// Places the board in the middle of the page. `None` if the white is narrower than the
    /// margins.
    fn place(self, page: &Page, square_mm: f64) -> Option<Plan> {
        let (width_mm, height_mm) = room_mm(page)?;
        let start = |room_mm: f64, squares: f64| {
            let start_mm = (room_mm - squares * square_mm) / 2.0;
            (start_mm > page.margin_mm - 1e-6).then(|| on_pixels(page, start_mm, f64::floor))
        };
        let BoardChoice { columns, rows, pattern } = self.board;
        Some(Plan {
            columns,
            rows,
            square_mm,
            pattern,
            left_mm: start(width_mm, self.sides[0])?,
            top_mm: start(height_mm, self.sides[1])?,
            page: *page,
            ruler_mm: ruler_mm(page)?,
        })
    }
}

fn least_mm(page: &Page) -> f64 {
    page.pixels.map_or(1.0, |pixels| 8.0 / pixels.per_mm())
}

/// Width and height above ruler and words. `None` if not even a short ruler fits.
fn room_mm(page: &Page) -> Option<(f64, f64)> {
    ruler_mm(page)?;
    let below_mm = footer_height_mm(page) + FOOTER_GAP_MM + page.margin_mm;
    Some((page.width_mm, page.height_mm - below_mm))
}

/// Length in whole pixels, if the page has pixels.
fn on_pixels(page: &Page, mm: f64, whole: fn(f64) -> f64) -> f64 {
    page.pixels.map_or(mm, |pixels| whole(mm * pixels.per_mm() + 1e-9) / pixels.per_mm())
}
