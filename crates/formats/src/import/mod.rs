//! Reads calibrations of boresight and other programs.
//!
//! | format | recognised by | holds in addition |
//! |---|---|---|
//! | `boresight.calibration/1` (`own`) | its schema | covariance, outlines, verdict, board |
//! | OpenCV YAML and JSON (`matrices`) | a camera matrix, one or two | number of cameras; corners (`own_corners`) |
//! | ROS `camera_info` (`matrices`) | a camera matrix, and a name of ROS | rectification |
//! | Kalibr camchain (`kalibr`) | `cam0` | number of cameras |
//! | mrcal `.cameramodel` (`mrcal`) | `lensmodel` | – |
//! | OpenCV XML (`xml`, `matrices`) | `<opencv_storage>` | corners (`own_corners`) |
//! | Metashape (`xml`, `named`) | `<calibration>` | – |
//! | RealityCapture XMP (`xml`, `named`) | `<x:xmpmeta>` | – |
//! | COLMAP `cameras.txt` (`colmap`) | a line of number, model, numbers | number of cameras |
//! | ORB-SLAM3 (`named`) | `Camera.type` | – |
//! | `transforms.json` (`named`) | `fl_x` | – |
//! | Basalt (`named`) | `value0` | number of cameras |
//! | VINS (`named`) | `model_type` | – |
//! | PhotonVision (`named`) | `cameraIntrinsics` | corners (`own_corners`) |
//! | Gyroflow (`named`) | `fisheye_params` | – |
//! | Open3D (`named`) | `intrinsic_matrix` as one list | – |
//!
//! ```text
//! text ─ syntax: JSON, YAML, or mrcal's Python literal (literal) ─▶ tree ─ one reader a format ─▶
//! OldCalibration
//! ```
//!
//! A file of OpenCV, ORB-SLAM3, RealityCapture (in `tiff:` or `exif:`) or `transforms.json` may
//! lack the picture's size, and a person states it. boresight's own file also holds the source. The
//! names of ROS are `distortion_model`, `camera_name` and `projection_matrix`. Open3D's file has no
//! distortion. Programs with other lens models are known by name (`unread`).
//!
//! Most of them put (0, 0) at the centre of the top-left pixel and use OpenCV's lens models, like
//! boresight, so numbers are kept bit for bit. COLMAP, `transforms.json`, Metashape and
//! RealityCapture count from elsewhere: there the principal point is rounded once. A lens with more
//! coefficients than k1, k2, p1, p2, k3, k4, k5, k6 is refused, never truncated. Text comes in,
//! numbers go out; nothing here opens a file.

mod colmap;
mod file_doubt;
mod kalibr;
mod literal;
mod matrices;
mod mrcal;
mod named;
mod numbers;
mod old_calibration;
mod own;
mod own_corners;
mod syntax;
mod unread;
mod xml;

use boresight_geometry::{frame::ImageSize, panic_message::caught};

#[doc(hidden)]
pub use file_doubt::FileDoubt;
#[doc(hidden)]
pub use old_calibration::{LockedLens, OwnCorners};
pub use old_calibration::{NotImported, OldCalibration, OldFormat};

/// Longest text allowed. A calibration has kilobytes; mrcal's, with every observation, has
/// megabytes.
pub const MAX_BYTES: usize = 16 << 20;

/// Reads a calibration in any of the formats, recognised by content.
///
/// # Errors
///
/// [`NotImported`].
///
/// ```
/// # use boresight_formats::import::read;
/// let camera_info = "\
/// image_width: 640
/// image_height: 480
/// camera_name: left
/// camera_matrix: {rows: 3, cols: 3, data: [500.0, 0, 320.0, 0, 500.0, 240.0, 0, 0, 1]}
/// distortion_model: plumb_bob
/// distortion_coefficients: {rows: 1, cols: 5, data: [-0.1, 0, 0, 0, 0]}
/// ";
/// let old = read(camera_info)?;
/// assert_eq!(old.camera.f_px.x, 500.0);
/// assert_eq!(old.camera.distortion.k1, -0.1);
/// # Ok::<(), boresight_formats::import::NotImported>(())
/// ```
pub fn read(text: &str) -> Result<OldCalibration, NotImported> {
    read_sized(text, None)
}

/// Reads a calibration as [`read`], with the picture's size for a file that doesn't state it.
///
/// # Errors
///
/// [`NotImported`], also if the file states another size.
pub fn read_sized(
    text: &str,
    image_size: Option<ImageSize>,
) -> Result<OldCalibration, NotImported> {
    if text.len() > MAX_BYTES {
        return Err(NotImported::TooLong { bytes: text.len() });
    }
    let size = image_size.map(|size| [size.width_px, size.height_px].map(f64::from));
    // Third-party parsers may panic.
    let read = caught(|| calibration(text, size));
    let mut old = read.map_err(|reason| NotImported::Malformed { reason })??;
    if let Some(stated) = image_size.filter(|stated| *stated != old.image_size) {
        return Err(NotImported::OtherSize { found: old.image_size, stated });
    }
    // No residual is negative: a negative number means something else.
    old.rms_px = old.rms_px.filter(|rms_px| *rms_px >= 0.0 && rms_px.is_finite());
    Ok(old)
}

fn calibration(text: &str, size: Option<[f64; 2]>) -> Result<OldCalibration, NotImported> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.trim_start().starts_with('<') {
        let (root, tree) = xml::parse(text)?;
        return match root.as_str() {
            "opencv_storage" => matrices::read(&tree, size),
            "calibration" => named::metashape(&tree),
            "xmpmeta" => named::realitycapture(&tree, size),
            _ => Err(NotImported::UnknownFormat),
        };
    }
    if colmap::recognises(text) {
        return colmap::read(text);
    }
    if let Some(program) = unread::by_text(text) {
        return Err(NotImported::Unread { program });
    }
    let tree = syntax::parse(text)?;
    let has = |name| tree.get(name).is_some();
    if tree["schema"].as_str().is_some_and(|schema| schema.starts_with("boresight.")) {
        return own::read(&tree);
    }
    let is_open3d = || {
        let distortion = ["distortion_coefficients", "dist_coeffs", "distortion", "dist"];
        tree["intrinsic_matrix"][0].is_number() && !distortion.into_iter().any(has)
    };
    if has("cameraIntrinsics") {
        named::photonvision(&tree)
    } else if has("lensmodel") {
        mrcal::read(&tree)
    } else if has("cam0") {
        kalibr::read(&tree)
    } else if has("Camera.type") {
        named::orb_slam(&tree, size)
    } else if has("fl_x") {
        named::nerf(&tree, size)
    } else if has("value0") {
        named::basalt(&tree)
    } else if has("model_type") {
        named::vins(&tree)
    } else if has("fisheye_params") {
        named::gyroflow(&tree)
    } else if is_open3d() {
        named::open3d(&tree)
    } else if let Some(program) = unread::by_tree(&tree) {
        Err(NotImported::Unread { program })
    } else {
        matrices::read(&tree, size)
    }
}
