//! Frames cut, joined, or changed on their way never become a view; good ones are taken.
//!
//! Two guards work in sequence. The gate refuses frames without the structure of a whole one, or
//! with a jump in brightness. JPEG has no checksum, and some damage passes: blocks with other
//! values, or the join of two frames at the same block. The session then refuses a moving board, or
//! a board with corners not moving together.
//!
//! The usual run takes a twentieth. All 100,000: `BORESIGHT_DAMAGE_EVERY=1 cargo test --test live
//! damaged_frames`.

use std::collections::BTreeMap;

use boresight::{
    capture::{Unpacker, integrity::JpegGate},
    config::Config,
    detection::{Detection, Detector, DetectorParams},
    device::PixelLayout,
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
    session::{Input, Observation, Outcome, Session},
};
use image::{ExtendedColorType, GrayImage, codecs::jpeg::JpegEncoder};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::cameras::{SIZE, jpeg, jpeg_picture};
use crate::pictures::{PAIRS, picture};

const SMALL: ImageSize = ImageSize { width_px: SIZE.0, height_px: SIZE.1 };
const FRAMES: usize = 20;
/// Number of poses with boards large enough for a view.
const UPRIGHT: usize = 4;
/// Number of cuts, and of damages of each other kind.
const CUTS: usize = 60_000;
const OTHERS: usize = 40_000;
/// Error of a corner in a wrong view: the maximum of a good corner.
const WRONG_PX: f64 = 0.1;

fn every() -> usize {
    std::env::var("BORESIGHT_DAMAGE_EVERY").ok().and_then(|n| n.parse().ok()).unwrap_or(20)
}

/// A frame of a camera with a board, and visible contents.
struct Whole {
    bytes: Vec<u8>,
    picture: GrayImage,
    seen: Detection,
}

fn compressed(picture: &GrayImage, quality: u8) -> Vec<u8> {
    // Grey as colour, as cameras send it.
    let rgb: Vec<u8> = picture.as_raw().iter().flat_map(|value| [*value; 3]).collect();
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode(&rgb, picture.width(), picture.height(), ExtendedColorType::Rgb8)
        .expect("encodes");
    bytes
}

/// Boards in different poses, each twice with other grain.
fn frames(detector: &mut Detector) -> Vec<Whole> {
    let board = Config::load(None, &[]).expect("defaults").board().expect("a board");
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    (0..FRAMES)
        .map(|number| {
            let (tilt_deg, slot_deg) = PAIRS[number / 2 % UPRIGHT];
            let mut grainy = picture(tilt_deg, slot_deg);
            grainy.iter_mut().for_each(|v| *v = v.saturating_add(rng.random_range(0..6)));
            let bytes = compressed(&grainy, 70 + number as u8);
            let picture = unpacker(&grainy).unpack(&bytes).expect("whole");
            let seen = detector.detect(&picture, &board).expect("a board");
            Whole { bytes, picture, seen }
        })
        .collect()
}

fn unpacker(like: &GrayImage) -> Unpacker {
    Unpacker::new(PixelLayout::Mjpeg, ImageSize::of(like), 0)
}

/// Error of the corners, if a session about to take a view of `whole` takes `picture` instead.
fn taken(whole: &Whole, picture: &GrayImage, detector: &mut Detector) -> Option<f64> {
    let config = Config::load(None, &[]).expect("defaults");
    let image_size = ImageSize::of(picture);
    let mut session = Session::new(config.session(image_size).expect("a board"));
    let board = session.setup().board;
    let observation = |number: u64, seen| Observation {
        frame_id: FrameId(number),
        captured_at: CaptureTime { nanos: number * 33_000_000 },
        kind: FrameKind::Video,
        name: String::new(),
        image_size,
        seen,
    };
    let (mut number, mut last) = (0, None);
    // The board is held still until one more frame completes the hold.
    for _ in 0..18 {
        number += 1;
        last = Some(session.handle(&Input::Observed(observation(number, Ok(whole.seen.clone())))));
    }
    assert!(session.frame_in_hand().is_some() && session.accepted().is_empty(), "{last:?}");
    let seen = detector.detect(picture, &board);
    let worst = seen.as_ref().ok().map(|seen| {
        let pairs = seen.corners.iter().zip(&whole.seen.corners);
        pairs.map(|(a, b)| (a.px - b.px).norm()).fold(0.0, f64::max)
    });
    let damaged = number + 1;
    let mut decision = session.handle(&Input::Observed(observation(damaged, seen)));
    for after in 1..4 {
        if matches!(decision.outcome, Outcome::Accepted { .. }) {
            break;
        }
        decision =
            session.handle(&Input::Observed(observation(damaged + after, Ok(whole.seen.clone()))));
    }
    match decision.outcome {
        Outcome::Accepted { frame, .. } if frame == damaged => worst,
        _ => None,
    }
}

