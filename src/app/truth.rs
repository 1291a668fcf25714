//! The simulated camera's truth, on disk and against the result.

use std::path::Path;

use serde_json::{Value, json};

use super::Announcer;
use crate::{
    calibration::Calibration,
    recording::save::{Overwrite, save},
    simulation::Truth,
};

/// Writes `truth.json` into the session: the lens, and where the board was in the middle of each frame's
/// exposure. Frames are numbered as in the session, of which this run began at `first_frame`; what an
/// earlier run wrote stays.
pub fn write(session: &Path, truth: &Truth, first_frame: u64) -> anyhow::Result<()> {
    let path = session.join("truth.json");
    let mut frames = earlier_frames(&path);
    frames.extend(truth.poses.iter().map(|(frame, cam_from_board)| {
        let t = &cam_from_board.translation.vector;
        let q = cam_from_board.rotation.quaternion();
        json!({
            "frame": frame.0 + first_frame,
            "rotation_wxyz": [q.w, q.i, q.j, q.k], "translation_m": [t.x, t.y, t.z],
        })
    }));
    let (camera, lens) = (&truth.camera, &truth.camera.distortion);
    let truth = json!({
        "schema": "boresight.truth/1",
        "f_px": [camera.f_px.x, camera.f_px.y], "pp_px": [camera.pp_px.x, camera.pp_px.y],
        "distortion": { "k1": lens.k1, "k2": lens.k2, "p1": lens.p1, "p2": lens.p2, "k3": lens.k3 },
        "cam_from_board": frames,
    });
    Ok(save(&path, truth.to_string().as_bytes(), Overwrite::Allowed)?)
}

fn earlier_frames(path: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    match serde_json::from_str::<Value>(&text) {
        Ok(mut earlier) => match earlier["cam_from_board"].take() {
            Value::Array(frames) => frames,
            _ => Vec::new(),
        },
        Err(_) => Vec::new(),
    }
}

/// Announces how far the result is from the truth, in pixels and in its standard deviations.
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
