//! Search for a lasting jump of the picture's brightness in the middle of a row.
//!
//! A block's mean is coded as the difference from the block before. If one mean is wrong, every
//! block after it is brighter or darker by as much: from there to the end of its row, and in the
//! next row up to there, each block differs from the one above it by the same step; the rest of the
//! two rows does not. No scene has such an edge: a real, slightly tilted edge crosses blocks, with
//! means in between. Steps near a row's end can't be distinguished from level edges; nor can steps
//! small against the picture's contents there.

/// Least steps, in grey levels and in units of a mean: the means of a smooth shade are rounded to
/// neighbouring units along lines with just such a break.
const LEAST_LEVELS: f64 = 3.0;
const LEAST_UNITS: i16 = 3;

/// Means of the blocks at the upper and lower edge of a row of units, summed per unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Edges {
    pub(super) top: i16,
    pub(super) bottom: i16,
}

/// Certainty of such a step, 0 to 1: the least share of blocks with the right difference from the
/// block above, over the four parts of two rows. `edges` are those of all units, row by row,
/// `columns` in each; `per_level` is the size of a grey level in their units. 0 for pictures of a
/// few units.
pub(super) fn seam(edges: &[Edges], columns: usize, per_level: f64) -> f64 {
    let least = ((LEAST_LEVELS * per_level).round() as i16).max(LEAST_UNITS);
    // Shorter parts of a row say too little.
    let margin = (columns / 12).max(5);
    let rows: Vec<&[Edges]> = edges.chunks_exact(columns.max(1)).collect();
    if columns < 4 * margin || rows.len() < 3 {
        return 0.0;
    }
    let (mut upper, mut lower) = (Vec::with_capacity(columns), Vec::with_capacity(columns));
    let mut lower_sum = steps(rows[0], rows[1], least, &mut lower);
    let mut surest = 0.0_f64;
    for pair in rows[1..].windows(2) {
        std::mem::swap(&mut upper, &mut lower);
        let upper_sum = lower_sum;
        lower_sum = steps(pair[0], pair[1], least, &mut lower);
        // Continue only if most blocks of a row's length step to the same side.
        let sum = upper_sum + lower_sum;
        if 10 * sum.abs() >= 4 * columns as i32 * i32::from(least) {
            surest =
                surest.max(broken_line(&upper, &lower, margin, i32::from(least) * sum.signum()));
        }
    }
    surest
}

/// Writes the steps from the units of row `high` down to row `low`, and returns the sum, with each
/// step limited to ±`least`.
fn steps(high: &[Edges], low: &[Edges], least: i16, steps: &mut Vec<i16>) -> i32 {
    steps.clear();
    steps.extend(low.iter().zip(high).map(|(low, high)| low.top - high.bottom));
    steps.iter().map(|step| i32::from((*step).clamp(-least, least))).sum()
}

/// Certainty, 0 to 1, that the `upper` steps from some column on, and the `lower` up to it, are all
/// the same step, of the sign of `least` and no smaller, and that all others are zero.
fn broken_line(upper: &[i16], lower: &[i16], margin: usize, least: i32) -> f64 {
    let counted = |step: i16| (i32::from(step) * least.signum()).clamp(-least.abs(), least.abs());
    let (mut gain, mut best) = (0, (i32::MIN, margin));
    for column in 0..upper.len() - margin {
        if column >= margin && gain > best.0 {
            best = (gain, column);
        }
        gain += counted(lower[column]) - counted(upper[column]);
    }
    let ((upper_calm, upper_step), (lower_step, lower_calm)) =
        (upper.split_at(best.1), lower.split_at(best.1));
    let mut line = [upper_step, lower_step].concat();
    let step = i32::from(*line.select_nth_unstable(upper.len() / 2).1);
    if step * least.signum() < least.abs() {
        return 0.0;
    }
    let near = (step.abs() / 4).max(1);
    let share = |part: &[i16], of: i32| {
        let count = part.iter().filter(|step| (i32::from(**step) - of).abs() <= near).count();
        count as f64 / part.len() as f64
    };
    [share(upper_step, step), share(lower_step, step), share(upper_calm, 0), share(lower_calm, 0)]
        .into_iter()
        .fold(1.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLUMNS: usize = 40;
    const ROWS: usize = 30;
    /// Size of a grey level in units of the means, for a quantization step of 8.
    const PER_LEVEL: f64 = 1.0;

    /// Units of one block each, with brightness `level` at a pixel, and a little grain.
    fn picture(level: impl Fn(f64, f64) -> f64) -> Vec<Edges> {
        let block = |number: usize| {
            let (column, row) = (number % COLUMNS, number / COLUMNS);
            let pixel = |at: usize| level((8 * column + at % 8) as f64, (8 * row + at / 8) as f64);
            let grain = (number * 37 % 5) as f64 / 2.0 - 1.0;
            let mean = ((0..64).map(pixel).sum::<f64>() / 64.0 + grain).round() as i16;
            Edges { top: mean, bottom: mean }
        };
        (0..COLUMNS * ROWS).map(block).collect()
    }

    fn board(x: f64, y: f64) -> f64 {
        let square = ((x + 0.2 * y) / 61.0).floor() + ((y - 0.2 * x) / 61.0).floor();
        if (60.0..250.0).contains(&x) && y > 40.0 && square.rem_euclid(2.0) < 1.0 {
            40.0
        } else {
            180.0
        }
    }

    #[test]
    fn a_jump_in_the_middle_of_a_row_is_seen() {
        for (from, step) in [(416, 12), (615, -25), (900, 60)] {
            let mut edges = picture(board);
            assert!(seam(&edges, COLUMNS, PER_LEVEL) < 0.3);
            for edge in &mut edges[from..] {
                edge.top += step;
                edge.bottom += step;
            }
            let surely = seam(&edges, COLUMNS, PER_LEVEL);
            assert!(surely > 0.5, "from {from} by {step}: {surely}");
        }
    }

    #[test]
    fn edges_of_scenes_are_none() {
        for slope in [0.0, 0.002, 0.01, 0.025, 0.1, 1.0] {
            for at in [60.0, 64.0, 117.0] {
                let halves = picture(|x, y| if y > at + slope * x { 20.0 } else { 220.0 });
                assert!(seam(&halves, COLUMNS, PER_LEVEL) < 0.45, "{slope} {at}");
                let bands = picture(|x, y| {
                    100.0 + 30.0 * (((y - at + slope * x) / 83.0).floor().rem_euclid(2.0))
                });
                assert!(seam(&bands, COLUMNS, PER_LEVEL) < 0.45, "{slope} {at}");
            }
        }
    }

    #[test]
    fn pictures_of_a_few_units_have_none() {
        for (columns, count) in [(0, 0), (1, 1), (8, 48), (40, 40), (40, 80)] {
            let edges = vec![Edges { top: 3, bottom: 9 }; count];
            assert!(seam(&edges, columns, PER_LEVEL) <= 0.0, "{columns} {count}");
        }
    }
}
