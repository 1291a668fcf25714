//! Calibrations in the formats of other programs; our own exports read back; hostile texts.

use boresight_calibrate::Verdict;
use boresight_formats::{
    export::{ExportedCamera, kalibr_camchain, mrcal_cameramodel, opencv_yaml, ros_camera_info},
    import::{MAX_BYTES, NotImported, OldCalibration, OldFormat, read, read_sized},
};
use boresight_geometry::{BROWN_PARAMETERS, Camera, LENS_PARAMETERS, LensKind, frame::ImageSize};
use proptest::prelude::*;

/// Written by OpenCV 4's calibration sample.
const OPENCV: &str = r#"%YAML:1.0
---
calibration_time: "Tue 14 May 2024 10:12:01 AM CEST"
nr_of_frames: 13
image_width: 640
image_height: 480
board_width: 9
board_height: 6
square_size: 2.5000000000000001e-02
# flags: +fix_aspectRatio
fix_aspect_ratio: 1.
flags: 2
fisheye_model: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3591573396163199e+02, 0., 3.4228315473308373e+02, 0.,
       5.3591573396163199e+02, 2.3557082909788173e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.6637260909660682e-01, -3.8588898922304653e-02,
       1.7831947042852964e-03, -2.8122100441115472e-04,
       2.3839153080878486e-01 ]
avg_reprojection_error: 3.9202404290381253e-01
per_view_reprojection_errors: !!opencv-matrix
   rows: 2
   cols: 1
   dt: f
   data: [ 1.92965463e-01, 1.08040072e+00 ]
image_points: !!opencv-matrix
   rows: 1
   cols: 2
   dt: "2f"
   data: [ 2.44406021e+02, 9.17690582e+01, 2.74571960e+02, 9.21737366e+01 ]
"#;

/// Written by OpenCV 5's FileStorage.
const OPENCV_JSON: &str = r#"{
    "calibration_time": "Tue 11 Nov 2026 10:00:00 AM",
    "image_width": 640,
    "image_height": 480,
    "camera_matrix": {
        "type_id": "opencv-matrix",
        "rows": 3,
        "cols": 3,
        "dt": "d",
        "data": [ 535.91573396163199, 0.0, 342.28315473308373, 0.0,
            535.91573396163199, 235.57082909788173, 0.0, 0.0, 1.0 ]
    },
    "distortion_coefficients": {
        "type_id": "opencv-matrix",
        "rows": 1,
        "cols": 5,
        "dt": "d",
        "data": [ -0.26637260909660682, -0.038588898922304653,
            0.0017831947042852964, -0.00028122100441115472,
            0.23839153080878486 ]
    }
}
"#;

/// Written by ROS's camera_calibration.
const ROS: &str = "image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [535.91573, 0.     , 342.28315,
           0.     , 536.0123, 235.57083,
           0.     , 0.     , 1.     ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.266373, -0.038589, 0.001783, -0.000281, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0.,
         0., 1., 0.,
         0., 0., 1.]
projection_matrix:
  rows: 3
  cols: 4
  data: [490.15, 0.     , 343.66, 0.     ,
           0.     , 507.67, 235.92, 0.     ,
           0.     , 0.     , 1.     , 0.     ]
";

/// Written by Kalibr for two cameras.
const KALIBR: &str = "cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.2834, 0.0739, 0.00019359, 1.76187114e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.9999, 0.0023, 0.0003, -0.1100]
  - [-0.0023, 0.9998, 0.0140, 0.0003]
  - [-0.0003, -0.0140, 0.9999, -0.0008]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [-0.2836, 0.0745, -0.0001, -3.5e-05]
  distortion_model: radtan
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
";

