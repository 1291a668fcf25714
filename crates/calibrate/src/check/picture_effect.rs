//! Effect of a [`Cause`] on the image of a corner, with derivatives.

use nalgebra::{Matrix2, Matrix2x4, Point2, Vector2};

use super::hypotheses::{Cause, SHARED_EXTRAS};
use crate::solve::whitened::Whitened;
use boresight_geometry::{Camera, Projection, frame::ImageSize};

/// Corner as projected by the plain lens.
#[derive(Clone, Copy)]
pub(super) struct PictureAt<'a> {
    pub(super) view: usize,
    pub(super) corner: &'a Whitened,
    pub(super) camera: &'a Camera,
    pub(super) plain: &'a Projection,
    pub(super) image_size: ImageSize,
}

/// Image of the corner under the cause.
pub(super) struct Effect {
    pub(super) px: Point2<f64>,
    /// Derivatives by the plain pixel, by the point before distortion, and by `(fx, fy, cx, cy)`,
    /// each with the others held.
    pub(super) by_px: Matrix2<f64>,
    pub(super) by_flat: Matrix2<f64>,
    pub(super) by_f_and_pp: Matrix2x4<f64>,
    /// Derivatives by the parameters of the cause.
    pub(super) by_cause: [Vector2<f64>; SHARED_EXTRAS],
}

impl PictureAt<'_> {
    /// Effect of `cause` with the parameters `by`, scaled by `times` if shared by all views.
    pub(super) fn effect(&self, cause: &Cause, by: &[f64], times: f64) -> Effect {
        let (px, flat) = (self.plain.px, self.plain.flat.coords);
        let (f_px, pp_px) = (self.camera.f_px, self.camera.pp_px);
        let off = px - pp_px;
        let r2 = flat.norm_squared();
        let mut effect = Effect {
            px,
            by_px: Matrix2::identity(),
            by_flat: Matrix2::zeros(),
            by_f_and_pp: Matrix2x4::zeros(),
            by_cause: [Vector2::zeros(); SHARED_EXTRAS],
        };
        match cause {
            Cause::LensShape | Cause::NextRadial => {
                let [first, second, x, y] =
                    std::array::from_fn(|i| by.get(i).copied().unwrap_or(0.0));
                let prism = Vector2::new(x, y);
                let power = self.camera.distortion.kind.next_radial_power();
                let radial = r2.powi(power);
                let more = flat * (radial * (first + second * r2)) + prism * r2;
                let by_r2 =
                    f64::from(power) * r2.powi(power - 1) * (first + second * r2) + radial * second;
                let by_flat = Matrix2::from_diagonal_element(radial * (first + second * r2))
                    + (flat * by_r2 + prism) * (2.0 * flat).transpose();
                effect.px += more.component_mul(&f_px);
                effect.by_flat = Matrix2::from_diagonal(&f_px) * by_flat;
                effect.by_f_and_pp[(0, 0)] = more.x;
                effect.by_f_and_pp[(1, 1)] = more.y;
                let along = (flat * radial).component_mul(&f_px);
                effect.by_cause[..4].copy_from_slice(&[
                    along,
                    along * r2,
                    Vector2::new(r2 * f_px.x, 0.0),
                    Vector2::new(0.0, r2 * f_px.y),
                ]);
            }
            Cause::SmoothField => {
                effect.by_cause = field_terms(self.image_size, &px);
                effect.px += effect
                    .by_cause
                    .iter()
                    .zip(by)
                    .map(|(term, by)| term * *by)
                    .sum::<Vector2<f64>>();
                effect.by_px += field_by_px(self.image_size, &px, by);
            }
            Cause::Focus | Cause::FocusDrift | Cause::FocusJump(_) | Cause::FocusBreathes(_) => {
                let scale = libm::exp(by[0] * times);
                effect.scale(pp_px, off, scale);
                effect.by_cause[0] = off * (scale * times);
            }
            Cause::Mixed(other) if other[self.view] => {
                let (scale, bend) = (libm::exp(by[0]), 1.0 + by[3] * r2);
                let shift = Vector2::new(by[1], by[2]);
                effect.scale(pp_px, off, scale * bend);
                effect.px += shift * f_px.x;
                effect.by_f_and_pp.set_column(0, &shift);
                effect.by_flat = off * (flat * (2.0 * scale * by[3])).transpose();
                effect.by_cause[..4].copy_from_slice(&[
                    off * (scale * bend),
                    Vector2::x() * f_px.x,
                    Vector2::y() * f_px.x,
                    off * (scale * r2),
                ]);
            }
            Cause::PixelSkew => {
                effect.px.x += by[0] * off.y;
                effect.by_px[(0, 1)] = by[0];
                effect.by_f_and_pp[(0, 3)] = -by[0];
                effect.by_cause[0] = Vector2::new(off.y, 0.0);
            }
            Cause::Shifted => effect.shift(by, 1.0),
            Cause::RollingShutter => {
                let height_px = f64::from(self.image_size.height_px);
                effect.shift(by, px.y / height_px - 0.5);
                effect.by_px.column_mut(1).axpy(
                    height_px.recip(),
                    &Vector2::new(by[0], by[1]),
                    1.0,
                );
            }
            // Compare the observed corner, so that the fit can't move it over the tear.
            Cause::Torn(rows)
                if rows[self.view].is_some_and(|row_px| self.corner.px.y > row_px) =>
            {
                effect.shift(by, 1.0);
            }
            Cause::Mixed(_)
            | Cause::Torn(_)
            | Cause::PixelAspect
            | Cause::BoardStretched
            | Cause::BoardBent
            | Cause::BoardFlexes => {}
        }
        effect
    }
}

