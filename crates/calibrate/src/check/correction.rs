//! Calibrates again with a correction for the likeliest cause of a misfit: non-square pixels or
//! squares, or a bent board. If the rest shows another cause, corrects that, too.
//!
//! A fit without a known cause has the wrong lens, by far more than the noise of its corners
//! suggests. The corrected fit is examined like any other, and the finding stays.

use std::borrow::Cow;

use nalgebra::{Point2, Point3, SMatrix};

use super::{
    cause_findings::finding_code,
    finding::{Finding, Severity},
    hypotheses::Cause,
    misfit_diagnosis::{Causes, positive_part},
    misfit_models::Bent,
    other_parameters::carried,
};
use crate::{
    params::CalibrationParams,
    solve::{bundle::Bundle, lens_model::LensFreedom},
};
use boresight_geometry::{Camera, Corner, LENS_PARAMETERS, frame::ImageSize};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Correction for causes of a misfit, with the remaining doubt.
#[derive(Clone, Debug)]
pub(crate) struct Correction {
    /// Ratio of height to width of non-square pixels.
    aspect: Option<f64>,
    /// Ratio of height to width of the board's squares.
    stretch: f64,
    bent: Option<Bent>,
    /// Covariance of `lens` from doubt about the causes and their parameters, as other causes look
    /// the same.
    doubt: LensMatrix,
    lens: Camera,
    /// Findings always reported by the corrected calibration.
    pub(crate) findings: Vec<Finding>,
}

impl Correction {
    /// Correction for a cause that a calibration can and should correct, combined with an `earlier`
    /// correction. `bundle` is the fit in which `causes` were found, with `n` coordinates. `None`
    /// if there is no such cause or it is already corrected.
    pub(crate) fn of(
        causes: &Causes,
        bundle: &Bundle,
        n: f64,
        image_size: ImageSize,
        earlier: Option<&Self>,
    ) -> Option<Self> {
        let lens = bundle.state.camera;
        let mut correction = earlier.cloned().unwrap_or(Self {
            aspect: None,
            stretch: 1.0,
            bent: None,
            doubt: LensMatrix::zeros(),
            lens,
            findings: Vec::new(),
        });
        correction.doubt = correction.doubt((&lens, &bundle.freedom), image_size);
        correction.lens = lens;
        let explanation = causes.correctable(|cause| match cause {
            Cause::PixelAspect => correction.aspect.is_some(),
            Cause::BoardStretched => correction.stretch != 1.0,
            _ => correction.bent.is_some(),
        })?;
        let parameters = bundle.freedom.count() + 6 * explanation.state.local.len();
        let variance = explanation.noise_variance(n, parameters);
        let of_parameters =
            (explanation.unit_covariance - explanation.known_unit_covariance) * variance;
        match explanation.cause {
            // The adjustment estimates the aspect.
            Cause::PixelAspect => {
                let f_px = explanation.state.bundle.camera.f_px;
                correction.aspect = Some(f_px.y / f_px.x);
            }
            Cause::BoardStretched => {
                correction.stretch = 1.0 + explanation.state.shared[0];
                let bent_m = correction.bent.iter_mut().flat_map(|bent| &mut bent.board_m);
                bent_m.for_each(|point_m| point_m.y *= correction.stretch);
                correction.doubt += positive_part(&of_parameters);
            }
            Cause::BoardBent => {
                correction.bent = Some(explanation.bent.clone()?);
                correction.doubt += positive_part(&of_parameters);
            }
            _ => return None,
        }
        correction.doubt += causes.doubt_beside(explanation);
        // The bound allows for it.
        let finding = |code| Finding { code, severity: Severity::Info };
        correction.findings.extend(finding_code(explanation).map(finding));
        Some(correction)
    }

    /// Remaining covariance for a lens with the given freedom, possibly of another family than the
    /// corrected lens.
    pub(crate) fn doubt(&self, lens: (&Camera, &LensFreedom), image_size: ImageSize) -> LensMatrix {
        carried(&self.doubt, &self.lens, lens, image_size)
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

    /// Points of a bent board in metres; `None` if the board is flat.
    pub(crate) fn bent_m(&self) -> Option<&[Point3<f64>]> {
        self.bent.as_ref().map(|bent| bent.board_m.as_slice())
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
