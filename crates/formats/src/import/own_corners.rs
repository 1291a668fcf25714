//! Corners that a calibration's file brings: of OpenCV's sample, and of PhotonVision.

use nalgebra::Point2;
use serde_json::Value;

use super::{
    numbers::{first, list},
    old_calibration::OwnCorners,
};
use crate::corner_table::{LEVEL_0_SIGMA_PX, TableView};
use boresight_geometry::{Corner, boards::Board};

/// Distance of a corner from its place in the grid, in squares, up to which the board is plain.
const OFF_GRID: f64 = 0.1;

/// Places on a board in the file's unit, with their images.
type Points = Vec<([f64; 2], [f64; 2])>;

/// Corners of a file of OpenCV's sample: `image_points`, row by row, or as in `grid_points`. `None`
/// if the file has none of a plain board.
pub(super) fn of_opencv(tree: &Value) -> Option<OwnCorners> {
    let whole = |name| first(tree, &[name])?.as_u64().and_then(|count| u16::try_from(count).ok());
    let (columns, rows) = (whole("boardwidth")?, whole("boardheight")?);
    let square = first(tree, &["squaresize"])?.as_f64()?;
    let images = first(tree, &["imagepoints"])?;
    // The size of OpenCV's matrix counts points, not numbers.
    let images = list(images.get("data").unwrap_or(images))?;
    let places: Vec<[f64; 2]> = match first(tree, &["gridpoints"]).and_then(list) {
        Some(points) => points.chunks_exact(3).map(|point| [point[0], point[1]]).collect(),
        None => (0..rows)
            .flat_map(|row| (0..columns).map(move |column| [column, row]))
            .map(|cell| cell.map(|at| f64::from(at) * square))
            .collect(),
    };
    let is_whole = !places.is_empty()
        && places.len() == usize::from(columns) * usize::from(rows)
        && images.len().is_multiple_of(2 * places.len());
    let images: Vec<[f64; 2]> = images.chunks_exact(2).map(|px| [px[0], px[1]]).collect();
    let view = |px: &[[f64; 2]]| places.iter().copied().zip(px.iter().copied()).collect();
    let views = || images.chunks(places.len()).map(view).collect();
    if is_whole { of_views(views(), square) } else { None }
}

/// Corners of a file of PhotonVision: its `observations`.
pub(super) fn of_photonvision(tree: &Value) -> Option<OwnCorners> {
    let point = |point: &Value| Some([point["x"].as_f64()?, point["y"].as_f64()?]);
    let view = |view: &Value| -> Option<Points> {
        let places = view["locationInObjectSpace"].as_array()?.iter().map(point);
        let images = view["locationInImageSpace"].as_array()?.iter().map(point);
        places.zip(images).map(|(place, image)| Some((place?, image?))).collect()
    };
    let views: Option<Vec<Points>> = tree["observations"].as_array()?.iter().map(view).collect();
    of_views(views?, tree["calobjectSpacing"].as_f64()?)
}

