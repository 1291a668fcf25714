//! The printed board: intersection with a ray, and the share of ink in a pixel.

use nalgebra::{Isometry3, Matrix3, Point2, Point3};

use super::{
    bend::Bend,
    exposure::Exposure,
    printed_circles::PrintedCircles,
    printed_code::PrintedCode,
    printed_markers::{Cells, Crossing, PrintedMarkers},
    printed_tags::PrintedTags,
    sheet_view::{PixelRay, SheetView, Spot},
};
use boresight_geometry::{board_code::BoardId, boards::Board};

/// White paper around the squares, in squares.
const MARGIN: f32 = 0.8;

/// Number of samples per pixel.
const SAMPLES: usize = 64;

/// Printed sheet, in squares or sides of a tag: `[0, across] × [0, down]` is checkered, with a
/// white margin.
///
/// Square (0, 0), diagonally outside corner 0, is dark. Light squares may have markers. An
/// AprilGrid has tags instead, or there are circles. A code may be in the margin.
#[derive(Clone, Debug)]
pub(super) struct Print {
    across: f32,
    down: f32,
    square_m: f64,
    bend: Option<Bend>,
    markers: Option<PrintedMarkers>,
    tags: Option<PrintedTags>,
    circles: Option<PrintedCircles>,
    code: Option<PrintedCode>,
    offsets_x: Vec<f32>,
    offsets_y: Vec<f32>,
}

/// Appearance around a point of the sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Patch {
    /// Only the background of the sheet.
    Backdrop,
    /// Only ink.
    Dark,
    /// Only paper.
    Light,
    /// At most four squares, or cells of a marker, around the crossing.
    Crossing(Crossing),
    /// Anything else.
    Mixed,
}

/// Shares of a pixel. The rest is backdrop.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Share {
    pub(super) dark: f32,
    pub(super) light: f32,
}

impl Print {
    /// Sheet of a board bent by `bend_m` along the z-axis; with the
    /// code of `id`, if any.
    pub(super) fn new(board: &Board, id: Option<BoardId>, bend_m: f64) -> Self {
        // A digital net, so that every aligned run of samples is spread evenly in x and in y,
        // folded into a tent two pixels wide: the pixel's own square and one pixel of the blur.
        let (offsets_x, offsets_y) = (0..SAMPLES as u32)
            .map(|k| (tent(k.reverse_bits()), tent(second_dimension(k))))
            .unzip();
        let square_m = board.measured_m();
        let [across, down] = board.target().size_m().map(|side_m| (side_m / square_m) as f32);
        let in_squares = board.markers().filter(|_| matches!(board, Board::Charuco(_)));
        Self {
            across,
            down,
            square_m,
            bend: Bend::new(board, bend_m),
            markers: in_squares.map(|markers| PrintedMarkers::new(board, &markers)),
            tags: PrintedTags::new(board),
            circles: PrintedCircles::new(board),
            code: id.and_then(|id| PrintedCode::new(board, id)),
            offsets_x,
            offsets_y,
        }
    }

    /// Points along the sheet's outline, in board metres.
    pub(super) fn outline_in_board_m(&self) -> Vec<Point3<f64>> {
        let (half_x, half_y) = (
            (f64::from(self.across) / 2.0 + f64::from(MARGIN)) * self.square_m,
            (f64::from(self.down) / 2.0 + f64::from(MARGIN)) * self.square_m,
        );
        (0..=32)
            .map(|step| f64::from(step) / 16.0 - 1.0)
            .flat_map(|s| {
                [
                    Point2::new(s * half_x, -half_y),
                    Point2::new(s * half_x, half_y),
                    Point2::new(-half_x, s * half_y),
                    Point2::new(half_x, s * half_y),
                ]
            })
            .map(|at| {
                let in_squares = (at / self.square_m).cast();
                let height = self.bend.map_or(0.0, |bend| bend.height(in_squares));
                Point3::new(at.x, at.y, f64::from(height) * self.square_m)
            })
            .collect()
    }

    /// Point of the sheet, and distance on the sheet, in board metres.
    pub(super) fn in_board_m(&self, u: f32, v: f32, distance: f32) -> (Point2<f64>, f64) {
        let from_middle =
            Point2::new(f64::from(u - 0.5 * self.across), f64::from(v - 0.5 * self.down));
        (from_middle * self.square_m, f64::from(distance) * self.square_m)
    }

