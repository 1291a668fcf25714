//! Ours: the opposed partner of the view taken, the next slot, then the most informative reflected
//! pairs.

use nalgebra::Isometry3;
use rand_chacha::ChaCha8Rng;

use crate::guidance::situation::Situation;
use boresight_geometry::{Corner, fit_pose};
use boresight_guide::guidance::{Knowledge, next_target};

/// Pose of our planner's ghost.
pub(super) fn wish(situation: &Situation<'_>, _: &mut ChaCha8Rng) -> Option<Isometry3<f64>> {
    let Situation { lens_estimate, views, board, params, .. } = *situation;
    let knowledge = Knowledge::new(views, board, lens_estimate, params);
    let target = next_target(views, &[], board, &knowledge, lens_estimate, params)?;
    let ghost: Vec<Corner> = target.ghost_px.iter().map(|px| Corner::isotropic(*px, 1.0)).collect();
    Some(fit_pose(&lens_estimate.camera, &board.corners_in_board_m(), &ghost).ok()?.cam_from_board)
}
