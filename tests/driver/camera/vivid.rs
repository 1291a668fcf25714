//! The kernel's test driver: read by ourselves, and by `v4l2-ctl`, which pipes its pictures.

use std::{
    process::{Command, Output},
    time::{Duration, Instant},
};

use boresight::{
    capture::{
        Arrival, CaptureError, FrameSource, Pipe, RawForm,
        v4l2::{Camera, Linux, LiveCamera, discover},
    },
    device::{Fault, PixelLayout},
};

use super::{LONG, PATIENCE, frames, row, wanted, words};

/// Debian's, put into the test machine by `tests/vm/run.sh`.
const V4L2_CTL: &str = "/app/v4l2-ctl";
/// Names of each format by the kernel, us, and ffmpeg.
const FORMATS: [(&str, PixelLayout, &str); 3] = [
    ("YUYV", PixelLayout::Yuyv, "yuyv422"),
    ("NV12", PixelLayout::Nv12, "nv12"),
    ("GREY", PixelLayout::Grey, "gray"),
];

fn vivid() -> Camera {
    let found = discover(&mut Linux::default()).cameras;
    found.into_iter().find(|camera| camera.driver == "vivid").expect("vivid")
}

/// Sets a control of the driver, unnoticed by a reader.
fn set(option: &str, value: &str) {
    let Output { status, stderr, .. } =
        Command::new(V4L2_CTL).args(["-d", "/dev/video0", option, value]).output().expect("starts");
    assert!(status.success(), "{value}: {}", String::from_utf8_lossy(&stderr));
}

/// Rows of the picture with the driver's clock and counter.
const COUNTED_ROWS: usize = 220;

fn command(fourcc: &str) -> String {
    let format = format!("--set-fmt-video=width=640,height=360,pixelformat={fourcc}");
    format!("pipe:{V4L2_CTL} -d /dev/video0 {format} --stream-mmap --stream-to=-")
}

/// Pictures of the driver of 640 by 360, through `v4l2-ctl`.
fn through_a_pipe(fourcc: &str, pixels: &str) -> Result<Pipe, CaptureError> {
    let raw: RawForm = format!("640x360:{pixels}@30").parse().expect("a form");
    // In a call of its own, for `v4l2-ctl` writes a line about it between the pictures.
    set("-p", "30");
    Pipe::open(&command(fourcc), Some(raw))
}

/// Next `count` pictures: the counted rows, and those below.
fn pictures(source: &mut impl FrameSource, count: usize) -> Vec<[Vec<u8>; 2]> {
    let started = Instant::now();
    let mut pictures = Vec::new();
    while pictures.len() < count {
        assert!(started.elapsed() < LONG, "{} pictures", pictures.len());
        if let Arrival::Frame(frame) = source.next_frame(PATIENCE).expect("a camera never breaks") {
            let (counted, rest) = frame.image.as_raw().split_at(COUNTED_ROWS * 640);
            pictures.push([counted.to_vec(), rest.to_vec()]);
        }
    }
    pictures
}

#[test]
#[ignore = "needs the driver vivid"]
fn the_test_driver_of_the_kernel_streams() {
    let camera = vivid();
    assert!(camera.is_virtual && !camera.is_ordinary());
    for (fourcc, layout, pixels) in FORMATS {
        let wanted = wanted(640, 360, layout);
        let mut source =
            LiveCamera::open(Linux::default(), camera.clone(), &wanted).expect("opens");
        let direct = pictures(&mut source, 20);
        let [_, scene] = &direct[0];
        assert!(direct.iter().all(|[_, rest]| rest == scene), "{fourcc}");
        drop(source);
        // Lost buffers of the driver take nothing from the pictures around them.
        set("-c", "percentage_of_dropped_buffers=30");
        let piped = pictures(&mut through_a_pipe(fourcc, pixels).expect("opens"), 40);
        set("-c", "percentage_of_dropped_buffers=0");
        let equal = piped.iter().filter(|[_, rest]| rest == scene).count();
        let name = layout.name();
        println!(
            "vivid {name}: {equal} of {} pictures through a pipe as we read them",
            piped.len()
        );
        assert_eq!(equal, piped.len(), "{fourcc}");
        assert!(piped.windows(2).all(|two| two[0] != two[1]), "{fourcc}: a picture came twice");
    }
}

/// Last test: the driver can't be plugged in again.
#[test]
#[ignore = "needs the driver vivid"]
fn the_test_driver_unplugged_behind_a_pipe() {
    set("-c", "inject_vidioc_streamon_error=1");
    let err = through_a_pipe("YUYV", "yuyv422").err().expect("no picture comes");
    let CaptureError::Camera { fault: Fault::CommandEnded, detail } = &err else { panic!("{err}") };
    // `v4l2-ctl` doesn't report it.
    assert_eq!(detail, "without a picture");
    row("a driver that doesn't start behind a pipe", &words(Fault::CommandEnded), Duration::ZERO);
    let mut source = through_a_pipe("YUYV", "yuyv422").expect("opens");
    frames(&mut source, 10);
    // `v4l2-ctl` then ends without an error, and the pictures have an end.
    set("-c", "disconnect=1");
    let started = Instant::now();
    loop {
        assert!(started.elapsed() < LONG);
        match source.next_frame(PATIENCE).expect("a camera never breaks") {
            Arrival::End => break,
            Arrival::Event(event) => panic!("{event:?}"),
            Arrival::Frame(_) | Arrival::NothingYet => {}
        }
    }
}
