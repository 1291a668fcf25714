//! Present and requested board side by side, in dots of braille, or in letters on a terminal
//! without braille.

use nalgebra::Point2;

use boresight_present::{ghost::Card, instruction::Instruction, text::window as words};

/// Characters of a card, across and down.
const CELLS: [usize; 2] = [14, 5];
/// Dots of a character, across and down.
const DOTS: [usize; 2] = [2, 4];
/// Bits of the dots in a braille character, by row and column.
const BRAILLE: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];
/// First character of braille.
const BLANK: u32 = 0x2800;
const GAP: &str = "  ";

/// Rim of a card: pixel and nearness.
type Rim = Vec<(Point2<f64>, f32)>;

/// Both cards, in lines of equal length; mirrored if `mirrored`.
pub(super) fn drawing(now: &Instruction, draws_dots: bool, mirrored: bool) -> Vec<String> {
    let side = if mirrored { -1.0 } else { 1.0 };
    let as_seen = |rim: Rim| -> Rim {
        rim.into_iter().map(|(px, near)| (Point2::new(side * px.x, px.y), near)).collect()
    };
    let rim = |card: &Option<Card>| card.as_ref().and_then(Card::rim).map(as_seen);
    let (seen, wanted) = (rim(&now.board), rim(&now.card));
    let reach = |rim: &Rim| {
        let along = |get: fn(&Point2<f64>) -> f64| {
            let values = rim.iter().map(|(px, _)| get(px));
            values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
        };
        along(|px| px.x).max(along(|px| px.y) * 1.4).max(1.0)
    };
    let largest = [&seen, &wanted].into_iter().flatten().map(reach).fold(1.0, f64::max);
    let draw = |rim: &Option<Rim>, label: &str| {
        let mut lines = rim.as_ref().map_or_else(
            || vec![" ".repeat(CELLS[0]); CELLS[1]],
            |rim| dots(rim, largest, draws_dots),
        );
        let label = if rim.is_some() { label } else { "" };
        lines.push(format!("{label:^width$}", width = CELLS[0]));
        lines
    };
    let cards = draw(&seen, words::NOW).into_iter().zip(draw(&wanted, words::WANTED));
    cards.map(|(seen, wanted)| format!("{seen}{GAP}{wanted}")).collect()
}

/// Card in dots, with a thick near edge.
fn dots(rim: &Rim, largest: f64, draws_dots: bool) -> Vec<String> {
    let [wide, high] = [CELLS[0] * DOTS[0], CELLS[1] * DOTS[1]];
    let mut is_set = vec![false; wide * high];
    let middle = rim.iter().fold([0.0, 0.0], |[x, y], (px, _)| [x + px.x, y + px.y]);
    let middle = middle.map(|sum| sum / rim.len().max(1) as f64);
    let scale = (wide as f64 - 3.0) / largest;
    let at = |px: &Point2<f64>| {
        let x = 0.5 * wide as f64 + scale * (px.x - middle[0]);
        [x, 0.5 * high as f64 + scale * (px.y - middle[1])]
    };
    let mut set = |x: f64, y: f64| {
        if x >= 0.0 && y >= 0.0 && x < wide as f64 && y < high as f64 {
            is_set[y as usize * wide + x as usize] = true;
        }
    };
    for (i, (from, near)) in rim.iter().enumerate() {
        let (to, near_to) = &rim[(i + 1) % rim.len()];
        let ([x, y], [to_x, to_y]) = (at(from), at(to));
        let is_near = near + near_to > 1.6;
        for step in 0..=2 * wide {
            let share = step as f64 / (2 * wide) as f64;
            let (x, y) = (x + share * (to_x - x), y + share * (to_y - y));
            set(x, y);
            if is_near {
                // Inwards.
                let inwards = [0.5 * wide as f64 - x, 0.5 * high as f64 - y];
                let length = inwards[0].hypot(inwards[1]).max(1e-9);
                set(x + inwards[0] / length, y + inwards[1] / length);
            }
        }
    }
    let cell = |across: usize, down: usize| {
        let bits = (0..DOTS[1]).flat_map(|y| (0..DOTS[0]).map(move |x| (x, y)));
        let at = |x: usize, y: usize| (down * DOTS[1] + y) * wide + across * DOTS[0] + x;
        let bits =
            bits.filter(|(x, y)| is_set[at(*x, *y)]).fold(0, |all, (x, y)| all | BRAILLE[y][x]);
        match bits {
            0 => ' ',
            _ if !draws_dots => '*',
            bits => char::from_u32(BLANK + bits).unwrap_or('*'),
        }
    };
    (0..CELLS[1]).map(|down| (0..CELLS[0]).map(|across| cell(across, down)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rim(points: [(f64, f64, f32); 4]) -> Rim {
        points.map(|(x, y, near)| (Point2::new(x, y), near)).into()
    }

    #[test]
    fn the_near_edge_is_thick() {
        let card =
            rim([(0.0, 0.0, 0.0), (100.0, 0.0, 0.0), (120.0, 70.0, 1.0), (-20.0, 70.0, 1.0)]);
        let lines = dots(&card, 140.0, true);
        assert_eq!(lines.len(), CELLS[1]);
        assert!(lines.iter().all(|line| line.chars().count() == CELLS[0]));
        let count = |line: &str| -> u32 {
            line.chars().filter(|c| *c != ' ').map(|c| (c as u32 - BLANK).count_ones()).sum()
        };
        let inked: Vec<u32> = lines.iter().map(|line| count(line)).filter(|ink| *ink > 0).collect();
        // A thick edge may lie across two lines of text.
        let (far, near) = (inked[..2].iter().sum::<u32>(), inked.iter().rev().take(2).sum::<u32>());
        assert!(2 * near > 3 * far, "{lines:#?}");
    }
}
