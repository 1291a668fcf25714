//! Fifty faults of cameras: each is survived, named by its code, and costs no wrong picture.

use std::{path::PathBuf, time::Duration};

use boresight::{
    capture::v4l2::{
        discover,
        kernel::{Format, FrameSizes},
    },
    device::{CameraEvent, Control, Fault, Mode},
    simulation::kernel::{SimCamera, SimFrame, SimKernel},
    text,
};

use crate::cameras::{
    FOCUS, FOCUS_AUTOMATIC, Run, SIZE, ZOOM, grey, jpeg, motion_jpeg, number, open, picture, run,
};

/// Seconds of a run, unless the case needs more.
const USUAL_SECS: f64 = 9.0;

/// Expected outcome of a case.
enum Want {
    /// The camera cannot be used, for the reason.
    Refused(Fault),
    /// The device is not listed as a camera, for the reason.
    NotListed(Fault),
    /// The camera runs without a fault.
    Works,
    /// The camera runs; at least this many frames are counted as rejected.
    Rejects(u64),
    /// The camera runs; at least this many frames are counted as dropped.
    Drops(u64),
    /// The camera runs, with the doubt.
    Doubts(Fault),
    /// The camera is lost for the reason and comes back.
    Returns(Fault),
    /// The camera is lost for the reason and stays away.
    StaysLost(Fault),
    /// The control changed; nothing may be taken until it is back.
    Moved(Control),
}

struct Case {
    name: &'static str,
    kernel: SimKernel,
    want: Want,
    secs: f64,
}

fn case(name: &'static str, want: Want, camera: SimCamera) -> Case {
    Case { name, kernel: SimKernel::new(vec![camera]), want, secs: USUAL_SECS }
}

fn changed(mut camera: SimCamera, change: impl FnOnce(&mut SimCamera)) -> SimCamera {
    change(&mut camera);
    camera
}

/// Starts at four seconds, when the camera is steady.
fn later(case: Case, happening: impl FnOnce(&mut SimCamera) + Send + 'static) -> Case {
    case.kernel.at(4.0, move |world| happening(&mut world.cameras[0]));
    case
}

/// Changes every seventh frame after the first two seconds.
fn now_and_then(
    camera: SimCamera,
    mut change: impl FnMut(u64, &mut SimFrame) + Send + 'static,
) -> SimCamera {
    camera.with_fault(move |number, frame| {
        if number > 60 && number % 7 == 0 {
            change(number, frame);
        }
    })
}

fn opening() -> Vec<Case> {
    let mut cases = vec![
        case(
            "it is not there",
            Want::Refused(Fault::NotFound),
            changed(grey(0), |c| c.present = false),
        ),
        case(
            "it may not be opened",
            Want::Refused(Fault::NotPermitted),
            changed(grey(0), |c| c.open_fails = Some(libc::EACCES)),
        ),
        case(
            "another program has it",
            Want::Refused(Fault::Busy),
            changed(grey(0), |c| c.open_fails = Some(libc::EBUSY)),
        ),
        case(
            "another program streams",
            Want::Refused(Fault::Busy),
            changed(grey(0), |c| c.set_format_fails = Some(libc::EBUSY)),
        ),
        case(
            "a node for metadata",
            Want::NotListed(Fault::NotACamera),
            changed(grey(0), |c| c.capability.node_caps = 0x0480_0000),
        ),
        case(
            "a node for output",
            Want::NotListed(Fault::NotACamera),
            changed(grey(0), |c| c.capability.node_caps = 0x0400_0002),
        ),
        case(
            "no formats",
            Want::NotListed(Fault::NoFormat),
            changed(grey(0), |c| c.formats.clear()),
        ),
        case(
            "an unknown format",
            Want::Refused(Fault::NoFormat),
            changed(grey(0), |c| c.formats[0].0 = *b"H264"),
        ),
        case(
            "a name with broken characters and commands",
            Want::Works,
            changed(grey(0), |c| c.capability.card = "caf\u{fffd}\u{1b}[2J".into()),
        ),
    ];
    let mut link = case("a link without a number", Want::Works, grey(0));
    link.kernel.world().cameras[0].node.links = vec![PathBuf::from("/dev/video_left")];
    link.secs = 5.0;
    cases.push(link);
    cases
}

