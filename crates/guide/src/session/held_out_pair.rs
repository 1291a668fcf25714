use crate::guidance::{View, partner_of};
use boresight_calibrate::{CalibrationParams, calibrate};
use boresight_geometry::{Corner, boards::Board, fit_pose, frame::ImageSize};

/// Minimum number of views beside the pair for a lens.
const VIEWS_NEEDED: usize = 2;

/// Prediction of the newest pair by the lens of the earlier views, before the pair was used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOutPair {
    /// Indices of the two views.
    pub views: [usize; 2],
    /// Root mean square prediction error of the corners; only the poses of the two views were
    /// fitted.
    pub rms_px: f64,
}

/// Predicts the newest pair of `views` from the others. `None` if the newest view has no partner,
/// or the others give no lens.
pub(super) fn held_out_pair(
    views: &[View],
    board: &Board,
    image_size: ImageSize,
    solver: &CalibrationParams,
) -> Option<HeldOutPair> {
    let newest = views.len().checked_sub(1)?;
    let partner = partner_of(newest, views)?;
    let pair = [partner.min(newest), partner.max(newest)];
    let others: Vec<Vec<Corner>> = (0..views.len())
        .filter(|index| !pair.contains(index))
        .map(|index| views[index].corners.clone())
        .collect();
    if others.len() < VIEWS_NEEDED {
        return None;
    }
    let earlier = calibrate(&others, board, image_size, solver).ok()?;
    let board_m = board.corners_in_board_m();
    let squares = pair.map(|index| {
        let fit = fit_pose(&earlier.camera, &board_m, &views[index].corners).ok()?;
        Some(fit.rms_px * fit.rms_px)
    });
    let [Some(first), Some(second)] = squares else { return None };
    Some(HeldOutPair { views: pair, rms_px: (0.5 * (first + second)).sqrt() })
}
