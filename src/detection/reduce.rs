//! Halves a picture, and reads between its pixels.

use image::GrayImage;

/// Means of 2×2 pixels. Pixel `p` of the result lies at `2p + 0.5` of the source.
pub(super) fn halve(source: &GrayImage, into: &mut GrayImage) {
    let (width, height) = (source.width() / 2, source.height() / 2);
    let row_bytes = source.width() as usize;
    let mut pixels = std::mem::take(into).into_raw();
    pixels.resize(width as usize * height as usize, 0);
    let raw = source.as_raw();
    for (y, row) in pixels.chunks_exact_mut((width as usize).max(1)).enumerate() {
        let upper = &raw[2 * y * row_bytes..][..2 * width as usize];
        let lower = &raw[(2 * y + 1) * row_bytes..][..2 * width as usize];
        for ((out, a), b) in row.iter_mut().zip(upper.chunks_exact(2)).zip(lower.chunks_exact(2)) {
            let sum = u16::from(a[0]) + u16::from(a[1]) + u16::from(b[0]) + u16::from(b[1]);
            *out = ((sum + 2) >> 2) as u8;
        }
    }
    // The buffer has exactly this size.
    *into = GrayImage::from_raw(width, height, pixels).unwrap_or_default();
}

/// Brightness at `(x, y)`, bilinear; the border is continued outwards.
pub(super) fn sample(image: &GrayImage, x: f32, y: f32) -> f32 {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let x = x.clamp(0.0, width as f32 - 1.001);
    let y = y.clamp(0.0, height as f32 - 1.001);
    let (column, row) = (x as usize, y as usize);
    let (fx, fy) = (x - column as f32, y - row as f32);
    let at = row * width + column;
    let raw = image.as_raw();
    let right = usize::from(column + 1 < width);
    let down = if row + 1 < height { width } else { 0 };
    let value = |offset: usize| f32::from(raw[at + offset]);
    let upper = value(0) * (1.0 - fx) + value(right) * fx;
    let lower = value(down) * (1.0 - fx) + value(down + right) * fx;
    upper * (1.0 - fy) + lower * fy
}