fn negotiation() -> Vec<Case> {
    let half = |wanted: Format| Format {
        width: wanted.width / 2,
        height: wanted.height / 2,
        bytes_per_line: wanted.width / 2,
        ..wanted
    };
    let padded = grey(0).with_fault(|_, frame| {
        let rows = frame.bytes.chunks(SIZE.0 as usize);
        frame.bytes = rows.flat_map(|row| row.iter().copied().chain([255; 32])).collect();
        frame.bytes_used = frame.bytes.len() as u32;
    });
    vec![
        case(
            "another size is granted",
            Want::Doubts(Fault::OtherMode),
            changed(grey(0), |c| {
                c.grants = Box::new(half);
                c.picture = Box::new(|n| {
                    image::imageops::crop_imm(&picture(n), 0, 0, 48, 32).to_image().into_raw()
                });
            }),
        ),
        case(
            "another format is granted",
            Want::Doubts(Fault::OtherMode),
            changed(grey(0), |c| {
                c.grants = Box::new(|wanted| Format {
                    fourcc: *b"YUYV",
                    bytes_per_line: 2 * wanted.width,
                    ..wanted
                });
                c.picture = Box::new(|n| {
                    picture(n).into_raw().into_iter().flat_map(|y| [y, 128]).collect()
                });
            }),
        ),
        case(
            "rows are padded",
            Want::Works,
            changed(padded, |c| {
                c.grants =
                    Box::new(|wanted| Format { bytes_per_line: wanted.width + 32, ..wanted });
            }),
        ),
        case(
            "the size in bytes is said to be 0",
            Want::Works,
            changed(grey(0), |c| {
                c.grants = Box::new(|wanted| Format { size_image: 0, bytes_per_line: 0, ..wanted });
            }),
        ),
        case(
            "the interval is 0/0",
            Want::Works,
            changed(grey(0), |c| {
                c.formats[0].2 = vec![(0, 0)];
                c.grants_interval = Some((0, 0));
            }),
        ),
        case(
            "sizes come as a range",
            Want::Works,
            changed(grey(0), |c| {
                c.formats[0].1 =
                    vec![FrameSizes::Stepwise { width: (32, 96, 16), height: (32, 64, 0) }];
            }),
        ),
        case(
            "capabilities and interval are nonsense",
            Want::Works,
            changed(grey(0), |c| {
                c.capability.node_caps = u32::MAX;
                c.formats[0].2 = vec![(u32::MAX, 1), (1, u32::MAX), (1, 30)];
            }),
        ),
        case("fewer buffers than asked for", Want::Works, changed(grey(0), |c| c.most_buffers = 2)),
    ]
}

fn starting() -> Vec<Case> {
    let slow_start = |secs: u64| changed(grey(0), |c| c.start_nanos = secs * 1_000_000_000);
    vec![
        case(
            "no bandwidth",
            Want::Refused(Fault::NoBandwidth),
            changed(grey(0), |c| c.stream_on_fails = Some(libc::ENOSPC)),
        ),
        case(
            "the start fails",
            Want::Refused(Fault::Transfer),
            changed(grey(0), |c| c.stream_on_fails = Some(libc::EIO)),
        ),
        case("no first picture", Want::StaysLost(Fault::NoFirstFrame), slow_start(1000)),
        case("the first picture takes 3 s", Want::Works, slow_start(3)),
    ]
}

