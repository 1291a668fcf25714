//! Bags that others wrote (tests/sources/write_bags.py), whole and broken: each picture that is
//! delivered is the one that was recorded.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use boresight_capture::{Arrival, BagFlaw, CaptureError, FrameSource, is_bag};
use boresight_sources::{CopiedBag, NotCopied, copy_with, open_bag as open};
use image::{GrayImage, Luma};

/// Pictures in each bag.
const PICTURES: u64 = 8;
/// Every bag with pictures on one topic.
const BAGS: [&str; 10] = [
    "plain.mcap",
    "lz4.mcap",
    "zstd.mcap",
    "rosbags.mcap",
    "packed.mcap",
    "png.mcap",
    "rosbags.db3",
    "messages.db3",
    "file.db3.zstd",
    "jazzy.db3",
];

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/bags").join(name)
}

/// The picture of that number, as write_bags.py makes it.
fn picture(number: u64) -> GrayImage {
    GrayImage::from_fn(16, 12, |x, y| Luma([(7 * x + 13 * y + 31 * number as u32) as u8]))
}

/// Counts the pictures that `bag` delivers, each of which must be the recorded one with its time;
/// and how it ends.
fn good_pictures(bag: &mut Box<dyn FrameSource>, what: &str) -> (u64, Option<CaptureError>) {
    let mut count = 0;
    loop {
        match bag.next_frame(Duration::ZERO) {
            Ok(Arrival::Frame(frame)) => {
                assert_eq!(frame.image, picture(frame.id.0), "{what}: picture {count}");
                assert_eq!(frame.captured_at.nanos, 1 + frame.id.0 * 33_333_333, "{what}");
                count += 1;
            }
            Ok(Arrival::End) => return (count, None),
            Ok(_) => {}
            Err(err) => return (count, Some(err)),
        }
    }
}

#[test]
fn pictures_of_every_writer_are_equal_bit_for_bit() {
    for name in BAGS {
        let path = fixture(name);
        assert!(is_bag(&path), "{name}");
        let mut bag = open(&path, None).expect(name);
        let size = bag.identity().image_size.expect("known");
        assert_eq!((size.width_px, size.height_px, bag.waits()), (16, 12, true));
        let (count, broken) = good_pictures(&mut bag, name);
        assert!(count == PICTURES && broken.is_none(), "{name}: {count} {broken:?}");
    }
}

#[test]
fn a_folder_of_ros_2_is_read_in_the_order_of_its_files() {
    let place = tempfile::tempdir().expect("a folder");
    fs::copy(fixture("rosbags.db3"), place.path().join("bag_9.db3")).expect("copied");
    fs::copy(fixture("zstd.mcap"), place.path().join("bag_10.mcap")).expect("copied");
    assert!(!is_bag(place.path()));
    fs::write(place.path().join("metadata.yaml"), "").expect("written");
    assert!(is_bag(place.path()));
    let mut bag = open(place.path(), None).expect("opens");
    let mut ids = Vec::new();
    while let Arrival::Frame(frame) = bag.next_frame(Duration::ZERO).expect("whole") {
        assert_eq!(frame.image, picture(frame.id.0 % PICTURES));
        ids.push(frame.id.0);
    }
    assert_eq!(ids, (0..2 * PICTURES).collect::<Vec<u64>>());
}

#[test]
fn topics_are_named_if_there_are_several_or_none() {
    let both = vec!["/left/image_raw".to_owned(), "/right/image_raw".to_owned()];
    let flaw = |path: &Path, topic| match open(path, topic) {
        Err(CaptureError::Bag { flaw, .. }) => flaw,
        other => panic!("{:?}", other.err()),
    };
    let two = fixture("two.db3");
    assert_eq!(flaw(&two, None), BagFlaw::Several(both.clone()));
    let asked = "/camera".to_owned();
    assert_eq!(flaw(&two, Some("/camera")), BagFlaw::NoSuchTopic { asked, have: both });
    let mut right = open(&two, Some("/right/image_raw")).expect("it's there");
    assert_eq!(good_pictures(&mut right, "right").0, PICTURES);
    let place = tempfile::tempdir().expect("a folder");
    let text = place.path().join("text.mcap");
    fs::write(&text, "hello").expect("written");
    assert!(matches!(flaw(&text, None), BagFlaw::Unreadable(_)));
}

