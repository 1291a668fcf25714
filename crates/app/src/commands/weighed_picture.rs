//! A picture with the grids weighed by the detector, to report a refusal.

use boresight_detect::{GridOutcome, WeighedGrid};
use image::{GrayImage, ImageFormat, Rgb, RgbImage, buffer::ConvertBuffer};

const NAMED: Rgb<u8> = Rgb([60, 210, 90]);
const MISSED: Rgb<u8> = Rgb([255, 180, 30]);
const CIRCLES: Rgb<u8> = Rgb([160, 160, 255]);
const UNLIKELY: Rgb<u8> = Rgb([140; 3]);
/// Half length of a cross, and of the black rim, per 640 px of the picture's width.
const CROSS_PX: i64 = 3;

/// `image` as a PNG with a cross on every corner of every grid. The first one lies on top: green
/// for the board, amber for a refusal, blue on circles. The others are grey.
///
/// # Errors
///
/// If the picture can't be written as a PNG.
pub fn weighed_picture(image: &GrayImage, grids: &[WeighedGrid]) -> anyhow::Result<Vec<u8>> {
    let mut drawn: RgbImage = image.convert();
    let reach = CROSS_PX * (1 + i64::from(image.width()) / 640);
    for (index, grid) in grids.iter().enumerate().rev() {
        let colour = match grid.outcome {
            _ if index > 0 => UNLIKELY,
            GridOutcome::Named(_) => NAMED,
            GridOutcome::Missed(_) => MISSED,
            GridOutcome::Circles => CIRCLES,
        };
        for at in &grid.corners_px {
            cross(&mut drawn, at.map(|at| at.round() as i64), reach, colour);
        }
    }
    let mut png = std::io::Cursor::new(Vec::new());
    drawn.write_to(&mut png, ImageFormat::Png)?;
    Ok(png.into_inner())
}

/// Draws a cross with a black rim.
fn cross(into: &mut RgbImage, [x, y]: [i64; 2], reach: i64, colour: Rgb<u8>) {
    let mut dot = |x: i64, y: i64, colour: Rgb<u8>| {
        if let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y))
            && let Some(pixel) = into.get_pixel_mut_checked(x, y)
        {
            *pixel = colour;
        }
    };
    for (along, width, colour) in [(reach + 1, 1, Rgb([0; 3])), (reach, 0, colour)] {
        for step in -along..=along {
            for side in -width..=width {
                dot(x + step, y + side, colour);
                dot(x + side, y + step, colour);
            }
        }
    }
}
