//! Visibility of the ghost on any picture: contrast measured on painted pixels.
//!
//! `BORESIGHT_PHOTOS=FOLDER` measures 200 pictures below the folder, too.

use std::{
    path::{Path, PathBuf},
    sync::LazyLock,
};

use boresight::{
    frame::{CaptureTime, Frame, FrameId, FrameKind},
    session::Snapshot,
    ui::{guide, theme::AMBER},
};
use egui::{Pos2, Theme, accesskit::Role, pos2};
use egui_kittest::{Harness, kittest::Queryable};
use image::{GrayImage, Luma, RgbaImage};

use crate::{
    Page, Table,
    fixtures::{Moment, moments},
    harness,
};

/// Relative luminance, WCAG 2.1.
fn luminance(pixel: &image::Rgba<u8>) -> f64 {
    static LINEAR: LazyLock<[f64; 256]> = LazyLock::new(|| {
        std::array::from_fn(|level| {
            let share = level as f64 / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        })
    });
    let [r, g, b] = [0, 1, 2].map(|channel: usize| LINEAR[usize::from(pixel.0[channel])]);
    0.2126 * r + 0.7152 * g + 0.0722 * b
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

/// Contrasts of the ghost's outline with the picture behind it, lowest first: the best within the
/// width of the line, every few pixels along it.
fn of_outline(with: &RgbaImage, without: &RgbaImage, disc: (Pos2, f32)) -> Vec<f64> {
    let is_dark = |pixel: &image::Rgba<u8>| pixel.0[..3].iter().all(|level| *level < 8);
    // The card's colour without a board in the picture.
    let is_core = |pixel: &image::Rgba<u8>| {
        let is = |core: [u8; 3]| (0..3).all(|i| pixel.0[i].abs_diff(core[i]) < 3);
        is(AMBER.to_array()[..3].try_into().expect("three")) || is([255; 3])
    };
    let of_ghost = |x: u32, y: u32| {
        let is_in_disc = pos2(x as f32, y as f32).distance(disc.0) < 1.2 * disc.1;
        !is_in_disc && with.get_pixel(x, y) != without.get_pixel(x, y)
    };
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

/// A guide page without a board in view, with and without a drawing: built once, for any number of
/// pictures.
struct Easel {
    pages: [Harness<'static, Table>; 2],
}

impl Easel {
    /// With and without the ghost.
    fn new(moments: &[Moment]) -> Self {
        Self::without(moments, "searching", |snapshot| snapshot.target = None)
    }

    fn without(moments: &[Moment], name: &str, remove: impl Fn(&mut Snapshot)) -> Self {
        let found = moments.iter().find(|moment| moment.name == name).expect("of that name");
        let page = |is_whole: bool| {
            let mut snapshot = found.snapshot.clone();
            snapshot.live = None;
            if !is_whole {
                remove(&mut snapshot);
            }
            let moment = Moment {
                name: found.name.clone(),
                snapshot,
                sentence: found.sentence.clone(),
                taken: false,
            };
            let mut page = harness(Page::Guide, &moment, Theme::Dark, 1.0);
            let screen = &mut page.state_mut().screen;
            screen.source = "/dev/video0".into();
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
            page.state_mut().screen.picture.show_frame(&frame, 9.99);
            page.step();
            page.step();
            page.render().expect("painted")
        })
    }

    /// Contrast of the sentence's letters with the lightest part of the picture beside them.
    fn of_sentence(&self, painted: &RgbaImage) -> f64 {
        let said = self.pages[0].get_by_role(Role::Status).rect();
        let lightest = |columns: std::ops::Range<u32>| {
            let rows = said.top() as u32..said.bottom() as u32;
            let pixels = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
            pixels.map(|(x, y)| luminance(painted.get_pixel(x, y))).fold(0.0, f64::max)
        };
        let (left, right) = (said.left() as u32, said.right() as u32);
        contrast(lightest(left..right), lightest(right + 8..right + 60))
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

/// A picture behind the ghost.
enum Behind {
    Made(&'static str, GrayImage),
    Photograph(PathBuf),
}

impl Behind {
    fn name(&self) -> String {
        match self {
            Self::Made(name, _) => (*name).into(),
            Self::Photograph(path) => path.display().to_string(),
        }
    }

    /// `None` for a file without a picture.
    fn picture(&self) -> Option<GrayImage> {
        match self {
            Self::Made(_, picture) => Some(picture.clone()),
            Self::Photograph(path) => Some(image::open(path).ok()?.thumbnail(1280, 720).to_luma8()),
        }
    }
}

fn behind() -> Vec<Behind> {
    let mut all: Vec<Behind> = [20, 70, 110, 128, 160, 200, 250]
        .map(|level| Behind::Made("grey", GrayImage::from_pixel(320, 180, Luma([level]))))
        .into();
    let squares = GrayImage::from_fn(320, 180, |x, y| {
        Luma([if (x / 5 + y / 5) % 2 == 0 { 30 } else { 225 }])
    });
    all.push(Behind::Made("squares", squares));
    let ramp = GrayImage::from_fn(320, 180, |x, _| Luma([(x * 255 / 319) as u8]));
    all.push(Behind::Made("ramp", ramp));
    if let Some(folder) = std::env::var_os("BORESIGHT_PHOTOS") {
        let found = photographs(Path::new(&folder));
        let count = found.len().max(1);
        let every = |at: usize| at * 200 / count != (at + 1) * 200 / count;
        let chosen = found.into_iter().enumerate().filter(|(at, _)| every(*at));
        all.extend(chosen.map(|(_, path)| Behind::Photograph(path)));
    }
    all
}

#[test]
fn the_ghost_is_seen_on_any_picture() {
    let all = behind();
    // Pages are painted on the processor: one thread for each of its cores.
    let moments = moments();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let share = all.len().div_ceil(threads);
    let found: Vec<Measured> = std::thread::scope(|scope| {
        let moments = &moments;
        let workers: Vec<_> = all
            .chunks(share)
            .map(|part| {
                let work = move || {
                    let mut easel = Easel::new(moments);
                    let measured = |behind| measure(&mut easel, behind);
                    part.iter().filter_map(measured).collect::<Vec<_>>()
                };
                std::thread::Builder::new().spawn_scoped(scope, work).expect("a thread")
            })
            .collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("measured")).collect()
    });
    println!("contrast over {} pictures, the lowest of each:", found.len());
    let of = [("the ghost's outline", 3.0, 0), ("the sentence", 4.5, 1)];
    for (what, wanted, index) in of {
        let mut lowest: Vec<(f64, &str)> =
            found.iter().map(|measured| (measured.lowest[index], measured.name.as_str())).collect();
        lowest.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at = |share: f64| lowest[(share * (lowest.len() - 1) as f64) as usize].0;
        println!("  {what}: least {:.2}, 5 % {:.2}, median {:.2}", at(0.0), at(0.05), at(0.5));
        let low: Vec<_> = lowest.iter().take_while(|(lowest, _)| *lowest < wanted).collect();
        assert!(low.is_empty(), "{what}: {low:?}");
    }
}

/// Visibility on a picture.
struct Measured {
    name: String,
    /// Lowest contrasts of the ghost's outline and of the sentence.
    lowest: [f64; 2],
}

/// `None` without a picture.
fn measure(easel: &mut Easel, behind: &Behind) -> Option<Measured> {
    let name = behind.name();
    let [with, without] = easel.paint(&behind.picture()?);
    let page = easel.pages[0].get_by_role_and_label(Role::Image, "Live picture").rect();
    let found = of_outline(&with, &without, guide::air::disc(page));
    assert!(found.len() > 100, "{name}: no outline");
    Some(Measured { lowest: [found[0], easel.of_sentence(&without)], name })
}
