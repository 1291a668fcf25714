//! A board of another kind is reported by name.

use boresight_detect::{Detector, DetectorParams, Miss, OtherBoard};
use boresight_geometry::{
    boards::{Board, BoardChoice},
    markers::{CircleRows, Dictionary},
};
use boresight_present::text;
use boresight_sim::{Scene, render_view};
use image::GrayImage;
use nalgebra::{Isometry3, Vector3};

/// A board by argument, as wide as a hand's spread.
fn board(name: &str) -> Board {
    let choice: BoardChoice = name.parse().expect("a board");
    choice.board(0.24 / f64::from(choice.columns.max(choice.rows))).expect("fits")
}

fn family(name: &str) -> OtherBoard {
    OtherBoard::Charuco {
        dictionary: name.parse::<Dictionary>().expect("known"),
        is_usual_side: true,
    }
}

/// Other board in a picture without the `named` one.
fn named_in(detector: &mut Detector, picture: &GrayImage, named: &str) -> Option<OtherBoard> {
    match detector.detect(picture, &board(named)) {
        Err(miss) if miss.leaves_open() => {
            detector.recognise(picture, Some(&board(named)), &|| true)
        }
        Err(Miss::OtherBoard(other)) => Some(other),
        _ => None,
    }
}

#[test]
fn a_board_of_another_kind_is_named() {
    let circles = |columns, rows, layout| OtherBoard::Circles { columns, rows, layout };
    let boards = [
        ("9x6", OtherBoard::Plain { columns: 9, rows: 6 }),
        ("charuco:9x7:DICT_4X4_50", family("DICT_4X4_1000")),
        ("charuco:9x7:DICT_5X5_100", family("DICT_5X5_1000")),
        ("charuco:9x7:DICT_6X6_250", family("DICT_6X6_1000")),
        ("charuco:9x7:DICT_7X7_50", family("DICT_7X7_1000")),
        ("charuco:9x7:DICT_ARUCO_ORIGINAL", family("DICT_ARUCO_ORIGINAL")),
        ("charuco:9x7:DICT_APRILTAG_36h11", family("DICT_APRILTAG_36h11")),
        ("aprilgrid:4x3", OtherBoard::AprilGrid),
        ("circles:7x5", circles(7, 5, CircleRows::Symmetric)),
        ("acircles:4x9", circles(4, 9, CircleRows::Asymmetric)),
    ];
    let mut detector = Detector::new(DetectorParams::default());
    for (shown, seen) in boards {
        let scene = Scene { board: board(shown), ..Scene::default_720p(3) };
        let turned = Vector3::new(0.3, -0.2, 0.25);
        let picture = render_view(&scene, &Isometry3::new(Vector3::new(0.0, 0.0, 0.5), turned));
        assert!(detector.detect(&picture, &scene.board).is_ok(), "{shown}");
        for (named, of_kind) in boards {
            let (shown_kind, named_kind) = (shown.split(':').next(), named.split(':').next());
            if shown_kind == named_kind || (!shown.contains(':') && !named.contains(':')) {
                continue;
            }
            let found = named_in(&mut detector, &picture, named);
            assert_eq!(found, Some(seen), "{shown} for {named} ({of_kind:?})");
        }
        // Its size can be chosen where known.
        if let Some(choice) = seen.choice() {
            assert_eq!(choice.to_string(), shown);
            assert!(text::miss(&Miss::OtherBoard(seen)).contains(&format!("--board {shown}")));
        }
    }
}

#[test]
fn markers_of_another_size_are_named() {
    let mut detector = Detector::new(DetectorParams::default());
    for side in ["15mm", "18mm"] {
        let shown = board(&format!("charuco:9x7:DICT_6X6_250:{side}"));
        let scene = Scene { board: shown, ..Scene::default_720p(3) };
        let turned = Vector3::new(0.3, -0.2, 0.25);
        let picture = render_view(&scene, &Isometry3::new(Vector3::new(0.0, 0.0, 0.4), turned));
        assert!(detector.detect(&picture, &shown).is_ok(), "{side}");
        for named in ["charuco:9x7:DICT_6X6_250", "9x6"] {
            let found = named_in(&mut detector, &picture, named);
            let dictionary = "DICT_6X6_1000".parse().expect("known");
            let seen = OtherBoard::Charuco { dictionary, is_usual_side: false };
            assert_eq!(found, Some(seen), "{side} for {named}");
        }
    }
}

#[test]
fn without_a_board_there_is_no_other_one() {
    let mut detector = Detector::new(DetectorParams::default());
    let scene = Scene::default_720p(5);
    // Only the room.
    let picture = render_view(&scene, &Isometry3::translation(0.0, 3.0, 0.5));
    for named in ["9x6", "charuco:9x7:DICT_4X4_50", "aprilgrid:4x3", "circles:7x5"] {
        assert_eq!(detector.recognise(&picture, Some(&board(named)), &|| true), None, "{named}");
    }
}
