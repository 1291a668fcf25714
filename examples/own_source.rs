//! A guided session over frames of your own: here pictures of a folder; a camera's driver would go in their place.
//!
//! cargo run --no-default-features --example own_source -- fixtures/recordings/v1/good/frames /tmp/session

use std::{path::PathBuf, sync::Arc, time::Duration};

use anyhow::{Context, anyhow};
use boresight::{
    app::{Announcer, Host, Opening, session::source::OpenSource},
    capture::{Arrival, CaptureError, FrameSource, SourceIdentity},
    config::Config,
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
};
use image::GrayImage;

/// Frames as they come.
struct Own<Frames> {
    frames: Frames,
    next: u64,
    image_size: ImageSize,
}

impl<Frames: Iterator<Item = GrayImage> + Send> FrameSource for Own<Frames> {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: "own".into(), image_size: Some(self.image_size) }
    }

    /// Returns a frame, an event, or that there are no more; after the given time without any, `Arrival::NothingYet`.
    fn next_frame(&mut self, _: Duration) -> Result<Arrival, CaptureError> {
        let Some(image) = self.frames.next() else { return Ok(Arrival::End) };
        let id = FrameId(self.next);
        self.next += 1;
        Ok(Arrival::Frame(Arc::new(Frame {
            id,
            captured_at: CaptureTime { nanos: id.0 * 33_000_000 },
            // A camera's frames are `FrameKind::Video`: the board must then be held for a moment.
            kind: FrameKind::Photograph,
            name: format!("{:03}", id.0),
            image,
        })))
    }
}

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let (Some(folder), Some(session)) = (arguments.next(), arguments.next()) else {
        return Err(anyhow!("own_source FOLDER SESSION"));
    };
    let listed: Result<Vec<PathBuf>, _> =
        std::fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path())).collect();
    let mut files = listed?;
    files.sort();
    let frames: Result<Vec<GrayImage>, _> =
        files.iter().map(|file| image::open(file).map(image::DynamicImage::into_luma8)).collect();
    let frames = frames?;
    let image_size = ImageSize::of(frames.first().context("no pictures")?);

    let own = Own { frames: frames.into_iter(), next: 0, image_size };
    let open = OpenSource { source: Box::new(own), on_frame: Box::new(|_| ()), truth: None };
    let settings = ["board.columns=7", "board.rows=5", "board.square_mm=30"].map(Into::into);
    let config = Config::load(None, &settings)?;
    let opening = Opening { out: Some(session.into()), ..Opening::new("own", config.clone()) };
    // Sentences for the person go here; what is shown in a window comes as snapshots (`Host::start`).
    let host = Host::new(Announcer::new(|line| println!("{line}")), Arc::default());
    let run = opening.begin_with("own", open, config)?;
    println!("exit status: {:?}", host.conclude(host.finish(run))?.exit);
    Ok(())
}