fn running() -> Vec<Case> {
    let stall = |c: &mut SimCamera| {
        c.frame_faults.push(Box::new(|number, frame| frame.delivered &= number > 200));
    };
    let cut = |_: u64, frame: &mut SimFrame| frame.bytes_used = frame.bytes_used * 2 / 3;
    let splice = |number: u64, frame: &mut SimFrame| {
        let other = jpeg(number + 8, SIZE);
        let at = frame.bytes.len().min(other.len()) / 2;
        frame.bytes.truncate(at);
        frame.bytes.extend(&other[at..]);
        frame.bytes_used = frame.bytes.len() as u32;
    };
    let no_tables = |_: u64, frame: &mut SimFrame| {
        frame.bytes = without_tables(&frame.bytes);
        frame.bytes_used = frame.bytes.len() as u32;
    };
    let mut last = Vec::new();
    let again = move |number: u64, frame: &mut SimFrame| {
        if number.is_multiple_of(7) && !last.is_empty() {
            frame.bytes.clone_from(&last);
        }
        last.clone_from(&frame.bytes);
    };
    let from_four = |value: fn(u64) -> u8| {
        move |number: u64, frame: &mut SimFrame| {
            if number > 110 {
                // Noise makes all frames different.
                let lit = |(at, byte): (usize, &mut u8)| {
                    *byte = value(number) + (at as u64 * number % 5) as u8;
                };
                frame.bytes.iter_mut().enumerate().for_each(lit);
            }
        }
    };
    vec![
        later(case("the stream stalls and goes on", Want::Returns(Fault::Stalled), grey(0)), stall),
        later(
            case("ready for nothing, again and again", Want::Returns(Fault::Stalled), grey(0)),
            |c| c.dequeue_fails = Some((libc::EAGAIN, 200)),
        ),
        later(case("signals", Want::Works, grey(0)), |c| c.interruptions = 500),
        later(case("single transfer errors", Want::Works, grey(0)), |c| {
            c.dequeue_fails = Some((libc::EIO, 2));
        }),
        later(
            case("a buffer that is not there", Want::Returns(Fault::DriverBroken), grey(0)),
            |c| {
                let mut once = true;
                c.frame_faults.push(Box::new(move |_, frame| {
                    if std::mem::take(&mut once) {
                        frame.index = Some(9);
                    }
                }));
            },
        ),
        case(
            "frames with the error flag",
            Want::Rejects(10),
            now_and_then(grey(0), |_, frame| frame.error = true),
        ),
        case(
            "frames without bytes",
            Want::Rejects(10),
            now_and_then(grey(0), |_, frame| frame.bytes_used = 0),
        ),
        case(
            "frames with too many bytes",
            Want::Rejects(10),
            now_and_then(grey(0), |_, frame| frame.bytes_used = 1 << 30),
        ),
        case("cut JPEG", Want::Rejects(10), now_and_then(motion_jpeg(0), cut)),
        case("JPEG without tables", Want::Works, now_and_then(motion_jpeg(0), no_tables)),
        case(
            "JPEG of another size",
            Want::Rejects(10),
            now_and_then(motion_jpeg(0), |n, frame| {
                frame.bytes = jpeg(n, (80, 64));
                frame.bytes_used = frame.bytes.len() as u32;
            }),
        ),
        case("two JPEG frames in one", Want::Rejects(10), now_and_then(motion_jpeg(0), splice)),
        case("frames that come twice", Want::Drops(10), grey(0).with_fault(again)),
        case(
            "gaps in the numbers",
            Want::Drops(10),
            now_and_then(grey(0), |_, frame| frame.delivered = false),
        ),
        case(
            "numbers and times run backwards",
            Want::Works,
            changed(
                now_and_then(grey(0), |number, frame| {
                    frame.sequence = 5;
                    frame.nanos = if number % 2 == 0 { 0 } else { u64::MAX };
                }),
                |c| c.first_sequence = u32::MAX - 20,
            ),
        ),
        case(
            "a frozen picture",
            Want::Doubts(Fault::Frozen),
            grey(0).with_fault(|number, frame| {
                if number > 110 {
                    frame.bytes = picture(110).into_raw();
                }
            }),
        ),
        case("black pictures", Want::Doubts(Fault::Dark), grey(0).with_fault(from_four(|_| 4))),
        case(
            "pictures lit in turn",
            Want::Doubts(Fault::Infrared),
            grey(0).with_fault(from_four(|n| if n % 2 == 0 { 40 } else { 160 })),
        ),
        later(case("half the rate", Want::Doubts(Fault::Slow), grey(0)), |c| c.slowness = 2.0),
    ]
}

