//! Reads calibrations that this and other programs wrote.
//!
//! | format | recognised by | holds in addition to lens and picture size |
//! |---|---|---|
//! | `boresight.calibration/1` (`own`) | its schema | covariance, where the boards were, verdict, board, source |
//! | OpenCV YAML and JSON (`matrices`) | a camera matrix | – |
//! | ROS `camera_info` (`matrices`) | a camera matrix, and a `distortion_model`, `camera_name` or `projection_matrix` | – |
//! | Kalibr camchain (`kalibr`) | `cam0` | how many cameras there are |
//! | mrcal `.cameramodel` (`mrcal`) | `lensmodel` | – |
//!
//! ```text
//! text ─ syntax: JSON, YAML, or mrcal's Python literal (literal) ─▶ tree ─ one reader a format ─▶ OldCalibration
//! ```
//!
//! All of them put (0, 0) at the centre of the top-left pixel and use OpenCV's lens models, as this program does, so numbers
//! are kept bit for bit. A lens that needs more than k1, k2, p1, p2, k3, k4, k5, k6 is refused, never truncated. Text comes in, numbers go out; nothing here opens a file.

mod kalibr;
mod literal;
mod matrices;
mod mrcal;
mod numbers;
mod old_calibration;
mod own;
mod syntax;

pub use old_calibration::{LockedLens, NotImported, OldCalibration, OldFormat};

/// Longest text that is read. A calibration has kilobytes; mrcal's, with every observation, has megabytes.
pub const MAX_BYTES: usize = 16 << 20;

/// Reads a calibration in any of the formats, recognised by its content.
///
/// # Errors
///
/// [`NotImported`].
pub fn read(text: &str) -> Result<OldCalibration, NotImported> {
    if text.len() > MAX_BYTES {
        return Err(NotImported::TooLong { bytes: text.len() });
    }
    let tree = syntax::parse(text)?;
    let mut old = if tree["schema"].as_str().is_some_and(|schema| schema.starts_with("boresight."))
    {
        own::read(&tree)
    } else if tree.get("lensmodel").is_some() {
        mrcal::read(&tree)
    } else if tree.get("cam0").is_some() {
        kalibr::read(&tree)
    } else {
        matrices::read(&tree)
    }?;
    // No residual is negative: a negative number means something else.
    old.rms_px = old.rms_px.filter(|rms_px| *rms_px >= 0.0 && rms_px.is_finite());
    Ok(old)
}