#[test]
fn a_bag_that_is_cut_anywhere_gives_its_whole_pictures_and_says_so() {
    let place = tempfile::tempdir().expect("a folder");
    for name in BAGS {
        let bytes = fs::read(fixture(name)).expect("read");
        let path = place.path().join(name);
        let (mut most, mut refused) = (0, 0);
        // Databases are large and slow to open; no step of theirs is a multiple of a page's.
        let step = if name.contains("db3") { 13 } else { 1 };
        for end in (0..bytes.len()).step_by(step) {
            fs::write(&path, &bytes[..end]).expect("written");
            let mut bag = match open(&path, None) {
                Ok(bag) => bag,
                Err(CaptureError::Bag { .. }) => {
                    refused += 1;
                    continue;
                }
                Err(other) => panic!("{name} cut at {end}: {other}"),
            };
            let (count, broken) = good_pictures(&mut bag, &format!("{name} cut at {end}"));
            assert!(broken.is_some() || count == PICTURES, "{name} cut at {end}: {count}");
            // More bytes are never fewer pictures.
            assert!(count >= most, "{name} cut at {end}: {count} < {most}");
            most = count;
        }
        println!(
            "{name}: {} bytes, {refused} too short for a picture, {most} at most",
            bytes.len()
        );
        // A file that is packed as a whole is a single block here, of which nothing is known before
        // its end.
        assert_eq!(most, if name == "file.db3.zstd" { 0 } else { PICTURES }, "{name}");
    }
}

/// Wrong bytes give no wrong picture where the bag has checksums, and no panic anywhere.
#[test]
fn a_bag_with_a_changed_byte_gives_no_other_picture() {
    let place = tempfile::tempdir().expect("a folder");
    for name in ["lz4.mcap", "zstd.mcap", "png.mcap"] {
        let bytes = fs::read(fixture(name)).expect("read");
        for at in (0..bytes.len()).step_by(3) {
            let mut changed = bytes.clone();
            changed[at] ^= 0x41;
            let path = place.path().join(name);
            fs::write(&path, &changed).expect("written");
            let Ok(mut bag) = open(&path, None) else { continue };
            while let Ok(Arrival::Frame(frame)) = bag.next_frame(Duration::ZERO) {
                assert!((0..PICTURES).any(|n| picture(n) == frame.image), "{name} at {at}");
            }
        }
    }
}

#[test]
fn a_copy_has_the_calibration_beside_each_picture() {
    let place = tempfile::tempdir().expect("a folder");
    for name in BAGS.into_iter().filter(|name| !name.ends_with("zstd")) {
        let copy = place.path().join(name);
        let mut stamps = Vec::new();
        let mut info = |header: boresight_sources::RosHeader<'_>| {
            assert_eq!(header.frame_id, "optical");
            stamps.push(header.stamp_nanos.expect("stamped"));
            vec![0, 1, 0, 0]
        };
        let copied = copy_with(&fixture(name), &copy, None, &mut info).expect(name);
        let topic = "/camera/camera_info".to_owned();
        assert_eq!(copied, CopiedBag { topic, messages: PICTURES, left_out: None }, "{name}");
        let wanted = (0..PICTURES).map(|n| 1_700_000_000_000_000_000 + n * 33_333_333);
        assert_eq!(stamps, wanted.collect::<Vec<u64>>(), "{name}");
        let mut bag = open(&copy, None).expect("a bag");
        let (count, broken) = good_pictures(&mut bag, name);
        assert!(count == PICTURES && broken.is_none(), "{name}: {count} {broken:?}");
        // Again: what stood there is replaced, and no file is.
        let again = place.path().join(format!("again-{name}"));
        let copied = copy_with(&copy, &again, None, &mut |_| vec![0, 1, 0, 0]).expect(name);
        assert_eq!(copied.messages, PICTURES);
        assert!(copy_with(&copy, &again, None, &mut |_| Vec::new()).is_err(), "{name}");
    }
    let packed =
        copy_with(&fixture("file.db3.zstd"), &place.path().join("x"), None, &mut |_| Vec::new());
    assert!(packed.expect_err("packed").to_string().contains("zstd -d"));
}