fn losing() -> Vec<Case> {
    let unplugged = |name, want, back: Option<SimCamera>| {
        let case = case(name, want, grey(0));
        case.kernel.at(4.0, |world| world.cameras[0].present = false);
        case.kernel.at(5.0, |world| match back {
            Some(camera) => world.cameras.push(camera),
            None => world.cameras[0].present = true,
        });
        case
    };
    let other = changed(grey(0), |c| {
        c.node.serial = "B2".into();
        c.capability.card = "Another camera".into();
    });
    let elsewhere = changed(grey(3), |c| c.node.place = "pci0000:00/usb2/2-4/2-4:1.0".into());
    let slept = case("the computer slept", Want::Returns(Fault::Suspended), grey(0));
    slept.kernel.at(4.0, |world| world.slept_nanos += 60_000_000_000);
    vec![
        unplugged("unplugged and plugged in", Want::Returns(Fault::Unplugged), None),
        later(case("an error without a reason", Want::StaysLost(Fault::Transfer), grey(0)), |c| {
            c.poll_error = true;
        }),
        later(unplugged("the stop fails, too", Want::Returns(Fault::Unplugged), None), |c| {
            c.stream_off_fails = Some(libc::EIO);
        }),
        unplugged(
            "back at another port under another number",
            Want::Returns(Fault::Unplugged),
            Some(elsewhere),
        ),
        unplugged("another camera in its place", Want::StaysLost(Fault::OtherCamera), Some(other)),
        slept,
    ]
}

fn controls() -> Vec<Case> {
    let deaf = changed(grey(0), |c| {
        let focus = c.controls.get_mut(&FOCUS_AUTOMATIC).expect("there");
        (focus.obeys, focus.value) = (false, 1);
        c.controls.get_mut(&FOCUS).expect("there").obeys = false;
        let zoom = c.controls.get_mut(&ZOOM).expect("there");
        (zoom.range.max, zoom.obeys) = (90, false);
    });
    vec![
        case("a control is set and nothing happens", Want::Doubts(Fault::ControlIgnored), deaf),
        later(case("autofocus comes back on", Want::Moved(Control::Focus), grey(0)), |c| {
            c.controls.get_mut(&FOCUS_AUTOMATIC).expect("there").value = 1;
            c.controls.get_mut(&FOCUS).expect("there").value = 44;
        }),
        later(case("zoom moves", Want::Moved(Control::Zoom), grey(0)), |c| {
            c.controls.get_mut(&ZOOM).expect("there").value = 140;
        }),
    ]
}

/// The JPEG without Huffman tables.
fn without_tables(bytes: &[u8]) -> Vec<u8> {
    let (mut kept, mut at) = (bytes[..2].to_vec(), 2);
    loop {
        let length = 2 + usize::from(u16::from_be_bytes([bytes[at + 2], bytes[at + 3]]));
        if bytes[at + 1] != 0xC4 {
            kept.extend(&bytes[at..at + length]);
        }
        at += length;
        if bytes[at - length + 1] == 0xDA {
            kept.extend(&bytes[at..]);
            return kept;
        }
    }
}

