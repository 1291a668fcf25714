//! Arrays as pictures.

use boresight::{
    boards::{Board, BoardChoice, MarkerSide, Pattern},
    geometry::Corner,
    markers::{CircleRows, Tags},
};
use image::GrayImage;
use nalgebra::{Matrix2, Point2};
use numpy::{PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::error::wrong;

/// The grey picture in `array`, rows by columns of bytes, in any memory order.
pub(crate) fn picture(array: &PyReadonlyArray2<'_, u8>) -> PyResult<GrayImage> {
    let [rows, columns] = [array.shape()[0], array.shape()[1]];
    let size = |side: usize| u32::try_from(side).map_err(|_| wrong("the picture is too large"));
    let (width, height) = (size(columns)?, size(rows)?);
    let bytes = array.as_array().iter().copied().collect();
    GrayImage::from_raw(width, height, bytes).ok_or_else(|| wrong("the picture is too large"))
}

/// A board as Python names it: inner corners in a row and in a column, side of a square in mm; of a
/// ChArUco board the dictionary, and the side of a marker in mm, if it's given; of an AprilGrid the
/// corners of tags, the side of a tag, and the tags' spacing with the first one's number; of
/// circles how their rows lie.
pub(crate) type Named =
    (u16, u16, f64, Option<String>, Option<f64>, Option<(f64, u16)>, Option<String>);

/// The board of that name, for squares of any side.
pub(crate) fn choice(
    (columns, rows, _, dictionary, marker_mm, tags, circles): &Named,
) -> PyResult<BoardChoice> {
    let pattern = if let Some(name) = circles {
        let rows = CircleRows::named(name);
        let wrong = || wrong(format!("circles are symmetric or asymmetric, not {name:?}"));
        Pattern::Circles(rows.ok_or_else(wrong)?)
    } else if let Some((spacing, first)) = *tags {
        Pattern::AprilGrid(Tags { spacing, first })
    } else if let Some(name) = dictionary {
        let dictionary = name.parse().map_err(|err| wrong(format!("{err}")))?;
        let side = marker_mm.map_or(MarkerSide::Usual, |mm| MarkerSide::Metres(mm * 1e-3));
        Pattern::Charuco { dictionary, side }
    } else {
        Pattern::Plain
    };
    Ok(BoardChoice { columns: *columns, rows: *rows, pattern })
}

/// The board of that name.
pub(crate) fn board(named: &Named) -> PyResult<Board> {
    choice(named)?.board(named.2 * 1e-3).map_err(|err| wrong(err.to_string()))
}

/// The corners of one view: N×2 positions, N×2×2 covariances, infinite for a corner that isn't
/// seen.
pub(crate) type View<'py> = (PyReadonlyArray2<'py, f64>, PyReadonlyArray3<'py, f64>);

/// The corners in `view`.
pub(crate) fn corners(view: &View<'_>) -> PyResult<Vec<Corner>> {
    let (px, covariance) = (view.0.as_array(), view.1.as_array());
    if px.ncols() != 2 || covariance.shape() != [px.nrows(), 2, 2] {
        return Err(wrong("a view is N×2 positions with N×2×2 covariances"));
    }
    let corner =
        |(px, c): (numpy::ndarray::ArrayView1<'_, f64>, numpy::ndarray::ArrayView2<'_, f64>)| {
            if c[[0, 0]] == f64::INFINITY || px.iter().all(|at| at.is_nan()) {
                return Ok(Corner::unseen(Point2::new(px[0], px[1])));
            }
            let covariance_px2 = Matrix2::new(c[[0, 0]], c[[0, 1]], c[[1, 0]], c[[1, 1]]);
            let is_right = covariance_px2.iter().chain(px.iter()).all(|value| value.is_finite())
                && covariance_px2.cholesky().is_some();
            let corner = Corner::new(Point2::new(px[0], px[1]), covariance_px2);
            is_right
                .then_some(corner)
                .ok_or_else(|| wrong("positions must be finite, and covariances positive definite"))
        };
    px.rows().into_iter().zip(covariance.outer_iter()).map(corner).collect()
}
