//! A pinned camera over a simulated street: told within looks, asked within seconds.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::{fs, path::Path};

use boresight_geometry::frame::ImageSize;
use boresight_station::{StateLine, Taken, WatchedCamera, exit, street::Street};
use boresight_watch::{Lens, NoAnswer, State};
use image::GrayImage;
use tempfile::TempDir;

fn street(planted: &str) -> Street {
    let mut street = Street::parse(&format!("3{planted}")).expect("a street");
    street.image_size = ImageSize { width_px: 320, height_px: 240 };
    street.camera = boresight_geometry::Camera::pinhole(210.0, nalgebra::Point2::new(163.0, 118.0));
    // Noon.
    street.began_secs += 43_200.0;
    street
}

fn at_secs(look: u32) -> f64 {
    street("").began_secs + 5.0 * f64::from(look)
}

fn open(folder: &Path) -> WatchedCamera {
    let street = street("");
    let lens = Lens::new(street.camera, None, street.image_size);
    let (mut camera, _) =
        WatchedCamera::open(folder, "arm", None, (Some(lens), false)).expect("opened");
    camera.pin();
    camera
}

fn look(camera: &mut WatchedCamera, planted: &str, looks: std::ops::Range<u32>) -> State {
    let street = street(planted);
    let mut state = camera.watch().decision().state;
    for look in looks {
        let at_secs = at_secs(look);
        let taken = Taken::at(at_secs);
        state = camera.look(vec![street.picture(at_secs)], taken).expect("recorded").state;
    }
    state
}

/// Exit code of a question, with a burst of eight pictures.
fn asked(folder: &Path, look: u32, picture: impl Fn(f64) -> GrayImage) -> boresight_app::Exit {
    let mut camera = WatchedCamera::ask(folder, at_secs(look)).expect("asked");
    let burst = (0..8).map(|n| picture(at_secs(look) + 0.25 * f64::from(n))).collect();
    exit(camera.look(burst, Taken::at(at_secs(look))).expect("looked").state)
}

#[test]
fn a_pin_takes_six_pictures_and_a_push_three() {
    let place = TempDir::new().expect("a folder");
    let mut camera = open(place.path());
    assert!(camera.is_to_be_pinned());
    assert!(matches!(look(&mut camera, "", 0..5), State::Learning { .. }));
    assert!(StateLine::heard(&camera).sentence.contains("pin"));
    assert_eq!(look(&mut camera, "", 5..6), State::Ok);
    assert!(!camera.is_to_be_pinned());
    // As a program that was started again goes on.
    drop(camera);
    let mut camera = open(place.path());
    assert_eq!(look(&mut camera, "", 6..20), State::Ok);
    assert_eq!(look(&mut camera, ",pan=3px@0d", 20..22), State::Ok);
    assert!(matches!(look(&mut camera, ",pan=3px@0d", 22..23), State::Moved(_)));
    let off_px = camera.watch().decision().off_px[0];
    assert!((off_px.abs() - 3.0).abs() < 0.15, "{off_px}");
    // The pin stays: what was learned since is no new zero. Beyond the patches' reach, too.
    assert!(matches!(look(&mut camera, ",pan=3px@0d", 23..40), State::Moved(_)));
    assert!(matches!(look(&mut camera, ",pan=60px@0d", 40..43), State::Moved(_)));
    assert_eq!(look(&mut camera, "", 43..48), State::Ok);
    assert!(matches!(look(&mut camera, ",cover=1@0d", 48..51), State::CannotTell { .. }));
    let stays = look(&mut camera, ",cover=1@0d", 51..64);
    assert!(matches!(stays, State::CannotTell { .. }), "{stays:?}");
}

#[test]
fn a_pin_that_gets_no_pictures_says_why() {
    let place = TempDir::new().expect("a folder");
    let mut camera = open(place.path());
    look(&mut camera, "", 0..2);
    camera.no_picture(NoAnswer::NotLoggedIn, Taken::at(at_secs(2))).expect("recorded");
    let line = StateLine::heard(&camera);
    assert!(camera.is_to_be_pinned() && line.sentence.contains("password"), "{line:?}");
}

#[test]
fn a_question_is_answered_by_pictures_of_now_and_changes_nothing() {
    use boresight_app::Exit;
    let place = TempDir::new().expect("a folder");
    let watched = open(place.path());
    drop(watched);
    let mut watched = open(place.path());
    look(&mut watched, "", 0..8);
    let lines = || fs::read(place.path().join("watch.jsonl")).expect("there");
    let before = lines();
    // While it's watched.
    let moved = street(",pan=-4px@0d");
    let covered = street(",cover=1@0d");
    let still = street("");
    assert!(matches!(asked(place.path(), 9, |at| still.picture(at)), Exit::Good));
    assert!(matches!(asked(place.path(), 9, |at| moved.picture(at)), Exit::Moved));
    assert!(matches!(asked(place.path(), 9, |at| covered.picture(at)), Exit::CannotTell));
    assert_eq!(lines(), before);
    // What was said before vouches for nothing: no picture comes.
    let camera = WatchedCamera::ask(place.path(), at_secs(9)).expect("asked");
    assert!(matches!(exit(camera.watch().decision().state), Exit::CannotTell));
    // A camera that was moved, and is back.
    look(&mut watched, ",pan=4px@0d", 10..14);
    assert!(matches!(asked(place.path(), 15, |at| still.picture(at)), Exit::Good));
}

#[test]
fn who_asks_once_hears_ok_only_of_a_look_that_was_answered() {
    use NoAnswer::{Frozen, NoPicture, NotLoggedIn, NotReached, OtherSize};
    let place = TempDir::new().expect("a folder");
    let mut camera = open(place.path());
    let said = |camera: &WatchedCamera| {
        let line = StateLine::asked(camera);
        (line.state, line.reason, exit(camera.watch().asked().state))
    };
    let none = [NoPicture, NotLoggedIn, NotReached, Frozen, OtherSize];
    assert_eq!(look(&mut camera, "", 0..8), State::Ok);
    assert_eq!(said(&camera), ("OK", None, boresight_app::Exit::Good));
    for (number, reason) in (8..).zip(none) {
        let taken = Taken::at(at_secs(2 * number));
        camera.no_picture(reason, taken).expect("recorded");
        let (state, named, exit) = said(&camera);
        assert_eq!((state, exit), ("CANNOT-TELL", boresight_app::Exit::CannotTell), "{reason:?}");
        assert!(named.is_some());
        // Who listens hears at once only what a person has to mend.
        let is_heard = StateLine::heard(&camera).state == "CANNOT-TELL";
        assert_eq!(is_heard, reason.is_for_a_person(), "{reason:?}");
        // A program that only reads the store says the same.
        let stored = WatchedCamera::look_at(place.path()).expect("there");
        assert_eq!(said(&stored).0, "CANNOT-TELL");
        look(&mut camera, "", 2 * number + 1..2 * number + 2);
    }
    // A picture that shows nothing is no answer either; a camera that was moved stays so.
    look(&mut camera, ",cover=1@0d", 40..41);
    assert_eq!(said(&camera).0, "CANNOT-TELL");
    look(&mut camera, ",pan=4px@0d", 42..46);
    camera.no_picture(NotLoggedIn, Taken::at(at_secs(47))).expect("recorded");
    assert_eq!(said(&camera).0, "MOVED");
}