/// Written by mrcal.
const MRCAL: &str = "# generated on 2024-05-14 10:12:01 with   mrcal-calibrate-cameras --lensmodel LENSMODEL_OPENCV5
{
    'lensmodel':  'LENSMODEL_OPENCV5',

    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....
    'intrinsics': [ 1761.181055, 1761.250444, 1965.706996, 1087.518797, -0.01266096516, 0.03590794372, -0.0002547045941, 0.0005275929652, 0.01968883397,],

    'valid_intrinsics_region': [
    [ 17, 23 ],
    [ 3000, 23 ],
    [ 17, 2000 ],
    ],

    # extrinsics are rt_fromref
    'extrinsics': [ 0, -0., 1e-05, 0.1, -2.5, 3,],

    'imagersize': [ 6016, 4016,],

    'icam_intrinsics': 0,

    # The optimization_inputs contain all the data used to compute this model.
    'optimization_inputs': b'P)h>@6aWAK2mk;8K>z@;00000000000001Z003fPa%E{{VR>J2Uw=S{#~}]',
}
";

/// Written by boresight, shortened.
const OWN: &str = r#"{ "schema": "boresight.calibration/1", "image_size": [1280, 720],
  "board": { "columns": 9, "rows": 6, "square_mm": 25.0 }, "verdict": "care", "findings": [], "source": "sim:random:7",
  "result": { "model": "k1k2", "focal": { "varies": false }, "f_px": [980.1, 980.1], "pp_px": [653.4, 348.2],
    "distortion": { "k1": -0.12, "k2": 0.05, "p1": 0.0, "p2": 0.0, "k3": 0.0 },
    "covariance": { "order": ["f", "cx", "cy", "k1", "k2"],
      "matrix": [[4, 0.5, 0, 0, 0], [0.5, 1, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 0, 1e-6, 0], [0, 0, 0, 0, 1e-6]] },
    "rms_px": 0.2 },
  "views": [{ "name": "0.png", "used": true, "outline_px": [[100, 100], [900, 120], [880, 600], [110, 590]] },
            { "name": "1.png", "used": false }] }"#;

const SAMPLES: [&str; 6] = [OPENCV, OPENCV_JSON, ROS, KALIBR, MRCAL, OWN];

fn old(text: &str) -> OldCalibration {
    read(text).expect("a calibration")
}

fn size(width_px: u32, height_px: u32) -> ImageSize {
    ImageSize { width_px, height_px }
}

/// Refusal of `text`, in words.
fn refused(text: &str) -> String {
    read(text).expect_err("refused").to_string()
}

#[test]
fn opencv_is_read_to_the_last_digit() {
    // As printed with one digit more than a double needs.
    let lens = [
        "535.91573396163199",
        "535.91573396163199",
        "342.28315473308373",
        "235.57082909788173",
        "-0.26637260909660682",
        "-0.038588898922304653",
        "0.0017831947042852964",
        "-0.00028122100441115472",
        "0.23839153080878486",
    ]
    .map(|digits| digits.parse::<f64>().expect("a number"));
    for text in [OPENCV, OPENCV_JSON] {
        let old = old(text);
        assert_eq!((old.format, old.image_size), (OldFormat::OpenCv, size(640, 480)));
        assert_eq!(old.camera.lens_parameters()[..BROWN_PARAMETERS], lens);
        assert_eq!((old.covariance, old.outlines.len()), (None, 0));
    }
    assert_eq!(old(OPENCV).rms_px, Some(0.392_024_042_903_812_53));
    // The same under the names of samples, tutorials and Python programs, four coefficients, no
    // matrices.
    let dumped = r#"{"mtx": [[800.5, 0, 320], [0, 801, 240], [0, 0, 1]], "dist": [[-0.1, 0.02, 0, 0.001]], "img_size": [640, 480]}"#;
    assert_eq!(
        old(dumped).camera.lens_parameters()[..BROWN_PARAMETERS],
        [800.5, 801.0, 320.0, 240.0, -0.1, 0.02, 0.0, 0.001, 0.0]
    );
    let tutorial = OPENCV
        .replace("camera_matrix", "Camera_Matrix")
        .replace("distortion_coefficients", "Distortion_Coefficients")
        .replace("image_width", "image_Width");
    assert_eq!(old(&tutorial).camera, old(OPENCV).camera);
    // OpenCV 3 wrote JSON with bare points.
    assert_eq!(old(&OPENCV_JSON.replace("1.0 ]", "1. ]")).camera, old(OPENCV).camera);
}