    /// Sheet as seen at `cam_from_board`. `None` from behind or edge-on.
    pub(super) fn seen_at(&self, cam_from_board: &Isometry3<f64>) -> Option<SheetView> {
        let turn = cam_from_board.rotation.to_rotation_matrix();
        let along_u = turn.matrix().column(0) * self.square_m;
        let along_v = turn.matrix().column(1) * self.square_m;
        let origin = cam_from_board.translation.vector
            - along_u * (f64::from(self.across) / 2.0)
            - along_v * (f64::from(self.down) / 2.0);
        let ray_from_sheet = Matrix3::from_columns(&[along_u, along_v, origin]);
        // The front is visible if the sheet's normal points away from the camera.
        if ray_from_sheet.determinant() <= 1e-12 * self.square_m.powi(2) {
            return None;
        }
        let sheet_from_ray = ray_from_sheet.try_inverse()?;
        let row = |i: usize| {
            [
                sheet_from_ray[(i, 0)] as f32,
                sheet_from_ray[(i, 1)] as f32,
                sheet_from_ray[(i, 2)] as f32,
            ]
        };
        let middle = [0.5 * self.across, 0.5 * self.down];
        let bent = self.bend.map(|bend| (middle, bend.seen_at(cam_from_board)));
        Some(SheetView { rows: [row(0), row(1), row(2)], bent })
    }

    /// Contents within `du`, `dv` squares around `(u, v)`.
    #[inline]
    pub(super) fn around(&self, u: f32, v: f32, du: f32, dv: f32) -> Patch {
        let inside =
            |du: f32, dv: f32| u > du && u < self.across - du && v > dv && v < self.down - dv;
        if let Some(circles) = self.circles.as_ref().filter(|_| inside(du, dv)) {
            return if circles.is_edge_near(u, v, du, dv) { Patch::Mixed } else { self.flat(u, v) };
        }
        if let Some(tags) = self.tags.as_ref().filter(|_| inside(du, dv)) {
            return match tags.around(u, v, du, dv) {
                Cells::One => self.flat(u, v),
                Cells::Four(crossing) => Patch::Crossing(crossing),
                Cells::More => Patch::Mixed,
            };
        }
        if inside(du, dv) {
            let (line_u, line_v) = (nearest_integer(u), nearest_integer(v));
            if (u - line_u).abs() > du && (v - line_v).abs() > dv {
                let markers = self.markers.as_ref().filter(|_| is_light(u, v));
                return match markers.map_or(Cells::One, |markers| markers.around(u, v, du, dv)) {
                    Cells::One => self.flat(u, v),
                    Cells::Four(crossing) => Patch::Crossing(crossing),
                    Cells::More => Patch::Mixed,
                };
            }
            let reaches = |markers: &PrintedMarkers| {
                markers.may_reach((u - line_u).abs(), (v - line_v).abs(), du, dv)
            };
            if self.markers.as_ref().is_some_and(reaches) {
                return Patch::Mixed;
            }
            if du >= 0.45 || dv >= 0.45 {
                return Patch::Mixed;
            }
            let is_dark = (line_u as i32 + line_v as i32) & 1 == 0;
            let dark = [is_dark, !is_dark, !is_dark, is_dark];
            return Patch::Crossing(Crossing { at: [line_u, line_v], dark });
        }
        if !inside(-MARGIN - du, -MARGIN - dv) {
            return Patch::Backdrop;
        }
        if !inside(-du, -dv) && inside(du - MARGIN, dv - MARGIN) {
            let has_code = self.code.as_ref().is_some_and(|code| code.may_reach(u, v, du, dv));
            return if has_code { Patch::Mixed } else { Patch::Light };
        }
        Patch::Mixed
    }

    /// Dark and light shares of a pixel, averaged over `exposure`.
    pub(super) fn share(&self, exposure: &Exposure, pixel: &PixelRay) -> Share {
        let count = exposure.view_count();
        let per_view = (SAMPLES / count.max(1)).max(1);
        let mut share = Share::default();
        exposure.for_each_spot(pixel, |index, spot| {
            if !spot.is_met() {
                return;
            }
            let start = (index * per_view) % SAMPLES;
            let end = (start + per_view).min(SAMPLES);
            let xs = &self.offsets_x[start..end];
            let ys = &self.offsets_y[start..end];
            let seen = self.share_of(spot, xs, ys);
            share.dark += seen.dark;
            share.light += seen.light;
        });
        let scale = 1.0 / count.max(1) as f32;
        Share { dark: share.dark * scale, light: share.light * scale }
    }

