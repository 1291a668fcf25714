//! Calibrates again with a correction for the likeliest cause of a misfit: non-square pixels or squares, or a bent
//! board.
//!
//! A fit that leaves out a known cause has the wrong lens, by far more than the noise of its corners suggests. The
//! corrected fit is examined as any other, and the finding stays.

use std::borrow::Cow;

use nalgebra::{Point2, Point3, SMatrix};

use super::{
    cause::Cause,
    cause_findings::finding_code,
    finding::{Finding, Severity},
    misfit_diagnosis::{Causes, positive_part},
    misfit_models::Bent,
};
use crate::{params::CalibrationParams, solve::bundle::Bundle};
use boresight_geometry::{Corner, LENS_PARAMETERS};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// A correction for a misfit, and the doubt that remains.
#[derive(Clone, Debug)]
pub(crate) struct Correction {
    kind: Kind,
    /// Covariance of the lens from doubt about the cause's parameters, and about the cause itself, as others look the
    /// same.
    pub(crate) doubt: LensMatrix,
    /// Finding that the corrected calibration reports in any case.
    pub(crate) finding: Finding,
}

#[derive(Clone, Debug)]
enum Kind {
    /// Pixels of this height to width.
    PixelAspect(f64),
    /// Squares of this height to width.
    BoardStretched(f64),
    BoardBent(Bent),
}

impl Correction {
    /// The correction for a cause that a calibration can and should correct. `bundle` is the fit in which `causes` were
    /// found, with `n` coordinates.
    pub(crate) fn of(causes: &Causes, bundle: &Bundle, n: f64) -> Option<Self> {
        let best = causes.correctable(n)?;
        let explanation = &best.explanation;
        let camera = &explanation.state.bundle.camera;
        let kind = match explanation.cause {
            Cause::PixelAspect => Kind::PixelAspect(camera.f_px.y / camera.f_px.x),
            Cause::BoardStretched => Kind::BoardStretched(1.0 + explanation.state.shared[0]),
            Cause::BoardBent => Kind::BoardBent(explanation.bent.clone()?),
            _ => return None,
        };
        let parameters = bundle.freedom.count() + 6 * explanation.state.local.len();
        let variance = explanation.noise_variance(n, parameters);
        let of_parameters = match kind {
            // The adjustment estimates the aspect itself.
            Kind::PixelAspect(_) => LensMatrix::zeros(),
            _ => (explanation.unit_covariance - explanation.known_unit_covariance) * variance,
        };
        let code = finding_code(best)?;
        Some(Self {
            kind,
            doubt: positive_part(&of_parameters) + causes.doubt_beside(best),
            // The bound allows for it.
            finding: Finding { code, severity: Severity::Info },
        })
    }

    /// The parameters that calibrate with the correction.
    pub(crate) fn params(&self, params: &CalibrationParams) -> CalibrationParams {
        let square_pixels = params.square_pixels && !matches!(self.kind, Kind::PixelAspect(_));
        CalibrationParams { square_pixels, ..params.clone() }
    }

    /// The board in metres to calibrate with. A bent board is flat here: its corners are moved instead, see [`Self::views`].
    pub(crate) fn board_m(&self, board_m: &[Point2<f64>]) -> Vec<Point2<f64>> {
        let stretch = if let Kind::BoardStretched(aspect) = self.kind { aspect } else { 1.0 };
        board_m.iter().map(|point_m| Point2::new(point_m.x, point_m.y * stretch)).collect()
    }

    /// The points of a bent board in metres; `None` if the board is flat.
    pub(crate) fn bent_m(&self) -> Option<&[Point3<f64>]> {
        if let Kind::BoardBent(bent) = &self.kind { Some(&bent.board_m) } else { None }
    }

    /// The corners as a flat board would show them.
    pub(crate) fn views<'a>(&self, views: &'a [Vec<Corner>]) -> Cow<'a, [Vec<Corner>]> {
        let Kind::BoardBent(bent) = &self.kind else { return Cow::Borrowed(views) };
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

    /// Corners of a view that repeats `kept`, the view of that number, as a flat board would show them: each is moved
    /// as the nearest one of `kept`.
    pub(crate) fn repeated(&self, view: usize, kept: &[Corner], corners: &[Corner]) -> Vec<Corner> {
        let shift_px = match &self.kind {
            Kind::BoardBent(bent) => bent.shift_px.get(view).map_or(&[][..], Vec::as_slice),
            Kind::PixelAspect(_) | Kind::BoardStretched(_) => &[],
        };
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

    /// Height of a pixel as a multiple of its width.
    pub(crate) fn pixel_aspect(&self) -> f64 {
        if let Kind::PixelAspect(aspect) = self.kind { aspect } else { 1.0 }
    }
}

/// `views` with rows moved so that pixels of the given ratio of height to width become square.
pub(crate) fn with_square_pixels(views: &[Vec<Corner>], pixel_aspect: f64) -> Vec<Vec<Corner>> {
    let square = |corner: &Corner| corner.with_rows_scaled(1.0 / pixel_aspect);
    views.iter().map(|corners| corners.iter().map(square).collect()).collect()
}
