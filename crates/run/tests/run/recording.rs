//! Recorded data comes back bit for bit, whatever happened to the program or to the file.

use std::{fs, path::Path};

use boresight_app::SavedSession;
use boresight_detect::{Detection, Miss, OtherBoard, Quality, Side};
use boresight_geometry::{
    Corner,
    device::{CameraInfo, Control, ControlBefore, Mode, PixelLayout},
    frame::{CaptureTime, Frame, FrameId, FrameKind, SceneScale},
    markers::{CircleRows, Dictionary},
};
use boresight_guide::{
    guidance::{Purpose, Target},
    session::{Command, Input, Observation, Session, ViewNumber},
};
use boresight_run::{
    config::Config,
    recording::{Header, Journal, RecordingError, Replayed, SessionFolder, replay, stored_frame},
};
use boresight_testkit::world::{SIZE, World, guided, setup};
use image::GrayImage;
use nalgebra::{Isometry3, Matrix2, Point2};
use proptest::{prelude::*, test_runner::RngSeed};
use tempfile::TempDir;

fn header() -> Header {
    Header::new("sim", SIZE, Config::load(None, &[]).expect("defaults"))
}

/// Records a guided session and returns the final state.
fn recorded(path: &Path) -> Session {
    let mut folder = SessionFolder::create(path, &header()).expect("created");
    let (_, session, _) = guided(3, |input, decision| {
        folder.journal_mut().append(input, decision, None, false).expect("appended");
    });
    session
}

fn journal(path: &Path) -> std::path::PathBuf {
    path.join("journal.jsonl")
}

#[test]
fn a_recording_replays_to_the_same_session() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let live = recorded(&path);
    let contents = SessionFolder::journal(&path).expect("whole");
    assert!(!contents.cut && contents.lines.len() > 50, "{} lines", contents.lines.len());
    let mut session = Session::new(setup(live.setup().board));
    let replayed = replay(&mut session, &contents.lines, |_, _| ()).expect("readable");
    assert_eq!(replayed, Replayed::default());
    assert_eq!(session.accepted(), live.accepted());
    let camera = |session: &Session| session.calibration().expect("calibrated").camera;
    assert_eq!(camera(&session), camera(&live));
}

#[test]
fn another_setting_gives_other_decisions_and_says_where() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let live = recorded(&path);
    let mut setup = setup(live.setup().board);
    setup.guidance.hold_secs = 0.9;
    let lines = SessionFolder::journal(&path).expect("whole").lines;
    let replayed = replay(&mut Session::new(setup), &lines, |_, _| ()).expect("readable");
    assert!(!replayed.differences.is_empty());
    let numbers: Vec<usize> = replayed.differences.iter().map(|one| one.line).collect();
    assert_eq!(numbers, replayed.different_lines);
    assert!(numbers.is_sorted_by(|a, b| a < b));
}

#[test]
fn a_line_cut_at_any_byte_is_dropped_and_the_session_goes_on() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    recorded(&path);
    let bytes = fs::read(journal(&path)).expect("readable");
    let whole = SessionFolder::journal(&path).expect("whole").lines.len();
    let last = bytes[..bytes.len() - 1].iter().rposition(|b| *b == b'\n').expect("lines") + 1;
    for cut_at in (last..bytes.len()).step_by(97).chain([last + 1, bytes.len() - 1]) {
        fs::write(journal(&path), &bytes[..cut_at]).expect("written");
        let (mut folder, _, contents) = SessionFolder::open(&path).expect("opens");
        assert_eq!(contents.lines.len(), whole - 1, "cut at {cut_at}");
        assert_eq!(contents.cut, cut_at > last);
        let mut session = Session::new(setup(World::new(3).board));
        replay(&mut session, &contents.lines, |_, _| ()).expect("readable");
        let decision = session.handle(&Input::Resumed);
        folder.journal_mut().append(&Input::Resumed, &decision, None, true).expect("appended");
        drop(folder);
        assert_eq!(SessionFolder::journal(&path).expect("whole").lines.len(), whole);
    }
}

