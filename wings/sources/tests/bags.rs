//! Bags that others wrote (tests/sources/write_bags.py), whole and broken: each picture that is delivered is the one that was
//! recorded.

use std::{
    fs,
    path::{Path, PathBuf},
    time::Duration,
};

use boresight_capture::{Arrival, BagFlaw, CaptureError, FrameSource, is_bag};
use boresight_sources::{Bag, CopiedBag, copy_with};
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

/// Counts the pictures that `bag` delivers, each of which must be the recorded one with its time; and how it ends.
fn good_pictures(bag: &mut Bag, what: &str) -> (u64, Option<CaptureError>) {
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

fn open(path: &Path, topic: Option<&str>) -> Result<Bag, CaptureError> {
    Bag::open(path, topic)
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
        // A file that is packed as a whole is a single block here, of which nothing is known before its end.
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