/// A kind of damage, and frame `which` with the damage.
fn damaged(
    frames: &[Whole],
    which: usize,
    number: usize,
    rng: &mut ChaCha8Rng,
) -> (&'static str, Vec<u8>) {
    let frame = &frames[which].bytes;
    let other = &frames[(which + 1 + number % (FRAMES - 1)) % FRAMES].bytes;
    let mut bytes = frame.clone();
    match number % 4 {
        0 => {
            for _ in 0..rng.random_range(8..64) {
                let at = rng.random_range(2..bytes.len() - 2);
                bytes[at] ^= 1 << rng.random_range(0..8);
            }
            ("bits flipped", bytes)
        }
        1 => {
            let at = rng.random_range(700..frame.len().min(other.len()) - 2);
            bytes.truncate(at);
            bytes.extend(&other[at..]);
            ("two frames joined", bytes)
        }
        2 => {
            // The buffer still holds an older frame behind the new one's end.
            let at = rng.random_range(2..frame.len() - 2);
            bytes.truncate(at);
            let behind = rng.random_range(2..other.len() - 2);
            bytes.extend(&other[behind..]);
            ("cut, with an old end", bytes)
        }
        _ => {
            // Lost bytes, up to the largest packet of USB: a hole closed up, or left empty.
            let from = rng.random_range(700..bytes.len() - 2);
            let until = (from + rng.random_range(1..1024)).min(bytes.len() - 1);
            if number % 8 == 3 {
                bytes.drain(from..until);
            } else {
                bytes[from..until].fill(0);
            }
            ("a packet lost", bytes)
        }
    }
}

#[derive(Default)]
struct Count {
    all: u32,
    /// Passed the gate with another picture.
    passed: u32,
    /// Became the view.
    views: u32,
    /// Became a view with wrong corners.
    wrong: u32,
    worst_px: f64,
}

#[test]
fn no_damaged_frame_becomes_a_wrong_view() {
    let every = every();
    let mut detector = Detector::new(DetectorParams::default());
    let frames = frames(&mut detector);
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut counts: BTreeMap<&str, Count> = BTreeMap::new();
    let mut judge = |kind, which: usize, bytes: &[u8]| {
        let whole = &frames[which];
        let count = counts.entry(kind).or_default();
        count.all += 1;
        // Damage without effect on pixels, such as in a comment, is none.
        let Ok(picture) = unpacker(&whole.picture).unpack(bytes) else { return };
        if picture == whole.picture {
            return;
        }
        count.passed += 1;
        if let Some(off_px) = taken(whole, &picture, &mut detector) {
            count.views += 1;
            count.wrong += u32::from(off_px > WRONG_PX);
            count.worst_px = count.worst_px.max(off_px);
        }
    };
    for number in (0..CUTS).step_by(every) {
        let which = number / every % FRAMES;
        let bytes = &frames[which].bytes;
        judge("cut at an offset", which, &bytes[..number * bytes.len() / CUTS]);
    }
    for number in (0..OTHERS).step_by(every) {
        let which = number / every % FRAMES;
        let (kind, bytes) = damaged(&frames, which, number / every, &mut rng);
        judge(kind, which, &bytes);
    }
    let (mut all, mut views, mut wrong) = (0, 0, 0);
    for (kind, count) in &counts {
        println!(
            "{kind:22} {:6} frames, {} through the gate, {} taken as a view, {} of them wrong (worst {:.3} px)",
            count.all, count.passed, count.views, count.wrong, count.worst_px
        );
        all += count.all;
        views += count.views;
        wrong += count.wrong;
    }
    println!("{all} damaged frames, {views} taken as a view, {wrong} of them wrong");
    assert_eq!((views, wrong), (0, 0));
}

