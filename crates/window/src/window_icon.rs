//! Icon of the window: a card in space inside the outline of a board, as in
//! `packaging/linux/boresight.svg`.

use egui::{Color32, IconData, Pos2, Rect, pos2};

use super::theme;

/// Side of the icon.
const SIDE: usize = 64;
/// Samples of a pixel along each axis.
const SAMPLES: usize = 4;
const ROUND: f32 = 14.0;
const BOARD: [Pos2; 4] = [pos2(12.0, 17.0), pos2(48.0, 12.0), pos2(52.0, 44.0), pos2(16.0, 52.0)];
const CARD: [Pos2; 4] = [pos2(18.0, 22.0), pos2(45.0, 18.0), pos2(42.0, 45.0), pos2(21.0, 42.0)];
const LINE: f32 = 3.0;
const HOLE: f32 = 6.0;

/// Painted icon.
pub(super) fn window_icon() -> IconData {
    let mut rgba = Vec::with_capacity(4 * SIDE * SIDE);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let mut sum = [0_u32; 4];
            for i in 0..SAMPLES * SAMPLES {
                let part = |at: usize| (at as f32 + 0.5) / SAMPLES as f32;
                let at = pos2(x as f32 + part(i % SAMPLES), y as f32 + part(i / SAMPLES));
                for (sum, level) in sum.iter_mut().zip(color(at).to_array()) {
                    *sum += u32::from(level);
                }
            }
            rgba.extend(sum.map(|sum| (sum / (SAMPLES * SAMPLES) as u32) as u8));
        }
    }
    IconData { rgba, width: SIDE as u32, height: SIDE as u32 }
}

fn color(at: Pos2) -> Color32 {
    let middle = pos2(0.5 * SIDE as f32, 0.5 * SIDE as f32);
    let inner = Rect::from_center_size(middle, egui::Vec2::splat(SIDE as f32 - 2.0 * ROUND));
    if inner.distance_to_pos(at) > ROUND {
        Color32::TRANSPARENT
    } else if at.distance(middle) < HOLE {
        theme::BAND
    } else if is_inside(&CARD, at) {
        theme::AMBER
    } else if (0..4).any(|i| distance(BOARD[i], BOARD[(i + 1) % 4], at) < 0.5 * LINE) {
        Color32::WHITE
    } else {
        theme::BAND
    }
}

/// True if `at` lies in a convex shape with clockwise corners.
fn is_inside(corners: &[Pos2; 4], at: Pos2) -> bool {
    (0..4).all(|i| {
        let (side, to) = (corners[(i + 1) % 4] - corners[i], at - corners[i]);
        side.x * to.y - side.y * to.x > 0.0
    })
}

/// Distance from the line between two points.
fn distance(from: Pos2, to: Pos2, at: Pos2) -> f32 {
    let along = to - from;
    let share = ((at - from).dot(along) / along.length_sq()).clamp(0.0, 1.0);
    (from + share * along).distance(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_icon_has_its_colours() {
        let icon = window_icon();
        let at = |x: usize, y: usize| &icon.rgba[4 * (y * SIDE + x)..4 * (y * SIDE + x) + 4];
        assert_eq!(at(0, 0), [0; 4]);
        assert_eq!(at(24, 28), theme::AMBER.to_array());
        assert_eq!(at(32, 32), theme::BAND.to_array());
    }
}
