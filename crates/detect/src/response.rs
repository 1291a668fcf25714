//! Computes the corner response on a ring of 16 pixels, and local maxima.
//!
//! On a circle around a checkerboard corner, opposite samples agree, and samples a quarter turn
//! apart differ; on an edge, opposite samples differ; on a thin line, the mean of the ring differs
//! from that of the centre. Source: Bennett & Lasenby, "ChESS – Quick and robust detection of
//! chess-board features", 2014.

use std::num::Wrapping;

use image::GrayImage;

use super::simd;

/// Radius of the ring; pixels closer to the edge of the picture have no response.
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

/// Local maximum of the response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Peak {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) strength: i16,
}

/// The response of every pixel, in `buffer`, which grows to the largest picture: clearing the room
/// before each takes as long as filling it. Values within the ring's radius of the edge are stale
/// and must not be read.
pub(super) fn respond<'a>(image: &GrayImage, buffer: &'a mut Vec<i16>) -> &'a [i16] {
    let (width, height) = (image.width() as usize, image.height() as usize);
    buffer.resize(buffer.len().max(width * height), 0);
    let into = &mut buffer[..width * height];
    if width > 2 * RING_RADIUS_PX && height > 2 * RING_RADIUS_PX {
        simd::widest(Responding(image.as_raw(), [width, height], into));
    }
    into
}

/// Pixels, size, and responses.
struct Responding<'a>(&'a [u8], [usize; 2], &'a mut [i16]);

impl simd::Loop for Responding<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(raw, [width, height], into) = self;
        for y in RING_RADIUS_PX..height - RING_RADIUS_PX {
            let row = &mut into[y * width + RING_RADIUS_PX..(y + 1) * width - RING_RADIUS_PX];
            respond_row(raw, width, y, row);
        }
    }
}

/// Computes a row, on slices of equal length so that the compiler vectorises the loop.
#[inline(always)]
fn respond_row(raw: &[u8], width: usize, y: usize, out: &mut [i16]) {
    let count = out.len();
    let shifted = |dx: isize, dy: isize| -> &[u8] {
        let row = y.wrapping_add_signed(dy);
        let start = (row * width + RING_RADIUS_PX).wrapping_add_signed(dx);
        &raw[start..start + count]
    };
    let ring: [&[u8]; 16] = std::array::from_fn(|k| shifted(RING[k].0, RING[k].1));
    let middle = [shifted(0, 0), shifted(-1, 0), shifted(1, 0), shifted(0, -1), shifted(0, 1)];
    // No sum comes near the limits of i16; overflow checks would prevent vectorisation.
    let level = |row: &[u8], x: usize| Wrapping(i16::from(row[x]));
    let size = |value: Wrapping<i16>| Wrapping(value.0.wrapping_abs());
    for (x, out) in out.iter_mut().enumerate() {
        let mut p = [Wrapping(0_i16); 16];
        for k in 0..16 {
            p[k] = level(ring[k], x);
        }
        let mut quarter_turn = Wrapping(0_i16);
        for k in 0..4 {
            quarter_turn += size((p[k] + p[k + 8]) - (p[k + 4] + p[k + 12]));
        }
        let mut half_turn = Wrapping(0_i16);
        for k in 0..8 {
            half_turn += size(p[k] - p[k + 8]);
        }
        let sum: Wrapping<i16> = p.iter().sum();
        let cross: Wrapping<i16> = middle.iter().map(|row| level(row, x)).sum();
        // 16/5 of the five middle samples.
        let mean = cross * Wrapping(3) + Wrapping(((i32::from(cross.0) * 13108) >> 16) as i16);
        *out = (quarter_turn - half_turn - (size(sum - mean) >> 1)).0;
    }
}

/// Pixels skipped at once if none exceeds the threshold.
const STRIDE_PX: usize = 32;

/// Local maxima of 5×5 pixels above `threshold`, strongest first, at most `limit`.
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
    simd::widest(Scanning(response, [width, height], border, threshold, into));
    // Ties are broken by position, so that the order is deterministic.
    into.sort_unstable_by(|a, b| {
        b.strength.cmp(&a.strength).then(a.y.total_cmp(&b.y)).then(a.x.total_cmp(&b.x))
    });
    into.truncate(limit);
}

/// Responses, size, border, threshold, and peaks.
struct Scanning<'a>(&'a [i16], [usize; 2], usize, i16, &'a mut Vec<Peak>);

impl simd::Loop for Scanning<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(response, [width, height], border, threshold, into) = self;
        for y in border..height - border {
            let row = &response[y * width..(y + 1) * width];
            for start in (border..width - border).step_by(STRIDE_PX) {
                let end = (start + STRIDE_PX).min(width - border);
                let highest = row[start..end].iter().fold(i16::MIN, |high, &r| high.max(r));
                if highest <= threshold {
                    continue;
                }
                for (x, &here) in (start..end).zip(&row[start..end]) {
                    if here > threshold && is_peak(response, width, x, y) {
                        into.push(peak(response, width, x, y));
                    }
                }
            }
        }
    }
}

/// The maximum at a pixel, refined to subpixel position by parabolas through the neighbours.
fn peak(response: &[i16], width: usize, x: usize, y: usize) -> Peak {
    let at = |x: usize, y: usize| f32::from(response[y * width + x]);
    let here = at(x, y);
    let offset = |before: f32, after: f32| {
        let bend = before - 2.0 * here + after;
        if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
    };
    Peak {
        x: x as f32 + offset(at(x - 1, y), at(x + 1, y)),
        y: y as f32 + offset(at(x, y - 1), at(x, y + 1)),
        strength: response[y * width + x],
    }
}

fn is_peak(response: &[i16], width: usize, x: usize, y: usize) -> bool {
    let strength = response[y * width + x];
    (y - 2..=y + 2).all(|row| {
        response[row * width + x - 2..=row * width + x + 2].iter().zip(x - 2..).all(
            // Of equal neighbours, the first in raster order is the peak.
            |(&other, column)| other < strength || (other == strength && (row, column) >= (y, x)),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_vector_width_gives_the_same_bits() {
        let picture = GrayImage::from_fn(203, 97, |x, y| {
            let noise = (x * 7919 + y * 104_729) % 61;
            image::Luma([(noise + if (x / 13 + y / 11) % 2 == 0 { 30 } else { 190 }) as u8])
        });
        let (mut widest, mut least) = (Vec::new(), vec![0; 203 * 97]);
        let widest = respond(&picture, &mut widest);
        simd::Loop::run(Responding(picture.as_raw(), [203, 97], &mut least));
        assert_eq!(widest, least);
        assert!(widest.iter().any(|response| *response > 500));
    }
}
