//! Calibrates again with a correction for the likeliest cause that all views share: non-square
//! pixels or squares, or a bent board. If the rest shows another one, corrects that, too.
//!
//! A fit without a known cause has the wrong lens, by far more than the noise of its corners
//! suggests. The corrected fit is examined like any other, and the finding stays.

use std::borrow::Cow;

use nalgebra::{Point2, Point3, Vector2};

use super::{
    explanations::{Explanation, Explanations},
    findings::corrected,
    kinds::Kind,
};
use crate::{check::finding::Finding, params::CalibrationParams, solve::bundle::Bundle};
use boresight_geometry::{Corner, LensMatrix};

/// Correction for causes of a misfit, with the remaining doubt.
#[derive(Clone, Debug)]
pub(crate) struct Correction {
    /// Ratio of height to width of non-square pixels.
    aspect: Option<f64>,
    /// Ratio of height to width of the board's squares.
    stretch: f64,
    bent: Option<Bent>,
    /// Covariance of the lens from doubt about the causes and their parameters: others look the
    /// same.
    pub(crate) doubt: LensMatrix,
    /// Findings of the corrected causes.
    pub(crate) findings: Vec<Finding>,
}

/// Board bent alike in all views.
#[derive(Clone, Debug)]
struct Bent {
    /// Height of each point over the flat board in metres, in numbering order.
    rise_m: Vec<f64>,
    /// Shift of each seen corner by the bend in pixels, view by view.
    shift_px: Vec<Vec<Vector2<f64>>>,
}

impl Correction {
    /// Correction for an explanation that a calibration can and should correct, combined with an
    /// `earlier` correction. `bundle` is the explained fit, with `n` coordinates. `None` if there
    /// is no such explanation or it is already corrected.
    pub(super) fn of(
        explanations: &Explanations,
        bundle: &Bundle,
        n: f64,
        earlier: Option<&Self>,
    ) -> Option<Self> {
        let mut correction = earlier.cloned().unwrap_or(Self {
            aspect: None,
            stretch: 1.0,
            bent: None,
            doubt: LensMatrix::zeros(),
            findings: Vec::new(),
        });
        let explanation = explanations.correctable(|kind| match kind {
            Kind::PixelAspect => correction.aspect.is_some(),
            Kind::BoardStretched => correction.stretch != 1.0,
            _ => correction.bent.is_some(),
        })?;
        let freedom = bundle.freedom.count() + 6 * bundle.state.cam_from_board.len();
        correction.apply(explanation, explanation.of_parameters(n, freedom));
        correction.doubt += explanations.doubt_beside(explanation);
        correction.findings.push(corrected(explanation));
        Some(correction)
    }

    fn apply(&mut self, explanation: &Explanation, of_parameters: LensMatrix) {
        match explanation.kind {
            // The adjustment estimates the aspect.
            Kind::PixelAspect => {
                let f_px = explanation.state.bundle.camera.f_px;
                self.aspect = Some(f_px.y / f_px.x);
            }
            Kind::BoardStretched => {
                self.stretch = 1.0 + explanation.state.extras[0];
                self.doubt += of_parameters;
            }
            _ => {
                let (rise_m, shift_px) = (&explanation.rise_m, &explanation.shift_px);
                self.bent = Some(Bent { rise_m: rise_m.clone(), shift_px: shift_px.clone() });
                self.doubt += of_parameters;
            }
        }
    }

    /// Calibration parameters with the correction.
    pub(crate) fn params(&self, params: &CalibrationParams) -> CalibrationParams {
        let square_pixels = params.square_pixels && self.aspect.is_none();
        CalibrationParams { square_pixels, ..params.clone() }
    }

    /// Board in metres to calibrate with. A bent board is flat here: its corners are moved instead,
    /// see [`Self::views`].
    pub(crate) fn board_m(&self, board_m: &[Point2<f64>]) -> Vec<Point2<f64>> {
        board_m.iter().map(|point_m| Point2::new(point_m.x, point_m.y * self.stretch)).collect()
    }

    /// Points of the board in metres, from those of the flat board.
    pub(crate) fn points_m(&self, board_m: &[Point2<f64>]) -> Vec<Point3<f64>> {
        let rise_m = |index: usize| self.bent.as_ref().map_or(0.0, |bent| bent.rise_m[index]);
        let point_m = |(i, p): (usize, &Point2<f64>)| Point3::new(p.x, p.y, rise_m(i));
        board_m.iter().enumerate().map(point_m).collect()
    }

    /// Corners as a flat board would show them.
    pub(crate) fn views<'a>(&self, views: &'a [Vec<Corner>]) -> Cow<'a, [Vec<Corner>]> {
        let Some(bent) = &self.bent else { return Cow::Borrowed(views) };
        let flat = |(corners, shifts): (&Vec<Corner>, &Vec<_>)| {
            let mut shifts = shifts.iter();
            let flat = |corner: &Corner| {
                let shift = corner.is_seen().then(|| shifts.next()).flatten();
                shift.map_or(*corner, |shift| Corner { px: corner.px - shift, ..*corner })
            };
            corners.iter().map(flat).collect()
        };
        Cow::Owned(views.iter().zip(&bent.shift_px).map(flat).collect())
    }

    /// Corners of a view that repeats `kept`, the view with index `view`, as a flat board would
    /// show them: each is moved like the nearest corner of `kept`.
    pub(crate) fn repeated(&self, view: usize, kept: &[Corner], corners: &[Corner]) -> Vec<Corner> {
        let shift_px = self.bent.as_ref().and_then(|bent| bent.shift_px.get(view));
        let shift_px = shift_px.map_or(&[][..], Vec::as_slice);
        let seen = || kept.iter().filter(|corner| corner.is_seen()).zip(shift_px);
        let flat = |corner: &Corner| {
            let distance = |beside: &Corner| (beside.px - corner.px).norm_squared();
            let nearest = seen().min_by(|(a, _), (b, _)| distance(a).total_cmp(&distance(b)));
            nearest
                .filter(|_| corner.is_seen())
                .map_or(*corner, |(_, shift)| Corner { px: corner.px - shift, ..*corner })
        };
        corners.iter().map(flat).collect()
    }

    /// Ratio of height to width of a pixel.
    pub(crate) fn pixel_aspect(&self) -> f64 {
        self.aspect.unwrap_or(1.0)
    }
}

/// `views` with rows scaled so that pixels of the given ratio of height to width become square.
pub(crate) fn with_square_pixels(views: &[Vec<Corner>], pixel_aspect: f64) -> Vec<Vec<Corner>> {
    let square = |corner: &Corner| corner.with_rows_scaled(1.0 / pixel_aspect);
    views.iter().map(|corners| corners.iter().map(square).collect()).collect()
}
