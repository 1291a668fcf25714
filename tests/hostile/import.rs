//! Calibrations of all programs. Accepted input makes sense, and reads back bit for bit.

use boresight::{
    calibration::{
        export::{CameraFormat, ExportedCamera, kalibr_camchain},
        import,
    },
    frame::ImageSize,
    geometry::{Camera, Distortion, LensKind},
    text,
};
use nalgebra::{Point2, Vector2};

use crate::{
    harness::{only_numbers, run},
    page::calibration,
};

fn seeds() -> Vec<String> {
    let camera = Camera {
        f_px: Vector2::new(900.25, 901.5),
        pp_px: Point2::new(640.5, 355.25),
        distortion: Distortion {
            k1: -0.2,
            k2: 0.05,
            p1: 1e-3,
            p2: -2e-4,
            k3: 0.01,
            ..Distortion::default()
        },
    };
    let image_size = ImageSize { width_px: 1280, height_px: 720 };
    let exported = ExportedCamera { name: "front", camera, image_size, rms_px: 0.2 };
    let without_k3 = Camera { distortion: Distortion { k3: 0.0, ..camera.distortion }, ..camera };
    let kalibr =
        kalibr_camchain(&ExportedCamera { camera: without_k3, ..exported }).expect("it fits");
    let fisheye =
        Distortion { kind: LensKind::Fisheye, k1: 0.03, k4: -1e-3, ..Distortion::default() };
    let wide = ExportedCamera { camera: Camera { distortion: fisheye, ..camera }, ..exported };
    let pinhole = Camera { distortion: Distortion::default(), ..camera };
    let pinhole = ExportedCamera { camera: pinhole, ..exported };
    let written = [exported, wide, pinhole].into_iter().flat_map(|exported| {
        CameraFormat::ALL.into_iter().filter_map(move |format| format.write(&exported).ok())
    });
    [calibration().to_string(), kalibr].into_iter().chain(written).collect()
}

/// Formats with another pixel origin round the principal point, and Metashape's the focal length,
/// too.
fn is_near(read: &Camera, written: &Camera) -> bool {
    let pairs = read.lens_parameters().into_iter().zip(written.lens_parameters());
    let near = |(a, b): (f64, f64)| (a - b).abs() <= 1e-9 * (1e5 + a.abs() + b.abs());
    read.distortion == written.distortion && pairs.into_iter().all(near)
}

#[test]
fn calibrations() {
    let seeds = seeds();
    let tree: serde_json::Value = serde_json::from_str(&seeds[0]).expect("JSON");
    run(
        "import",
        |mutator| {
            if mutator.chance(0.3) {
                let mut tree = tree.clone();
                let times = 1 + mutator.below(3);
                mutator.json(&mut tree, times);
                return tree.to_string().into_bytes();
            }
            mutator.text(&seeds)
        },
        |input| {
            let old = match import::read(&String::from_utf8_lossy(input)) {
                Ok(old) => old,
                Err(err) => {
                    return if err.to_string().is_empty() {
                        Err("no words".into())
                    } else {
                        Ok(false)
                    };
                }
            };
            only_numbers(&old)?;
            if old.rms_px.is_some_and(|rms_px| rms_px < 0.0) {
                return Err("a negative residual".into());
            }
            if old.covariance.is_some_and(|sd| sd.diagonal().min() < 0.0) {
                return Err("a negative variance".into());
            }
            drop(text::doubts_of_old(&old));
            let exported = ExportedCamera {
                name: old.source.as_deref().unwrap_or("camera"),
                camera: old.camera,
                image_size: old.image_size,
                rms_px: old.rms_px.unwrap_or(0.0),
            };
            for format in CameraFormat::ALL {
                let Ok(written) = format.write(&exported) else { continue };
                if format == CameraFormat::Matlab {
                    continue;
                }
                let again = import::read(&written).map_err(|err| format!("{err}: {written}"))?;
                if !is_near(&again.camera, &old.camera) || again.image_size != old.image_size {
                    return Err(format!(
                        "{format:?}: {:?} reads back as {:?}",
                        old.camera, again.camera
                    ));
                }
            }
            Ok(true)
        },
    );
}
