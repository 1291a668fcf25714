//! Exposure times of a picture's rows, and the board's movement meanwhile.

use std::borrow::Cow;

use nalgebra::{Isometry3, Point3, UnitQuaternion};

/// Largest invisible movement.
const UNSEEN_MOVEMENT_PX: f64 = 0.05;
/// Number of rows sampled for the movement over the picture, evenly from the first to the last.
const ROWS_LOOKED_AT: u32 = 5;

/// Poses of the board, spread evenly over the exposure.
pub(super) enum Shutter<'a> {
    /// Poses of all rows at once.
    Global(&'a [Isometry3<f64>]),
    /// Function from a row to the row's poses.
    Rolling(&'a dyn Fn(u32) -> Vec<Isometry3<f64>>),
}

/// Movement of the board while a picture is taken. Invisible movements are 0.
pub(super) struct Motion<'a> {
    /// Pose in the middle of the exposure of the middle row.
    pub(super) middle: Isometry3<f64>,
    /// Poses during the exposure of the middle row.
    pub(super) middle_row: Cow<'a, [Isometry3<f64>]>,
    /// Movement from the middle, over all rows.
    pub(super) over_picture_px: f64,
    /// Movement from the middle, within the exposure of a row.
    pub(super) over_row_px: f64,
}

impl<'a> Shutter<'a> {
    /// Movement of a board with the given outline. `None` without a pose.
    pub(super) fn motion(
        &self,
        last_row: u32,
        f_px: f64,
        outline_in_board_m: &[Point3<f64>],
    ) -> Option<Motion<'a>> {
        let mut exposures: Vec<Cow<'a, [Isometry3<f64>]>> = match *self {
            Self::Global(poses) => vec![Cow::Borrowed(poses)],
            Self::Rolling(of_row) => (0..ROWS_LOOKED_AT)
                .map(|part| Cow::Owned(of_row(part * last_row / (ROWS_LOOKED_AT - 1))))
                .collect(),
        };
        let middle = middle_pose(&exposures[exposures.len() / 2])?;
        let (mut over_picture_px, mut over_row_px) = (0.0_f64, 0.0_f64);
        for poses in &exposures {
            let far_px = |from: Isometry3<f64>| movement_px(f_px, &from, poses, outline_in_board_m);
            over_picture_px = over_picture_px.max(far_px(middle));
            over_row_px = over_row_px.max(middle_pose(poses).map_or(0.0, far_px));
        }
        let seen = |px: f64| if px > UNSEEN_MOVEMENT_PX { px } else { 0.0 };
        Some(Motion {
            middle,
            middle_row: exposures.swap_remove(exposures.len() / 2),
            over_picture_px: seen(over_picture_px),
            over_row_px: seen(over_row_px),
        })
    }
}

/// Pose in the middle of `poses`.
pub(super) fn middle_pose(poses: &[Isometry3<f64>]) -> Option<Isometry3<f64>> {
    let (a, b) = (poses.get(poses.len().checked_sub(1)? / 2)?, poses.get(poses.len() / 2)?);
    let turn = (b.rotation * a.rotation.inverse()).scaled_axis();
    Some(Isometry3::from_parts(
        (0.5 * (a.translation.vector + b.translation.vector)).into(),
        UnitQuaternion::from_scaled_axis(0.5 * turn) * a.rotation,
    ))
}

/// Largest distance of any point of the outline at `poses` from the same point at `from`.
fn movement_px(
    f_px: f64,
    from: &Isometry3<f64>,
    poses: &[Isometry3<f64>],
    outline_in_board_m: &[Point3<f64>],
) -> f64 {
    let mut farthest_px = 0.0_f64;
    for point in outline_in_board_m {
        let at = from * point;
        for pose in poses {
            // Without the lens: a bound suffices.
            let moved = (pose * point - at).norm();
            farthest_px = farthest_px.max(f_px * moved / at.z.max(1e-3));
        }
    }
    farthest_px
}
