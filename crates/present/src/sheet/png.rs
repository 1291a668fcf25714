use image::{GrayImage, Luma};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster};
use png::{BitDepth, ColorType, Encoder, PixelDimensions, Unit};

use super::{Disc, Rectangle, Resolution, Sheet, Words};

/// Font size as a share of the height of the letters' boxes.
const SIZE_OF_BOX: f64 = 0.73;
/// Position of the baseline in a box.
const BASELINE_OF_BOX: f64 = 0.78;

/// Reason for not writing a picture.
#[derive(Debug, thiserror::Error)]
pub enum NotWritten {
    /// More pixels than any printer needs.
    #[error("a picture of {width_px} x {height_px} pixels is too large")]
    TooLarge {
        /// Width of the picture.
        width_px: u32,
        /// Height of the picture.
        height_px: u32,
    },
    /// Error of the encoder.
    #[error("could not encode the picture")]
    Encode(#[from] png::EncodingError),
}

/// Grey PNG of the sheet with the resolution, for printing in true size.
///
/// Pixels on an edge are grey by their covered share, so edges are accurate to a fraction of a
/// pixel.
///
/// # Errors
///
/// [`NotWritten`].
pub fn png(sheet: &Sheet, resolution: Resolution) -> Result<Vec<u8>, NotWritten> {
    // Pages and resolutions are bounded: this fits.
    let whole = |mm: f64| (mm * resolution.per_mm()).round() as u32;
    let (width_px, height_px) = (whole(sheet.width_mm), whole(sheet.height_mm));
    if u64::from(width_px) * u64::from(height_px) > 300_000_000 {
        return Err(NotWritten::TooLarge { width_px, height_px });
    }
    let mut picture = GrayImage::from_pixel(width_px, height_px, Luma([255]));
    for black in sheet.squares.iter().chain(&sheet.markers).chain(&sheet.code).chain(&sheet.ruler) {
        fill(&mut picture, black, resolution.per_mm());
    }
    for disc in &sheet.discs {
        fill_disc(&mut picture, disc, resolution.per_mm());
    }
    for words in &sheet.words {
        write(&mut picture, words, resolution.per_mm());
    }
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, width_px, height_px);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Eight);
    let per_m = resolution.per_m();
    encoder.set_pixel_dims(Some(PixelDimensions { xppu: per_m, yppu: per_m, unit: Unit::Meter }));
    let mut writer = encoder.write_header()?;
    writer.write_image_data(picture.as_raw())?;
    writer.finish()?;
    Ok(file)
}

/// Darkens each pixel by the share covered by the rectangle.
fn fill(picture: &mut GrayImage, black: &Rectangle, per_mm: f64) {
    let Rectangle { left_mm, top_mm, width_mm, height_mm } = *black;
    let across = covered(left_mm * per_mm, (left_mm + width_mm) * per_mm, picture.width());
    let down = covered(top_mm * per_mm, (top_mm + height_mm) * per_mm, picture.height());
    for (y, share_y) in down {
        for (x, share_x) in across.clone() {
            darken(picture, x, y, share_x * share_y);
        }
    }
}

/// Darkens each pixel by the share covered by the disc, to a thousandth of a pixel.
fn fill_disc(picture: &mut GrayImage, disc: &Disc, per_mm: f64) {
    /// Scan lines per pixel.
    const LINES: u32 = 16;
    let ([x, y], radius) = (disc.centre_mm.map(|mm| mm * per_mm), disc.radius_mm * per_mm);
    for (row, _) in covered(y - radius, y + radius, picture.height()) {
        let half = |line: u32| {
            let off = f64::from(row) + (f64::from(line) + 0.5) / f64::from(LINES) - y;
            (radius * radius - off * off).max(0.0).sqrt()
        };
        let mut shares = std::collections::BTreeMap::new();
        for half in (0..LINES).map(half).filter(|half| *half > 0.0) {
            for (column, share) in covered(x - half, x + half, picture.width()) {
                *shares.entry(column).or_insert(0.0) += share / f64::from(LINES);
            }
        }
        for (column, share) in shares {
            darken(picture, column, row, share);
        }
    }
}

/// Pixels between two positions, each with the covered share.
fn covered(from: f64, to: f64, size: u32) -> impl Iterator<Item = (u32, f64)> + Clone {
    // Rounding must not leave a trace on the next pixel.
    let (from, to) = (near_whole(from).max(0.0), near_whole(to).min(size.into()));
    (from.floor() as u32..to.ceil() as u32).map(move |pixel| {
        let start = f64::from(pixel);
        (pixel, (to.min(start + 1.0) - from.max(start)).clamp(0.0, 1.0))
    })
}

fn near_whole(px: f64) -> f64 {
    if (px - px.round()).abs() < 1e-6 { px.round() } else { px }
}

fn write(picture: &mut GrayImage, words: &Words, per_mm: f64) {
    let weight = if words.bold { FontWeight::Bold } else { FontWeight::Regular };
    let box_px = words.size_mm * per_mm / SIZE_OF_BOX;
    let scale = box_px / RasterHeight::Size32.val() as f64;
    let advance_px =
        noto_sans_mono_bitmap::get_raster_width(weight, RasterHeight::Size32) as f64 * scale;
    let shift_px = if words.centred { advance_px * words.text.len() as f64 / 2.0 } else { 0.0 };
    let left_px = words.x_mm * per_mm - shift_px;
    let top_px = words.baseline_mm * per_mm - BASELINE_OF_BOX * box_px;
    for (i, letter) in words.text.chars().enumerate() {
        let Some(raster) = get_raster(letter, weight, RasterHeight::Size32) else { continue };
        let left_px = left_px + advance_px * i as f64;
        for (row, line) in raster.rows().enumerate() {
            for (column, intensity) in line.iter().enumerate().filter(|(_, i)| **i > 0) {
                // Each pixel of the letter is a small grey rectangle of the picture.
                let (x, y) = (left_px + column as f64 * scale, top_px + row as f64 * scale);
                let across = covered(x, x + scale, picture.width());
                for (y, share_y) in covered(y, y + scale, picture.height()) {
                    for (x, share_x) in across.clone() {
                        let share = share_x * share_y * f64::from(*intensity) / 255.0;
                        darken(picture, x, y, share);
                    }
                }
            }
        }
    }
}

fn darken(picture: &mut GrayImage, x: u32, y: u32, share: f64) {
    if let Some(Luma([value])) = picture.get_pixel_mut_checked(x, y) {
        // Between 0 and 255.
        *value = (f64::from(*value) - 255.0 * share).round().max(0.0) as u8;
    }
}
