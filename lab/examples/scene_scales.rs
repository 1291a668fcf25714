//! The scene behind the board as a witness of the focal length: folders of pictures by a fixed
//! camera, as they are and with their second half enlarged.
//!
//! ```text
//! cargo run --release -p boresight-lab --example scene_scales -- BOARD FOLDER…
//! ```
//!
//! `BOARD` is given as `9x6`. A line for each folder and enlargement: usable pictures, root mean
//! square of the log focal ratios of each half about its mean, the same in stated standard
//! deviations, the measured enlargement with its scatter, and processor time a picture.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use boresight_calibrate::{CalibrationParams, calibrate};
use boresight_detect::{Detector, DetectorParams};
use boresight_geometry::{
    Camera, Corner,
    boards::BoardChoice,
    frame::{ImageSize, SceneScale},
};
use boresight_scene::{Lens, scene_scales};
use image::GrayImage;
use nalgebra::Point2;

type Failed = Box<dyn std::error::Error>;

const ENLARGED: [f64; 4] = [1.0, 1.003, 1.01, 1.03];

fn main() -> Result<(), Failed> {
    let mut args = std::env::args().skip(1);
    let board: BoardChoice = args.next().ok_or("a board, as 9x6")?.parse()?;
    let board = board.board(0.025)?;
    for folder in args {
        let mut pictures = Vec::new();
        for path in pictures_in(Path::new(&folder))? {
            let image = image::open(&path)?.to_luma8();
            let found = Detector::new(DetectorParams::default()).detect(&image, &board);
            if let Ok(found) = found {
                pictures.push((image, found.corners));
            }
        }
        let Some((first, _)) = pictures.first() else { continue };
        let size = ImageSize::of(first);
        let views: Vec<Vec<Corner>> = pictures.iter().map(|(_, corners)| corners.clone()).collect();
        let camera = match calibrate(&views, &board, size, &CalibrationParams::default()) {
            Ok(found) => found.camera,
            Err(_) => Camera::pinhole(f64::from(size.width_px), size.centre_px()),
        };
        let lens = Lens::new(camera, None, size);
        let half = pictures.len() / 2;
        for factor in ENLARGED {
            let load = |index: usize| {
                let (image, corners) = &pictures[index];
                let seen = corners.iter().filter(|corner| corner.is_seen());
                let middle = camera.pp_px;
                let by = if index < half { 1.0 } else { factor };
                let points = seen.map(|corner| middle + (corner.px - middle) * by).collect();
                Some((enlarged(image, &middle, by), points))
            };
            let began = Instant::now();
            let scales = scene_scales(&lens, pictures.len(), 1, load);
            let ms = began.elapsed().as_secs_f64() * 1e3 / pictures.len() as f64;
            print(&folder, factor, &scales, half, ms);
        }
    }
    Ok(())
}

fn print(folder: &str, factor: f64, scales: &[Option<SceneScale>], half: usize, ms: f64) {
    let halves: [Vec<SceneScale>; 2] =
        [&scales[..half], &scales[half..]].map(|half| half.iter().flatten().copied().collect());
    let mean =
        |half: &[SceneScale]| half.iter().map(|it| it.log_focal).sum::<f64>() / half.len() as f64;
    let means = [mean(&halves[0]), mean(&halves[1])];
    let (mut squares, mut z_squares, mut count) = (0.0, 0.0, 0);
    for (half, mean) in halves.iter().zip(means) {
        for it in half {
            squares += (it.log_focal - mean).powi(2);
            z_squares += ((it.log_focal - mean) / it.sd).powi(2);
            count += 1;
        }
    }
    let rms = |squares: f64| (squares / f64::from(count.max(1))).sqrt();
    println!(
        "{:28} {factor:.3}: {:2}+{:2} of {:2}, rms {:.5}, z {:.2}; enlarged {:+.3} % (planted {:+.3}), {ms:.0} ms",
        Path::new(folder).file_name().unwrap_or_default().to_string_lossy(),
        halves[0].len(),
        halves[1].len(),
        scales.len(),
        rms(squares),
        rms(z_squares),
        100.0 * (means[1] - means[0]),
        100.0 * factor.ln(),
    );
}

fn pictures_in(folder: &Path) -> Result<Vec<PathBuf>, Failed> {
    let entries = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut paths: Vec<PathBuf> = entries.collect::<Result<_, std::io::Error>>()?;
    paths.retain(|path| {
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        ["png", "jpg", "jpeg"].iter().any(|known| ending == *known)
    });
    paths.sort();
    Ok(paths)
}

/// Picture enlarged about a point, by linear interpolation.
fn enlarged(image: &GrayImage, middle: &Point2<f64>, factor: f64) -> GrayImage {
    if factor == 1.0 {
        return image.clone();
    }
    let (width, height) = image.dimensions();
    GrayImage::from_fn(width, height, |x, y| {
        let from = |at: u32, middle: f64| (f64::from(at) - middle) / factor + middle;
        let (x, y) = (from(x, middle.x), from(y, middle.y));
        let (left, top) = (x.floor().max(0.0), y.floor().max(0.0));
        let at = |x: f64, y: f64| {
            let px = image.get_pixel((x as u32).min(width - 1), (y as u32).min(height - 1));
            f64::from(px[0])
        };
        let (u, v) = (x - left, y - top);
        let upper = at(left, top) * (1.0 - u) + at(left + 1.0, top) * u;
        let lower = at(left, top + 1.0) * (1.0 - u) + at(left + 1.0, top + 1.0) * u;
        image::Luma([(upper * (1.0 - v) + lower * v).round() as u8])
    })
}