#[test]
fn a_damaged_line_is_named_and_what_stands_before_it_is_saved() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    recorded(&path);
    let bytes = fs::read(journal(&path)).expect("readable");
    let starts: Vec<usize> = std::iter::once(0)
        .chain(bytes.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(at, _)| at + 1))
        .collect();
    for (line, offset) in [(1, 30), (20, 5), (20, 200), (41, 60)] {
        let mut damaged = bytes.clone();
        damaged[starts[line - 1] + offset] ^= 0x04;
        fs::write(journal(&path), &damaged).expect("written");
        match SessionFolder::open(&path) {
            Err(RecordingError::Damaged { damage, .. }) => assert_eq!(damage.line, line),
            other => assert!(other.is_err(), "line {line}: opened"),
        }
        let before = Journal::read_until_damage(&journal(&path)).expect("readable");
        assert_eq!(before.lines.len(), line - 1);
        assert_eq!(fs::read(journal(&path)).expect("readable"), damaged, "nothing is changed");
    }
    // An altogether missing line breaks the count of the next.
    let mut missing = bytes[..starts[9]].to_vec();
    missing.extend(&bytes[starts[10]..]);
    fs::write(journal(&path), missing).expect("written");
    let opened = SessionFolder::journal(&path);
    assert!(matches!(opened, Err(RecordingError::Damaged { damage, .. }) if damage.line == 10));
}

#[test]
fn what_a_power_cut_leaves_of_lines_that_were_not_synced_is_dropped() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let mut folder = SessionFolder::create(&path, &header()).expect("created");
    let mut count = 0;
    guided(3, |input, decision| {
        count += 1;
        folder.journal_mut().append(input, decision, None, count == 20).expect("appended");
    });
    drop(folder);
    let bytes = fs::read(journal(&path)).expect("readable");
    let ends: Vec<usize> =
        bytes.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(at, _)| at + 1).collect();
    let with_hole = |from: usize, to: usize| {
        let mut holed = bytes.clone();
        holed[from..to].fill(0);
        fs::write(journal(&path), &holed).expect("written");
        SessionFolder::open(&path).map(|(_, _, contents)| (contents.lines.len(), contents.cut))
    };
    // After the synced line: anything lost by the disk is a cut.
    for (from, to, left) in [
        (ends[24] + 3, ends[30] - 5, 25),
        (ends[24], ends[25], 25),
        (ends[20] + 1, bytes.len(), 21),
        (ends[40] + 9, bytes.len() - 1, 41),
    ] {
        assert_eq!(with_hole(from, to).expect("opens"), (left, true), "{from} to {to}");
    }
    // Before it, a line knows about the others: their loss is damage.
    for (from, to) in [(ends[3] + 2, ends[4] - 2), (0, 40), (ends[18], ends[19])] {
        let opened = with_hole(from, to);
        assert!(matches!(opened, Err(RecordingError::Damaged { .. })), "{opened:?}");
    }
    // Nothing but a zero is a hole.
    let mut flipped = bytes.clone();
    flipped[ends[24] + 30] ^= 4;
    fs::write(journal(&path), flipped).expect("written");
    assert!(matches!(SessionFolder::open(&path), Err(RecordingError::Damaged { .. })));
}

#[test]
fn memory_does_not_grow_with_the_length_of_a_session() {
    let place = TempDir::new().expect("folder");
    let peak = |count: usize| {
        let path = place.path().join(count.to_string());
        let mut folder = SessionFolder::create(&path, &header()).expect("created");
        let mut world = World::new(3);
        let mut session = Session::new(setup(world.board));
        for index in 0..count {
            // A constantly moving board.
            let x_m = if index % 2 == 0 { -0.15 } else { -0.05 };
            let input = Input::Observed(world.observe(&Isometry3::translation(x_m, -0.05, 0.5)));
            let decision = session.handle(&input);
            folder.journal_mut().append(&input, &decision, None, false).expect("appended");
        }
        drop(folder);
        let mut held = None;
        let memory = allocation_counter::measure(|| held = SavedSession::open(&path).ok());
        let saved = held.expect("a session");
        assert_eq!(saved.contents.lines.len(), count);
        assert_eq!(saved.replayed, Replayed::default());
        memory.bytes_max
    };
    let (short, long) = (peak(300), peak(3000));
    println!("bytes at most: {short} with 300 lines, {long} with 3,000");
    assert!(long < short + (64 << 10), "{short} -> {long}");
}

#[test]
fn a_session_belongs_to_its_header() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    recorded(&path);
    let file = path.join("session.toml");
    let text = fs::read_to_string(&file).expect("readable");
    assert!(SessionFolder::read(&path).expect("whole").1.header_crc32.is_some());
    fs::write(&file, text.replace("hold_secs = ", "hold_secs = 1")).expect("written");
    for refused in [SessionFolder::read(&path).err(), SessionFolder::open(&path).err()] {
        assert!(matches!(refused, Some(RecordingError::OtherHeader { .. })), "{refused:?}");
    }
    // Invalid numbers of any origin.
    for nonsense in [
        text.replace("hold_secs = 0.3", "hold_secs = nan"),
        text.replace("image_size_px = [1280, 720]", "image_size_px = [0, 720]"),
        text.replace("target_margin = ", "target_margin = inf # "),
    ] {
        assert_ne!(nonsense, text);
        fs::write(&file, nonsense).expect("written");
        let refused = SessionFolder::header(&path);
        assert!(matches!(refused, Err(RecordingError::Header { .. })), "{refused:?}");
    }
}