/// Pictures different from all of the camera's.
fn wrong_pictures(run: &Run, name: &str) -> usize {
    // Compressed, cropped or repainted pictures have another table.
    let known: Vec<_> = if name.contains("JPEG") {
        (0..17).map(|n| zune(&jpeg(n, SIZE))).collect()
    } else {
        Vec::new()
    };
    let painted = ["black", "lit in turn", "another size"].iter().any(|word| name.contains(word));
    let right = |image: &image::GrayImage| match known.is_empty() {
        true => painted || number(image).is_some(),
        false => known.contains(image),
    };
    run.frames.iter().filter(|(_, _, image)| !right(image)).count()
}

fn zune(bytes: &[u8]) -> image::GrayImage {
    let size = boresight::frame::ImageSize { width_px: SIZE.0, height_px: SIZE.1 };
    boresight::capture::Unpacker::new(boresight::device::PixelLayout::Mjpeg, size, 0)
        .unpack(bytes)
        .expect("whole")
}

fn check(case: Case) -> Result<String, String> {
    let Case { name, kernel, want, secs } = case;
    let told = |fault: Fault| {
        let (cause, action) = text::camera::fault(fault);
        format!("{}: {cause}. {action}", fault.code())
    };
    let source_name = if name.contains("link") { "/dev/video_left" } else { "/dev/video0" };
    let listed = !discover(&mut kernel.clone()).cameras.is_empty();
    let mut source = match (open(&kernel, source_name), &want) {
        (Ok(source), Want::Refused(_) | Want::NotListed(_)) => {
            drop(source);
            return Err("it was opened".into());
        }
        (Ok(source), _) => source,
        (Err(fault), Want::Refused(wanted)) if fault == *wanted => {
            return clean(&kernel).map(|()| told(fault));
        }
        (Err(fault), Want::NotListed(wanted)) if fault == *wanted && !listed => {
            return clean(&kernel).map(|()| told(fault));
        }
        (Err(fault), _) => return Err(format!("refused: {}", fault.code())),
    };
    let run = run(&mut source, &kernel, secs);
    drop(source);
    clean(&kernel)?;
    let wrong = wrong_pictures(&run, name);
    if wrong > 0 {
        return Err(format!("{wrong} wrong pictures of {}", run.frames.len()));
    }
    if !run.frames.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 < pair[1].1) {
        return Err("numbers or times do not rise".into());
    }
    if run.longest > Duration::from_millis(2100) {
        return Err(format!("a call took {:?}", run.longest));
    }
    let lost = run.lost();
    let most = run.frames.len();
    let good = match want {
        Want::Refused(_) | Want::NotListed(_) => false,
        Want::Works => lost.is_empty() && most > 50 && run.doubts().is_empty(),
        Want::Rejects(least) => lost.is_empty() && most > 50 && run.counted.1 >= least,
        Want::Drops(least) => lost.is_empty() && most > 50 && run.counted.0 >= least,
        Want::Doubts(fault) => lost.is_empty() && run.doubts().contains(&fault),
        Want::Returns(fault) => lost == [fault] && run.returned(),
        Want::StaysLost(fault) => lost.last() == Some(&fault) && !run.returned(),
        Want::Moved(control) => {
            let moved = |event: &CameraEvent| matches!(event, CameraEvent::ControlChanged(change) if change.control == control);
            run.events.iter().any(moved) && run.takeable < most && lost.is_empty()
        }
    };
    let seen = match want {
        Want::Doubts(fault) | Want::Returns(fault) | Want::StaysLost(fault) => told(fault),
        Want::Moved(_) => told(Fault::GeometryMoved),
        Want::Rejects(_) | Want::Drops(_) => {
            format!("{} dropped, {} rejected", run.counted.0, run.counted.1)
        }
        _ => format!("{most} pictures"),
    };
    let rest = format!(
        "lost {lost:?}, doubts {:?}, counted {:?}, {most} pictures, {} takeable; {:?}",
        run.doubts(),
        run.counted,
        run.takeable,
        run.events
    );
    good.then_some(seen).ok_or(rest)
}

