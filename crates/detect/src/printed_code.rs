//! Reads the code in the margin of a printed board.
//!
//! The corners locate the strip: a homography, and one coefficient of the lens, extend the board's
//! plane a little beyond them. Each cell is compared with the white margin and the nearest dark
//! square beside it.

use image::GrayImage;
use nalgebra::{Point2, Vector2};

use super::plane::Plane;
use boresight_geometry::{
    Corner,
    board_code::{BoardCode, CELLS, Edge, FAR, NEAR, place_in_cell},
    boards::Board,
    frame::ImageSize,
};

/// Least readable difference between white and black, in grey levels.
const MIN_CONTRAST: f64 = 24.0;
/// Distance from the middle between black and white, as a share of the difference, below which a
/// cell is unclear.
const UNCLEAR: f64 = 0.04;

/// Code beside a board whose `corners` were found in `image`; `None` if there is none, or it can't
/// be read.
///
/// The code names a board of as many corners as `board`; the size of squares doesn't matter.
pub fn read_code(image: &GrayImage, board: &Board, corners: &[Corner]) -> Option<BoardCode> {
    if corners.len() != board.corner_count() {
        return None;
    }
    let points_m = board.corners_in_board_m();
    let pairs = points_m.iter().copied().zip(corners);
    let seen =
        pairs.filter(|(_, corner)| corner.is_seen()).map(|(point, corner)| (point, corner.px));
    let plane = Plane::through(&seen, ImageSize::of(image))?;
    let size = (board.columns(), board.rows());
    let middle = (Vector2::new(size.0 as f64, size.1 as f64) + Vector2::repeat(1.0)) / 2.0;
    let square_m = board.square_m();
    let px_of = |(x, y): (f64, f64)| plane.px(&((Vector2::new(x, y) - middle) * square_m).into());
    codes(image, size, &px_of).map(|(code, _)| code).next()
}

/// True if the code of `board` is seen, and runs forwards if the turn is otherwise unknown. `px_of`
/// maps a place, in squares from the board's top-left corner, to the picture.
pub(super) fn is_named_by_code(image: &GrayImage, board: &Board, px_of: &PxOf<'_>) -> bool {
    let size = (board.columns(), board.rows());
    let either_way = !board.looks_the_same_upside_down();
    codes(image, size, px_of).any(|(_, forwards)| forwards || either_way)
}

/// Map from a place on the board to a pixel; `None` if the lens has none for it.
type PxOf<'a> = dyn Fn((f64, f64)) -> Option<Point2<f64>> + 'a;

/// Codes of a board of the given size, each with true if running along the board's columns or rows,
/// not against them.
fn codes(
    image: &GrayImage,
    size: (usize, usize),
    px_of: &PxOf<'_>,
) -> impl Iterator<Item = (BoardCode, bool)> {
    Edge::ALL.into_iter().filter_map(move |edge| {
        let mut cells = strip(image, px_of, size, edge)?;
        let forwards = BoardCode::read(&cells);
        let code = forwards.or_else(|| {
            cells.reverse();
            BoardCode::read(&cells)
        })?;
        // A board turned by a quarter is numbered the other way round.
        let named = code.board()?;
        let seen = [(named.columns(), named.rows()), (named.rows(), named.columns())];
        seen.contains(&size).then_some((code, forwards.is_some()))
    })
}

fn strip(
    image: &GrayImage,
    px_of: &PxOf<'_>,
    size: (usize, usize),
    edge: Edge,
) -> Option<[bool; CELLS]> {
    let level = |along: f64, outside: f64| grey(image, &px_of(edge.place(size, along, outside))?);
    // Sample here first: a strip whose end lies outside the picture is rejected cheaply.
    level(1.0, FAR)?;
    let squares = match edge {
        Edge::Top | Edge::Bottom => size.0 + 1,
        Edge::Left | Edge::Right => size.1 + 1,
    };
    let mut cells = [false; CELLS];
    for (index, cell) in cells.iter_mut().enumerate() {
        let middle = place_in_cell(index, 0.5);
        let white = level(middle, 0.5 * NEAR)?;
        // One of two neighbouring squares is black.
        let square = ((middle * squares as f64) as usize).min(squares - 2);
        let centre = |square: usize| level((square as f64 + 0.5) / squares as f64, -0.5);
        let black = centre(square)?.min(centre(square + 1)?);
        if white - black < MIN_CONTRAST {
            return None;
        }
        let mut sum = 0.0;
        for within in [0.3, 0.5, 0.7] {
            for across in [0.3, 0.5, 0.7] {
                sum += level(place_in_cell(index, within), NEAR + across * (FAR - NEAR))?;
            }
        }
        let whiteness = (sum / 9.0 - black) / (white - black);
        if (whiteness - 0.5).abs() < UNCLEAR {
            return None;
        }
        *cell = whiteness < 0.5;
    }
    Some(cells)
}

/// Brightness between pixels; `None` outside of the picture.
fn grey(image: &GrayImage, px: &Point2<f64>) -> Option<f64> {
    let inside = px.x >= 0.0
        && px.y >= 0.0
        && px.x < f64::from(image.width()) - 1.0
        && px.y < f64::from(image.height()) - 1.0;
    if !inside {
        return None;
    }
    let (x, y) = (px.x as u32, px.y as u32);
    let (right, down) = (px.x - f64::from(x), px.y - f64::from(y));
    let at = |dx, dy| f64::from(image.get_pixel(x + dx, y + dy).0[0]);
    let above = at(0, 0) * (1.0 - right) + at(1, 0) * right;
    let below = at(0, 1) * (1.0 - right) + at(1, 1) * right;
    Some(above * (1.0 - down) + below * down)
}
