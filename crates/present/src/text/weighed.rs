//! What the detector weighed: one line a grid, and the bits below it.

use boresight_detect::{GridOutcome, Searched, Side, WeighedEnd, WeighedGrid, WeighedPlace};

use super::miss;

/// Nothing in the picture looked like a checkerboard.
pub const NO_GRID: &str = "no grid of corners was found";
/// Meaning of the bits, before the first ones.
pub const ABOUT: &str = "Bits weigh one explanation against another: 8 bits are 256 to 1, and a grid's place needs a lead of 8. \
                         A part of a plain board also needs its code or, live, its track.";

/// How a grid was found, what came of it, and why.
pub fn weighed(number: usize, grid: &WeighedGrid) -> Vec<String> {
    let [long, wide] = grid.size;
    let outcome = match grid.outcome {
        GridOutcome::Named(corners) => format!("{corners} corners of the board"),
        GridOutcome::Circles => "not the board: its dark shapes are round".into(),
        GridOutcome::Missed(why) => miss(&why),
    };
    let seen = grid.corners_px.len();
    let mut lines = vec![format!(
        "{number}. Grid of {}x{} corners, {seen} seen, {}: {outcome}",
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
    lines
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

fn place(&WeighedPlace { first, quarter_turns, bits, has_code }: &WeighedPlace) -> String {
    let [ends, colours, track] = bits;
    let mut from = vec![format!("ends {ends:.0}"), format!("colours {colours:.0}")];
    if track != 0.0 {
        from.push(format!("track {track:.0}"));
    }
    if has_code {
        from.push("the code is there".into());
    }
    let [column, row] = first.map(|index| index + 1);
    let turned = match quarter_turns {
        0 => String::new(),
        turns => format!(", turned by {}°", 90 * turns),
    };
    format!("column {column}, row {row}{turned} ({})", from.join(", "))
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
            outcome: GridOutcome::Missed(Miss::PartialBoard {
                found: 40,
                wanted: 54,
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
}