#[test]
fn the_rational_model_is_read_and_more_is_refused() {
    let eight = |last: &str| {
        OPENCV
            .replace("rows: 5", &format!("rows: {}", 5 + last.split(',').count()))
            .replace("2.3839153080878486e-01 ]", &format!("2.3839153080878486e-01, {last} ]"))
    };
    assert_eq!(old(&eight("0., 0., 0.")).camera, old(OPENCV).camera);
    assert_eq!(old(&eight("0.25, 0., -0.5")).camera.lens_parameters()[9..], [0.25, 0.0, -0.5]);
    let words = refused(&eight("0., 0., 0., 0.001, 0., 0., 0."));
    assert!(words.contains("s1 = 0.001") && words.contains("only pinholes"), "{words}");
}

#[test]
fn ros_is_read() {
    let found = old(ROS);
    assert_eq!((found.format, found.image_size), (OldFormat::Ros, size(640, 480)));
    assert_eq!(
        found.camera.lens_parameters()[..BROWN_PARAMETERS],
        [535.91573, 536.0123, 342.28315, 235.57083, -0.266373, -0.038589, 0.001783, -0.000281, 0.0]
    );
    assert_eq!(found.source.as_deref(), Some("narrow_stereo"));
    // Older files do not name the model; ROS takes them for plumb_bob.
    assert_eq!(old(&ROS.replace("distortion_model: plumb_bob\n", "")).camera, found.camera);
    // As `rostopic echo` prints the message.
    let echoed = "header:\n  seq: 1\n  frame_id: \"cam\"\nheight: 480\nwidth: 640\ndistortion_model: \"plumb_bob\"\nD: [-0.1, 0.02, 0.0, 0.001, 0.0]\nK: [800.5, 0.0, 320.0, 0.0, 801.0, 240.0, 0.0, 0.0, 1.0]\nR: [1.0]\nbinning_x: 0\n---\n";
    assert_eq!(old(echoed).camera.lens_parameters()[..4], [800.5, 801.0, 320.0, 240.0]);
    assert_eq!(old(&ROS.replace("plumb_bob", "rational_polynomial")).camera, found.camera);
    assert!(refused(&ROS.replace("plumb_bob", "thin_prism_fisheye")).contains("thin_prism"));
    // Of five coefficients: no fisheye lens has them.
    let words = refused(&ROS.replace("plumb_bob", "equidistant"));
    assert!(words.contains("4 finite numbers"), "{words}");
}

#[test]
fn kalibr_is_read_and_says_how_many_cameras_there_are() {
    let found = old(KALIBR);
    assert_eq!((found.format, found.image_size), (OldFormat::Kalibr, size(752, 480)));
    assert_eq!(
        found.camera.lens_parameters()[..BROWN_PARAMETERS],
        [458.654, 457.296, 367.215, 248.375, -0.2834, 0.0739, 0.00019359, 1.76187114e-05, 0.0]
    );
    assert_eq!((found.camera_count, found.source.as_deref()), (2, Some("/cam0/image_raw")));
    let fisheye = old(&KALIBR.replace("radtan", "equidistant")).camera.distortion;
    assert_eq!((fisheye.kind, fisheye.p1), (LensKind::Fisheye, 0.0));
    assert_eq!([fisheye.k1, fisheye.k2, fisheye.k3], [-0.2834, 0.0739, 0.00019359]);
    assert_eq!(fisheye.k4, 1.76187114e-05);
    assert!(refused(&KALIBR.replace(": pinhole", ": omni")).contains("omni-radtan"));
}

