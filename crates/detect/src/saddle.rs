//! Moves a rough corner to the nearest saddle point of brightness.

use image::GrayImage;

/// Saddle point of brightness nearest to `guess`, for squares with sides of about `side` pixels;
/// `None` if it's more than `most_px` away.
///
/// At a corner, the gradient at every pixel is perpendicular to the line to the corner (Förstner &
/// Gülch 1987).
pub(super) fn settle(
    image: &GrayImage,
    guess: [f32; 2],
    side: f32,
    most_px: f32,
) -> Option<[f32; 2]> {
    let reach = (0.3 * side).clamp(2.0, 8.0) as isize;
    let (width, height) = (image.width() as isize, image.height() as isize);
    let raw = image.as_raw();
    let mut at = guess;
    for _ in 0..6 {
        let (column, row) = (at[0].round() as isize, at[1].round() as isize);
        // Near the edge of the picture the window is cropped.
        let (left, right) = ((column - reach).max(1), (column + reach).min(width - 2));
        let (top, bottom) = ((row - reach).max(1), (row + reach).min(height - 2));
        if left + 2 > right || top + 2 > bottom {
            return Some(at);
        }
        let across = (right - left + 1) as usize;
        let (mut a, mut b, mut c, mut u, mut v) = (0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32, 0.0_f32);
        for y in top..=bottom {
            let start = (y * width + left) as usize;
            let line = &raw[start - 1..start + across + 1];
            let above = &raw[start - width as usize..][..across];
            let below = &raw[start + width as usize..][..across];
            let py = y as f32 - at[1];
            for (k, (pair, (above, below))) in
                line.windows(3).zip(above.iter().zip(below)).enumerate()
            {
                let px = left as f32 + k as f32 - at[0];
                let gx = f32::from(pair[2]) - f32::from(pair[0]);
                let gy = f32::from(*below) - f32::from(*above);
                a += gx * gx;
                b += gx * gy;
                c += gy * gy;
                let along = gx * px + gy * py;
                u += gx * along;
                v += gy * along;
            }
        }
        let determinant = a * c - b * b;
        if determinant <= 1e-3 * (a + c) * (a + c) {
            return Some(at);
        }
        let step = [(c * u - b * v) / determinant, (a * v - b * u) / determinant];
        at = [at[0] + step[0], at[1] + step[1]];
        // Also refuses NaN.
        if !(libm::hypotf(at[0] - guess[0], at[1] - guess[1]) <= most_px) {
            return None;
        }
        if libm::hypotf(step[0], step[1]) < 0.02 {
            break;
        }
    }
    Some(at)
}
