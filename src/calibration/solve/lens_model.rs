//! The nested lens models, and priors on their parameters.

use crate::{frame::ImageSize, geometry::LENS_PARAMETERS};

/// The distortion coefficients that are estimated. The models are nested: each contains the ones before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LensModel {
    /// No distortion.
    Pinhole,
    /// Radial, r².
    K1,
    /// Radial, r² and r⁴.
    K1K2,
    /// Radial r², r⁴, and tangential.
    K1K2P1P2,
    /// Radial r², r⁴, r⁶, and tangential.
    K1K2P1P2K3,
}

/// The lens parameters that an adjustment estimates, in the order of [`LENS_PARAMETERS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LensFreedom {
    /// Whether each parameter is estimated. With square pixels, `fy` isn't: it follows `fx`.
    pub free: [bool; LENS_PARAMETERS],
    /// Whether `fy = fx`, one parameter.
    pub square_pixels: bool,
}

/// Prior on the lens parameters: independent normal distributions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensPrior {
    /// Means.
    pub mean: [f64; LENS_PARAMETERS],
    /// Information 1/sd² of each; zero for no prior.
    pub information: [f64; LENS_PARAMETERS],
}

impl LensModel {
    /// All models, simplest first.
    pub const ALL: [Self; 5] =
        [Self::Pinhole, Self::K1, Self::K1K2, Self::K1K2P1P2, Self::K1K2P1P2K3];

    /// Stable name.
    pub fn code(self) -> &'static str {
        match self {
            Self::Pinhole => "none",
            Self::K1 => "k1",
            Self::K1K2 => "k1k2",
            Self::K1K2P1P2 => "k1k2p1p2",
            Self::K1K2P1P2K3 => "k1k2p1p2k3",
        }
    }

    /// Number of distortion coefficients.
    pub fn coefficients(self) -> usize {
        match self {
            Self::Pinhole => 0,
            Self::K1 => 1,
            Self::K1K2 => 2,
            Self::K1K2P1P2 => 4,
            Self::K1K2P1P2K3 => 5,
        }
    }

    /// Frees focal length, principal point and the coefficients of this model.
    pub fn freedom(self, square_pixels: bool) -> LensFreedom {
        let mut free = [false; LENS_PARAMETERS];
        for (i, free) in free.iter_mut().enumerate() {
            *free = i < 4 + self.coefficients();
        }
        free[1] = !square_pixels;
        LensFreedom { free, square_pixels }
    }
}

impl LensFreedom {
    /// Number of free parameters.
    pub fn count(&self) -> usize {
        self.free.iter().filter(|free| **free).count()
    }
}

impl LensPrior {
    /// A weak prior that makes few views sufficient, `docs/method.md`, section 2: PP at the image centre ± 100 px (in
    /// proportion for pictures wider than 1920 px), k1 0 ± 0.4, k2 0 ± 0.6, p1 and p2 0 ± 0.01, k3 0 ± 0.6.
    pub fn weak(image_size: ImageSize) -> Self {
        let centre = image_size.centre_px();
        let pp_sd_px = 100.0_f64.max(100.0 * f64::from(image_size.width_px) / 1920.0);
        let mut prior = Self { mean: [0.0; LENS_PARAMETERS], information: [0.0; LENS_PARAMETERS] };
        prior.mean[2] = centre.x;
        prior.mean[3] = centre.y;
        let sds = [pp_sd_px, pp_sd_px, 0.4, 0.6, 0.01, 0.01, 0.6];
        for (information, sd) in prior.information[2..].iter_mut().zip(sds) {
            *information = 1.0 / (sd * sd);
        }
        prior
    }

    /// Adds a prior on the focal length along both axes: `f_px` ± `sd_px`.
    #[must_use]
    pub fn with_focal_length(mut self, f_px: f64, sd_px: f64) -> Self {
        for i in 0..2 {
            self.mean[i] = f_px;
            self.information[i] = 1.0 / (sd_px * sd_px);
        }
        self
    }
}
