//! Topics of ROS 2 and the service of a camera's driver, through the two middlewares that most of
//! ROS 2 uses, in other processes: Eclipse Cyclone DDS, `ros2_camera.py`, where `BORESIGHT_PYTHON`
//! is a Python with its package; and eProsima Fast DDS, where `BORESIGHT_FASTDDS` is the program
//! made of `fastdds_camera.cpp`. `make test-sources` brings both. Without them, a test says that
//! it's skipped.

#![cfg(target_os = "linux")]
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use std::time::Duration;

use boresight_capture::{CaptureError, FrameSource};
use boresight_geometry::{
    device::{CameraEvent, Fault},
    frame::ImageSize,
};
use boresight_sources::{
    RosImageType,
    ros2::{Answer, Domain, NotSet, Ros2, set_camera_info, topics},
};
use common::{Fake, event, frames, is_pattern, until, until_back, until_lost};

/// A driver in a domain of its own; `None` without Python's package.
fn started(domain: u16, topic: &str, more: &[&str]) -> Option<(Fake, Domain)> {
    let Ok(python) = std::env::var("BORESIGHT_PYTHON") else {
        eprintln!("skipped: BORESIGHT_PYTHON names no Python with cyclonedds");
        return None;
    };
    let number = domain.to_string();
    let named = ["--domain", &number, "--topic", topic];
    let fake = Fake::script(&python, "ros2_camera.py", &[&named[..], more].concat())?;
    Some((fake, domain_of(domain)))
}

fn domain_of(number: u16) -> Domain {
    Domain::of(|name| (name == "ROS_DOMAIN_ID").then(|| number.to_string())).expect("a number")
}

fn opened(name: &str, domain: Domain) -> Ros2 {
    Ros2::open(name, domain).unwrap_or_else(|err| panic!("{name}: {err}"))
}

#[test]
fn a_domain_is_a_number_up_to_232() {
    let of =
        |id: &'static str| Domain::of(move |name| (name == "ROS_DOMAIN_ID").then(|| id.into()));
    assert_eq!(of("").ok(), Some(Domain::default()));
    assert!(of("232").is_ok() && of("233").is_err() && of("one").is_err());
}

#[test]
fn pictures_are_as_they_were_sent() {
    for (at, topic, more) in [
        (31, "/camera/image_raw", &["--encoding", "mono8"][..]),
        (32, "/camera/image_raw", &["--encoding", "mono16", "--best-effort"]),
        (33, "/camera/image_raw/compressed", &[]),
        (34, "/camera/image_raw", &["--size", "1280x720", "--rate", "5"]),
    ] {
        let Some((_fake, domain)) = started(at, topic, more) else { return };
        let mut source = opened(&format!("ros2:{topic}"), domain);
        assert_eq!(source.identity().name, format!("ros2:{topic}"));
        let frames = frames(&mut source, 20);
        assert!(frames.iter().all(|frame| is_pattern(frame)), "{topic} {more:?}");
        let times: Vec<u64> = frames.iter().map(|frame| frame.captured_at.nanos).collect();
        assert!(times.is_sorted_by(|a, b| a < b), "{times:?}");
    }
}

#[test]
fn topics_are_listed_and_one_that_is_not_there_names_them() {
    let Some((_fake, domain)) = started(35, "/left/image_raw", &[]) else { return };
    let listed = topics(domain, Duration::from_secs(5));
    let [topic] = &listed[..] else { panic!("{listed:?}") };
    assert_eq!((topic.name.as_str(), topic.publishers), ("/left/image_raw", 1));
    assert_eq!(topic.kind, RosImageType::Image);
    let Err(CaptureError::Camera { fault, detail }) = Ros2::open("ros2:/right/image_raw", domain)
    else {
        panic!("nobody publishes it")
    };
    assert_eq!((fault, detail.as_str()), (Fault::NoSuchTopic, "there are /left/image_raw"));
}

#[test]
fn what_cannot_be_read_is_named() {
    let Some((_fake, domain)) = started(36, "/depth/image", &["--encoding", "32FC1"]) else {
        return;
    };
    let Err(CaptureError::Camera { fault, detail }) = Ros2::open("ros2:/depth/image", domain)
    else {
        panic!("depth is no picture")
    };
    assert_eq!((fault, detail.as_str()), (Fault::NoFormat, "32FC1"));
}

