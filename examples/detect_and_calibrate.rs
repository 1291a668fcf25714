//! Finds a board in pictures, calibrates from them, and says how certain the result is.
//!
//! cargo run --no-default-features --example detect_and_calibrate -- 7x5 30 fixtures/recordings/v1/good/frames

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use boresight::{
    boards::Board,
    calibration::{CalibrationParams, calibrate, files::ViewName, projection_jacobian},
    detection::{Detector, DetectorParams},
    frame::ImageSize,
    text,
};

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let usage = "detect_and_calibrate COLUMNSxROWS SQUARE_MM FOLDER";
    let (Some(counts), Some(square_mm), Some(folder)) =
        (arguments.next(), arguments.next(), arguments.next())
    else {
        return Err(anyhow!(usage));
    };
    let (columns, rows) = counts.split_once('x').context(usage)?;
    let square_m = 1e-3 * square_mm.parse::<f64>()?;
    let board = Board::new(columns.parse()?, rows.parse()?, square_m)?;

    let listed: Result<Vec<PathBuf>, _> =
        std::fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path())).collect();
    let mut files = listed?;
    files.sort();
    // A detector keeps its buffers from picture to picture.
    let mut detector = Detector::new(DetectorParams::default());
    let (mut views, mut names, mut image_size) = (Vec::new(), Vec::new(), None);
    for file in &files {
        let picture = image::open(file)?.into_luma8();
        image_size = image_size.or(Some(ImageSize::of(&picture)));
        match detector.detect(&picture, &board) {
            Ok(found) => {
                views.push(found.corners);
                names.push(ViewName {
                    name: file.display().to_string(),
                    number: None,
                    reason: None,
                });
            }
            Err(miss) => println!("{}: {}", file.display(), text::miss(&miss)),
        }
    }
    let image_size = image_size.context("no pictures")?;

    let found = calibrate(&views, &board, image_size, &CalibrationParams::default())
        .map_err(|reason| anyhow!("{}", text::not_calibrated(&reason, &names).0))?;
    let (f, pp, sd) = (found.camera.f_px, found.camera.pp_px, found.sd());
    println!("f ({:.2}, {:.2}) ± {:.2} px", f.x, f.y, sd[0]);
    println!("pp ({:.2} ± {:.2}, {:.2} ± {:.2}) px", pp.x, sd[2], pp.y, sd[3]);
    println!("verdict: {}", found.verdict.code());
    for finding in &found.findings {
        println!("  {}", text::finding(finding, &names).0);
    }
    // How far off the picture of a ray may be, over the whole picture.
    if let Some(jacobian) = projection_jacobian(&found.camera, image_size) {
        println!("projection: ± {:.3} px at most", jacobian.sd(&found.covariance_all).max_px);
    }
    Ok(())
}
