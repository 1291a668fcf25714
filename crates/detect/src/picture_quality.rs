//! Reasons in the picture for a missing board: too dark, or blurred.
//!
//! If corners have no response, the grids can't give the reason. Two measures of the picture, or of
//! the board's expected part of it, then do: the brightness of its lightest places, and the width
//! of its steepest edges.

use image::GrayImage;

use super::outcome::Miss;

/// Sampling step of rows and columns.
const STRIDE: usize = 12;
/// Largest brightness of the lightest hundredth of a picture that is too dark, in grey levels.
const DARK_TO: f64 = 40.0;
/// Half the step from dark to light needed by corners, in grey levels.
const NEEDED_CONTRAST: f64 = 20.0;
/// Search length of an edge in pixels, and least step in grey levels.
const SPAN_PX: usize = 40;
const LEAST_STEP: u8 = 50;
/// Least number of edges for a measure of sharpness, and the reciprocal of the measure's rank: the
/// sharpest tenth counts, because some edges are soft in any picture.
const LEAST_EDGES: usize = 30;
const SHARPEST: usize = 10;
/// Standard deviation of the blur, in pixels, beyond which corners have no response: the ring
/// around them has a radius of five.
const LIMIT_PX: f64 = 2.8;
/// Slope of a step of height 1 after a blur with a standard deviation of 1.
const SLOPE: f64 = 0.398_942;

/// Rectangle: left, top, right, bottom.
pub(super) type Region = [usize; 4];

/// Reason for a missing board in the `region` of `picture`, if visible; if the region surely is a
/// part of a board, its own contrast counts. `scale` is full-size pixels per pixel. `widths` is a
/// buffer.
pub(super) fn reason(
    picture: &GrayImage,
    (region, is_board): (Option<Region>, bool),
    scale: f64,
    widths: &mut Vec<f32>,
) -> Option<Miss> {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let [left, top, right, bottom] = region.unwrap_or([0, 0, width, height]);
    let (right, bottom) = (right.min(width), bottom.min(height));
    if left + SPAN_PX >= right || top + SPAN_PX >= bottom {
        return None;
    }
    let raw = picture.as_raw();
    let at = |x: usize, y: usize| raw[y * width + x];
    let mut counts = [0_usize; 256];
    for y in (top..bottom).step_by(STRIDE) {
        for x in left..right {
            counts[usize::from(at(x, y))] += 1;
        }
    }
    let percentile = |share: f64| {
        let wanted = share * counts.iter().sum::<usize>() as f64;
        let mut passed = 0.0;
        counts.iter().position(|count| {
            passed += *count as f64;
            passed >= wanted
        })
    };
    let (dark, light) = (percentile(0.01)? as f64, percentile(0.99)? as f64);
    let contrast = (light - dark) / 2.0;
    // Blur as wide as a board's squares takes half of the contrast.
    let least_step = if is_board { LEAST_STEP.min(contrast as u8) } else { LEAST_STEP };
    // Motion smears only the edges across it.
    let size = [right - left, bottom - top];
    let limits = (least_step, if is_board { 2 } else { SHARPEST });
    let across = blur_px(size, limits, widths, |x, y| at(left + x, top + y));
    let down = blur_px([size[1], size[0]], limits, widths, |y, x| at(left + x, top + y));
    let widest_px = across.max(down);
    if widest_px > LIMIT_PX {
        let [blur_px, limit_px] = [widest_px, LIMIT_PX].map(|px| px * scale);
        return Some(Miss::Blurred { blur_px, limit_px });
    }
    // More light helps a board only if white would then give the contrast.
    let is_dark =
        if is_board { 255.0 * contrast >= NEEDED_CONTRAST * light } else { light <= DARK_TO };
    (is_dark && contrast < NEEDED_CONTRAST)
        .then_some(Miss::LowContrast { contrast, needed: NEEDED_CONTRAST })
}