/// Checks the kernel's rules and for leftovers.
fn clean(kernel: &SimKernel) -> Result<(), String> {
    if kernel.open_devices() > 0 {
        return Err("a device is still open".into());
    }
    let violations = kernel.world().violations.clone();
    if violations.is_empty() { Ok(()) } else { Err(format!("{violations:?}")) }
}

#[test]
fn fifty_faults_are_survived_and_named() {
    let cases: Vec<Case> = [opening(), negotiation(), starting(), running(), losing(), controls()]
        .into_iter()
        .flatten()
        .collect();
    assert_eq!(cases.len(), 50);
    let mut failed = Vec::new();
    for case in cases {
        let name = case.name;
        match check(case) {
            Ok(seen) => println!("{name:46} {seen}"),
            Err(why) => failed.push(format!("{name}: {why}")),
        }
    }
    println!("{} of 50", 50 - failed.len());
    assert!(failed.is_empty(), "\n{}\n", failed.join("\n"));
}

/// Tables of docs/cameras.md: each fault has a row; each answer has an existing test.
#[test]
fn the_tables_of_sources_have_every_fault_and_a_test_for_every_answer() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let read = |file: &str| {
        std::fs::read_to_string(root.join(file)).unwrap_or_else(|err| panic!("{file}: {err}"))
    };
    let page = read("docs/cameras.md");
    let rows = |from: &str| -> Vec<Vec<String>> {
        let lines = page.lines().skip_while(|line| !line.starts_with(from)).skip(2);
        let cells = |line: &str| line.split('|').map(|cell| cell.trim().to_owned()).collect();
        lines.take_while(|line| line.starts_with('|')).map(cells).collect()
    };
    let faults = rows("| | fault |");
    let names: Vec<&str> = [opening(), negotiation(), starting(), running(), losing(), controls()]
        .iter()
        .flatten()
        .map(|case| case.name)
        .collect();
    assert_eq!(faults.iter().map(|row| row[2].as_str()).collect::<Vec<_>>(), names);
    let head = page.lines().find(|line| line.starts_with("| | fault |")).expect("a table");
    let sources: Vec<&str> =
        head.split('|').skip(3).map(str::trim).filter(|cell| !cell.is_empty()).collect();
    let mut tested = vec![std::collections::BTreeSet::new(); sources.len()];
    for row in rows("| source | test | faults |") {
        let quoted: Vec<&str> = row[2].split('`').skip(1).step_by(2).collect();
        let [file, name] = quoted[..] else { panic!("{row:?}") };
        assert!(read(file).contains(&format!("fn {name}(")), "{file} has no test {name}");
        let source = sources.iter().position(|source| source.starts_with(&row[1])).expect("known");
        let numbers = row[3].split(", ").flat_map(|part| match part.split_once(" to ") {
            Some((first, last)) => number_of(first)..=number_of(last),
            None => number_of(part)..=number_of(part),
        });
        tested[source].extend(numbers);
    }
    for (at, row) in faults.iter().enumerate() {
        for (source, tested) in tested.iter().enumerate() {
            let is_answered = !row[3 + source].starts_with('–');
            assert_eq!(tested.contains(&(at + 1)), is_answered, "{}: {}", row[2], sources[source]);
        }
    }
}

fn number_of(text: &str) -> usize {
    text.parse().unwrap_or_else(|_| panic!("{text:?} is no row"))
}