#[test]
fn a_session_is_open_once_and_never_made_twice() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let folder = SessionFolder::create(&path, &header()).expect("created");
    assert!(matches!(SessionFolder::open(&path), Err(RecordingError::Locked { .. })));
    drop(folder);
    let before = fs::read(path.join("session.toml")).expect("readable");
    let again = SessionFolder::create(&path, &header());
    assert!(matches!(again, Err(RecordingError::NotNew { .. })));
    assert_eq!(fs::read(path.join("session.toml")).expect("readable"), before);
    assert!(SessionFolder::open(&path).is_ok());
}

#[test]
fn a_session_names_its_camera() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let control = |control, value, automatic| ControlBefore {
        control,
        value: Some(value),
        automatic,
        exact: vec![(9_963_800, 7)],
    };
    let facts = CameraInfo {
        name: "evil \u{1b}[2J \"name\"".into(),
        usb_id: Some((0x046d, 0x082d)),
        serial: "0001".into(),
        place: "pci0000:00/usb1/1-3".into(),
        backend: "v4l",
        mode: Mode { size: SIZE, layout: PixelLayout::Mjpeg, interval_secs: Some((1, 30)) },
        controls: vec![control(Control::Focus, 30, Some(true)), control(Control::Zoom, -1, None)],
    };
    let header = header().of_camera(Some(facts));
    drop(SessionFolder::create(&path, &header).expect("created"));
    assert_eq!(SessionFolder::header(&path).expect("readable"), header);
    let text = fs::read_to_string(path.join("session.toml")).expect("readable");
    for line in
        ["[camera]", "usb = \"046d:082d\"", "format = \"MJPG\"", "rate_hz = 30.0", "value = 30"]
    {
        assert!(text.contains(line), "no {line:?} in {text}");
    }
}

#[test]
fn a_newer_or_foreign_header_is_refused() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    recorded(&path);
    let file = path.join("session.toml");
    let text = fs::read_to_string(&file).expect("readable");
    for wrong in [
        text.replace("boresight.session/1", "boresight.session/2"),
        text.replace("columns", "colums"),
        "not toml [".to_owned(),
        String::new(),
    ] {
        assert_ne!(wrong, text);
        fs::write(&file, &wrong).expect("written");
        let refused = SessionFolder::open(&path);
        assert!(matches!(refused, Err(RecordingError::Header { .. })), "{refused:?}");
        assert_eq!(fs::read_to_string(&file).expect("readable"), wrong, "nothing is changed");
    }
}

#[test]
fn pictures_are_kept_exactly_and_damage_is_noticed() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let folder = SessionFolder::create(&path, &header()).expect("created");
    let image = GrayImage::from_fn(64, 48, |x, y| image::Luma([(x * 7 + y * 13 + x * y) as u8]));
    let frame = Frame {
        id: FrameId(5),
        captured_at: CaptureTime { nanos: 1 },
        kind: FrameKind::Video,
        name: String::new(),
        image: image.clone(),
    };
    let stored = folder.store_frame(frame.id, &frame).expect("stored");
    assert_eq!(stored_frame(&path, &stored).expect("whole"), image);
    let file = path.join("frames/00000005.png");
    let mut bytes = fs::read(&file).expect("readable");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&file, bytes).expect("written");
    assert!(matches!(stored_frame(&path, &stored), Err(RecordingError::Frame { .. })));
    fs::remove_file(&file).expect("removed");
    assert!(stored_frame(&path, &stored).is_err());
}

fn number() -> impl Strategy<Value = f64> {
    // Every kind of finite number, the subnormal ones, too.
    any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |x| x.is_finite())
}

