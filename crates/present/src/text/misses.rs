//! Reasons for missing boards, of a picture and of a folder.

use super::{apart, prompt};
use boresight_detect::{Miss, OtherBoard, Side};
use boresight_guide::session::Prompt;

/// Reason for finding no board, with the action and the measured value.
pub fn miss(miss: &Miss) -> String {
    match *miss {
        Miss::NoBoard => "Show the whole board: near, sharp and well lit".into(),
        Miss::PartialBoard { found, wanted, cut_off_by, .. } if found >= wanted => {
            let act = cut_off_by.map_or_else(String::new, |side| format!("Move {}. ", away(side)));
            format!("{act}Leave white around the board, as wide as a row: its end isn't clear")
        }
        Miss::PartialBoard { found, wanted, cut_off_by: Some(side), .. } => {
            let way = away(side);
            format!(
                "Move {way}: part of the board is out of view, {found} of {wanted} corners found"
            )
        }
        Miss::PartialBoard { found, wanted, cut_off_by: None, .. } => {
            let act = "corners found: uncover the board, tip it less or hold it still";
            match miss.rectangle().and_then(OtherBoard::choice) {
                Some(seen) => {
                    format!("{found} of {wanted} {act}. If it has no more: --board {seen}")
                }
                None => format!("{found} of {wanted} {act}"),
            }
        }
        Miss::Glare { found, wanted } => format!(
            "Too much glare: {found} of {wanted} corners found. Tip the board away from the light, or uncover it"
        ),
        Miss::OtherBoard(other) => different(other),
        Miss::Mirrored => {
            "The board is mirrored. Switch the camera's flip off, or show the board's front".into()
        }
        Miss::OtherMarkers { markers: 0 } => {
            "No markers seen on this board. Come closer, or choose a plain board: --board CxR"
                .into()
        }
        Miss::OtherMarkers { .. } => {
            "Different markers than the board's. Check the squares and the dictionary in --board"
                .into()
        }
        Miss::OtherSquares { .. } => {
            "Different board: it has these markers, but in other places. Check the columns and rows in --board (exchanged?), and the first tag of an AprilGrid"
                .into()
        }
        Miss::TooSmall { square_px, needed_px } => {
            let (square, least) = apart(square_px, needed_px, 0);
            format!("Come closer: squares of {square} px (at least {least} px)")
        }
        Miss::Blurred { blur_px, limit_px } => {
            let (blur, most) = apart(blur_px, limit_px, 1);
            format!("Hold still or focus the lens: blurred by {blur} px (limit {most} px)")
        }
        Miss::LowContrast { contrast, needed } => {
            let (contrast, least) = apart(contrast, needed, 0);
            format!("Too dark. Add light: {contrast} grey levels of contrast (at least {least})")
        }
        Miss::OutOfTime => {
            "The search took too long. Use a plain wall, smaller pictures or a faster computer".into()
        },
    }
}

/// Way to move a board that's cut off by `side`.
fn away(side: Side) -> &'static str {
    match side {
        Side::Left => "right",
        Side::Right => "left",
        Side::Top => "down",
        Side::Bottom => "up",
    }
}

/// Name of the board seen instead, and the way to choose it.
fn different(other: OtherBoard) -> String {
    let it = match other {
        OtherBoard::Plain { columns, rows } => {
            format!("it has {columns}x{rows} inner corners. To use it: --board {columns}x{rows}")
        }
        OtherBoard::Larger { columns, rows } => {
            format!("it has at least {columns}x{rows} inner corners. Show it whole to count them")
        }
        OtherBoard::Charuco { dictionary, is_usual_side: true } => format!(
            "it's a ChArUco board with markers of the usual size. To use it, count its squares: --board charuco:CxR:{dictionary}"
        ),
        OtherBoard::Charuco { dictionary, is_usual_side: false } => format!(
            "it's a ChArUco board whose markers have an unusual size. To use it, count its squares and measure both: --board charuco:CxR:{dictionary}:MARKERmm --square SQUAREmm"
        ),
        OtherBoard::AprilGrid => {
            "it's an AprilGrid. To use it, count its tags: --board aprilgrid:CxR".into()
        }
        OtherBoard::Circles { columns, rows, .. } => {
            let argument = other.choice().map_or_else(String::new, |it| format!(": --board {it}"));
            format!("it has {columns}x{rows} circles. To use it{argument}")
        }
    };
    format!("Different board: {it}")
}

/// Reasons for finding no board in some `of` pictures: a sentence each with the number of pictures,
/// most frequent first.
pub fn misses(misses: &[Miss], of: usize) -> Vec<String> {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for miss in misses {
        let sentence = match miss {
            Miss::OtherBoard(_) | Miss::NoBoard => self::miss(miss),
            _ => prompt(Prompt::of_miss(miss)),
        };
        match counts.iter_mut().find(|(other, _)| *other == sentence) {
            Some((_, count)) => *count += 1,
            None => counts.push((sentence, 1)),
        }
    }
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    counts.into_iter().map(|(sentence, count)| format!("{count} of {of}: {sentence}")).collect()
}

/// Board shown by the pictures of a folder without the named one, with the command for it.
pub fn agreed(command: &str) -> String {
    format!("The pictures agree on another board. To use it: {command}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(found: usize, size: [usize; 2], cut_off_by: Option<Side>) -> Miss {
        Miss::PartialBoard { found, wanted: 54, size, cut_off_by }
    }

    #[test]
    fn all_corners_are_never_a_reason_to_uncover_or_to_show_more() {
        for cut_off_by in [None, Some(Side::Bottom)] {
            let said = miss(&part(54, [0; 2], cut_off_by));
            assert!(!said.contains("54") && said.contains("white around"), "{said}");
        }
        assert!(miss(&part(48, [8, 6], None)).contains("--board 8x6"));
        for gap in [part(47, [8, 6], None), part(48, [8, 6], Some(Side::Left))] {
            assert!(!miss(&gap).contains("--board"), "{gap:?}");
        }
    }

    #[test]
    fn a_folder_has_one_sentence_a_reason_and_the_most_frequent_comes_first() {
        let seen = [
            Miss::LowContrast { contrast: 3.0, needed: 20.0 },
            part(40, [0; 2], Some(Side::Top)),
            part(20, [0; 2], Some(Side::Top)),
        ];
        let said = misses(&seen, 9);
        assert_eq!(said, ["2 of 9: Move down. It's cut off", "1 of 9: Too dark. Add light"]);
    }
}