#[test]
fn unplugging_is_noticed_within_two_seconds_and_the_camera_streams_within_five() {
    let kernel = SimKernel::new(vec![grey(0)]);
    for cycle in 0..500 {
        let secs = 4.0 + f64::from(cycle) * 4.0;
        kernel.at(secs, |world| world.cameras[0].present = false);
        kernel.at(secs + 1.0, move |world| {
            let camera = &mut world.cameras[0];
            camera.present = true;
            camera.node.path = format!("/dev/video{}", cycle % 3).into();
        });
    }
    let mut source = open(&kernel, "usb:0c45:6366:A1").expect("opens");
    let run = run(&mut source, &kernel, 2004.0);
    drop(source);
    clean(&kernel).expect("clean");
    assert_eq!(run.lost(), vec![Fault::Unplugged; 500]);
    let returns = run.events.iter().filter(|e| matches!(e, CameraEvent::Returned { .. })).count();
    assert_eq!(returns, 500, "each return is within its cycle of 3 s");
}

#[test]
fn controls_are_put_back_when_the_session_ends() {
    let kernel = SimKernel::new(vec![grey(0)]);
    let values = |kernel: &SimKernel| -> Vec<i64> {
        kernel.world().cameras[0].controls.values().map(|control| control.value).collect()
    };
    let before = values(&kernel);
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    let run = run(&mut source, &kernel, 4.0);
    let locked = run.events.iter().find_map(|event| match event {
        CameraEvent::Locked { locks } => Some(*locks),
        _ => None,
    });
    let focus = locked.expect("locked").focus;
    assert_eq!(focus, boresight::device::Lock::Locked { value: 30 });
    assert_ne!(values(&kernel), before);
    drop(source);
    assert_eq!(values(&kernel), before);
}

#[test]
fn each_damaged_frame_is_told_with_the_next_good_one() {
    let kernel = SimKernel::new(vec![now_and_then(grey(0), |_, frame| frame.error = true)]);
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    let counts: Vec<u64> = run(&mut source, &kernel, 6.0)
        .events
        .iter()
        .filter_map(|event| match event {
            CameraEvent::Counted { rejected, .. } => Some(*rejected),
            _ => None,
        })
        .collect();
    assert!(counts.len() > 10, "{counts:?}");
    assert!(counts.windows(2).all(|two| two[1] - two[0] <= 1), "{counts:?}");
}

#[test]
fn equal_cameras_are_told_apart_by_their_port_whatever_the_order() {
    for order in 0..200_u32 {
        // Three identical cameras, found in another order each time.
        let ports = [1, 2, 3].map(|port| format!("pci0000:00/usb1/1-{port}/1-{port}:1.0"));
        let mut cameras = Vec::new();
        for (at, port) in ports.iter().enumerate() {
            let mut camera = grey((at as u32 + order) % 3);
            camera.node.place.clone_from(port);
            camera.node.serial = if order % 2 == 0 { String::new() } else { "SN0001".into() };
            cameras.push(camera);
        }
        cameras.rotate_left(order as usize % 3);
        let kernel = SimKernel::new(cameras);
        let serial = if order % 2 == 0 { "" } else { ":SN0001" };
        assert_eq!(open(&kernel, &format!("usb:0c45:6366{serial}")).err(), Some(Fault::Twin));
        let mut source = open(&kernel, &format!("usb:0c45:6366{serial}@1-2")).expect("one of them");
        assert_eq!(source.camera().node.place, ports[1]);
        // It goes; the others stay, and none is taken for it.
        kernel.at(4.0, |world| {
            world
                .cameras
                .iter_mut()
                .filter(|c| c.node.place.contains("1-2:"))
                .for_each(|c| c.present = false);
        });
        let gone = run(&mut source, &kernel, 7.0);
        assert!(!gone.returned() && gone.lost() == [Fault::Unplugged], "{:?}", gone.events);
    }
}

#[test]
fn a_mode_is_what_the_driver_grants() {
    let kernel = SimKernel::new(vec![grey(0)]);
    let Mode { size, interval_secs, .. } = open(&kernel, "/dev/video0").expect("opens").mode();
    assert_eq!((size.width_px, size.height_px, interval_secs), (SIZE.0, SIZE.1, Some((1, 30))));
}
