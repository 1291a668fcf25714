//! Calibrations of all programs. Accepted input makes sense, and reads back bit for bit.

use boresight::{
    calibration::{
        export::{CameraFormat, ExportedCamera, kalibr_camchain},
        import::{self, OldCalibration},
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

/// Size that a person states.
const SIZE: ImageSize = ImageSize { width_px: 640, height_px: 480 };

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
    let others = OTHERS.into_iter().map(str::to_owned);
    [calibration().to_string(), kalibr, with_corners()]
        .into_iter()
        .chain(others)
        .chain(written)
        .collect()
}

/// Files of other programs that none of ours are like: of two cameras, without a size, by a
/// fisheye's own name, with corners, and those of other lens models.
const OTHERS: [&str; 8] = [
    r#"%YAML:1.0
---
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 320., 0., 500., 240., 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.1, 0.02, 0., 0., 0. ]
M2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 510., 0., 322., 0., 510., 241., 0., 0., 1. ]
"#,
    "mtx: [[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]]\ndist: [[0.1, 0, 0, 0, 0]]\n",
    r#"{"fl_x": 331.0, "fl_y": 331.0, "cx": 320.0, "cy": 240.0, "w": 640, "h": 480,
    "k1": 0.03, "k2": -0.01, "k3": 0.0, "k4": 0.0, "is_fisheye": true, "frames": []}"#,
    "pinhole:\n  fx: 529.0\n  fy: 529.0\n  cx: 320.0\nmodel: pinhole_radial_tangential\n",
    "K: [500, 0, 320, 0, 500, 240, 0, 0, 1]\nD: [0, 0, 0, 0]\nxi: 1.2\n",
    "Intrinsic of \"Depth\" / 640x480 / {Z16}\n  PPX: 320.1\n  PPY: 240.2\n  Fx: 380\n  Fy: 380\n",
    r#"{"resolution": {"width": 640, "height": 480},
    "cameraIntrinsics": {"rows": 3, "cols": 3, "data": [600, 0, 321, 0, 600, 238, 0, 0, 1]},
    "distCoeffs": {"rows": 1, "cols": 5, "data": [0.1, 0, 0, 0, 0]}, "calobjectSpacing": 0.025,
    "observations": [{"locationInObjectSpace": [{"x": 0, "y": 0, "z": 0},
    {"x": 0.025, "y": 0, "z": 0}, {"x": 0, "y": 0.025, "z": 0}, {"x": 0.025, "y": 0.05, "z": 0}],
    "locationInImageSpace": [{"x": 9, "y": 7}, {"x": 39, "y": 7}, {"x": 9, "y": 30},
        {"x": 39, "y": 55}]}]}"#,
    "#polynomial coefficients for the DIRECT mapping function\n5 -1 0 1 2 3\n",
];

/// A file of OpenCV's sample with its corners.
fn with_corners() -> String {
    let corners: Vec<String> =
        (0..24).map(|at| format!("{} {}.5", 9 + 30 * (at % 4), 5 + 7 * at)).collect();
    format!(
        "<?xml version=\"1.0\"?><opencv_storage>\n<nframes>2</nframes>\n<image_width>640\
         </image_width>\n<image_height>480</image_height>\n<board_width>4</board_width>\n\
         <board_height>3</board_height>\n<square_size>0.025</square_size>\n<camera_matrix \
         type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt>\n<data>600. 0. 321. 0. \
         600. 238. 0. 0. 1.</data></camera_matrix>\n<distortion_coefficients \
         type_id=\"opencv-matrix\"><rows>5</rows><cols>1</cols>\n<dt>d</dt><data>-.1 .1 0. 0. 0.\
         </data></distortion_coefficients>\n<image_points type_id=\"opencv-matrix\"><rows>2</rows>\
         <cols>12</cols>\n<dt>\"2f\"</dt><data>{}</data></image_points>\n</opencv_storage>",
        corners.join(" ")
    )
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
            let text = String::from_utf8_lossy(input);
            let stated = import::read_sized(&text, Some(SIZE));
            if let Ok(old) = &stated
                && old.image_size != SIZE
            {
                return Err(format!("another size than stated: {:?}", old.image_size));
            }
            let old = match import::read(&text).or(stated) {
                Ok(old) => old,
                Err(err) => {
                    return if err.to_string().is_empty() {
                        Err("no words".into())
                    } else {
                        Ok(false)
                    };
                }
            };
            if let Some(own) = &old.corners {
                let count = own.board.corner_count();
                let views = own.views.iter().filter_map(|view| view.corners.as_ref());
                for corners in views {
                    if corners.len() != count {
                        return Err(format!("{} corners of {count}", corners.len()));
                    }
                    let mut seen = corners.iter().filter(|corner| corner.is_seen());
                    if !seen.all(|corner| corner.px.iter().all(|px| px.is_finite())) {
                        return Err("a corner that is nowhere".into());
                    }
                }
            }
            // A corner that wasn't seen has no place.
            let old = OldCalibration { corners: None, ..old };
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
                if !format.is_read() {
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