#[test]
fn mrcal_is_read() {
    let found = old(MRCAL);
    assert_eq!((found.format, found.image_size), (OldFormat::Mrcal, size(6016, 4016)));
    let lens = found.camera.lens_parameters();
    assert_eq!(lens[..4], [1761.181055, 1761.250444, 1965.706996, 1087.518797]);
    assert_eq!((lens[4], lens[8]), (-0.01266096516, 0.01968883397));
    let eight = MRCAL
        .replace("'LENSMODEL_OPENCV5'", "'LENSMODEL_OPENCV8'")
        .replace("0.01968883397,]", "0.01968883397, 0, 0., -0.,]");
    assert_eq!(old(&eight).camera, found.camera);
    assert_eq!(old(&eight.replace("0.,", "1e-3,")).camera.distortion.k5, 1e-3);
    let splined = "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=30_Ny=20_fov_x_deg=170";
    assert!(
        refused(&MRCAL.replace("LENSMODEL_OPENCV5'", &format!("{splined}'"))).contains(splined)
    );
    // The numbers must be those of the model.
    assert!(
        refused(&MRCAL.replace("'LENSMODEL_OPENCV5'", "'LENSMODEL_OPENCV4'"))
            .contains("intrinsics")
    );
}

#[test]
fn our_own_brings_covariance_and_where_the_boards_were() {
    let found = old(OWN);
    assert_eq!((found.format, found.image_size), (OldFormat::Own, size(1280, 720)));
    assert_eq!(
        found.camera.lens_parameters()[..BROWN_PARAMETERS],
        [980.1, 980.1, 653.4, 348.2, -0.12, 0.05, 0.0, 0.0, 0.0]
    );
    let covariance = found.covariance.expect("covariance");
    // One f is both fx and fy.
    assert_eq!((covariance[(0, 1)], covariance[(1, 2)], covariance[(4, 4)]), (4.0, 0.5, 1e-6));
    assert_eq!(covariance[(8, 8)], 0.0);
    assert_eq!(found.outlines.len(), 1);
    assert_eq!(found.verdict, Some(Verdict::Care));
    assert_eq!(found.board.map(|board| (board.columns(), board.square_m())), Some((9, 0.025)));
    assert_eq!(found.source.as_deref(), Some("sim:random:7"));
    assert_eq!(
        read(&OWN.replace("boresight.calibration/1", "boresight.calibration/9")),
        Err(NotImported::Schema { found: "boresight.calibration/9".into() })
    );
    // Additions of a later version are skipped; fields of this one may be missing.
    let later = OWN.replace("\"rms_px\": 0.2", "\"shutter\": { \"rolls\": true }");
    let later = read(&later).expect("a calibration");
    assert_eq!((later.camera, later.rms_px), (found.camera, None));
    // An invalid covariance is not used.
    let negative = read(&OWN.replace("[[4, ", "[[-4, ")).expect("a calibration");
    assert_eq!(negative.covariance, None);
    let none =
        r#"{ "schema": "boresight.calibration/1", "image_size": [1280, 720], "result": null }"#;
    assert_eq!(read(none), Err(NotImported::NoResult));
}

