use std::sync::Arc;

use nalgebra::{Matrix2, Point2};

use super::{
    accepted::AcceptedView, calm::Shown, camera::CameraState, decision::Decision, ending::Ending,
    far_board::FarBoard, held_out_pair::HeldOutPair, input::Observation, setup::SessionSetup,
    view_number::ViewNumber,
};
use crate::guidance::{GuidanceParams, Lack, LensEstimate, Role, Target, View, partner_of};
use boresight_calibrate::Calibration;
use boresight_detect::Miss;
use boresight_geometry::{
    BoardOutline, Camera, Corner, FocalLength, PrincipalLine,
    boards::Board,
    frame::{CaptureTime, FrameId},
};

/// Snapshot for a window or a command line: plain data, cheap to clone.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Setup of the session, with the limits for views.
    pub setup: Arc<SessionSetup>,
    /// Ending of the session, or the ending if stopped now.
    pub ending: Ending,
    /// Missing part of an unfinished session; `None` once over.
    pub lack: Option<Lack>,
    /// The newest decision.
    pub decision: Decision,
    /// Prompt and advice on the screen: calmer than the newest decision's advice.
    pub shown: Shown,
    /// Share of the hold passed, 0 to 1; `None` without a hold.
    pub hold: Option<f64>,
    /// The newest frame.
    pub live: Option<Arc<LiveView>>,
    /// The requested pose.
    pub target: Option<Target>,
    /// The setup's limits, capped at the reach of the camera's corners.
    pub limits: GuidanceParams,
    /// Root mean square error of the corners, in pixels, from boards moving during the readout.
    pub moved_px: f64,
    /// Limits of the board, if small in the picture.
    pub far: Option<FarBoard>,
    /// Noise of a corner per axis, measured while the board was held; `None` until a hold has shown
    /// enough.
    pub measured_noise_px: Option<f64>,
    /// Prediction of the newest pair before use.
    pub held_out: Option<HeldOutPair>,
    /// Estimate of the principal point; the picture's centre without a calibration.
    pub pp_px: Point2<f64>,
    /// Covariance of `pp_px`; `None` while the lens is a guess.
    pub pp_covariance_px2: Option<Matrix2<f64>>,
    /// The lens estimate, through which ghosts and lines are drawn.
    pub lens: Camera,
    /// The calibration so far.
    pub calibration: Option<Arc<Calibration>>,
    /// Accepted views, in the order of the calibration.
    pub views: Arc<[ViewSummary]>,
    /// Corners of each of `views`, as used by the calibration.
    pub corners: Arc<[Vec<Corner>]>,
    /// Opposed pairs of `views`.
    pub pairs: Arc<[PairSummary]>,
    /// Views removed by the newest decision, oldest first: several if focus or zoom moved.
    pub just_removed: Vec<ViewNumber>,
    /// View to be restored next.
    pub removed: Option<ViewNumber>,
    /// Forecast of the views still to take; `None` once the session is over.
    pub views_to_go: Option<usize>,
    /// State of the live camera, if any.
    pub camera: CameraState,
    /// True if the source has no more frames.
    pub source_ended: bool,
    /// True if the person paused.
    pub paused: bool,
    /// True if a rig asks for the pose, false if it asks for none; `None` without a rig.
    pub is_led: Option<bool>,
    /// Failed workers, with the reasons.
    pub failures: Vec<(String, String)>,
}

impl Snapshot {
    /// True if the session has a view, or one that can be restored.
    pub fn keeps_views(&self) -> bool {
        !self.views.is_empty() || self.removed.is_some()
    }
}

/// Corners and measurements of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveView {
    /// Number of the frame.
    pub frame_id: FrameId,
    /// Driver's timestamp.
    pub captured_at: CaptureTime,
    /// Inner corners in numbering order, as seen or, if unseen, as expected; or the reason for a
    /// miss.
    pub corners_px: Result<Vec<Point2<f64>>, Miss>,
    /// Indices of the unseen corners.
    pub unseen: Vec<usize>,
    /// Measurements from the corners; `None` without a board, if it faces the camera, or beyond the
    /// lens model's fold.
    pub measured: Option<Measured>,
    /// Width of the blur of the board's edges.
    pub blur_px: Option<f64>,
    /// Root mean square speed of the corners; `None` without an earlier frame.
    pub speed_px_per_s: Option<f64>,
}

/// Measurements from the corners of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Principal line, undistorted by the lens estimate of that time.
    pub line: PrincipalLine,
    /// Direction in the picture in which the board recedes, clockwise from the right.
    pub tilt_azimuth_rad: f64,
    /// Angle between board and image plane; `None` if the line does not fit the principal point.
    pub tilt_rad: Option<f64>,
    /// Larger of the shares of the picture's width and height that the corners span.
    pub span_fraction: f64,
    /// Distance of the board's middle from the principal point across the line: see
    /// [`lateral_offset_px`].
    pub lateral_offset_px: f64,
}

