//! Picture files: readable ones are searched.

use std::{fs, io::Cursor};

use boresight::{
    boards::Board,
    capture::read_picture,
    detection::{Detector, DetectorParams},
};
use image::{DynamicImage, GrayImage, ImageFormat, Luma};

use crate::{
    harness::{run, scratch},
    jpeg::jpegs,
};

/// Pictures of a board in every form of PNG.
pub(crate) fn pngs() -> Vec<Vec<u8>> {
    let board = GrayImage::from_fn(160, 120, |x, y| {
        let inside = (15..145).contains(&x) && (15..105).contains(&y);
        Luma([if inside && (x / 13 + y / 13) % 2 == 0 { 30 } else { 220 }])
    });
    let grey = DynamicImage::from(board);
    let all = [
        grey.clone(),
        grey.to_rgb8().into(),
        grey.to_rgba8().into(),
        grey.to_luma16().into(),
        grey.to_luma_alpha8().into(),
        grey.to_rgb16().into(),
    ];
    let png = |image: DynamicImage| encoded(&image, ImageFormat::Png);
    all.into_iter().map(png).chain([with_palette()]).collect()
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("encodes");
    bytes.into_inner()
}

/// Small pictures in the other formats. Not WebP: its decoder asks for the room of the stated size
/// before it reads, and uses none of it; the whole program is measured on that.
fn others() -> Vec<Vec<u8>> {
    let grey = GrayImage::from_fn(48, 36, |x, y| Luma([(5 * x + 11 * y) as u8]));
    let (grey, colour) = (DynamicImage::from(grey.clone()), DynamicImage::from(grey).to_rgb8());
    let colour = DynamicImage::from(colour);
    let (tiff, bmp, pnm) = (ImageFormat::Tiff, ImageFormat::Bmp, ImageFormat::Pnm);
    let mut all: Vec<_> = [tiff, bmp, pnm].map(|format| encoded(&grey, format)).into();
    all.extend([tiff, bmp, pnm].map(|format| encoded(&colour, format)));
    all.push(encoded(&DynamicImage::from(grey.to_luma16()), tiff));
    all.push(b"P5 4 3 255\n0123456789ab".to_vec());
    all.push(b"P2\n# of a person\n3 2\n15\n0 1 2\n3 4 15\n".to_vec());
    all
}

#[test]
fn other_pictures() {
    let place = scratch();
    let file = place.path().join("picture");
    let seeds = others();
    let board = Board::new(9, 6, 0.025).expect("valid");
    let mut detector = Detector::new(DetectorParams::default());
    run(
        "other_pictures",
        |mutator| mutator.bytes(&seeds),
        |input| {
            fs::write(&file, input).expect("written");
            match read_picture(&file) {
                // Most are read, few are searched: that takes a thousand times as long.
                Ok(image) => {
                    if image.len() < 100 {
                        detector.detect(&image, &board).ok();
                    }
                    Ok(true)
                }
                Err(err) if err.to_string().is_empty() => Err("no words".into()),
                Err(_) => Ok(false),
            }
        },
    );
}

/// A PNG of four colours, including a transparent one.
fn with_palette() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 40, 30);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(vec![0, 0, 0, 90, 90, 90, 200, 200, 200, 255, 255, 255]);
    encoder.set_trns(vec![255, 0]);
    let mut writer = encoder.write_header().expect("encodes");
    let colours: Vec<u8> = (0..1200).map(|at| (at / 7 % 4) as u8).collect();
    writer.write_image_data(&colours).expect("encodes");
    writer.finish().expect("encodes");
    bytes
}

/// Corrects the checksums of a PNG's chunks: decoders don't expect damage behind them.
fn mend(png: &mut [u8]) {
    let mut at = 8;
    while at + 12 <= png.len() && png.starts_with(b"\x89PNG\r\n\x1a\n") {
        let length = u32::from_be_bytes([png[at], png[at + 1], png[at + 2], png[at + 3]]) as usize;
        let Some(end) = at.checked_add(8 + length).filter(|end| end + 4 <= png.len()) else {
            return;
        };
        let checksum = crc32fast::hash(&png[at + 4..end]).to_be_bytes();
        png[end..end + 4].copy_from_slice(&checksum);
        at = end + 4;
    }
}

#[test]
fn pictures() {
    let place = scratch();
    let file = place.path().join("picture");
    let seeds = [pngs(), jpegs()].concat();
    let board = Board::new(9, 6, 0.025).expect("valid");
    let mut detector = Detector::new(DetectorParams::default());
    run(
        "picture",
        |mutator| {
            let mut bytes = mutator.bytes(&seeds);
            if mutator.chance(0.7) {
                mend(&mut bytes);
            }
            bytes
        },
        |input| {
            fs::write(&file, input).expect("written");
            let image = match read_picture(&file) {
                Ok(image) => image,
                Err(err) if err.to_string().is_empty() => return Err("no words".into()),
                Err(_) => return Ok(false),
            };
            if let Ok(found) = detector.detect(&image, &board) {
                let (width, height) = (f64::from(image.width()), f64::from(image.height()));
                for corner in &found.corners {
                    let inside = (-0.5..width).contains(&corner.px.x)
                        && (-0.5..height).contains(&corner.px.y);
                    let variance = corner.covariance_px2.trace();
                    if !(inside && variance > 0.0 && variance.is_finite()) {
                        return Err(format!("a corner that can't be: {corner:?}"));
                    }
                }
            }
            Ok(true)
        },
    );
}
