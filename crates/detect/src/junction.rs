//! Reads the structure of a corner candidate: two edges and the colours between them.

use std::sync::LazyLock;

use image::GrayImage;

use super::{reduce::sample_inside, response::Peak};

/// Corner candidate with edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Junction {
    pub(super) x: f32,
    pub(super) y: f32,
    /// Directions of the two edges, modulo π. Rotating from the first to the second (clockwise on
    /// the screen, `x` right and `y` down) sweeps over a light square.
    pub(super) edges_rad: [f32; 2],
    /// Half the brightness step.
    pub(super) contrast: f32,
}

const SAMPLES: usize = 32;
const RADIUS_PX: f32 = 4.5;

/// Offsets of the samples from the corner.
static RING: LazyLock<[[f32; 2]; SAMPLES]> = LazyLock::new(|| {
    std::array::from_fn(|k| {
        let (sin, cos) = libm::sincosf(angle_rad(k as f32));
        [RADIUS_PX * cos, RADIUS_PX * sin]
    })
});

/// Reads the ring around a peak. `None` unless the colour changes exactly four times, opposite
/// changes are in line within 27°, and the edges cross at more than 30°.
pub(super) fn read(image: &GrayImage, peak: &Peak) -> Option<Junction> {
    let ring = RING.each_ref().map(|[dx, dy]| sample_inside(image, peak.x + dx, peak.y + dy));
    let low = ring.iter().copied().fold(f32::MAX, f32::min);
    let high = ring.iter().copied().fold(f32::MIN, f32::max);
    let middle = 0.5 * (low + high);
    let mut changes = [(0.0_f32, false); 4];
    let mut count = 0;
    for k in 0..SAMPLES {
        let (here, next) = (ring[k] - middle, ring[(k + 1) % SAMPLES] - middle);
        if (here >= 0.0) != (next >= 0.0) {
            if count == 4 {
                return None;
            }
            changes[count] = (angle_rad(k as f32 + here / (here - next)), next >= 0.0);
            count += 1;
        }
    }
    if count != 4 {
        return None;
    }
    // Changes to light and to dark alternate, so opposite changes are of the same kind.
    let first_to_light = usize::from(!changes[0].1);
    let to_light = [changes[first_to_light].0, changes[first_to_light + 2].0];
    let to_dark = [changes[1 - first_to_light].0, changes[3 - first_to_light].0];
    let edges_rad = [in_line(to_light)?, in_line(to_dark)?];
    let crossing = libm::sinf(edges_rad[0] - edges_rad[1]).abs();
    (crossing > 0.5).then_some(Junction {
        x: peak.x,
        y: peak.y,
        edges_rad,
        contrast: 0.5 * (high - low),
    })
}

fn angle_rad(step: f32) -> f32 {
    step * std::f32::consts::TAU / SAMPLES as f32
}

/// Common direction of two opposite changes, modulo π; `None` if they aren't in line.
fn in_line([a, b]: [f32; 2]) -> Option<f32> {
    let off = libm::sinf(b - a - std::f32::consts::PI);
    let opposite = libm::cosf(b - a) < 0.0;
    (opposite && off.abs() < 0.45).then(|| {
        let off = libm::asinf(off);
        (a + 0.5 * off).rem_euclid(std::f32::consts::PI)
    })
}

/// Sine of the angle between two directions, modulo π.
pub(super) fn apart(a: f32, b: f32) -> f32 {
    libm::sinf(a - b).abs()
}