/// Whole pictures hard to tell from damaged pictures.
fn odd_but_good(number: u64, (width, height): (u32, u32), rng: &mut ChaCha8Rng) -> GrayImage {
    let shift = (number / 10 % 64) as f64;
    let mut grain = |strength: f64| strength * (rng.random::<f64>() - 0.5);
    let wave = jpeg_picture(number, (width, height));
    GrayImage::from_fn(width, height, |x, y| {
        let (x, y, calm) = (f64::from(x), f64::from(y), f64::from(wave.get_pixel(x, y).0[0]));
        let level = match number % 10 {
            0 => calm + grain(10.0),
            // Everything too bright, or nearly nothing seen.
            1 => calm * 2.5 - 60.0 + grain(4.0),
            2 => calm * 0.1 - 4.0 + grain(12.0),
            // All noise.
            3 => 128.0 + grain(8.0 * (1.0 + shift)),
            // Dark below a level or nearly level edge; bands of flickering light.
            4 => (if y > 20.0 + shift { 12.0 } else { calm }) + grain(2.0),
            5 => (if y > 60.0 + x * (shift - 32.0) / 640.0 { 12.0 } else { 230.0 }) + grain(2.0),
            6 => calm * (if (y + shift) % 40.0 < 17.0 { 0.7 } else { 1.0 }) + grain(3.0),
            7 => calm * (1.0 + 0.3 * ((y + shift) / 15.0).sin()) + grain(3.0),
            // Lines of text, and upright edges.
            8 => {
                if (x * 0.7).sin() * (y * 1.1 + shift).sin() > 0.4 && y % 16.0 < 11.0 {
                    0.0
                } else {
                    255.0
                }
            }
            _ => {
                if (x + shift) % 29.0 < 14.0 {
                    0.0
                } else {
                    255.0
                }
            }
        };
        image::Luma([level.clamp(0.0, 255.0) as u8])
    })
}

#[test]
fn good_frames_are_taken() {
    let mut refused = BTreeMap::new();
    let count = 10_000 / every() as u64;
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for number in 0..count {
        let (width, height) = (160 + 11 * (number % 17) as u32, 120 + 7 * (number % 13) as u32);
        let picture = odd_but_good(number, (width, height), &mut rng);
        let quality = [30, 50, 75, 85, 95, 100][(number / 10 % 6) as usize];
        // Some cameras see no colour.
        let bytes = if number % 7 == 0 {
            let mut bytes = Vec::new();
            JpegEncoder::new_with_quality(&mut bytes, quality)
                .encode(&picture, width, height, ExtendedColorType::L8)
                .expect("encodes");
            bytes
        } else {
            compressed(&picture, quality)
        };
        let wanted = ImageSize { width_px: width, height_px: height };
        if let Err(flaw) = JpegGate::default().check(&bytes, wanted) {
            *refused.entry((number % 10, format!("{flaw:?}"))).or_insert(0) += 1;
        }
    }
    println!("{count} good frames, refused: {refused:?}");
    assert!(refused.values().sum::<u64>() * 1000 <= count);
}

#[test]
fn a_camera_that_always_pads_its_frames_is_learnt_and_others_are_not() {
    let mut gate = JpegGate::default();
    let padded = |number: u64| {
        let mut bytes = jpeg(number, SIZE);
        let end = bytes.len() - 2;
        bytes.splice(end..end, [0, 0, 0]);
        bytes
    };
    let taken: Vec<bool> = (0..20).map(|n| gate.check(&padded(n), SMALL).is_ok()).collect();
    assert!(
        taken[..4].iter().all(|taken| !taken) && taken[4..].iter().all(|taken| *taken),
        "{taken:?}"
    );
    assert!(
        Unpacker::new(PixelLayout::Mjpeg, SMALL, 0).unpack(&padded(1)).is_err(),
        "once is no habit"
    );
}

#[test]
fn raw_frames_with_too_few_bytes_are_refused_at_every_length() {
    for (layout, bytes) in [
        (PixelLayout::Grey, 1.0),
        (PixelLayout::Yuyv, 2.0),
        (PixelLayout::Nv12, 1.5),
        (PixelLayout::Y10, 2.0),
        (PixelLayout::Y12, 2.0),
        (PixelLayout::Y16, 2.0),
        (PixelLayout::Rgb, 3.0),
        (PixelLayout::Bgr, 3.0),
        (PixelLayout::Bayer, 1.0),
    ] {
        let whole = (f64::from(SIZE.0 * SIZE.1) * bytes) as usize;
        let frame = vec![90; whole];
        let mut unpacker = Unpacker::new(layout, SMALL, 0);
        assert!(unpacker.unpack(&frame).is_ok());
        for cut in (0..whole).step_by(97).chain([whole - 1]) {
            assert!(unpacker.unpack(&frame[..cut]).is_err(), "{layout:?} cut at {cut}");
        }
    }
}
