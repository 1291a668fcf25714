//! Measures one picture of the board.

use nalgebra::{Matrix2, Point2, SMatrix};

use super::Refusal;
use crate::{
    board::Checkerboard,
    frame::{CaptureTime, FrameId, ImageSize},
    geometry::{Camera, Corner, Homography, LENS_PARAMETERS, PrincipalLine, mean_px},
};

/// What is believed of the camera so far.
#[derive(Clone, Debug, PartialEq)]
pub struct LensEstimate {
    /// Size of the pictures.
    pub image_size: ImageSize,
    /// The camera. A guess until [`Self::covariance`] is there.
    pub camera: Camera,
    /// Covariance of the lens parameters, in the order of `LENS_PARAMETERS`; `None` for a guess.
    pub covariance: Option<SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>>,
}

impl LensEstimate {
    /// Before any view: a pinhole with the principal point at the picture's centre and a usual angle of view.
    pub fn guess(image_size: ImageSize) -> Self {
        let f_px = 0.9 * f64::from(image_size.width_px.max(image_size.height_px));
        Self { image_size, camera: Camera::pinhole(f_px, image_size.centre_px()), covariance: None }
    }

    /// Covariance of the principal point; ±100 px per axis for a guess.
    pub fn pp_covariance_px2(&self) -> Matrix2<f64> {
        match &self.covariance {
            Some(covariance) => covariance.fixed_view::<2, 2>(2, 2).into_owned(),
            None => Matrix2::from_diagonal_element(1e4),
        }
    }

    /// By how many pixels the principal line is pulled per pixel that the board's centre is off the
    /// principal point, as far as the lens is unknown: `2.75 sd(k1)`, METHOD section 3.3.
    pub fn line_bias_per_px(&self) -> f64 {
        let sigma_k1 =
            self.covariance.as_ref().map_or(0.3, |c| c[(4, 4)].max(0.0).sqrt().max(0.01));
        2.75 * sigma_k1
    }
}

/// One detected board, measured.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The frame it was seen in.
    pub frame_id: FrameId,
    /// When.
    pub captured_at: CaptureTime,
    /// Corners as seen.
    pub corners: Vec<Corner>,
    /// Width of the blur of its edges.
    pub blur_px: f64,
    /// Principal line of the corners, undistorted by the lens_estimate.
    pub line: PrincipalLine,
    /// Angle between board and image plane; `None` if the line does not fit the principal point.
    pub tilt_rad: Option<f64>,
    /// Mean corner, as seen.
    pub mean_px: Point2<f64>,
    /// Larger of the shares of the picture's width and height that the corners span.
    pub fill: f64,
    /// Least distance of a corner from the picture's edge.
    pub margin_px: f64,
    /// The frame of the accepted view whose opposed partner it was taken as.
    pub partner_frame: Option<FrameId>,
}

impl View {
    /// Direction in the image in which the board recedes, in `[0, 2π)`.
    pub fn slot_rad(&self) -> f64 {
        self.line.tilt_azimuth_rad
    }
}

/// Measures the `corners` seen in a frame, through the lens that is believed.
///
/// # Errors
///
/// [`Refusal::NoLine`] if the board faces the camera or its corners fit no plane.
pub fn measure(
    frame: (FrameId, CaptureTime),
    corners: &[Corner],
    blur_px: f64,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> Result<View, Refusal> {
    let undistorted: Vec<Corner> = corners
        .iter()
        .map(|corner| Corner {
            px: lens_estimate.camera.undistort_px(&corner.px).unwrap_or(corner.px),
            covariance_px2: corner.covariance_px2,
        })
        .collect();
    let homography =
        Homography::fit(&board.corners_in_board_m(), &undistorted).map_err(|_| Refusal::NoLine)?;
    let line =
        PrincipalLine::of(&homography, lens_estimate.image_size.centre_px(), mean_px(&undistorted))
            .map_err(|_| Refusal::NoLine)?;
    let tilt_rad = line.tilt_rad(&lens_estimate.camera.pp_px);
    let (low, high) = bounds_px(corners.iter().map(|corner| corner.px));
    let (width, height) = (
        f64::from(lens_estimate.image_size.width_px),
        f64::from(lens_estimate.image_size.height_px),
    );
    let margin_px = low.x.min(low.y).min(width - 1.0 - high.x).min(height - 1.0 - high.y);
    Ok(View {
        frame_id: frame.0,
        captured_at: frame.1,
        corners: corners.to_vec(),
        blur_px,
        line,
        tilt_rad,
        mean_px: mean_px(corners),
        fill: ((high.x - low.x) / width).max((high.y - low.y) / height),
        margin_px,
        partner_frame: None,
    })
}

/// Smallest axis-parallel box around `points`: its top-left and bottom-right corner, the one beyond the other
/// if there are no points.
pub fn bounds_px(points: impl Iterator<Item = Point2<f64>>) -> (Point2<f64>, Point2<f64>) {
    let start = (Point2::new(f64::MAX, f64::MAX), Point2::new(f64::MIN, f64::MIN));
    points.fold(start, |(low, high), p| {
        (Point2::new(low.x.min(p.x), low.y.min(p.y)), Point2::new(high.x.max(p.x), high.y.max(p.y)))
    })
}