#[test]
fn a_fisheye_of_instant_ngp_is_read_as_a_fisheye() {
    // As instant-ngp's colmap2nerf.py writes SIMPLE_RADIAL_FISHEYE and OPENCV_FISHEYE.
    let file = |k4: f64, more: &str| {
        format!(
            r#"{{"camera_angle_x": 1.2, "fl_x": 331.0, "fl_y": 331.0, "k1": 0.03, "k2": 0, "k3": 0,
            "k4": {k4}, "p1": 0, "p2": 0, "cx": 320.0, "cy": 240.0, "w": 640, "h": 480{more}}}"#
        )
    };
    for k4 in [0.0, 1e-3] {
        let lens = old(&file(k4, r#", "is_fisheye": true"#)).camera.distortion;
        assert_eq!((lens.kind, lens.k1, lens.k4), (LensKind::Fisheye, 0.03, k4));
    }
    let plain = old(&file(0.0, r#", "is_fisheye": false"#));
    assert_eq!(plain.camera.distortion.kind, LensKind::Perspective);
    let both = file(0.0, r#", "is_fisheye": true, "camera_model": "OPENCV""#);
    assert!(refused(&both).contains("OPENCV with is_fisheye"));
    assert!(refused(&file(0.0, r#", "ftheta_p0": 1"#)).contains("ftheta"));
}

#[test]
fn a_size_that_a_file_lacks_is_stated_by_a_person() {
    // As OpenCV's tutorial in Python saves with PyYAML.
    let bare = "camera_matrix: [[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]]
dist_coeff: [[0.1, -0.2, 0.0, 0.0, 0.01]]
";
    let stated = Some(size(640, 480));
    assert_eq!(read(bare), Err(NotImported::NoSize));
    let lens = read_sized(bare, stated).expect("with a size");
    assert_eq!((lens.image_size, lens.camera.distortion.k3), (size(640, 480), 0.01));
    // The file's own size is never overruled.
    assert_eq!(read_sized(OPENCV, stated), read(OPENCV));
    let other = NotImported::OtherSize { found: size(640, 480), stated: size(1280, 960) };
    assert_eq!(read_sized(OPENCV, Some(size(1280, 960))), Err(other));
    let nerf = r#"{"fl_x": 331.0, "fl_y": 331.0, "cx": 320.0, "cy": 240.0}"#;
    assert_eq!(read(nerf), Err(NotImported::NoSize));
    assert_eq!(read_sized(nerf, stated).expect("with a size").image_size, size(640, 480));
}

#[test]
fn the_first_camera_of_a_stereo_pair_is_read() {
    let matrix = |f: f64| format!("[[{f}, 0.0, 320.0], [0.0, {f}, 240.0], [0.0, 0.0, 1.0]]");
    for [k, d] in [["K", "D"], ["M", "D"], ["camera_matrix_", "dist_coeffs_"], ["mtx", "dist"]] {
        let pair = format!(
            "{k}1: {}\n{d}1: [0.1, 0.0, 0.0, 0.0]\n{k}2: {}\n{d}2: [0.2, 0.0, 0.0, 0.0]\nR: [1.0]\n",
            matrix(500.0),
            matrix(600.0)
        );
        let read = read_sized(&pair, Some(size(640, 480))).expect(k);
        assert_eq!((read.camera.f_px.x, read.camera.distortion.k1), (500.0, 0.1), "{k}");
        assert_eq!(read.camera_count, 2, "{k}");
    }
}

#[test]
fn calibrations_of_other_lens_models_are_refused_by_name() {
    let boofcv = "pinhole:\n  fx: 529.0\n  cx: 320.0\nmodel: pinhole_radial_tangential\n";
    let omnidir = "K: [500, 0, 320, 0, 500, 240, 0, 0, 1]\nD: [0, 0, 0, 0]\nxi: 1.2\n";
    let realsense = "Intrinsic of \"Depth\" / 640x480 / {Z16}\n  PPX: 320.1\n  PPY: 240.2\n  Fx: 380\n  Fy: 380\n  Distortion: Brown Conrady\n  Coeffs: 0 0 0 0 0\n";
    for (text, program) in [
        (boofcv, "BoofCV"),
        (omnidir, "omnidir"),
        (realsense, "RealSense"),
        ("{\"ppx\": 1, \"ppy\": 1, \"fx\": 1}", "RealSense"),
        ("#polynomial coefficients for the DIRECT mapping function\n5 -1\n", "OCamCalib"),
        ("% Camera front, written by boresight\nK = [1 2 3];\n", "MATLAB"),
    ] {
        assert!(refused(text).contains(program), "{}", refused(text));
    }
}

#[test]
fn what_no_camera_has_is_refused() {
    for (text, from, to, word) in [
        (OPENCV, "image_width: 640", "image_width: -640", "size is -640"),
        (OPENCV, "image_width: 640", "image_width: 640.5", "640.5"),
        (OPENCV, "image_width: 640", "image_width: .nan", "how large"),
        (OPENCV, "image_width: 640\n", "", "how large"),
        (OPENCV, "data: [ 5.3591573396163199e+02", "data: [ .inf", "camera matrix"),
        (OPENCV, "data: [ 5.3591573396163199e+02", "data: [ -5.3", "fx is -5.3"),
        (OPENCV, "data: [ 5.3591573396163199e+02, 0.", "data: [ 535.9, 1.5", "skew is 1.5"),
        (OPENCV, "rows: 3", "rows: 4", "camera matrix"),
        (OPENCV, "rows: 3", "rows: -3", "camera matrix"),
        (OPENCV, "data: [ -2.6637260909660682e-01", "data: [ 1e999", "distortion_coefficients"),
        (OPENCV, "fisheye_model: 0", "fisheye_model: 1", "4 finite numbers"),
        (ROS, "-0.266373", "nan", "distortion_coefficients"),
        (KALIBR, "[458.654", "[[458.654]", "intrinsics"),
        (KALIBR, "resolution: [752, 480]", "resolution: [752]", "resolution"),
        (MRCAL, "1761.181055", "1e999", "line 6"),
        (MRCAL, "6016", "0", "size is 0"),
        (OWN, "980.1", "0.5", "fx is 0.5"),
        (OWN, "980.1", "1e999", "result.f_px[0]: invalid type: null"),
        (OWN, "980.1", "null", "result.f_px[0]: invalid type: null"),
        (OWN, "980.1, 980.1", "980.1", "result.f_px: invalid length 1"),
        (OWN, "[653.4", "[\"653.4\"", "result.pp_px[0]: invalid type: string"),
        (OWN, "\"k2\": 0.05, ", "", "result.distortion: missing field `k2`"),
        (OWN, "1280", "-1280", "image_size[0]: invalid value: integer `-1280`"),
        (OWN, "1280", "4000000", "size is 4000000"),
        (OWN, "\"image_size\"", "\"size\"", "missing field `image_size`"),
    ] {
        let words = refused(&text.replacen(from, to, 1));
        assert!(words.contains(word), "{word:?} not in {words:?}");
    }
}

#[test]
fn what_is_no_calibration_is_told_which_formats_there_are() {
    for text in [
        "",
        "dear",
        "# nothing\n",
        "a: 1\nb: [2]\n",
        "{}",
        "[1, 2]",
        "<?xml version=\"1.0\"?>\n<a/>",
    ] {
        let words = refused(text);
        for format in ["calibration.json", "OpenCV", "ROS", "Kalibr", "mrcal"] {
            assert!(words.contains(format), "{text:?}: {words}");
        }
    }
    let long = " ".repeat(MAX_BYTES + 1);
    assert_eq!(read(&long), Err(NotImported::TooLong { bytes: MAX_BYTES + 1 }));
    for deep in ["{", "[", "- ", "{\"a\":", "{'lensmodel':", "a: {b: [", "(", "? "] {
        assert!(read(&deep.repeat(100_000)).is_err(), "{deep}");
    }
    let mut laughs = String::from("a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1]\n");
    for i in 1..12 {
        let aliases = vec![format!("*a{}", i - 1); 8].join(", ");
        laughs += &format!("a{i}: &a{i} [{aliases}]\n");
    }
    assert!(read(&laughs).is_err());
}

/// Possible lenses of a camera, with every bit used.
fn lens() -> impl Strategy<Value = [f64; LENS_PARAMETERS]> {
    (
        prop::array::uniform2(1.1..1e5),
        prop::array::uniform2(-1e4..1e4),
        prop::array::uniform8(-1e3..1e3),
    )
        .prop_map(|([fx, fy], [cx, cy], [k1, k2, p1, p2, k3, k4, k5, k6])| {
            [fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6]
        })
}

proptest! {
    #[test]
    fn exports_read_back_bit_for_bit(lens in lens(), zeros in 0_usize..9, width_px in 1_u32..100_000, height_px in 1_u32..100_000) {
        let mut lens = lens;
        lens[LENS_PARAMETERS - zeros..].fill(0.0);
        let exported = ExportedCamera {
            name: "front camera",
            camera: Camera::from_lens_parameters(LensKind::Perspective, &lens),
            image_size: size(width_px, height_px),
            rms_px: 0.1 + 0.2,
        };
        let back = |text: &str, format| {
            let old = old(text);
            prop_assert_eq!((old.format, old.image_size), (format, exported.image_size));
            prop_assert_eq!(old.camera, exported.camera);
            Ok(())
        };
        back(&opencv_yaml(&exported), OldFormat::OpenCv)?;
        back(&ros_camera_info(&exported), OldFormat::Ros)?;
        back(&mrcal_cameramodel(&exported).expect("perspective"), OldFormat::Mrcal)?;
        match kalibr_camchain(&exported) {
            Ok(yaml) => {
                prop_assert!(zeros > 3);
                back(&yaml, OldFormat::Kalibr)?;
            }
            Err(_) => prop_assert!(zeros <= 3),
        }
    }

    #[test]
    fn fisheye_lenses_read_back_bit_for_bit(lens in lens()) {
        let mut lens = lens;
        for i in [6, 7, 10, 11] {
            lens[i] = 0.0;
        }
        let exported = ExportedCamera {
            name: "front camera",
            camera: Camera::from_lens_parameters(LensKind::Fisheye, &lens),
            image_size: size(1280, 960),
            rms_px: 0.25,
        };
        for (text, format) in [
            (opencv_yaml(&exported), OldFormat::OpenCv),
            (ros_camera_info(&exported), OldFormat::Ros),
            (kalibr_camchain(&exported).expect("equidistant"), OldFormat::Kalibr),
        ] {
            let old = old(&text);
            prop_assert_eq!(old.format, format);
            prop_assert_eq!(old.camera, exported.camera);
        }
        prop_assert!(mrcal_cameramodel(&exported).is_err());
    }

    #[test]
    fn any_text_is_read_or_refused(text in "(?s).{0,200}") {
        let _ = read(&text);
    }

    #[test]
    fn brackets_and_quotes_are_read_or_refused(text in "[-{}\\[\\]()'\",:#b\\\\ \n0-9.eé&*!|>%?a]{0,80}", kind in 0_usize..3) {
        let _ = read(&format!("{}{text}", ["", "{'lensmodel': ", "%YAML:1.0\n---\n"][kind]));
    }

    #[test]
    fn a_damaged_calibration_is_read_or_refused(
        sample in 0..SAMPLES.len(), at in 0.0..1.0_f64, cut in 0_usize..40, put in "(?s).{0,8}",
    ) {
        let text: Vec<char> = SAMPLES[sample].chars().collect();
        let from = (at * text.len() as f64) as usize;
        let to = (from + cut).min(text.len());
        let damaged: String =
            text[..from].iter().copied().chain(put.chars()).chain(text[to..].iter().copied()).collect();
        if let Ok(old) = read(&damaged) {
            // Accepted input is a camera.
            prop_assert!(old.camera.f_px.min() > 1.0);
            prop_assert!(old.camera.lens_parameters().iter().all(|value| value.is_finite()));
            prop_assert!(old.image_size.width_px > 0 && old.image_size.height_px > 0);
        }
    }
}
