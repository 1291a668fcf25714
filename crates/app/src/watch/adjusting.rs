//! Helps to push a camera back, live: pictures in, the one thing to do out.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant},
};

use super::{camera::WatchedCamera, feed::Feed, times::now_secs};
use boresight_capture::Arrival;
use boresight_geometry::frame::ImageSize;
use boresight_watch::{Adjust, Advice, NoAnswer, Turn, View};
use image::GrayImage;

/// Most pictures a second: nobody pushes faster, and a small computer has other things to do.
const BETWEEN: Duration = Duration::from_millis(100);
const PATIENCE: Duration = Duration::from_millis(100);

impl WatchedCamera {
    /// How far a picture is from where the camera should point at this hour, px; and the turn itself.
    ///
    /// # Errors
    ///
    /// Why that can't be told.
    pub fn off_px(
        &self,
        grey: GrayImage,
        at_secs: f64,
    ) -> Result<(nalgebra::Vector4<f64>, Turn), NoAnswer> {
        if ImageSize::of(&grey) != self.lens().image_size {
            return Err(NoAnswer::OtherSize);
        }
        let measured = self.station().measure(&View::of(grey))?;
        Ok((measured.turn.in_px(self.lens()) - self.watch().target_px(at_secs), measured.turn))
    }
}

/// Follows a source until the camera stands right, `stop` is set, or the source ends; `hear` gets each advice with its
/// picture. True if the camera stands right.
///
/// # Errors
///
/// If the source can't be opened or breaks.
pub fn adjust(
    camera: &WatchedCamera,
    feed: &Feed,
    stop: &AtomicBool,
    hear: &mut dyn FnMut(&Advice, &GrayImage),
) -> anyhow::Result<bool> {
    let mut way = Adjust::new(camera.watch().scatter_px());
    let mut take = |grey: &GrayImage, at_secs: f64, now_secs: f64| {
        let off = camera.off_px(grey.clone(), at_secs).map(|(off, _)| off);
        let advice = way.handle(now_secs, off);
        hear(&advice, grey);
        advice == Advice::Right
    };
    if let Some(pictures) = feed.stills()? {
        // Pictures that stand alone: their own times count.
        for (at, path) in pictures {
            let grey = boresight_capture::read_picture(&path)?;
            if stop.load(Ordering::Relaxed) || take(&grey, at, at) {
                return Ok(!stop.load(Ordering::Relaxed));
            }
        }
        return Ok(false);
    }
    let mut source = feed.open()?;
    let began = Instant::now();
    let mut last: Option<Instant> = None;
    while !stop.load(Ordering::Relaxed) {
        match source.next_frame(PATIENCE)? {
            Arrival::Frame(frame) => {
                if last.is_some_and(|last| last.elapsed() < BETWEEN) {
                    continue;
                }
                last = Some(Instant::now());
                if take(&frame.image, now_secs(), began.elapsed().as_secs_f64()) {
                    return Ok(true);
                }
            }
            Arrival::End => return Ok(false),
            Arrival::Event(_) | Arrival::NothingYet => {}
        }
    }
    Ok(false)
}