impl Effect {
    /// Scales the picture about the principal point; `off` is the offset of the corner from it.
    fn scale(&mut self, pp_px: Point2<f64>, off: Vector2<f64>, scale: f64) {
        self.px = pp_px + off * scale;
        self.by_px *= scale;
        self.by_f_and_pp[(0, 2)] = 1.0 - scale;
        self.by_f_and_pp[(1, 3)] = 1.0 - scale;
    }

    /// Shifts the corner by a share of two parameters in pixels.
    fn shift(&mut self, by: &[f64], share: f64) {
        self.px += Vector2::new(by[0], by[1]) * share;
        self.by_cause[0] = Vector2::x() * share;
        self.by_cause[1] = Vector2::y() * share;
    }
}

/// Offset from the picture's centre, 1 at the sides.
fn from_middle(image_size: ImageSize, px: &Point2<f64>) -> Vector2<f64> {
    (px - image_size.centre_px()) * 2.0 / f64::from(image_size.width_px)
}

/// Terms of a [`Cause::SmoothField`] at `px`: those of second order, except the two given by p1 and
/// p2, and of third order, 1 px at the sides of the picture.
pub(super) fn field_terms(
    image_size: ImageSize,
    px: &Point2<f64>,
) -> [Vector2<f64>; SHARED_EXTRAS] {
    let off = from_middle(image_size, px);
    let (u, v) = (off.x, off.y);
    let along_x = |value: f64| Vector2::new(value, 0.0);
    let along_y = |value: f64| Vector2::new(0.0, value);
    let square = u * u + v * v;
    let [a, b, c, d] = [u * u * u, u * u * v, u * v * v, v * v * v];
    [
        along_x(square),
        along_y(square),
        Vector2::new(u * u - v * v, -2.0 * u * v),
        Vector2::new(2.0 * u * v, u * u - v * v),
        along_x(a),
        along_x(b),
        along_x(c),
        along_x(d),
        along_y(a),
        along_y(b),
        along_y(c),
        along_y(d),
    ]
}

/// Derivative by the pixel of the sum of [`field_terms`] weighted with `by`.
fn field_by_px(image_size: ImageSize, px: &Point2<f64>, by: &[f64]) -> Matrix2<f64> {
    let off = from_middle(image_size, px);
    let (u, v) = (off.x, off.y);
    let cubes = [
        Vector2::new(3.0 * u * u, 0.0),
        Vector2::new(2.0 * u * v, u * u),
        Vector2::new(v * v, 2.0 * u * v),
        Vector2::new(0.0, 3.0 * v * v),
    ];
    let third =
        |by: &[f64]| -> Vector2<f64> { cubes.iter().zip(by).map(|(cube, by)| cube * *by).sum() };
    let x = off * (2.0 * by[0])
        + Vector2::new(u, -v) * (2.0 * by[2])
        + Vector2::new(v, u) * (2.0 * by[3])
        + third(&by[4..8]);
    let y = off * (2.0 * by[1])
        + Vector2::new(-v, -u) * (2.0 * by[2])
        + Vector2::new(u, -v) * (2.0 * by[3])
        + third(&by[8..12]);
    Matrix2::from_rows(&[x.transpose(), y.transpose()]) * (2.0 / f64::from(image_size.width_px))
}
