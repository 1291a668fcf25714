//! Uncertainty of a ray's image over the picture: shades with their numbers.

use nalgebra::Point2;

use super::{
    number::{brief, brief_data},
    section::{figure, missing},
};
use crate::{
    chart::{Canvas, Stroke},
    known::Known,
    text::{
        report::{self as words, Section},
        result,
    },
};
use boresight_formats::CalibrationFile;
use boresight_geometry::{GRID_COLUMNS, GRID_ROWS, cell_centres_px, frame::ImageSize};

/// Colours where the goal is met, from least to most uncertain.
pub(super) const MET: [&str; 4] = ["#e8f6ea", "#cdebd1", "#aedcb5", "#8ccb97"];
/// Colours where the goal isn't met.
pub(super) const NOT_MET: [&str; 4] = ["#ffedcc", "#ffd999", "#ffc266", "#f5a623"];

/// Colours of a result that must not be used, or whose errors aren't known.
const VOID: [&str; 4] = ["#f2f2f2", "#e2e2e2", "#d0d0d0", "#bbbbbb"];

/// SVG drawing of the map.
pub(super) fn drawing(calibration: &CalibrationFile) -> String {
    let Some(projection) = calibration.projection_sd_px.as_ref().filter(|map| !map.grid.is_empty())
    else {
        return figure(Section::Projection, &missing(words::TOO_FEW), "");
    };
    let [width_px, height_px] = calibration.image_size;
    let size = ImageSize { width_px: width_px.max(1), height_px: height_px.max(1) };
    let mut canvas = Canvas::large_picture(calibration.size_px(), Section::Projection.heading());
    let met = Known::of_file(calibration);
    let least = projection.grid.iter().map(|[_, _, sd]| *sd).fold(f64::INFINITY, f64::min);
    let mut hatched = false;
    for (centre, corners) in cells(size) {
        let sd_px = projection
            .grid
            .iter()
            .find(|[x, y, _]| (Point2::new(*x, *y) - centre).norm() < 0.25)
            .map(|[_, _, sd]| *sd);
        let Some(sd_px) = sd_px else {
            hatched = true;
            canvas.hatch(&corners);
            continue;
        };
        let shades = match &met {
            None => &VOID,
            Some(known) if known.is_met(size, &centre) => &MET,
            Some(_) => &NOT_MET,
        };
        let shade = shade(sd_px, shades, [least, projection.max]);
        canvas.area(&corners, shade, Stroke::thin("#fff"));
        canvas.number(centre, "#111", brief(sd_px, 2).trim_start_matches('0'));
    }
    let [mean_px, max_px] = [projection.mean, projection.max].map(|sd_px| brief_data(sd_px, 2));
    let met = met.and_then(|known| known.met());
    let goal = met.map_or(String::new(), |met| format!(" {}", result::met_in_green(&met)));
    let note = words::projection_note(&mean_px, &max_px, hatched) + &goal;
    figure(Section::Projection, &canvas.svg(), &note)
}

/// One of `shades` for `px` between the least and most of a map. Equal steps of the logarithm:
/// errors grow by factors towards the corners.
pub(super) fn shade(px: f64, shades: &[&'static str; 4], [least, most]: [f64; 2]) -> &'static str {
    let share = if most > least && least > 0.0 {
        libm::log(px / least) / libm::log(most / least)
    } else {
        0.0
    };
    // From 0 to the last shade.
    shades[(share.clamp(0.0, 1.0) * (shades.len() - 1) as f64).round() as usize]
}

/// Centre and corners of every cell of the grid, row by row.
pub(super) fn cells(size: ImageSize) -> impl Iterator<Item = (Point2<f64>, [Point2<f64>; 4])> {
    let along =
        |at: u32, cells: u32, size: u32| f64::from(at) / f64::from(cells) * f64::from(size) - 0.5;
    let x = move |at: u32| along(at, GRID_COLUMNS, size.width_px);
    let y = move |at: u32| along(at, GRID_ROWS, size.height_px);
    let corners = (0..GRID_ROWS).flat_map(move |row| {
        (0..GRID_COLUMNS).map(move |column| {
            [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| Point2::new(x(column + i), y(row + j)))
        })
    });
    cell_centres_px(size).zip(corners)
}
