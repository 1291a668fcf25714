//! Plants moves, glass, text and foreign pictures into the pictures of a fixed camera, and counts
//! wrong answers.
//!
//! ```text
//! planted FOLDER fx,fy,cx,cy[,k1…] LEARN EVERY [FOREIGN_FOLDER…]
//! ```

mod watched;

use boresight_geometry::frame::ImageSize;
use boresight_watch::{Gallery, Glass, Lens, Mask, Turn, View};
use image::{GrayImage, imageops};
use nalgebra::Vector4;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use watched::{
    Failed, answer, blurred, dirty, foggy, learned, lens, masks, middle, noisy, pictures, read,
    turn_by, units, veiled,
};

type Change = fn(&GrayImage) -> GrayImage;

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, numbers, learn, every, foreign @ ..] = arguments.as_slice() else {
        return Err("FOLDER fx,fy,cx,cy[,k1…] LEARN EVERY [FOREIGN_FOLDER…]".into());
    };
    let files = pictures(folder)?;
    let learn: usize = learn.parse()?;
    let lens = lens(numbers, ImageSize::of(&read(&files[0])?))?;
    let (gallery, mask) = learned(&lens, &files[..learn], usize::MAX)?;
    let tested: Vec<GrayImage> =
        files[learn..].iter().step_by(every.parse()?).map(read).collect::<Result<_, _>>()?;
    small_moves(&lens, &gallery, &tested);
    kinds(&lens, &gallery, &tested);
    glass(&lens, &gallery, &tested);
    text(&lens, &files[..learn], &tested, &mask)?;
    no_answers(&lens, &gallery, &tested, foreign)?;
    Ok(())
}

/// Row 3: mixtures of small moves, through clean, blurred, foggy and dirty glass.
fn small_moves(lens: &Lens, gallery: &Gallery, tested: &[GrayImage]) {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let glass: [(&str, Change); 4] =
        [("clean", GrayImage::clone), ("blur 1 px", blurred), ("fog 0.3", foggy), ("dirt", dirty)];
    for (name, change) in glass {
        let (mut planted, mut found, mut within, mut largest) = (0, 0, 0, Vector4::zeros());
        for grey in tested {
            let Ok(own) = gallery.measure(&View::of(change(grey)), lens) else { continue };
            for _ in 0..5 {
                let mut part = |size: f64| size * [-1.0, 0.0, 1.0][rng.random_range(0..3)];
                let f = lens.camera.f_px;
                let turn = Turn {
                    pan_rad: part(1.0) / f.x,
                    tilt_rad: part(1.0) / f.y,
                    roll_rad: part(0.1_f64.to_radians()),
                    log_focal: part(0.003),
                };
                planted += 1;
                let view = View::of(change(&turn_by(grey, lens, &turn)));
                let Ok(seen) = gallery.measure(&view, lens) else { continue };
                found += 1;
                let off = (seen.turn.vector() - own.turn.then(&turn).vector())
                    .component_mul(&units(lens))
                    .abs();
                within +=
                    usize::from(off[0] < 0.15 && off[1] < 0.15 && off[2] < 0.02 && off[3] < 0.05);
                largest = largest.sup(&off);
            }
        }
        println!(
            "row 3, {name}: {planted} planted, {found} answered, {:.1} % of these within 0.15 px, 0.02 deg, 0.05 %; largest {:.3?}",
            100.0 * f64::from(within as u32) / f64::from(found.max(1)),
            largest.as_slice()
        );
    }
}

/// Row 5, limited to pictures: largest part of the estimate, in px at the picture's corner.
fn kinds(lens: &Lens, gallery: &Gallery, tested: &[GrayImage]) {
    let f = lens.camera.f_px.x;
    for (name, turn, part) in [
        ("pan", Turn { pan_rad: 3.0 / f, ..Turn::default() }, 0),
        ("tilt", Turn { tilt_rad: 3.0 / f, ..Turn::default() }, 1),
        ("roll", Turn { roll_rad: 0.3_f64.to_radians(), ..Turn::default() }, 2),
        ("focal", Turn { log_focal: 0.006, ..Turn::default() }, 3),
    ] {
        let (mut count, mut wrong, mut turned, mut knocked) = (0, 0, 0, 0);
        for grey in tested {
            let Ok(own) = gallery.measure(&View::of(grey.clone()), lens) else { continue };
            let Ok(seen) = gallery.measure(&View::of(turn_by(grey, lens, &turn)), lens) else {
                continue;
            };
            count += 1;
            let off = seen.turn.since(&own.turn).in_px(lens);
            wrong += usize::from(off.abs().imax() != part);
            if let Some(causes) = seen.causes(lens) {
                turned += usize::from(causes.turned_px < causes.shifted_px);
                knocked += usize::from(causes.turned_px > causes.shifted_px);
            }
        }
        println!(
            "row 5, {name}: {count} planted, {wrong} wrong kind; a turn fits better {turned}, a shift {knocked}"
        );
    }
    // A moved principal point shifts the picture without turning it.
    let (mut turned, mut knocked) = (0, 0);
    for grey in tested {
        let shifted = GrayImage::from_fn(grey.width(), grey.height(), |x, y| {
            *grey.get_pixel(x.saturating_sub(3), y)
        });
        let Ok(seen) = gallery.measure(&View::of(shifted), lens) else { continue };
        if let Some(causes) = seen.causes(lens) {
            turned += usize::from(causes.turned_px < causes.shifted_px);
            knocked += usize::from(causes.turned_px > causes.shifted_px);
        }
    }
    println!("row 5, shifted by 3 px as it is: a turn fits better {turned}, a shift {knocked}");
}