    fn share_of(&self, spot: &Spot, xs: &[f32], ys: &[f32]) -> Share {
        let du = spot.by_x[0].abs() + spot.by_y[0].abs();
        let dv = spot.by_x[1].abs() + spot.by_y[1].abs();
        let one = xs.len() as f32;
        match self.around(spot.u, spot.v, du, dv) {
            Patch::Backdrop => Share::default(),
            Patch::Dark => Share { dark: 1.0, light: 0.0 },
            Patch::Light => Share { dark: 0.0, light: 1.0 },
            Patch::Crossing(crossing) => {
                let [from_u, from_v] = [spot.u - crossing.at[0], spot.v - crossing.at[1]];
                let (mut left, mut above, mut both) = (0_u32, 0_u32, 0_u32);
                for (x, y) in xs.iter().zip(ys) {
                    let is_left = from_u + spot.by_x[0] * x + spot.by_y[0] * y < 0.0;
                    let is_above = from_v + spot.by_x[1] * x + spot.by_y[1] * y < 0.0;
                    left += u32::from(is_left);
                    above += u32::from(is_above);
                    both += u32::from(is_left & is_above);
                }
                let all = xs.len() as u32;
                let counts = [both, above - both, left - both, all + both - left - above];
                let dark: u32 =
                    counts.iter().zip(crossing.dark).filter(|(_, b)| *b).map(|(n, _)| n).sum();
                let dark = dark as f32 / one;
                Share { dark, light: 1.0 - dark }
            }
            Patch::Mixed => {
                let (mut dark, mut light) = (0.0, 0.0);
                for (x, y) in xs.iter().zip(ys) {
                    let u = spot.u + spot.by_x[0] * x + spot.by_y[0] * y;
                    let v = spot.v + spot.by_x[1] * x + spot.by_y[1] * y;
                    match self.at(u, v) {
                        Patch::Dark => dark += 1.0,
                        Patch::Light => light += 1.0,
                        Patch::Backdrop | Patch::Crossing(_) | Patch::Mixed => {}
                    }
                }
                Share { dark: dark / one, light: light / one }
            }
        }
    }

    fn at(&self, u: f32, v: f32) -> Patch {
        if u > 0.0 && u < self.across && v > 0.0 && v < self.down {
            self.flat(u, v)
        } else if u > -MARGIN && u < self.across + MARGIN && v > -MARGIN && v < self.down + MARGIN {
            let on_bar = self.code.as_ref().is_some_and(|code| code.is_black(u, v));
            if on_bar { Patch::Dark } else { Patch::Light }
        } else {
            Patch::Backdrop
        }
    }

    /// Colour at a point inside the pattern.
    #[inline]
    fn flat(&self, u: f32, v: f32) -> Patch {
        if let Some(circles) = &self.circles {
            return if circles.is_black(u, v) { Patch::Dark } else { Patch::Light };
        }
        if let Some(tags) = &self.tags {
            return if tags.is_black(u, v) { Patch::Dark } else { Patch::Light };
        }
        let on_marker = |markers: &PrintedMarkers| markers.is_black(u, v);
        if !is_light(u, v) || self.markers.as_ref().is_some_and(on_marker) {
            Patch::Dark
        } else {
            Patch::Light
        }
    }
}

/// True for a point of the pattern in a light square.
#[inline]
fn is_light(u: f32, v: f32) -> bool {
    (u as i32 + v as i32) & 1 == 1
}

/// Nearest integer, for `|x| < 2²²`: adds a number whose last bit has the value 1.
#[inline]
fn nearest_integer(x: f32) -> f32 {
    const LAST_BIT_IS_ONE: f32 = 12_582_912.0;
    (x + LAST_BIT_IS_ONE) - LAST_BIT_IS_ONE
}

/// Sobol's second dimension, as a fraction of 2³².
fn second_dimension(mut k: u32) -> u32 {
    let (mut direction, mut bits) = (1_u32 << 31, 0);
    while k != 0 {
        if k & 1 == 1 {
            bits ^= direction;
        }
        k >>= 1;
        direction ^= direction >> 1;
    }
    bits
}

/// Spreads an even fraction of 2³² as a tent on (-1, 1): the quantiles of two boxes' convolution.
fn tent(fraction: u32) -> f32 {
    let t = f64::from(fraction) / 4_294_967_296.0 + 0.5 / SAMPLES as f64;
    (if t < 0.5 { (2.0 * t).sqrt() - 1.0 } else { 1.0 - (2.0 * (1.0 - t)).sqrt() }) as f32
}
