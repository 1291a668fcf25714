//! Corner response on a ring, and its local maxima.
//!
//! On a circle around a checkerboard corner opposite samples agree and samples a quarter turn apart
//! differ; on an edge opposite samples differ; on a thin line the ring's mean differs from the middle.
//! Source of the idea: Bennett & Lasenby, "ChESS – Quick and robust detection of chess-board features", 2014.

use image::GrayImage;

/// Half the width of the ring: no response closer to the picture's edge.
pub(super) const RING_RADIUS_PX: usize = 5;

const RING: [(isize, isize); 16] = [
    (0, -5),
    (2, -5),
    (3, -3),
    (5, -2),
    (5, 0),
    (5, 2),
    (3, 3),
    (2, 5),
    (0, 5),
    (-2, 5),
    (-3, 3),
    (-5, 2),
    (-5, 0),
    (-5, -2),
    (-3, -3),
    (-2, -5),
];

/// A local maximum of the response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Peak {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) strength: i16,
}

/// Response of every pixel, zero within the ring's radius of the picture's edge.
pub(super) fn respond(image: &GrayImage, into: &mut Vec<i16>) {
    let (width, height) = (image.width() as usize, image.height() as usize);
    into.clear();
    into.resize(width * height, 0);
    if width <= 2 * RING_RADIUS_PX || height <= 2 * RING_RADIUS_PX {
        return;
    }
    for y in RING_RADIUS_PX..height - RING_RADIUS_PX {
        let row = &mut into[y * width + RING_RADIUS_PX..(y + 1) * width - RING_RADIUS_PX];
        respond_row(image.as_raw(), width, y, row);
    }
}

/// One row; plain slices of one length, so that the compiler vectorises it.
fn respond_row(raw: &[u8], width: usize, y: usize, out: &mut [i16]) {
    let count = out.len();
    let shifted = |dx: isize, dy: isize| -> &[u8] {
        let row = y.wrapping_add_signed(dy);
        let start = (row * width + RING_RADIUS_PX).wrapping_add_signed(dx);
        &raw[start..start + count]
    };
    let ring: [&[u8]; 16] = std::array::from_fn(|k| shifted(RING[k].0, RING[k].1));
    let middle = [shifted(0, 0), shifted(-1, 0), shifted(1, 0), shifted(0, -1), shifted(0, 1)];
    for (x, out) in out.iter_mut().enumerate() {
        let p: [i16; 16] = std::array::from_fn(|k| i16::from(ring[k][x]));
        let mut quarter_turn = 0_i16;
        for k in 0..4 {
            quarter_turn += ((p[k] + p[k + 8]) - (p[k + 4] + p[k + 12])).abs();
        }
        let mut half_turn = 0_i16;
        for k in 0..8 {
            half_turn += (p[k] - p[k + 8]).abs();
        }
        let sum: i16 = p.iter().sum();
        let cross: i16 = middle.iter().map(|row| i16::from(row[x])).sum();
        // 16/5 of the five middle samples.
        let mean = cross * 3 + ((i32::from(cross) * 13108) >> 16) as i16;
        *out = quarter_turn - half_turn - (sum - mean).abs();
    }
}

/// Maxima of 5×5 pixels above `threshold`, strongest first, at most `limit`.
pub(super) fn peaks(
    response: &[i16],
    width: usize,
    threshold: i16,
    limit: usize,
    into: &mut Vec<Peak>,
) {
    into.clear();
    let height = response.len() / width.max(1);
    let border = RING_RADIUS_PX + 2;
    if width <= 2 * border || height <= 2 * border {
        return;
    }
    for y in border..height - border {
        let row = &response[y * width..(y + 1) * width];
        for x in border..width - border {
            let strength = row[x];
            if strength > threshold && is_peak(response, width, x, y) {
                let at = |dx: isize, dy: isize| {
                    f32::from(
                        response[(y.wrapping_add_signed(dy)) * width + x.wrapping_add_signed(dx)],
                    )
                };
                let offset = |before: f32, here: f32, after: f32| {
                    let bend = before - 2.0 * here + after;
                    if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
                };
                into.push(Peak {
                    x: x as f32 + offset(at(-1, 0), at(0, 0), at(1, 0)),
                    y: y as f32 + offset(at(0, -1), at(0, 0), at(0, 1)),
                    strength,
                });
            }
        }
    }
    // A stable sort: equal strengths stay in picture order.
    into.sort_by_key(|peak| std::cmp::Reverse(peak.strength));
    into.truncate(limit);
}

fn is_peak(response: &[i16], width: usize, x: usize, y: usize) -> bool {
    let strength = response[y * width + x];
    (y - 2..=y + 2).all(|row| {
        (x - 2..=x + 2).all(|column| {
            let other = response[row * width + column];
            // Of equal neighbours the first in picture order is the peak.
            other < strength || (other == strength && (row, column) >= (y, x))
        })
    })
}
