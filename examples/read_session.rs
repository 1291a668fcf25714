//! Reads a recorded session: its views with their corners, what came of them, and the lens in another program's format.
//!
//! cargo run --no-default-features --example read_session -- fixtures/recordings/v1/good

use std::path::PathBuf;

use anyhow::anyhow;
use boresight::{
    app::{SavedSession, session::result::calibration_file},
    calibration::export::{CameraFormat, ExportedCamera},
};

fn main() -> anyhow::Result<()> {
    let folder: PathBuf =
        std::env::args().nth(1).ok_or_else(|| anyhow!("read_session SESSION"))?.into();
    // Every decision is made again; views that were taken stay taken.
    let saved = SavedSession::open(&folder)?;
    println!("{}, {}", saved.header.created, saved.header.source);
    for view in saved.session.accepted() {
        let seen = view.view.corners.iter().filter(|corner| corner.is_seen()).count();
        println!("{}: {seen} corners", view.picture_name());
    }
    let file = calibration_file(&saved.session, &saved.header);
    println!("verdict: {}", file.verdict);
    let Some(lens) = file.result else { return Ok(()) };
    let exported = ExportedCamera {
        name: "front",
        camera: lens.camera(),
        image_size: saved.header.image_size(),
        rms_px: lens.rms_px.unwrap_or(0.0),
    };
    print!("{}", CameraFormat::RosYaml.write(&exported)?);
    Ok(())
}