/// An accepted view in short.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewSummary {
    /// Number of the view, as shown to people.
    pub number: ViewNumber,
    /// Frame of the view.
    pub frame_id: FrameId,
    /// Role of the view.
    pub role: Role,
    /// Direction in the picture in which the board recedes, clockwise from the right.
    pub tilt_azimuth_rad: f64,
    /// Angle between board and image plane; `None` if the line does not fit the principal point.
    pub tilt_rad: Option<f64>,
    /// Principal line, undistorted by the newest lens estimate.
    pub line: PrincipalLine,
    /// Signed distance of the line from the newest estimate of the principal point.
    pub pl_residual_px: f64,
    /// Focal length from the view alone.
    pub focal: Option<FocalLength>,
    /// Root mean square reprojection residual, once there is a calibration.
    pub rms_px: Option<f64>,
    /// Corners as seen, in numbering order.
    pub corners_px: Arc<[Point2<f64>]>,
    /// Outline of the seen part of the board.
    pub outline: Option<BoardOutline>,
    /// Number of the opposed partner.
    pub partner: Option<ViewNumber>,
}

/// Two opposed views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairSummary {
    /// Index of the earlier view.
    pub first: usize,
    /// Index of the later view.
    pub second: usize,
    /// Mean signed distance of the two lines from the principal point, along a common normal: the
    /// pair's remainder after cancellation.
    pub balance_px: f64,
}

/// Signed distance of `middle_px` from `pp_px` across the principal line of a board tilted towards
/// `tilt_azimuth_rad`; positive to the right when looking that way.
pub fn lateral_offset_px(
    tilt_azimuth_rad: f64,
    middle_px: &Point2<f64>,
    pp_px: &Point2<f64>,
) -> f64 {
    let offset = middle_px - pp_px;
    offset.y * libm::cos(tilt_azimuth_rad) - offset.x * libm::sin(tilt_azimuth_rad)
}

impl LiveView {
    /// Describes an `observation`; `view` is its measurement, if any.
    pub(super) fn of(
        observation: &Observation,
        view: Option<&View>,
        speed_px_per_s: Option<f64>,
        pp_px: &Point2<f64>,
    ) -> Self {
        let seen = observation.seen.as_ref();
        Self {
            frame_id: observation.frame_id,
            captured_at: observation.captured_at,
            corners_px: match seen {
                Ok(seen) => Ok(seen.corners.iter().map(|corner| corner.px).collect()),
                Err(miss) => Err(*miss),
            },
            unseen: seen.map_or_else(
                |_| Vec::new(),
                |seen| {
                    let corners = seen.corners.iter().enumerate();
                    corners.filter_map(|(i, corner)| (!corner.is_seen()).then_some(i)).collect()
                },
            ),
            measured: view.map(|view| Measured {
                line: view.line.clone(),
                tilt_azimuth_rad: view.tilt_azimuth_rad(),
                tilt_rad: view.tilt_rad,
                span_fraction: view.span_fraction,
                lateral_offset_px: lateral_offset_px(view.tilt_azimuth_rad(), &view.mean_px, pp_px),
            }),
            blur_px: seen.ok().map(|seen| seen.quality.blur_px),
            speed_px_per_s,
        }
    }
}

/// Summaries of the accepted views and pairs. `measured` holds the same views through
/// `lens_estimate`.
pub(super) fn summaries(
    accepted: &[AcceptedView],
    measured: &[View],
    board: &Board,
    lens_estimate: &LensEstimate,
    calibration: Option<&Calibration>,
) -> (Arc<[ViewSummary]>, Arc<[PairSummary]>) {
    let pp = lens_estimate.camera.pp_px;
    let partners: Vec<_> = (0..measured.len()).map(|index| partner_of(index, measured)).collect();
    let pairs = partners.iter().enumerate().filter_map(|(first, partner)| {
        let second = partner.filter(|second| *second > first)?;
        let (one, other) = (&measured[first].line, &measured[second].line);
        // The sign of a line's normal is arbitrary.
        let sign = one.normal().dot(&other.normal()).signum();
        let balance_px = 0.5 * (one.distance_px(&pp) + sign * other.distance_px(&pp));
        Some(PairSummary { first, second, balance_px })
    });
    let pairs = pairs.collect();
    let numbers: Vec<ViewNumber> = accepted.iter().map(|accepted| accepted.number).collect();
    let views = accepted.iter().zip(measured).enumerate().map(|(index, (accepted, view))| {
        let result = calibration.and_then(|calibration| calibration.views.get(index));
        ViewSummary {
            number: accepted.number,
            frame_id: view.frame_id,
            role: accepted.role,
            tilt_azimuth_rad: view.tilt_azimuth_rad(),
            tilt_rad: view.tilt_rad,
            line: view.line.clone(),
            pl_residual_px: view.line.distance_px(&pp),
            focal: result.and_then(|result| result.focal),
            rms_px: result.map(|result| result.residual_rms_px),
            corners_px: view.corners.iter().map(|corner| corner.px).collect(),
            outline: view.outline(board),
            partner: partners[index].map(|partner| numbers[partner]),
        }
    });
    (views.collect(), pairs)
}
