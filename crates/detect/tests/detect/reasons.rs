//! True reasons for a missing board, and no boards where there are none.

use boresight_detect::{Detection, Detector, DetectorParams, Miss, OtherBoard};
use boresight_geometry::boards::{Board, BoardChoice};
use image::{GrayImage, Luma, imageops};

/// Level of the paper around the squares.
const WHITE: u8 = 210;

fn board(name: &str) -> Board {
    name.parse::<BoardChoice>().expect("a board").board(0.025).expect("fits")
}

/// `columns` by `rows` squares with sides of `px`, the first dark, in front of a wall.
fn squares([columns, rows]: [u32; 2], px: u32, wall: u8) -> GrayImage {
    let drawn = GrayImage::from_fn(640, 480, |x, y| {
        let (column, row) = (x.wrapping_sub(90) / px, y.wrapping_sub(70) / px);
        Luma([match (column < columns && row < rows, (column + row) % 2) {
            (false, _) => wall,
            (true, 0) => 40,
            (true, _) => WHITE,
        }])
    });
    imageops::blur(&drawn, 0.8)
}

fn found(picture: &GrayImage, name: &str) -> Result<Detection, Miss> {
    Detector::new(DetectorParams::default()).detect(picture, &board(name))
}

#[test]
fn a_size_wrong_by_a_row_or_two_is_named() {
    for (columns, rows) in [(9, 6), (8, 6), (7, 7), (10, 7)] {
        let picture = squares([columns + 1, rows + 1], 40, WHITE);
        let right = OtherBoard::Plain { columns: columns as usize, rows: rows as usize };
        for (more, down) in [(1, 0), (2, 0), (0, 1), (0, 2), (1, 1), (-1, 0), (-2, 0), (0, -1)] {
            let wrong = format!("{}x{}", columns as i32 + more, rows as i32 + down);
            let reason = found(&picture, &wrong).expect_err("another board");
            assert_eq!(reason, Miss::OtherBoard(right), "{columns}x{rows} named {wrong}");
        }
    }
}

/// Squares up to the edge of a card: no white tells where the board ends.
#[test]
fn a_smaller_board_without_a_rim_may_be_the_named_one_covered() {
    let reason = found(&squares([9, 7], 40, 125), "9x6").expect_err("another board");
    assert_eq!(reason.rectangle(), Some(OtherBoard::Plain { columns: 8, rows: 6 }), "{reason:?}");
}

#[test]
fn a_larger_board_that_is_cut_off_has_at_least_the_corners_seen() {
    let picture = squares([20, 8], 40, WHITE);
    for named in ["6x5", "9x6"] {
        let reason = found(&picture, named).expect_err("another board");
        let Miss::OtherBoard(OtherBoard::Larger { columns, rows: 7 }) = reason else {
            panic!("{named}: {reason:?}")
        };
        assert!((12..=13).contains(&columns), "{named}: {columns}");
    }
}

#[test]
fn squares_are_no_circles() {
    for px in [9, 14, 24] {
        let picture = imageops::blur(&squares([11, 8], px, WHITE), 0.9);
        for named in ["acircles:4x11", "acircles:5x7", "acircles:4x9", "circles:7x4"] {
            let reason = found(&picture, named).expect_err("squares");
            assert!(!matches!(reason, Miss::PartialBoard { .. }), "{named}, {px} px: {reason:?}");
            let mut detector = Detector::new(DetectorParams::default());
            let other = detector.recognise(&picture, Some(&board(named)), &|| true);
            assert!(!matches!(other, Some(OtherBoard::Circles { .. })), "{px} px: {other:?}");
        }
    }
}

/// Dark squares between light ones look framed like markers.
#[test]
fn squares_have_no_markers() {
    for blur in [0.8, 2.4, 3.2] {
        let picture = imageops::blur(&squares([10, 7], 24, 125), blur);
        for named in ["charuco:7x5:DICT_4X4_50", "charuco:10x7:DICT_5X5_100"] {
            let reason = found(&picture, named).expect_err("another board");
            assert_eq!(reason, Miss::OtherMarkers { markers: 0 }, "{named}, {blur}");
        }
    }
}

/// The corners seen are fewer, and what hides the others is the blur.
#[test]
fn a_blurred_board_is_neither_covered_nor_smaller() {
    let picture = imageops::blur(&squares([7, 5], 30, WHITE), 0.38 * 30.0);
    let reason = found(&picture, "9x6").expect_err("blurred");
    assert!(matches!(reason, Miss::Blurred { .. }), "{reason:?}");
}

/// Rows lost to a moving hand aren't beyond the edge beside them.
#[test]
fn a_smeared_board_beside_the_edge_is_not_cut_off() {
    const SMEAR_PX: u32 = 32;
    let sharp = imageops::crop_imm(&squares([10, 7], 24, WHITE), 82, 0, 558, 480).to_image();
    let smeared = GrayImage::from_fn(500, 400, |x, y| {
        let sum = |sum, k| sum + u32::from(sharp.get_pixel(x + k, y + k).0[0]);
        Luma([((0..SMEAR_PX).fold(0, sum) / SMEAR_PX) as u8])
    });
    let reason = found(&smeared, "9x6").expect_err("smeared");
    assert!(matches!(reason, Miss::Blurred { .. }), "{reason:?}");
}

/// A board much larger than the named one has more corners than are looked for.
#[test]
fn a_much_larger_board_is_never_named_too_small() {
    let picture = squares([18, 13], 28, WHITE);
    for named in ["3x3", "4x3", "9x6"] {
        let reason = found(&picture, named).expect_err("another board");
        let Miss::OtherBoard(
            OtherBoard::Plain { columns: 17, rows: 12 } | OtherBoard::Larger { .. },
        ) = reason
        else {
            panic!("{named}: {reason:?}")
        };
    }
}

/// Nine corners are in many things; white all around is only around a board.
#[test]
fn three_by_three_corners_need_a_rim() {
    found(&squares([4, 4], 40, WHITE), "3x3").expect("a board with its white");
    found(&squares([4, 4], 40, 125), "3x3").expect_err("a chequered card");
}

/// A sheet as light as paper over the end of the middle rows leaves squares above and below.
#[test]
fn a_board_under_a_white_sheet_is_not_a_smaller_one() {
    let mut picture = squares([10, 7], 40, WHITE);
    for (x, y, level) in picture.enumerate_pixels_mut() {
        let is_under = (411..640).contains(&x) && (123..297).contains(&y);
        level.0[0] = if is_under { WHITE } else { level.0[0] };
    }
    let reason = found(&picture, "9x6").expect_err("covered");
    assert!(matches!(reason, Miss::PartialBoard { cut_off_by: None, .. }), "{reason:?}");
}