fn of_views(views: Vec<Points>, square: f64) -> Option<OwnCorners> {
    let places = || views.iter().flatten().map(|(place, _)| place);
    let least = [0, 1].map(|axis| places().map(|at| at[axis]).fold(f64::INFINITY, f64::min));
    let cell = |place: &[f64; 2]| [0, 1].map(|axis| (place[axis] - least[axis]) / square);
    let is_on_grid = |at: f64| at.is_finite() && (at - at.round()).abs() < OFF_GRID;
    if !places().flat_map(cell).all(is_on_grid) {
        return None;
    }
    // Counts beyond those of a board saturate, and are refused by it.
    let index = |place: &[f64; 2]| cell(place).map(|at| at.round() as u16);
    let count = |axis: usize| places().map(|at| index(at)[axis]).max()?.checked_add(1);
    let (columns, rows) = (count(0)?, count(1)?);
    let board = Board::new(columns, rows, if square < 1.0 { square } else { square / 1e3 }).ok()?;
    let view = |(number, points): (usize, Points)| {
        let mut corners = vec![Corner::unseen([f64::NAN; 2].into()); board.corner_count()];
        // A corner that wasn't found is at negative pixels.
        for (place, px) in points.iter().filter(|(_, px)| px[0] >= 0.0 || px[1] >= 0.0) {
            let [column, row] = index(place).map(usize::from);
            corners[row * usize::from(columns) + column] =
                Corner::isotropic(Point2::from(*px), LEVEL_0_SIGMA_PX);
        }
        TableView { name: format!("view {}", number + 1), corners: Some(corners) }
    };
    let views = views.into_iter().enumerate().map(view).collect();
    Some(OwnCorners { board, views })
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use super::*;
    use crate::import::{OldCalibration, read};

    /// Images of three views of 4 × 3 corners, row by row.
    fn images() -> Vec<[f64; 2]> {
        let image = |index: u32| [f64::from(index % 4) * 30.5 + 9.0, f64::from(index) * 7.25 + 5.0];
        (0..36).map(image).collect()
    }

    fn corners(old: &OldCalibration) -> (Board, Vec<[f64; 2]>) {
        let own = old.corners.as_ref().expect("corners");
        let seen = own.views.iter().flat_map(|view| view.corners.as_ref().expect("corners"));
        (own.board, seen.map(|corner| corner.px.into()).collect())
    }

    #[test]
    fn opencvs_file_brings_its_corners() {
        let numbers: Vec<String> = images().iter().flatten().map(f64::to_string).collect();
        let text = |square: &str, width: u32, rest: &str| {
            format!(
                "<?xml version=\"1.0\"?><opencv_storage><nframes>3</nframes>\
                 <image_width>640</image_width><image_height>480</image_height>\
                 <board_width>{width}</board_width><board_height>3</board_height>\
                 <square_size>{square}</square_size>\
                 <camera_matrix type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt>\
                 <data>600. 0. 321. 0. 600. 238. 0. 0. 1.</data></camera_matrix>\
                 <distortion_coefficients type_id=\"opencv-matrix\"><rows>5</rows><cols>1</cols>\
                 <dt>d</dt><data>-.1 .1 0. 0. 0.</data></distortion_coefficients>\
                 <image_points type_id=\"opencv-matrix\"><rows>3</rows><cols>12</cols>\
                 <dt>\"2f\"</dt><data>{}</data></image_points>{rest}</opencv_storage>",
                numbers.join(" ")
            )
        };
        let old = read(&text("0.025", 4, "")).expect("a calibration");
        assert_eq!(old.views, Some(3));
        let (board, px) = corners(&old);
        assert_eq!((board, px), (Board::new(4, 3, 0.025).expect("a board"), images()));
        let (board, _) = corners(&read(&text("25", 4, "")).expect("a calibration"));
        assert_eq!(board, Board::new(4, 3, 0.025).expect("a board"));
        // Circles in shifted rows aren't a plain board, and 5 × 3 corners aren't those of the
        // views.
        let shifted: String = (0..12).fold(String::new(), |mut all, index| {
            let (row, column) = (index / 4, index % 4);
            let _ = write!(all, "{} {row} 0 ", f64::from(2 * column + row % 2) / 2.0);
            all
        });
        let shifted = text("1", 4, &format!("<grid_points>{shifted}</grid_points>"));
        assert_eq!(read(&shifted).expect("a calibration").corners, None);
        for width in [0, 5] {
            assert_eq!(read(&text("0.025", width, "")).expect("a calibration").corners, None);
        }
    }

    #[test]
    fn photonvisions_file_brings_its_corners_wherever_they_are_on_the_board() {
        let point = |index: usize, [x, y]: [f64; 2]| {
            let (column, row) = ((index % 12 % 4) as f64, (index % 12 / 4) as f64);
            let place = [1.0 + column, 1.0 + row].map(|at| at * 0.0254);
            (
                serde_json::json!({"x": place[0], "y": place[1], "z": 0}),
                serde_json::json!({"x": x, "y": y}),
            )
        };
        let points: Vec<_> = images().into_iter().enumerate().map(|(i, px)| point(i, px)).collect();
        let observation = |view: &[(Value, Value)]| {
            let (places, images): (Vec<_>, Vec<_>) = view.iter().rev().cloned().unzip();
            serde_json::json!({"locationInObjectSpace": places, "locationInImageSpace": images})
        };
        let observations: Vec<Value> = points.chunks(12).map(observation).collect();
        let mut tree = serde_json::json!({
            "resolution": {"width": 640, "height": 480},
            "cameraIntrinsics": {"rows": 3, "cols": 3, "data": [600, 0, 321, 0, 600, 238, 0, 0, 1]},
            "distCoeffs": {"rows": 1, "cols": 5, "data": [0.1, 0, 0, 0, 0]},
            "calobjectSpacing": 0.0254, "observations": observations
        });
        let (board, px) = corners(&read(&tree.to_string()).expect("a calibration"));
        assert_eq!((board, px), (Board::new(4, 3, 0.0254).expect("a board"), images()));
        let missing = &mut tree["observations"][0]["locationInImageSpace"][11];
        *missing = serde_json::json!({"x": -1, "y": -1});
        let old = read(&tree.to_string()).expect("a calibration");
        let views = &old.corners.expect("corners").views;
        assert!(!views[0].corners.as_ref().expect("corners")[0].is_seen());
    }
}