/// A file of MCAP with an attachment that ends before its checksum.
fn cut_attachment() -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let attachment = [&[0; 16][..], &text("a"), &text("b"), &[0; 8]].concat();
    let record =
        |code: u8, body: &[u8]| [&[code][..], &(body.len() as u64).to_le_bytes(), body].concat();
    let magic = b"\x89MCAP0\r\n";
    let header = record(1, &[text(""), text("")].concat());
    [&magic[..], &header, &record(9, &attachment), magic].concat()
}

#[test]
fn what_a_library_gives_up_on_is_an_error_of_that_bag() {
    let place = tempfile::tempdir().expect("a folder");
    let path = place.path().join("a.mcap");
    fs::write(&path, cut_attachment()).expect("written");
    let refused = open(&path, None).err();
    assert!(matches!(refused, Some(CaptureError::GaveUp { .. })), "{refused:?}");
    let copied = copy_with(&path, &place.path().join("b.mcap"), None, &mut |_| Vec::new());
    assert!(matches!(copied, Err(NotCopied::Bag(CaptureError::GaveUp { .. }))), "{copied:?}");
}

/// Processor time is bounded by words and sizes: each of these would take minutes or gigabytes.
#[test]
fn bags_that_unpack_without_an_end_are_refused() {
    let place = tempfile::tempdir().expect("a folder");
    let temporary = || {
        let names = fs::read_dir(std::env::temp_dir()).expect("listable").flatten();
        names.filter(|entry| entry.metadata().is_ok_and(|data| data.len() > 1 << 24)).count()
    };
    let refused = |name: &str, words: &str| {
        let found = open(&place.path().join(name), None).err();
        let found = found.unwrap_or_else(|| panic!("{name}")).to_string();
        assert!(found.contains(words), "{name}: {found}");
    };
    let before = temporary();
    let zeros = std::io::Read::take(std::io::repeat(0), 1 << 27);
    let packed = zstd::encode_all(zeros, 1).expect("in memory");
    for name in ["a.mcap.zstd", "a.db3.zstd"] {
        fs::write(place.path().join(name), &packed).expect("written");
        refused(name, "larger than");
    }
    assert_eq!(temporary(), before);

    let record =
        |code: u8, body: &[u8]| [&[code][..], &(body.len() as u64).to_le_bytes(), body].concat();
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let magic = b"\x89MCAP0\r\n";
    let header = record(1, &[text(""), text("")].concat());
    let sizes = [&[0; 16][..], &(1_u64 << 27).to_le_bytes(), &[0; 4]].concat();
    let length = (packed.len() as u64).to_le_bytes();
    let chunk = record(6, &[&sizes, &text("zstd")[..], &length, &packed].concat());
    let bomb = [&magic[..], &header, &chunk, magic].concat();
    fs::write(place.path().join("bomb.mcap"), bomb).expect("written");
    refused("bomb.mcap", "unpacks to far more");

    let channel = |number: u32| {
        let ids = [(number as u16).to_le_bytes(), [0, 0]].concat();
        record(4, &[ids, text(&format!("/t{number}")), text("cdr"), vec![0; 4]].concat())
    };
    let many: Vec<u8> = (0..100_000).flat_map(channel).collect();
    fs::write(place.path().join("many.mcap"), [&magic[..], &header, &many, magic].concat())
        .expect("written");
    refused("many.mcap", "more");
}

/// A view computes what it holds, so it may have no end.
#[test]
fn a_database_whose_messages_are_computed_is_refused() {
    let place = tempfile::tempdir().expect("a folder");
    for (table, what) in [
        ("messages", "SELECT i AS id, 1 AS topic_id, i AS timestamp, zeroblob(9) AS data"),
        ("topics", "SELECT 1 AS id, '/' || i AS name, 'a' AS type, 'cdr' AS serialization_format"),
    ] {
        let path = place.path().join(format!("{table}.db3"));
        fs::copy(fixture("rosbags.db3"), &path).expect("copied");
        let db = rusqlite::Connection::open(&path).expect("opens");
        let rows = "WITH RECURSIVE r(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM r)";
        db.execute_batch(&format!(
            "DROP TABLE {table}; CREATE VIEW {table} AS {rows} {what} FROM r"
        ))
        .expect("made");
        drop(db);
        let refused = open(&path, None).err().expect("refused").to_string();
        assert!(refused.contains("computed"), "{refused}");
    }
}

