//! Explanations weighed by the detector: one line per grid, and the bits below.

use boresight_detect::{
    GridOutcome, ReadMarker, Searched, Side, VotedPlace, WeighedEnd, WeighedGrid, WeighedMarkers,
    WeighedPlace,
};

use super::{miss, numbers::counted};

/// Note that nothing in the picture looked like a board.
pub const NO_GRID: &str = "no grid of corners or circles was found";
/// Meaning of the bits, before the first ones.
pub const ABOUT: &str = "Bits weigh one explanation against another: 8 bits are 256 to 1, and a grid's place needs a lead of 8. \
                         A part of a plain board also needs its code or, live, its track. Where markers say the place, it needs \
                         22 bits beyond chance, too.";

/// Grid as found, with outcome and reason.
pub fn weighed(number: usize, grid: &WeighedGrid) -> Vec<String> {
    let [long, wide] = grid.size;
    // Grids of circles have neither weighed ends nor markers.
    let what = if grid.ends.is_empty() && grid.markers.is_none() { "circles" } else { "corners" };
    let outcome = match grid.outcome {
        GridOutcome::Named(seen) => format!("{seen} {what} of the board"),
        GridOutcome::Circles => "not the board: its dark shapes are round".into(),
        GridOutcome::Missed(why) => miss(&why),
    };
    let seen = grid.corners_px.len();
    let mut lines = vec![format!(
        "{number}. Grid of {}x{} {what}, {seen} seen, {}: {outcome}",
        long.max(wide),
        long.min(wide),
        searched(grid.searched)
    )];
    if !grid.ends.is_empty() {
        let ends: Vec<String> = grid.ends.iter().map(end).collect();
        lines.push(format!("   Bits for white / more squares beyond: {}", ends.join(", ")));
        lines.push(if grid.places.is_empty() {
            "   No place on the board: it's larger".into()
        } else {
            let places: Vec<String> = grid.places.iter().map(place).collect();
            format!("   Likeliest places of its first corner: {}", places.join("; "))
        });
    }
    lines.extend(grid.markers.iter().flat_map(markers));
    lines
}

/// Place of a grid by the markers, and the role of each marker.
fn markers(WeighedMarkers { read, places }: &WeighedMarkers) -> Vec<String> {
    let mut lines = vec![match (read.len(), places.is_empty()) {
        (0, _) => "   No markers were read".into(),
        (count, true) => format!("   {} read, none of the board's", counted(count, "marker")),
        (count, false) => {
            let places: Vec<String> = places.iter().map(voted_place).collect();
            let likeliest = places.join("; ");
            format!(
                "   {} read. Likeliest places of the grid's first corner: {likeliest}",
                counted(count, "marker")
            )
        }
    }];
    lines.extend(read.iter().map(|it| format!("   {}", read_marker(it))));
    lines
}

fn voted_place(place: &VotedPlace) -> String {
    let VotedPlace { first, quarter_turns, bits, agreeing, conflicts, outside } = place;
    let mut from = vec![format!("{bits:.0} bits"), format!("{agreeing} fit")];
    if *conflicts > 0 {
        from.push(format!("{conflicts} don't"));
    }
    if *outside > 0 {
        from.push(format!("{} beyond the board", counted(*outside, "corner")));
    }
    format!("{} ({})", corner(first.map(i64::from), *quarter_turns), from.join(", "))
}

/// Cells of a marker, row by row: `#` black, `.` white.
fn read_marker(ReadMarker { square, marker, is_white, wrong, bits }: &ReadMarker) -> String {
    let side = is_white.len().isqrt().max(1);
    let row = |cells: &[bool]| cells.iter().map(|white| if *white { '.' } else { '#' }).collect();
    let cells: Vec<String> = is_white.chunks(side).map(row).collect();
    let place = square.map_or_else(String::new, |square| {
        let [column, row] = square.map(|index| index + 1);
        format!(" in column {column}, row {row} of the squares")
    });
    let says = match (marker, bits) {
        (Some(number), Some(bits)) if *wrong == 0 => {
            format!("marker {number}, every cell: {bits:.0} bits")
        }
        (Some(number), Some(bits)) => {
            format!("marker {number} but for {}: {bits:.0} bits", counted(*wrong, "cell"))
        }
        (Some(number), None) => {
            format!("not marker {number}, which belongs there: {} differ", counted(*wrong, "cell"))
        }
        (None, _) if square.is_some() => "no marker belongs there".into(),
        (None, _) => "not one of the board's".into(),
    };
    format!("{}{place}: {says}", cells.join("/"))
}

