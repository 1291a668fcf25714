//! Output of `detect --json`, which serves as a corner table, too.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use boresight_detect::{Detection, Miss, Quality};
use boresight_geometry::{Corner, boards::Board};
use boresight_present::text;

/// A line of `detect --json`: one picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct DetectedLine {
    /// Name of the picture's file, as the caller gave it.
    pub file: String,
    /// Whether the board was found, whole or in part.
    pub found: bool,
    /// Why not, in words; null if it was.
    pub reason: Option<String>,
    /// Inner corners in a row and in a column.
    pub board: [usize; 2],
    /// Column, row, x, y and standard deviation in pixels of each corner that is seen; null without a board.
    pub corners: Option<Vec<CornerEntry>>,
    /// How well the board is seen; null without one.
    #[serde(default)]
    pub quality: Option<QualityEntry>,
    /// Time that the search took, in milliseconds.
    #[serde(default)]
    pub millis: f64,
}

/// Column, row, x, y and standard deviation of a corner.
pub type CornerEntry = (usize, usize, f64, f64, f64);

/// How well a board is seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct QualityEntry {
    /// Standard deviation of the blur.
    pub blur_px: f64,
    /// Difference of light and dark squares, in grey levels.
    pub contrast: f64,
    /// Share of the corners beside overexposed squares, 0 to 1.
    pub glare: f64,
    /// How far the board moved while the shutter was open.
    pub motion_px: f64,
}

impl DetectedLine {
    /// Line for the picture in `file`.
    pub fn of(file: &str, board: &Board, seen: &Result<Detection, Miss>, millis: f64) -> Self {
        let corners = seen.as_ref().ok().map(|detection| {
            let all = detection.corners.iter().enumerate();
            all.filter(|(_, corner)| corner.is_seen())
                .map(|(i, corner)| {
                    let [column, row] = board.target().place(i);
                    (column, row, corner.px.x, corner.px.y, corner.sigma_px())
                })
                .collect()
        });
        let quality = seen.as_ref().ok().map(|detection| {
            let Quality { blur_px, contrast, glare, motion_px } = detection.quality;
            QualityEntry { blur_px, contrast, glare, motion_px }
        });
        Self {
            found: seen.is_ok(),
            corners,
            quality,
            millis,
            ..Self::without(file, board, seen.as_ref().err().map(text::miss))
        }
    }

    /// Corners row by row over the `board`.
    ///
    /// # Errors
    ///
    /// The reason for having none, or that the line is of another board.
    pub fn on_board(&self, board: &Board) -> Result<Vec<Corner>, String> {
        let Some(seen) = &self.corners else {
            return Err(self.reason.clone().unwrap_or_else(|| "no corners".into()));
        };
        let [columns, rows] = self.board;
        let mut corners =
            vec![Corner::unseen(Point2::new(f64::NAN, f64::NAN)); board.corner_count()];
        for (column, row, x, y, sigma_px) in seen {
            let is_on_board = *column < columns && self.board == [board.columns(), board.rows()];
            let place = corners.get_mut(row * columns + column).filter(|_| is_on_board);
            let is_corner = x.is_finite() && y.is_finite() && *sigma_px > 0.0;
            match place.filter(|_| is_corner) {
                Some(place) => *place = Corner::isotropic(Point2::new(*x, *y), *sigma_px),
                None => return Err(format!("corners of a {columns}x{rows} board: check --board")),
            }
        }
        Ok(corners)
    }

    /// Line for a `file` without corners, with the reason.
    pub fn without(file: &str, board: &Board, reason: Option<String>) -> Self {
        Self {
            file: file.into(),
            found: false,
            reason,
            board: [board.columns(), board.rows()],
            corners: None,
            quality: None,
            millis: 0.0,
        }
    }
}
