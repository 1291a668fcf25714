//! Frame rate: on the driver alone, and through the program's own capture.

use std::time::{Duration, Instant};

use boresight::{
    capture::v4l2::{
        Linux,
        kernel::{Format, Kernel},
    },
    device::PixelLayout,
    frame::ImageSize,
};

use super::{LONG, cameras, frames, open, wanted};

/// Number of frames for measuring a rate.
const COUNT: u32 = 90;
/// Promised rate of the modes.
const PROMISED_HZ: f64 = 30.0;

#[test]
#[ignore = "needs the camera of tests/vm"]
fn pictures_come_at_the_rate_of_the_mode() {
    println!("| mode               | driver alone | program gets | program decodes |");
    for (width, height, layout) in [
        (1280, 720, PixelLayout::Mjpeg),
        (640, 480, PixelLayout::Yuyv),
        (1920, 1080, PixelLayout::Mjpeg),
    ] {
        let alone = driver_alone(width, height, layout);
        let mut source = open(&wanted(width, height, layout));
        assert_eq!(source.mode().size, ImageSize { width_px: width, height_px: height });
        let before = frames(&mut source, 5).newest;
        let seen = frames(&mut source, COUNT);
        let secs = seen.took.as_secs_f64();
        let (came, used) = ((seen.newest - before) as f64 / secs, f64::from(COUNT) / secs);
        let name = format!("{width}x{height} {}", layout.name());
        println!("| {name:18} | {alone:10.1} | {came:10.1} | {used:10.1} | of {PROMISED_HZ}");
    }
}

/// Frames per second of a loop taking frames from the driver and nothing else.
fn driver_alone(width: u32, height: u32, layout: PixelLayout) -> f64 {
    let fourcc = if layout == PixelLayout::Mjpeg { *b"MJPG" } else { *b"YUYV" };
    let mut kernel = Linux::default();
    let device = kernel.open(&cameras(1)[0].node.path).expect("opens");
    let format = Format { width, height, fourcc, bytes_per_line: 0, size_image: 0 };
    kernel.set_format(device, format).expect("granted");
    kernel.set_interval(device, (1, 30)).expect("granted");
    for index in 0..kernel.request_buffers(device, 4).expect("granted") {
        kernel.map(device, index).expect("mapped");
        kernel.queue(device, index).expect("queued");
    }
    kernel.stream_on(device).expect("starts");
    let (mut taken, mut first) = (0, None);
    let began = Instant::now();
    while taken <= COUNT {
        assert!(began.elapsed() < LONG, "{taken} frames");
        kernel.wait(device, Duration::from_secs(1)).expect("waits");
        while let Ok(filled) = kernel.dequeue(device) {
            first.get_or_insert_with(Instant::now);
            taken += 1;
            kernel.queue(device, filled.index).expect("queued");
        }
    }
    let secs = first.map_or(f64::MAX, |first| first.elapsed().as_secs_f64());
    kernel.stream_off(device).expect("stops");
    kernel.unmap_all(device);
    kernel.request_buffers(device, 0).expect("given back");
    kernel.close(device);
    f64::from(taken - 1) / secs
}
