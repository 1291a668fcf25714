//! Lens with a focal length that differs from view to view.
//!
//! The principal lines of the free homographies intersect in the principal point at any focal
//! lengths of the views (Chuang 2021, section 3.4); each line then gives the focal length of its
//! view.

use nalgebra::{Matrix2, SVector, Vector2};

use super::{
    bundle::Observations,
    free_homography::{self, DistortionCentrePrior, FreeHomographies},
    lens_model::LensModel,
    view_scatter::averaged,
};
use boresight_geometry::{
    Camera, Distortion, FocalLength, LENS_PARAMETERS, LensMatrix, LensParameter, LensParts,
    PrincipalLine,
};

type LensVector = SVector<f64, LENS_PARAMETERS>;

/// Most groups of views left out in turn.
const GROUPS: usize = 20;

/// Lens of views that share everything except the focal length.
#[derive(Clone, Debug)]
pub(crate) struct VaryingFocal {
    /// Lens with the mean focal length, and the distortion at that focal length.
    pub(crate) camera: Camera,
    /// Covariance of the lens parameters; the variance of the focal length is one view's, on
    /// average.
    pub(crate) covariance: LensMatrix,
    pub(crate) noise_factor: f64,
    /// Sample standard deviation of the focal lengths of the views, in pixels.
    pub(crate) scatter_px: f64,
    /// Focal length of each view; `None` for views that face the camera.
    pub(crate) focal: Vec<Option<FocalLength>>,
}

/// Lens model of [`VaryingFocal`].
pub(crate) const MODEL: LensModel = LensModel::K1K2P1P2;

/// Derives principal point, focal lengths and distortion from `free`.
///
/// With `g` in units of `S` about the distortion centre DC and `e = (DC − P)/f`, the radial model
/// about DC is `x + k1 |x−e|² (x−e) + …` with `k1 = K1 (f/S)²`, `k2 = K2 (f/S)⁴`; to first order in
/// `e` that is OpenCV's model with `(p2, p1) = −k1 e`.
///
/// The covariance is that of the scatter with views left out of the whole procedure (Efron 1982,
/// the grouped jackknife): the corners of a view err alike, by more than their noise tells.
///
/// `None` if fewer than two views have a focal length, or if some views alone determine the lens.
pub(crate) fn varying_focal(
    observations: &Observations,
    free: &FreeHomographies,
    prior: DistortionCentrePrior,
    noise_floor: f64,
) -> Option<VaryingFocal> {
    let found = from_lines(free, noise_floor)?;
    let views = observations.view_count();
    let groups = views.min(GROUPS);
    let mut scatter = LensMatrix::zeros();
    for group in 0..groups {
        let kept: Vec<usize> = (0..views).filter(|view| view % groups != group).collect();
        let start: Vec<_> = kept.iter().map(|view| free.image_from_board[*view]).collect();
        let without = free_homography::fit(&observations.only(&kept), prior, &start)?;
        let there = from_lines(&without, noise_floor)?.camera.lens_parameters();
        let here = found.camera.lens_parameters();
        let off = LensVector::from_fn(|i, _| there[i] - here[i]);
        scatter += off * off.transpose() * ((groups - 1) as f64 / groups as f64);
    }
    let mut covariance = averaged(scatter, scatter, groups);
    // A view's own focal length scatters more than the mean.
    let of_one_px2 = found.covariance.f().m11.max(covariance.f().m11);
    covariance.set_block(LensParameter::F, LensParameter::F, &Matrix2::from_element(of_one_px2));
    Some(VaryingFocal { covariance, ..found })
}

/// [`varying_focal`] with the covariance of independent corners.
fn from_lines(free: &FreeHomographies, noise_floor: f64) -> Option<VaryingFocal> {
    let noise_factor = free.noise_factor().max(noise_floor);
    let variance = noise_factor * noise_factor;
    let pp_covariance_px2: Matrix2<f64> = free.pp_unit_covariance_px2 * variance;
    let focal: Vec<Option<FocalLength>> = free
        .lines
        .iter()
        .map(|line| {
            let line = line.as_ref()?;
            let line = PrincipalLine { covariance: line.covariance * variance, ..line.clone() };
            line.focal_length(&free.pp_px, &pp_covariance_px2).ok()
        })
        .collect();
    let known: Vec<&FocalLength> = focal.iter().flatten().collect();
    if known.len() < 2 {
        return None;
    }
    let count = known.len() as f64;
    let mean_px = known.iter().map(|focal| focal.f_px).sum::<f64>() / count;
    let squares: f64 = known.iter().map(|focal| (focal.f_px - mean_px).powi(2)).sum();
    let of_one_px2 = known.iter().map(|focal| focal.sigma_px.powi(2)).sum::<f64>() / count;

    let per_unit = mean_px / free.unit_px();
    let centre = (free.distortion_centre_px - free.pp_px) / mean_px;
    let (k1, k2) = (free.k[0] * per_unit.powi(2), free.k[1] * per_unit.powi(4));
    let distortion =
        Distortion { k1, k2, p1: -k1 * centre.y, p2: -k1 * centre.x, ..Distortion::default() };
    let shared = free.shared_unit_covariance * variance;
    let to_k = [per_unit.powi(2), per_unit.powi(4)];
    let mut covariance = LensMatrix::zeros();
    let radial = [LensParameter::K1, LensParameter::K2];
    let of_radial = Matrix2::from_fn(|i, j| shared[(2 + i, 2 + j)] * to_k[i] * to_k[j]);
    covariance.set_block(LensParameter::F, LensParameter::F, &Matrix2::from_element(of_one_px2));
    covariance.set_block(LensParameter::PP, LensParameter::PP, &pp_covariance_px2);
    covariance.set_block(radial, radial, &of_radial);
    // p1 depends on y, p2 on x.
    for (p, axis) in [(LensParameter::P1, 1), (LensParameter::P2, 0)] {
        let of_centre = shared[(axis, axis)] + pp_covariance_px2[(axis, axis)];
        covariance[(p.index(), p.index())] = of_centre * (k1 / mean_px).powi(2);
    }
    let camera = Camera { f_px: Vector2::repeat(mean_px), pp_px: free.pp_px, distortion };
    let usable = covariance.iter().chain(&camera.lens_parameters()).all(|x| x.is_finite());
    usable.then_some(VaryingFocal {
        camera,
        covariance,
        noise_factor,
        scatter_px: (squares / (count - 1.0)).sqrt(),
        focal,
    })
}

impl VaryingFocal {
    /// Camera of a view; with the mean focal length if the view has none.
    pub(crate) fn camera_of(&self, view: usize) -> Camera {
        let f_px = self.focal[view].map_or(self.camera.f_px.x, |focal| focal.f_px);
        Camera { f_px: Vector2::repeat(f_px), ..self.camera }
    }
}