/// Corner of the board by position, and the board's rotation.
fn corner(first: [i64; 2], quarter_turns: usize) -> String {
    let [column, row] = first.map(|index| index + 1);
    let turned = match quarter_turns {
        0 => String::new(),
        turns => format!(", turned by {}°", 90 * turns),
    };
    format!("column {column}, row {row}{turned}")
}

fn searched(Searched { scale, grown }: Searched) -> String {
    let size = if scale < 1.0 {
        format!("{:.0} times as large", 1.0 / scale)
    } else if scale > 1.0 {
        format!("1/{scale:.0} as large")
    } else {
        "full size".into()
    };
    if grown { format!("{size} with squares grown together") } else { size }
}

fn end(&WeighedEnd { side, white_bits, squares_bits }: &WeighedEnd) -> String {
    let side = match side {
        Side::Left => "left",
        Side::Right => "right",
        Side::Top => "top",
        Side::Bottom => "bottom",
    };
    format!("{side} {white_bits:.0} / {squares_bits:.0}")
}

fn place(WeighedPlace { first, quarter_turns, bits, has_code }: &WeighedPlace) -> String {
    let [ends, colours, track] = bits;
    let mut from = vec![format!("ends {ends:.0}"), format!("colours {colours:.0}")];
    if *track != 0.0 {
        from.push(format!("track {track:.0}"));
    }
    if *has_code {
        from.push("the code is there".into());
    }
    format!("{} ({})", corner(first.map(|index| index as i64), *quarter_turns), from.join(", "))
}

#[cfg(test)]
mod tests {
    use boresight_detect::Miss;

    use super::*;

    #[test]
    fn a_refused_part_shows_what_it_lacked() {
        let side = |side, white_bits, squares_bits| WeighedEnd { side, white_bits, squares_bits };
        let grid = WeighedGrid {
            searched: Searched { scale: 2.0, grown: false },
            corners_px: vec![[0.0; 2]; 40],
            size: [5, 8],
            ends: vec![side(Side::Left, 30.2, -8.0), side(Side::Right, -20.0, -4.0)],
            places: vec![WeighedPlace {
                first: [1, 0],
                quarter_turns: 2,
                bits: [12.4, 0.0, 0.0],
                has_code: false,
            }],
            markers: None,
            outcome: GridOutcome::Missed(Miss::PartialBoard {
                found: 40,
                wanted: 54,
                size: [8, 5],
                cut_off_by: Some(Side::Right),
            }),
        };
        let lines = weighed(1, &grid);
        assert_eq!(
            lines,
            [
                "1. Grid of 8x5 corners, 40 seen, 1/2 as large: Move left: part of the board is out of view, 40 of 54 corners found",
                "   Bits for white / more squares beyond: left 30 / -8, right -20 / -4",
                "   Likeliest places of its first corner: column 2, row 1, turned by 180° (ends 12, colours 0)",
            ]
        );
    }

    #[test]
    fn markers_are_told_one_by_one() {
        let cells = [0b0110_u16, 0b1001, 0b1111, 0b0000];
        let is_white: Vec<bool> = cells
            .iter()
            .flat_map(|row| (0..4).rev().map(move |cell| row >> cell & 1 == 1))
            .collect();
        let read = |marker, wrong, bits| ReadMarker {
            square: Some([0, 1]),
            marker,
            is_white: is_white.clone(),
            wrong,
            bits,
        };
        let place = VotedPlace {
            first: [0, -1],
            quarter_turns: 0,
            bits: 28.0,
            agreeing: 2,
            conflicts: 1,
            outside: 5,
        };
        let says = WeighedMarkers {
            read: vec![
                read(Some(4), 0, Some(16.0)),
                read(Some(4), 1, Some(12.0)),
                read(Some(4), 7, None),
                read(None, 0, None),
            ],
            places: vec![place],
        };
        assert_eq!(
            markers(&says),
            [
                "   4 markers read. Likeliest places of the grid's first corner: column 1, row 0 (28 bits, 2 fit, 1 don't, 5 corners beyond the board)",
                "   #..#/.##./..../#### in column 1, row 2 of the squares: marker 4, every cell: 16 bits",
                "   #..#/.##./..../#### in column 1, row 2 of the squares: marker 4 but for 1 cell: 12 bits",
                "   #..#/.##./..../#### in column 1, row 2 of the squares: not marker 4, which belongs there: 7 cells differ",
                "   #..#/.##./..../#### in column 1, row 2 of the squares: no marker belongs there",
            ]
        );
        let none = WeighedMarkers::default();
        assert_eq!(markers(&none), ["   No markers were read"]);
    }
}