/// A file of MCAP with a message of Foxglove for each of `messages`.
fn of_foxglove(schema: &str, encoding: &str, messages: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut bytes).expect("begins");
    let schema = writer.add_schema(schema, encoding, b"").expect("added");
    let channel = writer.add_channel(schema, "/cam", encoding, &Default::default()).expect("added");
    for (number, data) in messages.iter().enumerate() {
        let header = mcap::records::MessageHeader {
            channel_id: channel,
            sequence: number as u32,
            log_time: number as u64,
            publish_time: number as u64,
        };
        writer.write_to_known_channel(&header, data).expect("written");
    }
    writer.finish().expect("ends");
    drop(writer);
    bytes.into_inner()
}

/// A field of a protobuf message that is text or bytes.
fn field(number: u8, bytes: &[u8]) -> Vec<u8> {
    let mut all = vec![number << 3 | 2];
    let mut rest = bytes.len();
    while rest > 0x7F {
        all.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    all.push(rest as u8);
    [all, bytes.to_vec()].concat()
}

#[test]
fn pictures_of_foxglove_are_equal_bit_for_bit() {
    use base64::{Engine, engine::general_purpose::STANDARD};
    let place = tempfile::tempdir().expect("a folder");
    let numbers = || (0..PICTURES).map(|number| (picture(number), number * 33_333_333));
    let png = |image: &GrayImage| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, image::ImageFormat::Png).expect("encoded");
        bytes.into_inner()
    };
    // Seconds 7, and nanoseconds as a number of any length.
    let time = |nanos: u64| {
        let mut all = vec![8, 7, 16];
        let mut rest = nanos;
        while rest > 0x7F {
            all.push(rest as u8 | 0x80);
            rest >>= 7;
        }
        all.push(rest as u8);
        field(1, &all)
    };
    let raw = |(image, nanos): (GrayImage, u64)| {
        let size = [21, 16, 0, 0, 0, 29, 12, 0, 0, 0, 45, 16, 0, 0, 0];
        let rest = [field(4, b"mono8"), field(6, image.as_raw()), field(7, b"cam")].concat();
        [time(nanos), size.to_vec(), rest].concat()
    };
    let compressed = |(image, nanos): (GrayImage, u64)| {
        [time(nanos), field(2, &png(&image)), field(3, b"png"), field(4, b"cam")].concat()
    };
    let json = |(image, nanos): (GrayImage, u64)| {
        let data = STANDARD.encode(png(&image));
        format!(
            r#"{{"timestamp":{{"sec":7,"nsec":{nanos}}},"frame_id":"cam","format":"png","data":"{data}"}}"#
        )
        .into_bytes()
    };
    let raw_json = |(image, nanos): (GrayImage, u64)| {
        let data = STANDARD.encode(image.as_raw());
        format!(
            r#"{{"timestamp":{{"sec":7,"nsec":{nanos}}},"frame_id":"cam","encoding":"8UC1","width":16,"height":12,"step":16,"data":"{data}"}}"#
        )
        .into_bytes()
    };
    for (schema, encoding, messages) in [
        ("foxglove.RawImage", "protobuf", numbers().map(raw).collect::<Vec<_>>()),
        ("foxglove.CompressedImage", "protobuf", numbers().map(compressed).collect()),
        ("foxglove.CompressedImage", "json", numbers().map(json).collect()),
        ("foxglove.RawImage", "json", numbers().map(raw_json).collect()),
    ] {
        let path = place.path().join("a.mcap");
        fs::write(&path, of_foxglove(schema, encoding, &messages)).expect("written");
        let mut bag = open(&path, None).expect(schema);
        let (count, broken) = good_pictures(&mut bag, schema);
        assert!(count == PICTURES && broken.is_none(), "{schema} {encoding}: {count} {broken:?}");
        // Cut anywhere, a message is whole or no picture.
        for end in (0..messages[0].len()).step_by(7) {
            let cut = [messages[0][..end].to_vec(), messages[1].clone()];
            fs::write(&path, of_foxglove(schema, encoding, &cut)).expect("written");
            if let Ok(mut bag) = open(&path, None) {
                while let Ok(Arrival::Frame(frame)) = bag.next_frame(Duration::ZERO) {
                    assert_eq!(frame.image, picture(frame.id.0), "{schema} {encoding} {end}");
                }
            }
        }
    }
}
