//! Counts pictures of a held pose once.
//!
//! Copies of a picture have its noise, and pictures of an unmoved board share errors outside the
//! noise model: the board's shape, and the lens's deviation there. Counted as independent, they
//! would make the lens look more certain than it is, and support too rich a model.

use std::borrow::Cow;

use nalgebra::Point2;

use super::{causes::Correction, result::Calibration, solve::initial_guess::first_alike};
use boresight_geometry::{
    Corner,
    boards::Board,
    fit_pose,
    frame::{ImageSize, SceneScale},
    seen_count,
};

/// Root mean square difference of two views' corners below which both show the same held pose, as a
/// fraction of the picture's width: 1.3 px at 1280.
const HELD: f64 = 0.001;

/// Groups of views of the same held pose.
pub(super) struct Repeats {
    /// Indices of the first view of each pose, in order.
    kept: Vec<usize>,
    /// Place in `kept` of each view or of the repeated view.
    place: Vec<usize>,
}

impl Repeats {
    /// Groups of repeats; `None` if no view repeats another.
    pub(super) fn among(
        views: &[Vec<Corner>],
        board: &Board,
        image_size: ImageSize,
    ) -> Option<Self> {
        let (kept, place) = first_alike(views, board, HELD * f64::from(image_size.width_px));
        (kept.len() < views.len()).then_some(Self { kept, place })
    }

    /// Views without repeats.
    pub(super) fn without(&self, views: &[Vec<Corner>]) -> Vec<Vec<Corner>> {
        self.kept.iter().map(|index| views[*index].clone()).collect()
    }

    /// Scales of the scene in the kept views.
    pub(super) fn scene(&self, scene: &[Option<SceneScale>]) -> Vec<Option<SceneScale>> {
        self.kept.iter().map(|index| scene.get(*index).copied().flatten()).collect()
    }

    /// Index of a view among all, from the place among the kept views.
    pub(super) fn number(&self, place: usize) -> usize {
        self.kept.get(place).copied().unwrap_or(place)
    }

    /// Result of all `views` from `found`, computed from the kept views: each view gets its own
    /// pose and residual, under the `correction` in `found`.
    pub(super) fn restored(
        &self,
        found: Calibration,
        correction: Option<&Correction>,
        views: &[Vec<Corner>],
        board_m: &[Point2<f64>],
    ) -> Calibration {
        let board_m = correction
            .map_or(Cow::Borrowed(board_m), |correction| Cow::Owned(correction.board_m(board_m)));
        let result_of = |index: usize| {
            let place = self.place[index];
            let mut result = found.views[place].clone();
            let (corners, kept) = (&views[index], &views[self.number(place)]);
            if corners == kept {
                return result;
            }
            result.is_seen = corners.iter().map(Corner::is_seen).collect();
            let corners = correction.map_or(Cow::Borrowed(corners), |correction| {
                Cow::Owned(correction.repeated(place, kept, corners))
            });
            let camera = found.camera_of(place);
            if let Ok(fit) = fit_pose(&camera, &board_m, &corners) {
                result.cam_from_board = fit.cam_from_board;
                let squares: f64 = corners
                    .iter()
                    .zip(board_m.iter())
                    .filter(|(corner, _)| corner.is_seen())
                    .filter_map(|(corner, point_m)| {
                        let px = camera.px_from_board(&fit.cam_from_board, point_m)?;
                        Some((corner.px - px).norm_squared())
                    })
                    .sum();
                result.residual_rms_px =
                    (squares / (2 * seen_count(&corners)).max(1) as f64).sqrt();
            }
            result
        };
        let all = (0..views.len()).map(result_of).collect();
        let mut findings = found.findings.clone();
        for finding in &mut findings {
            finding.code.renumber(&|place| self.number(place));
        }
        Calibration { views: all, findings, ..found }
    }
}
