//! Truth of the simulated camera, on disk and against the result.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::Announcer;
use boresight_calibrate::Calibration;
use boresight_files::{Links, Overwrite, TEXT_LIMIT, read_text, save};
use boresight_formats::DistortionEntry;
use boresight_geometry::Camera;
use boresight_sim::Truth;

/// `boresight.truth/1`: the simulated camera's lens, and where the board was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct TruthFile {
    /// [`TRUTH_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.truth/1")))]
    pub schema: String,
    /// Focal length along x and y.
    pub f_px: [f64; 2],
    /// Principal point.
    pub pp_px: [f64; 2],
    /// OpenCV's distortion coefficients.
    pub distortion: DistortionEntry,
    /// Pose of the board in the middle of each frame's exposure.
    pub cam_from_board: Vec<FramePose>,
}

/// Pose of the board in the camera's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct FramePose {
    /// Number of the frame in the session.
    pub frame: u64,
    /// Unit quaternion, real part first.
    pub rotation_wxyz: [f64; 4],
    /// Translation in metres.
    pub translation_m: [f64; 3],
}

/// Name and version of [`TruthFile`].
pub const TRUTH_SCHEMA: &str = "boresight.truth/1";

/// Writes `truth.json` into the session. Frames are numbered as in the session, from `first_frame`
/// in this run; the frames of earlier runs stay.
///
/// # Errors
///
/// [`boresight_files::FileError::Write`].
pub fn write(session: &Path, truth: &Truth, first_frame: u64) -> anyhow::Result<()> {
    let path = session.join("truth.json");
    let mut frames = earlier_frames(&path);
    frames.extend(truth.poses.iter().map(|(frame, cam_from_board)| {
        let t = &cam_from_board.translation.vector;
        let q = cam_from_board.rotation.quaternion();
        FramePose {
            frame: frame.0.saturating_add(first_frame),
            rotation_wxyz: [q.w, q.i, q.j, q.k],
            translation_m: [t.x, t.y, t.z],
        }
    }));
    let Camera { f_px, pp_px, distortion } = truth.camera;
    let file = TruthFile {
        schema: TRUTH_SCHEMA.into(),
        f_px: [f_px.x, f_px.y],
        pp_px: [pp_px.x, pp_px.y],
        distortion: distortion.into(),
        cam_from_board: frames,
    };
    let json = serde_json::to_value(&file)?.to_string();
    Ok(save(&path, json.as_bytes(), Overwrite::Allowed)?)
}

/// Frames of an earlier file; empty if missing or unreadable.
fn earlier_frames(path: &Path) -> Vec<FramePose> {
    let text = read_text(path, TEXT_LIMIT, Links::Refused).unwrap_or_default();
    serde_json::from_str::<TruthFile>(&text).map_or_else(|_| Vec::new(), |file| file.cam_from_board)
}

/// Announces the distance of the result from the truth, in pixels and in standard deviations.
pub fn announce(truth: &Truth, calibration: &Calibration, announcer: &Announcer) {
    let say = |line: &str| announcer.say(line);
    let off = |found: f64, truth: f64, sd: f64| {
        format!("{truth:.2} ({:+.3} px, {:.1} sd)", found - truth, ((found - truth) / sd).abs())
    };
    let [sd_f, _, sd_x, sd_y, ..] = calibration.sd();
    let (found, camera) = (&calibration.camera, &truth.camera);
    say("The simulated camera's truth, and how far the result is from it:");
    say(&format!("  principal point  x {}", off(found.pp_px.x, camera.pp_px.x, sd_x)));
    say(&format!("                   y {}", off(found.pp_px.y, camera.pp_px.y, sd_y)));
    say(&format!("  focal length       {}", off(found.f_px.x, camera.f_px.x, sd_f)));
}