#[test]
fn a_publisher_goes_and_comes_back_and_other_sizes_are_no_pictures() {
    let topic = "/camera/image_raw";
    let Some((mut fake, domain)) = started(37, topic, &[]) else { return };
    let mut source = opened("ros2:/camera/image_raw", domain);
    let blind = until(&mut source, |arrival| {
        matches!(event(arrival), Some(CameraEvent::Doubtful { fault: Fault::Unwatched, .. }))
    });
    assert!(matches!(event(&blind[0]), Some(CameraEvent::Started { .. })));
    frames(&mut source, 3);
    fake.say("silent");
    assert_eq!(until_lost(&mut source), Some(Fault::StreamLost));
    fake.say("speaking");
    until_back(&mut source);
    frames(&mut source, 3);
    fake.say("size 640x480");
    assert_eq!(until_lost(&mut source), Some(Fault::OtherSize));
    fake.say("size 320x240");
    until_back(&mut source);
    let size = ImageSize { width_px: 320, height_px: 240 };
    assert!(frames(&mut source, 3).iter().all(|frame| ImageSize::of(&frame.image) == size));
    // Killed, and another one in its place: the middleware finds it.
    drop(fake);
    assert_eq!(until_lost(&mut source), Some(Fault::StreamLost));
    let _again = started(37, topic, &[]);
    until_back(&mut source);
    assert!(frames(&mut source, 3).iter().all(|frame| is_pattern(frame)));
}

#[test]
fn of_two_publishers_the_first_is_taken() {
    let topic = "/camera/image_raw";
    let Some((_one, domain)) = started(38, topic, &[]) else { return };
    let mut source = opened("ros2:/camera/image_raw", domain);
    frames(&mut source, 1);
    let _two = started(38, topic, &["--size", "64x64"]);
    // Long enough for both to have sent many.
    let all = frames(&mut source, 100);
    assert!(all.iter().all(|frame| frame.image.width() == 320 && is_pattern(frame)));
    assert_eq!(topics(domain, Duration::ZERO)[0].publishers, 2);
}

#[test]
fn a_driver_takes_a_calibration_or_says_why_not() {
    let Some((mut fake, domain)) = started(39, "/camera/image_raw", &[]) else { return };
    // A message of this layout is read by rosbags, too: tests/sources/bags.py.
    let info = include_bytes!("camera_info.cdr");
    let answer = set_camera_info("ros2:/camera/image_raw", domain, info).expect("it answers");
    let service = "/camera/set_camera_info".to_owned();
    let stored = Answer { service: service.clone(), is_taken: true, words: "stored".into() };
    assert_eq!(answer, stored);
    let told = fake.wait_for("info");
    assert!(told.starts_with("info 1280 720 plumb_bob [-0.3, 0.1, "), "{told}");
    fake.say("refuse not today");
    let answer = set_camera_info("ros2:/camera/image_raw", domain, info).expect("it answers");
    assert_eq!(answer, Answer { is_taken: false, words: "not today".into(), ..stored });
    let nobody = set_camera_info("ros2:/other/deep/image", domain, info);
    let names = ["/other/deep/set_camera_info", "/other/set_camera_info", "/set_camera_info"];
    assert_eq!(nobody, Err(NotSet::NoService(names.map(str::to_owned).to_vec())));
    fake.say("deaf");
    let silent = set_camera_info("ros2:/camera/image_raw", domain, info);
    assert_eq!(silent, Err(NotSet::NoAnswer(service)));
}

#[test]
fn fast_dds_is_understood_too() {
    let Ok(program) = std::env::var("BORESIGHT_FASTDDS") else {
        eprintln!("skipped: BORESIGHT_FASTDDS names no program");
        return;
    };
    let Some(mut fake) = Fake::start(&program, &["40"]) else { return };
    let domain = domain_of(40);
    let mut source = opened("ros2:/camera/image_raw", domain);
    assert!(frames(&mut source, 20).iter().all(|frame| is_pattern(frame)));
    let info = include_bytes!("camera_info.cdr");
    let answer = set_camera_info("ros2:/camera/image_raw", domain, info).expect("it answers");
    assert!(answer.is_taken && answer.words == "stored", "{answer:?}");
    let sent: String = info.iter().map(|byte| format!("{byte:02x}")).collect();
    assert!(fake.wait_for("info").starts_with(&format!("info 00010000{sent}")));
}