/// Row 11, limited to single pictures.
fn glass(lens: &Lens, gallery: &Gallery, tested: &[GrayImage]) {
    let changes: [(&str, Change); 4] = [
        ("as it is", GrayImage::clone),
        ("blur 1 px", blurred),
        ("fog 0.3", foggy),
        ("dirt", dirty),
    ];
    for (name, change) in changes {
        let (mut sharp, mut contrast) = (Vec::new(), Vec::new());
        for grey in tested {
            let view = View::of(change(grey));
            let Ok(measured) = gallery.measure(&view, lens) else { continue };
            let Some(glass) = Glass::of(&measured, gallery, &view) else { continue };
            sharp.push(glass.sharpness);
            contrast.push(glass.contrast);
        }
        println!(
            "row 11, {name}: {} of {} judged; sharpness {:.2}, contrast {:.2}",
            sharp.len(),
            tested.len(),
            middle(&mut sharp),
            middle(&mut contrast)
        );
    }
}

/// Row 10: a time and a logo in the learning pictures.
fn text(
    lens: &Lens,
    learn: &[std::path::PathBuf],
    tested: &[GrayImage],
    clean: &Mask,
) -> Result<(), Failed> {
    let size = lens.image_size;
    let folder = std::env::temp_dir().join(format!("planted-text-{}", std::process::id()));
    std::fs::create_dir(&folder)?;
    let mut files = Vec::new();
    for (n, file) in learn.iter().enumerate() {
        let path = folder.join(format!("{n:05}.png"));
        written_over(&read(file)?, n as u32).save(&path)?;
        files.push(path);
    }
    let mask = masks(&files)?;
    let mut of_text = (0.0, 0.0);
    for (x, y) in text_pixels(size) {
        of_text = (of_text.0 + f64::from(u8::from(mask.covers(x, y))), of_text.1 + 1.0);
    }
    let (gallery, _) = learned(lens, &files, usize::MAX)?;
    let turn = Turn { pan_rad: 3.0 / lens.camera.f_px.x, ..Turn::default() };
    let (mut found, mut largest) = (0, 0.0_f64);
    for (n, grey) in tested.iter().enumerate() {
        let of = |grey: &GrayImage| gallery.measure(&View::of(written_over(grey, n as u32)), lens);
        let (Ok(own), Ok(seen)) = (of(grey), of(&turn_by(grey, lens, &turn))) else { continue };
        found += 1;
        let off = seen.turn.vector() - own.turn.then(&turn).vector();
        largest = largest.max((off[0] * lens.camera.f_px.x).abs());
    }
    std::fs::remove_dir_all(&folder)?;
    println!(
        "row 10: text covered {:.1} %; masked without text {:.2} %, with {:.2} %; moves of 3 px: {found} of {} answered, largest error {largest:.3} px",
        100.0 * of_text.0 / of_text.1,
        100.0 * clean.share(size.width_px, size.height_px),
        100.0 * mask.share(size.width_px, size.height_px),
        tested.len()
    );
    Ok(())
}

/// Row 9: pictures without a valid answer.
fn no_answers(
    lens: &Lens,
    gallery: &Gallery,
    tested: &[GrayImage],
    foreign: &[String],
) -> Result<(), Failed> {
    let (width, height) = (lens.image_size.width_px, lens.image_size.height_px);
    let mut others = Vec::new();
    for folder in foreign {
        for file in pictures(folder)?
            .iter()
            .filter(|file| file.extension().is_some_and(|e| e == "jpg" || e == "png"))
        {
            others.push(imageops::resize(
                &read(file)?,
                width,
                height,
                imageops::FilterType::Triangle,
            ));
        }
    }
    let some = |change: Change| -> Vec<GrayImage> { tested.iter().map(change).collect() };
    for (name, pictures) in [
        ("other cameras", others),
        ("mirrored", some(imageops::flip_horizontal)),
        ("upside down", some(imageops::rotate180)),
        ("black", vec![GrayImage::new(width, height)]),
        (
            "covered",
            some(|grey| GrayImage::from_pixel(grey.width(), grey.height(), image::Luma([30]))),
        ),
        ("nearly black", some(|grey| noisy(grey, 0.02))),
        ("veiled", some(veiled)),
    ] {
        let answered = pictures
            .iter()
            .filter(|grey| answer(gallery, &View::of((*grey).clone()), lens).is_ok())
            .count();
        println!("row 9, {name}: {answered} of {} answered", pictures.len());
    }
    Ok(())
}

/// Pixels of a text of 16 letters and a logo.
fn text_pixels(size: ImageSize) -> Vec<(u32, u32)> {
    let letters = (0..16)
        .flat_map(|n| (0..22).flat_map(move |y| (0..12).map(move |x| (24 + 15 * n + x, 24 + y))));
    let logo = (0..40).flat_map(move |y| {
        (0..90).map(move |x| (size.width_px - 130 + x, size.height_px - 80 + y))
    });
    letters.chain(logo).collect()
}

/// Picture with a time (with changing last letters) and a logo, both white with a black rim.
fn written_over(grey: &GrayImage, n: u32) -> GrayImage {
    let mut out = grey.clone();
    let size = ImageSize::of(grey);
    for (i, (x, y)) in text_pixels(size).into_iter().enumerate() {
        let (letter, within) = (i as u32 / 264, i as u32 % 264);
        let (row, column) = (within / 12, within % 12);
        let is_bar = if letter < 16 {
            let digit = if letter < 10 { letter * 7 } else { letter * 7 + n * (letter - 9) };
            let inside = (2..20).contains(&row) && (2..10).contains(&column);
            inside && ((row / 4 + digit) % 3 != 0 || column / 3 == digit % 3)
        } else {
            (x / 7 + y / 9) % 2 == 0
        };
        out.put_pixel(x, y, image::Luma([if is_bar { 250 } else { 5 }]));
    }
    out
}
