//! The ghost is seen on any picture: contrast measured on painted pixels.
//!
//! `BORESIGHT_PHOTOS=FOLDER` measures it on every picture below the folder, too.

use std::path::{Path, PathBuf};

use boresight::frame::{CaptureTime, Frame, FrameId, FrameKind};
use egui::{Theme, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable};
use image::{GrayImage, Luma, RgbaImage};

use crate::{
    Page, Table,
    fixtures::{Moment, moments},
    harness,
};

/// Relative luminance, WCAG 2.1.
fn luminance(pixel: &image::Rgba<u8>) -> f64 {
    let linear = |level: u8| {
        let share = f64::from(level) / 255.0;
        if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
    };
    let [r, g, b, _] = pixel.0;
    0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
}

fn contrast(a: f64, b: f64) -> f64 {
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

/// Mean luminance around a place.
fn around(image: &RgbaImage, (x, y): (u32, u32)) -> f64 {
    let reach = 4;
    let (mut sum, mut count) = (0.0, 0.0);
    for y in y.saturating_sub(reach)..(y + reach + 1).min(image.height()) {
        for x in x.saturating_sub(reach)..(x + reach + 1).min(image.width()) {
            sum += luminance(image.get_pixel(x, y));
            count += 1.0;
        }
    }
    sum / count
}

/// Contrast of the ghost's outline with the picture behind it, lowest first: of whatever is best within the width
/// of the line, every few pixels along it.
fn of_outline(with: &RgbaImage, without: &RgbaImage) -> Vec<f64> {
    let is_dark = |pixel: &image::Rgba<u8>| pixel.0[..3].iter().all(|level| *level < 8);
    // The outline's colour without a board in the picture, and that of the brackets.
    let is_core = |pixel: &image::Rgba<u8>| {
        [190, 255].iter().any(|core| pixel.0[..3].iter().all(|level| level.abs_diff(*core) < 3))
    };
    let of_ghost = |x: u32, y: u32| with.get_pixel(x, y) != without.get_pixel(x, y);
    let reach = 7;
    let mut found = Vec::new();
    for (x, y, pixel) in with.enumerate_pixels() {
        if !is_dark(pixel) || !of_ghost(x, y) || (x * 7 + y * 13) % 3 != 0 {
            continue;
        }
        let core = (y.saturating_sub(reach)..(y + reach + 1).min(with.height()))
            .flat_map(|y| {
                (x.saturating_sub(reach)..(x + reach + 1).min(with.width())).map(move |x| (x, y))
            })
            .filter(|(x, y)| of_ghost(*x, *y) && is_core(with.get_pixel(*x, *y)))
            .map(|(x, y)| luminance(with.get_pixel(x, y)))
            .fold(0.0, f64::max);
        // At the picture's edge the core may be cut off.
        if core > 0.0 {
            let picture = around(without, (x, y));
            found.push(contrast(luminance(pixel), picture).max(contrast(core, picture)));
        }
    }
    found.sort_by(f64::total_cmp);
    found
}

/// A guide page without a board in view, with and without the ghost: built once, for any number of pictures.
struct Easel {
    pages: [Harness<'static, Table>; 2],
}

impl Easel {
    fn new(moments: &[Moment]) -> Self {
        let searching = moments
            .iter()
            .find(|moment| moment.name == "searching")
            .expect("a moment of that name");
        let page = |has_ghost: bool| {
            let mut snapshot = searching.snapshot.clone();
            if !has_ghost {
                snapshot.target = None;
            }
            let moment = Moment {
                name: searching.name.clone(),
                snapshot,
                sentence: searching.sentence.clone(),
                taken: false,
            };
            let mut page = harness(Page::Guide, &moment, Theme::Dark, 1.0);
            page.state_mut().screen.source = "/dev/video0".into();
            page
        };
        Self { pages: [page(true), page(false)] }
    }

    /// The picture with the ghost, and without.
    fn paint(&mut self, picture: &GrayImage) -> [RgbaImage; 2] {
        let frame = Frame {
            id: FrameId(2),
            captured_at: CaptureTime { nanos: 40_000_000 },
            kind: FrameKind::Video,
            name: String::new(),
            image: picture.clone(),
        };
        self.pages.each_mut().map(|page| {
            let ctx = page.ctx.clone();
            page.state_mut().screen.picture.show_frame(&ctx, &frame, 9.99);
            page.step();
            page.step();
            page.render().expect("painted")
        })
    }

    /// Lowest contrast of the sentence's letters with what is behind them.
    fn of_sentence(&self, painted: &RgbaImage) -> f64 {
        let band = self.pages[0].get_by_role(Role::Status).rect();
        let (mut light, mut dark) = (0.0_f64, f64::INFINITY);
        for y in band.top() as u32..band.bottom() as u32 {
            for x in band.left() as u32..band.right() as u32 {
                let level = luminance(painted.get_pixel(x, y));
                (light, dark) = (light.max(level), dark.min(level));
            }
        }
        contrast(light, dark)
    }
}

fn photographs(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let is_picture = path.extension().is_some_and(|e| {
            ["png", "jpg", "jpeg"].iter().any(|name| e.eq_ignore_ascii_case(name))
        });
        if path.is_dir() {
            found.extend(photographs(&path));
        } else if is_picture {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
fn the_ghost_is_seen_on_any_picture() {
    let mut pictures: Vec<(String, GrayImage)> = [20, 70, 110, 128, 160, 200, 250]
        .map(|level| (format!("grey {level}"), GrayImage::from_pixel(320, 180, Luma([level]))))
        .into();
    let stripes = GrayImage::from_fn(320, 180, |x, y| {
        Luma([if (x / 5 + y / 5) % 2 == 0 { 30 } else { 225 }])
    });
    pictures.push(("squares".into(), stripes));
    let ramp = GrayImage::from_fn(320, 180, |x, _| Luma([(x * 255 / 319) as u8]));
    pictures.push(("ramp".into(), ramp));
    if let Some(folder) = std::env::var_os("BORESIGHT_PHOTOS") {
        let photographs = photographs(Path::new(&folder));
        let step = (photographs.len() / 200).max(1);
        for path in photographs.into_iter().step_by(step) {
            let Ok(picture) = image::open(&path) else { continue };
            let picture = picture.thumbnail(1280, 720).to_luma8();
            pictures.push((path.display().to_string(), picture));
        }
    }
    // Pages are painted on the processor: one thread for each of its cores.
    let moments = moments();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let share = pictures.len().div_ceil(threads);
    let found: Vec<(f64, f64)> = std::thread::scope(|scope| {
        let moments = &moments;
        let workers: Vec<_> = pictures
            .chunks(share)
            .map(|pictures| {
                let work = move || {
                    let mut easel = Easel::new(moments);
                    pictures.iter().map(|picture| measure(&mut easel, picture)).collect::<Vec<_>>()
                };
                std::thread::Builder::new().spawn_scoped(scope, work).expect("a thread")
            })
            .collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("measured")).collect()
    });
    let (mut lowest, mut sentence): (Vec<f64>, Vec<f64>) = found.into_iter().unzip();
    lowest.sort_by(f64::total_cmp);
    sentence.sort_by(f64::total_cmp);
    println!(
        "contrast over {} pictures: along the ghost's outline least {:.2}, median {:.2}; of the sentence least {:.2}",
        lowest.len(),
        lowest[0],
        lowest[lowest.len() / 2],
        sentence[0]
    );
}

/// Lowest contrast of the ghost's outline, and that of the sentence.
fn measure(easel: &mut Easel, (name, picture): &(String, GrayImage)) -> (f64, f64) {
    let [with, without] = easel.paint(picture);
    let found = of_outline(&with, &without);
    assert!(found.len() > 100, "{name}: no outline");
    assert!(found[0] >= 3.0, "{name}: {:.2}", found[0]);
    let sentence = easel.of_sentence(&with);
    assert!(sentence >= 4.5, "{name}: {sentence:.2}");
    (found[0], sentence)
}