fn seen() -> impl Strategy<Value = Result<Detection, Miss>> {
    let corner = (number(), number(), number(), number(), number())
        .prop_map(|(x, y, a, b, c)| Corner::new(Point2::new(x, y), Matrix2::new(a, b, b, c)));
    let unseen = (number(), number()).prop_map(|(x, y)| Corner::unseen(Point2::new(x, y)));
    let corner = prop_oneof![4 => corner, 1 => unseen];
    let detection = (prop::collection::vec(corner, 0..6), [(); 4].map(|()| number())).prop_map(
        |(corners, [blur_px, contrast, glare, motion_px])| {
            Ok(Detection { corners, quality: Quality { blur_px, contrast, glare, motion_px } })
        },
    );
    let side = prop::option::of(prop::sample::select(vec![
        Side::Left,
        Side::Right,
        Side::Top,
        Side::Bottom,
    ]));
    prop_oneof![
        detection,
        Just(Err(Miss::NoBoard)),
        Just(Err(Miss::OutOfTime)),
        (0..99_usize, 1..99_usize, [0..9_usize, 0..9_usize], side).prop_map(
            |(found, wanted, size, cut_off_by)| Err(Miss::PartialBoard {
                found,
                wanted,
                size,
                cut_off_by
            })
        ),
        (number(), number())
            .prop_map(|(square_px, needed_px)| Err(Miss::TooSmall { square_px, needed_px })),
        (number(), number())
            .prop_map(|(blur_px, limit_px)| Err(Miss::Blurred { blur_px, limit_px })),
        (number(), number())
            .prop_map(|(contrast, needed)| Err(Miss::LowContrast { contrast, needed })),
        (3..99_usize, 3..99_usize)
            .prop_map(|(columns, rows)| Err(Miss::OtherBoard(OtherBoard::Plain { columns, rows }))),
        (3..99_usize, 3..99_usize).prop_map(|(columns, rows)| {
            let layout = CircleRows::Asymmetric;
            Err(Miss::OtherBoard(OtherBoard::Circles { columns, rows, layout }))
        }),
        Just(Err(Miss::OtherBoard(OtherBoard::AprilGrid))),
        any::<bool>().prop_map(|is_usual_side| {
            let dictionary = Dictionary::default();
            Err(Miss::OtherBoard(OtherBoard::Charuco { dictionary, is_usual_side }))
        }),
        Just(Err(Miss::Mirrored)),
        (0_usize..50).prop_map(|markers| Err(Miss::OtherMarkers { markers })),
        (0_usize..50).prop_map(|markers| Err(Miss::OtherSquares { markers })),
        (0..99_usize, 1..99_usize).prop_map(|(found, wanted)| Err(Miss::Glare { found, wanted })),
    ]
}

fn input() -> impl Strategy<Value = Input> {
    let observed = (any::<u64>(), any::<u64>(), any::<bool>(), ".*", seen()).prop_map(
        |(frame, nanos, video, name, seen)| {
            Input::Observed(Observation {
                frame_id: FrameId(frame),
                captured_at: CaptureTime { nanos },
                kind: if video { FrameKind::Video } else { FrameKind::Photograph },
                name,
                image_size: SIZE,
                seen,
            })
        },
    );
    prop_oneof![
        4 => observed,
        1 => prop::sample::select(vec![
            Input::Command(Command::ForceNext),
            Input::Command(Command::UndoLast),
            Input::Command(Command::Remove { view: ViewNumber(7) }),
            Input::Command(Command::Restore),
            Input::Command(Command::Pause),
            Input::Command(Command::Resume),
            Input::Command(Command::TakeMore),
            Input::Led(None),
            Input::Scene(vec![(ViewNumber(7), SceneScale { log_focal: -0.011, sd: 4e-4 })]),
            Input::Resumed,
            Input::SourceEnded,
            Input::Stop,
        ]),
        1 => (".*", ".*").prop_map(|(worker, reason)| Input::WorkerFailed { worker, reason }),
        1 => prop::collection::vec(((0.0..2000.0), (0.0..2000.0)), 0..60).prop_map(|ghost_px| {
            Input::Led(Some(Target {
                purpose: Purpose::MostInformative,
                tilt_azimuth_rad: ghost_px.len() as f64 / 60.0,
                tilt_rad: 0.6,
                ghost_px: ghost_px.into_iter().map(|(x, y)| Point2::new(x, y)).collect(),
                leaves_picture: false,
            }))
        }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 48,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    /// Observations are read back bit for bit.
    #[test]
    fn inputs_come_back_bit_for_bit(inputs in prop::collection::vec(input(), 1..8)) {
        let place = TempDir::new().expect("folder");
        let mut folder = SessionFolder::create(&place.path().join("s"), &header()).expect("created");
        let mut session = Session::new(setup(World::new(3).board));
        for input in &inputs {
            let decision = session.handle(&Input::Stop);
            folder.journal_mut().append(input, &decision, None, false).expect("appended");
        }
        let lines = SessionFolder::journal(&place.path().join("s")).expect("whole").lines;
        let back: Vec<Input> =
            lines.iter().map(|line| Input::from(line.expect("readable").input)).collect();
        prop_assert_eq!(back, inputs);
    }
}
