//! Live help to push a camera back: pictures in, the next action out.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use crate::words;
use crate::{camera::WatchedCamera, feed::Feed, times::now_secs};
use boresight_app::Voice;
use boresight_capture::Arrival;
use boresight_geometry::frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize};
use boresight_watch::{Adjust, Advice, NoAnswer, Turn, View, px_per_turn};
use image::GrayImage;
use nalgebra::Point2;

/// Minimum time between pictures: no hand is faster, and small computers are slow.
const BETWEEN: Duration = Duration::from_millis(100);
const PATIENCE: Duration = Duration::from_millis(100);

/// Step for a picture while a camera is pushed back.
#[derive(Debug)]
pub struct Step<'a> {
    /// Next action.
    pub advice: Advice,
    /// Closeness: [`Adjust::closeness`].
    pub closeness: Option<f64>,
    /// The picture.
    pub frame: &'a Arc<Frame>,
    /// Expected edges of the scene at the present hour, px.
    pub outline: Vec<Point2<f64>>,
}

/// Way back, with the drawing state.
struct Way<'a> {
    camera: &'a WatchedCamera,
    adjust: Adjust,
    /// Drawn reference: that of the first picture's light.
    drawn: Option<usize>,
}

impl Way<'_> {
    fn step<'f>(&mut self, frame: &'f Arc<Frame>, at_secs: f64, now_secs: f64) -> Step<'f> {
        let (camera, lens) = (self.camera, self.camera.lens());
        let gallery = &camera.station().gallery;
        let view = View::of(frame.image.clone());
        let target_px = camera.watch().target_px(at_secs);
        let off = if ImageSize::of(&frame.image) == lens.image_size {
            camera.station().measure(&view).map(|m| m.turn.in_px(lens) - target_px)
        } else {
            Err(NoAnswer::OtherSize)
        };
        let advice = self.adjust.handle(now_secs, off);
        if self.drawn.is_none() {
            self.drawn = gallery.nearest(&view).first().copied();
        }
        let reference = self.drawn.and_then(|index| gallery.references.get(index));
        let target = Turn::from_vector(&target_px.component_div(&px_per_turn(lens)));
        Step {
            closeness: self.adjust.closeness(&advice),
            advice,
            frame,
            outline: reference.map_or_else(Vec::new, |reference| {
                reference.outline(lens, &target.since(&reference.turn))
            }),
        }
    }
}

/// Follows a source until the camera points right, `stop` is set, or the source ends; `hear` gets
/// every step. True if the camera points right.
///
/// # Errors
///
/// If the source can't be opened or breaks.
pub fn adjust(
    camera: &WatchedCamera,
    feed: &Feed,
    stop: &AtomicBool,
    hear: &mut dyn FnMut(&Step<'_>),
) -> anyhow::Result<bool> {
    let adjust = Adjust::new(camera.watch().may_be_left_px());
    let mut way = Way { camera, adjust, drawn: None };
    let mut take = |frame: &Arc<Frame>, at_secs: f64, now_secs: f64| {
        let step = way.step(frame, at_secs, now_secs);
        hear(&step);
        step.advice == Advice::Right
    };
    if let Some(pictures) = feed.stills() {
        // Single pictures: their own times count.
        for (at, path) in pictures {
            let frame = still(boresight_capture::read_picture(&path)?);
            if stop.load(Ordering::Relaxed) || take(&frame, at, at) {
                return Ok(!stop.load(Ordering::Relaxed));
            }
        }
        return Ok(false);
    }
    let began = Instant::now();
    if let Feed::Street(street) = feed {
        // The street ends with its last day.
        let end_secs = street.began_secs + street.days * 86_400.0;
        let frame = still(street.picture(end_secs));
        while !stop.load(Ordering::Relaxed) {
            if take(&frame, end_secs, began.elapsed().as_secs_f64()) {
                return Ok(true);
            }
            std::thread::sleep(BETWEEN);
        }
        return Ok(false);
    }
    let mut source = feed.open()?;
    let mut last: Option<Instant> = None;
    while !stop.load(Ordering::Relaxed) {
        match source.next_frame(PATIENCE)? {
            Arrival::Frame(frame) => {
                if last.is_some_and(|last| last.elapsed() < BETWEEN) {
                    continue;
                }
                last = Some(Instant::now());
                if take(&frame, now_secs(), began.elapsed().as_secs_f64()) {
                    return Ok(true);
                }
            }
            Arrival::End => return Ok(false),
            Arrival::Event(_) | Arrival::NothingYet => {}
        }
    }
    Ok(false)
}

/// Speaks the advice through the computer's voice.
pub fn say_aloud(voice: &Voice, advice: &Advice) {
    let facing = words::facing(advice);
    if let Some((text, mirrored)) = words::aloud(advice).zip(words::aloud(&facing)) {
        voice.requests()(text, mirrored);
    }
}

/// A single picture as a frame.
fn still(image: GrayImage) -> Arc<Frame> {
    Arc::new(Frame {
        id: FrameId(0),
        captured_at: CaptureTime { nanos: 0 },
        kind: FrameKind::Photograph,
        name: String::new(),
        image,
    })
}
