//! Measurements from a picture of the board.

use nalgebra::{Matrix2, Point2};

use super::{params::width_scale, refusal::Refusal};
use boresight_geometry::{
    BoardOutline, Camera, Corner, Homography, LensMatrix, LensParameter, LensParts, PrincipalLine,
    boards::Board,
    frame::{CaptureTime, FrameId, ImageSize},
    mean_px,
};

/// Standard deviation of a guessed principal point in a picture 1280 pixels wide: most cameras have
/// theirs within 100 pixels of the centre.
const GUESSED_PP_SD_PX: f64 = 100.0;
/// Largest share of corners without a ray through the lens estimate, as its inverse: beyond 90° no
/// plane does them justice, and a first estimate may end too early. The others measure the view.
const ONE_OUTSIDE_IN: usize = 4;

/// The lens as estimated from the accepted views, or a guess without views.
#[derive(Clone, Debug, PartialEq)]
pub struct LensEstimate {
    /// Size of the pictures.
    pub image_size: ImageSize,
    /// The camera; a guess while [`Self::covariance`] is `None`.
    pub camera: Camera,
    /// Covariance of the lens parameters, in the order of `LENS_PARAMETERS`; `None` for a guess.
    pub covariance: Option<LensMatrix>,
    /// Covariance of the lens parameters before any view, if known from an earlier calibration of
    /// the same lens.
    pub known_covariance: Option<LensMatrix>,
}

impl LensEstimate {
    /// A pinhole with the principal point at the picture's centre and a usual angle of view, 58°
    /// across.
    pub fn guess(image_size: ImageSize) -> Self {
        let f_px = 0.9 * f64::from(image_size.width_px.max(image_size.height_px));
        Self {
            image_size,
            camera: Camera::pinhole(f_px, image_size.centre_px()),
            covariance: None,
            known_covariance: None,
        }
    }

    /// Focal length in picture widths (of a portrait picture: heights).
    pub fn f_to_width(&self) -> f64 {
        let ImageSize { width_px, height_px } = self.image_size;
        self.camera.f_px.x / f64::from(width_px.max(height_px))
    }

    /// Covariance of the principal point; for a guess ±100 px per axis in a picture 1280 pixels
    /// wide.
    pub fn pp_covariance_px2(&self) -> Matrix2<f64> {
        match &self.covariance {
            Some(covariance) => covariance.pp(),
            None => {
                let sd_px = GUESSED_PP_SD_PX * width_scale(self.image_size);
                Matrix2::from_diagonal_element(sd_px * sd_px)
            }
        }
    }

    /// Pull of the unknown part of the distortion on a principal line, in pixels for each pixel
    /// between the board's centre and the principal point: `2.75 sd(k1)`. Source: `docs/method.md`,
    /// section 3.3.
    pub(crate) fn line_bias_per_px(&self) -> f64 {
        let sd =
            |covariance: &LensMatrix| covariance.variance_of(LensParameter::K1).max(0.0).sqrt();
        let sigma_k1 = self.covariance.as_ref().map_or(0.3, |covariance| sd(covariance).max(0.01));
        2.75 * sigma_k1
    }
}

/// A detected board, measured through a [`LensEstimate`].
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Frame of the view.
    pub frame_id: FrameId,
    /// Driver's timestamp of the frame.
    pub captured_at: CaptureTime,
    /// Corners as seen, distorted, in the board's numbering order.
    pub corners: Vec<Corner>,
    /// Width of the blur of the board's edges.
    pub blur_px: f64,
    /// Principal line of the undistorted corners.
    pub line: PrincipalLine,
    /// Angle between board and image plane; `None` if the line does not fit the principal point.
    pub tilt_rad: Option<f64>,
    /// Mean of the seen corners.
    pub mean_px: Point2<f64>,
    /// Larger of the shares of the picture's width and height spanned by the seen corners.
    pub span_fraction: f64,
    /// Frame of the opposed partner among the accepted views, settled at acceptance.
    pub partner_frame: Option<FrameId>,
    /// True for a further view of an accepted direction: it needs no partner, and is none.
    pub is_further: bool,
}

impl View {
    /// Direction in the picture in which the board recedes, clockwise from the right, in `[0, 2π)`.
    pub fn tilt_azimuth_rad(&self) -> f64 {
        self.line.tilt_azimuth_rad
    }

    /// Outline of the seen part of `board`.
    pub fn outline(&self, board: &Board) -> Option<BoardOutline> {
        let px: Vec<_> = self.corners.iter().map(|corner| corner.px).collect();
        board.target().outline(&px, &|index| self.corners[index].is_seen())
    }

    /// Larger of the shares of the picture's width and height spanned by the whole board, the
    /// unseen part as expected: above 1 if larger than the picture.
    pub(crate) fn board_span_fraction(&self, image_size: ImageSize) -> f64 {
        span_fraction(bounds_px(self.corners.iter().map(|corner| corner.px)), image_size)
    }
}

/// Measures the `corners` seen in a frame through the lens estimate.
///
/// # Errors
///
/// [`Refusal::OutsideLens`] if the lens model has no ray for more than a quarter of the corners,
/// [`Refusal::NoLine`] if the board faces the camera or its corners fit no plane.
pub fn measure(
    (frame_id, captured_at): (FrameId, CaptureTime),
    corners: &[Corner],
    blur_px: f64,
    board: &Board,
    lens_estimate: &LensEstimate,
) -> Result<View, Refusal> {
    let camera = &lens_estimate.camera;
    let undistorted: Vec<Corner> = corners
        .iter()
        .map(|corner| camera.undistort_corner(corner).unwrap_or(Corner::unseen(corner.px)))
        .collect();
    let count = |corners: &[Corner]| corners.iter().filter(|corner| corner.is_seen()).count();
    let of = count(corners);
    let outside = of - count(&undistorted);
    if outside > of / ONE_OUTSIDE_IN {
        return Err(Refusal::OutsideLens { outside, of });
    }
    let homography =
        Homography::fit(&board.corners_in_board_m(), &undistorted).map_err(|_| Refusal::NoLine)?;
    let centre_px = lens_estimate.image_size.centre_px();
    let line = PrincipalLine::of(&homography, centre_px, mean_px(&undistorted))
        .map_err(|_| Refusal::NoLine)?;
    let tilt_rad = line.tilt_rad(&camera.pp_px);
    let seen = || corners.iter().filter(|corner| corner.is_seen());
    let bounds = bounds_px(seen().map(|corner| corner.px));
    Ok(View {
        frame_id,
        captured_at,
        corners: corners.to_vec(),
        blur_px,
        line,
        tilt_rad,
        mean_px: mean_px(corners),
        span_fraction: span_fraction(bounds, lens_estimate.image_size),
        partner_frame: None,
        is_further: false,
    })
}

fn span_fraction((low, high): (Point2<f64>, Point2<f64>), image_size: ImageSize) -> f64 {
    let ImageSize { width_px, height_px } = image_size;
    ((high.x - low.x) / f64::from(width_px)).max((high.y - low.y) / f64::from(height_px))
}

/// Smallest axis-parallel box around `points`: top-left and bottom-right corner. Without points the
/// top-left corner lies beyond the bottom-right one.
pub fn bounds_px(points: impl Iterator<Item = Point2<f64>>) -> (Point2<f64>, Point2<f64>) {
    let start = (Point2::new(f64::MAX, f64::MAX), Point2::new(f64::MIN, f64::MIN));
    points.fold(start, |(low, high), p| {
        (Point2::new(low.x.min(p.x), low.y.min(p.y)), Point2::new(high.x.max(p.x), high.y.max(p.y)))
    })
}