/// Standard deviation of the blur of the sharpest edges across lines of pixels, zero without enough
/// edges of the `least_step`; `value` is the brightness at a place along a line.
fn blur_px(
    [along, across]: [usize; 2],
    (least_step, sharpest): (u8, usize),
    widths: &mut Vec<f32>,
    value: impl Fn(usize, usize) -> u8,
) -> f64 {
    widths.clear();
    for line in (0..across).step_by((across / LEAST_EDGES).clamp(1, STRIDE)) {
        for start in (0..along.saturating_sub(SPAN_PX + 1)).step_by(SPAN_PX) {
            let (mut low, mut high, mut steepest) = (u8::MAX, 0_u8, 1_u8);
            let mut next = [value(start, line), value(start + 1, line)];
            for place in start..start + SPAN_PX {
                let here = next[0];
                next = [next[1], value(place + 2, line)];
                (low, high) = (low.min(here), high.max(here));
                // Over two pixels, too, to reduce noise.
                steepest = steepest.max(here.abs_diff(next[0]) / 2 + here.abs_diff(next[1]) / 4);
            }
            if high - low >= least_step {
                widths.push(f32::from(high - low) / f32::from(steepest));
            }
        }
    }
    if widths.len() < LEAST_EDGES {
        return 0.0;
    }
    widths.sort_unstable_by(f32::total_cmp);
    SLOPE * f64::from(widths[widths.len() / sharpest])
}

#[cfg(test)]
mod tests {
    use image::{Luma, imageops};

    use super::*;

    fn squares(light: u8) -> GrayImage {
        let is_dark = |x: u32, y: u32| (x / 30 + y / 30).is_multiple_of(2);
        GrayImage::from_fn(600, 400, |x, y| Luma([if is_dark(x, y) { light / 8 } else { light }]))
    }

    #[test]
    fn a_sharp_picture_has_no_reason_and_a_dark_or_blurred_one_has() {
        let mut widths = Vec::new();
        assert_eq!(reason(&squares(200), (None, false), 1.0, &mut widths), None);
        let soft = imageops::blur(&squares(200), 1.5);
        assert_eq!(reason(&soft, (None, false), 1.0, &mut widths), None);
        let dark = reason(&squares(18), (None, false), 1.0, &mut widths);
        assert!(matches!(dark, Some(Miss::LowContrast { .. })), "{dark:?}");
        let blurred = imageops::blur(&squares(200), 6.0);
        let Some(Miss::Blurred { blur_px, .. }) = reason(&blurred, (None, false), 2.0, &mut widths)
        else {
            panic!("not blurred")
        };
        assert!((8.0..18.0).contains(&blur_px), "{blur_px}");
        // The left half is sharp; the board was in the right half.
        let mut half = blurred;
        imageops::replace(
            &mut half,
            &imageops::crop_imm(&squares(200), 0, 0, 300, 400).to_image(),
            0,
            0,
        );
        assert_eq!(reason(&half, (None, false), 1.0, &mut widths), None);
        let right = reason(&half, (Some([320, 0, 600, 400]), false), 1.0, &mut widths);
        assert!(matches!(right, Some(Miss::Blurred { .. })), "{right:?}");
        assert_eq!(reason(&GrayImage::new(3, 3), (None, false), 1.0, &mut widths), None);
    }

    /// A wall may have any contrast; the squares of a board need their own.
    #[test]
    fn a_dim_board_is_too_dark_and_a_dim_wall_is_not() {
        let mut dim = squares(200);
        dim.iter_mut().for_each(|level| *level = 60 + *level / 8);
        let seen = |is_board| reason(&dim, (None, is_board), 1.0, &mut Vec::new());
        assert_eq!(seen(false), None);
        assert!(matches!(seen(true), Some(Miss::LowContrast { .. })), "{:?}", seen(true));
        dim.iter_mut().for_each(|level| *level += 130);
        assert_eq!(reason(&dim, (None, true), 1.0, &mut Vec::new()), None, "white, but pale");
    }

    #[test]
    fn motion_smears_the_edges_across_it() {
        let sharp = squares(200);
        let smeared = GrayImage::from_fn(600, 400, |x, y| {
            let sum: u32 =
                (0..20).map(|k| u32::from(sharp.get_pixel((x + k).min(599), y).0[0])).sum();
            Luma([(sum / 20) as u8])
        });
        let seen = reason(&smeared, (None, false), 1.0, &mut Vec::new());
        assert!(matches!(seen, Some(Miss::Blurred { .. })), "{seen:?}");
    }
}
