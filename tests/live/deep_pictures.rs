//! Cameras with pictures deeper than 8 bits or behind a colour filter.

use std::time::Duration;

use boresight::{
    capture::{Arrival, FrameSource},
    detection::{Detector, DetectorParams, Search, Track},
    device::PixelLayout,
    frame::ImageSize,
    session::{Input, Observation, Session},
    simulation::kernel::{SimCamera, SimKernel},
};
use image::{GrayImage, Luma};

use crate::{
    cameras::open,
    pictures::{PAIRS, picture},
};

/// Number of pictures of a board held still.
const EACH: u64 = 60;

/// Session with a camera of the given format: its layout, and the numbers of the frames with views.
fn session(fourcc: [u8; 4], bytes: fn(&GrayImage) -> Vec<u8>) -> (PixelLayout, Vec<u64>) {
    let poses: Vec<GrayImage> =
        PAIRS[..3].iter().map(|(tilt_deg, slot_deg)| picture(*tilt_deg, *slot_deg)).collect();
    let show = move |number: u64| {
        let mut picture = poses[(number / EACH) as usize % poses.len()].clone();
        // No camera sends the same frame twice, unless frozen.
        picture.put_pixel(0, 0, Luma([number as u8]));
        bytes(&picture)
    };
    let kernel = SimKernel::new(vec![SimCamera::new(0, "A1", (fourcc, 640, 480), show)]);
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    let layout = source.camera_facts().expect("a camera").mode.layout;
    let size = ImageSize { width_px: 640, height_px: 480 };
    let config = boresight::config::Config::load(None, &[]).expect("defaults");
    let mut session = Session::new(config.session(size).expect("a board"));
    let board = config.board().expect("a board");
    let (mut detector, mut track) = (Detector::new(DetectorParams::default()), Track::default());
    while kernel.world().now_nanos < 9_000_000_000 {
        match source.next_frame(Duration::from_millis(100)).expect("a camera never breaks") {
            Arrival::Frame(frame) => {
                let near = track.predict(frame.kind, frame.captured_at);
                let search = Search { near: near.as_ref(), ..Search::FULL };
                let seen = detector.search(&frame.image, &board, search);
                track.add(frame.kind, frame.captured_at, &seen);
                session.handle(&Input::Observed(Observation {
                    frame_id: frame.id,
                    captured_at: frame.captured_at,
                    kind: frame.kind,
                    name: String::new(),
                    image_size: ImageSize::of(&frame.image),
                    seen,
                }));
            }
            Arrival::Event(event) => {
                session.handle(&Input::Camera(event));
            }
            Arrival::NothingYet => {}
            Arrival::End => unreachable!("a camera never ends"),
        }
    }
    assert_eq!(kernel.world().violations, Vec::<String>::new());
    (layout, session.accepted().iter().map(|view| view.view.frame_id.0).collect())
}

#[test]
fn a_session_takes_the_same_views_in_12_bits_as_in_8() {
    let deep = |picture: &GrayImage| {
        let deep = |grey: &u8| (u32::from(*grey) * 4095).div_ceil(255) as u16;
        picture.as_raw().iter().flat_map(|grey| deep(grey).to_le_bytes()).collect()
    };
    let (layout, views) = session(*b"Y12 ", deep);
    assert_eq!(layout, PixelLayout::Y12);
    assert!(!views.is_empty());
    assert_eq!(views, session(*b"GREY", |picture| picture.as_raw().clone()).1);
}

#[test]
fn a_session_is_taken_behind_a_colour_filter() {
    // A filter dims red and blue, as daylight behind real ones does.
    let mosaic = |picture: &GrayImage| {
        let seen = |(x, y, pixel): (u32, u32, &Luma<u8>)| {
            let share = [[1.0, 0.6], [0.5, 1.0]][y as usize % 2][x as usize % 2];
            (f64::from(pixel.0[0]) * share) as u8
        };
        picture.enumerate_pixels().map(seen).collect()
    };
    let (layout, views) = session(*b"GRBG", mosaic);
    assert_eq!(layout, PixelLayout::Bayer);
    assert!(!views.is_empty());
}
