//! Explanations weighed by the detector: one line per grid, and the bits below.

use boresight_detect::{
    GridOutcome, Searched, Side, VotedPlace, WeighedEnd, WeighedGrid, WeighedMarkers, WeighedPlace,
};

use super::{miss, numbers::counted};

/// Note that nothing in the picture looked like a board.
pub const NO_GRID: &str = "no grid of corners or circles was found";
/// Meaning of the bits, before the first ones.
pub const ABOUT: &str = "Bits weigh one explanation against another: 8 bits are 256 to 1, and a grid's place needs a lead of 8. \
                         A part of a plain board also needs its code or, live, its track. Where markers say the place, it needs \
                         22 bits beyond chance, too.";

/// Number of grids whose evidence is listed: the likeliest one and its runner-up.
const WITH_EVIDENCE: usize = 2;

/// The grids, likeliest first, with outcome and reason, a line each; then the evidence of the
/// first.
pub fn weighed(grids: &[WeighedGrid]) -> Vec<String> {
    let table = grids.iter().zip(1..).map(|(grid, number)| format!("{number}. {}", found(grid)));
    let weighed = grids.iter().zip(1..).take(WITH_EVIDENCE);
    let weighed = weighed.flat_map(|(grid, number)| {
        evidence(grid).into_iter().map(move |line| format!("   Of {number}: {line}"))
    });
    table.chain(weighed).collect()
}

/// Grid as found, with outcome and reason.
fn found(grid: &WeighedGrid) -> String {
    let [long, wide] = grid.size;
    // Grids of circles have neither weighed ends nor markers.
    let what = if grid.ends.is_empty() && grid.markers.is_none() { "circles" } else { "corners" };
    let outcome = match grid.outcome {
        GridOutcome::Named(seen) => format!("{seen} {what} of the board"),
        GridOutcome::Circles => "not the board: its dark shapes are round".into(),
        GridOutcome::Missed(why) => miss(&why),
    };
    format!(
        "Grid of {}x{} {what}, {} seen, {}: {outcome}",
        long.max(wide),
        long.min(wide),
        grid.corners_px.len(),
        searched(grid.searched)
    )
}

fn evidence(grid: &WeighedGrid) -> Vec<String> {
    let mut lines = Vec::new();
    if !grid.ends.is_empty() {
        let ends: Vec<String> = grid.ends.iter().map(end).collect();
        lines.push(format!("Bits for white / more squares beyond: {}", ends.join(", ")));
        lines.push(if grid.places.is_empty() {
            "No place on the board: it's larger".into()
        } else {
            let places: Vec<String> = grid.places.iter().map(place).collect();
            format!("Likeliest places of its first corner: {}", places.join("; "))
        });
    }
    lines.extend(grid.markers.as_ref().map(markers));
    lines
}

/// Places of a grid by the markers.
fn markers(WeighedMarkers { read, places }: &WeighedMarkers) -> String {
    match (*read, places.is_empty()) {
        (0, _) => "No markers were read".into(),
        (count, true) => format!("{} read, none of the board's", counted(count, "marker")),
        (count, false) => {
            let places: Vec<String> = places.iter().map(voted_place).collect();
            format!(
                "{} read. Likeliest places of the grid's first corner: {}",
                counted(count, "marker"),
                places.join("; ")
            )
        }
    }
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
        let lines = weighed(&[grid]);
        assert_eq!(
            lines,
            [
                "1. Grid of 8x5 corners, 40 seen, 1/2 as large: Move left: part of the board is out of view, 40 of 54 corners found",
                "   Of 1: Bits for white / more squares beyond: left 30 / -8, right -20 / -4",
                "   Of 1: Likeliest places of its first corner: column 2, row 1, turned by 180° (ends 12, colours 0)",
            ]
        );
    }

    #[test]
    fn markers_are_summed() {
        let place = VotedPlace {
            first: [0, -1],
            quarter_turns: 0,
            bits: 28.0,
            agreeing: 2,
            conflicts: 1,
            outside: 5,
        };
        assert_eq!(
            markers(&WeighedMarkers { read: 4, places: vec![place] }),
            "4 markers read. Likeliest places of the grid's first corner: column 1, row 0 (28 bits, 2 fit, 1 don't, 5 corners beyond the board)"
        );
        assert_eq!(markers(&WeighedMarkers::default()), "No markers were read");
    }
}
