//! Bent boards: a parabola along the longer side.

use nalgebra::{Isometry3, Point2};

use boresight_geometry::boards::Board;

/// Bent board. Lengths are in squares; the board's z-axis points away from a camera that sees its
/// front.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    /// Offset of the middle along z from the first and the last row of corners.
    sag: f32,
    /// Half the distance between the two rows.
    half: f32,
    /// True if the bend is along the columns because rows are more numerous.
    is_upright: bool,
}

/// Bent board at a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct BentView {
    pub(super) bend: Bend,
    /// The board's axes in the camera's frame.
    pub(super) axes: [[f32; 3]; 3],
}

/// Distances of a ray along and across the bend per square along the board's normal.
#[derive(Clone, Copy, Debug)]
struct Slant {
    along: f32,
    across: f32,
}

impl Bend {
    /// `None` for a flat board.
    pub(super) fn new(board: &Board, bend_m: f64) -> Option<Self> {
        let is_upright = board.rows() > board.columns();
        let square_m = board.measured_m();
        let [across_m, down_m] = board.reach_m();
        let half = (across_m.max(down_m) / square_m) as f32;
        let sag = (bend_m / square_m) as f32;
        (sag != 0.0 && half > 0.0).then_some(Self { sag, half, is_upright })
    }

    /// Height along z at a point of the board, relative to the middle.
    pub(super) fn height(&self, from_middle: Point2<f32>) -> f32 {
        self.height_at(if self.is_upright { from_middle.y } else { from_middle.x })
    }

    pub(super) fn seen_at(self, cam_from_board: &Isometry3<f64>) -> BentView {
        let turn = cam_from_board.rotation.to_rotation_matrix();
        let axis = |i: usize| {
            let axis = turn.matrix().column(i);
            [axis[0] as f32, axis[1] as f32, axis[2] as f32]
        };
        let axes =
            if self.is_upright { [axis(1), axis(0), axis(2)] } else { [axis(0), axis(1), axis(2)] };
        BentView { bend: self, axes }
    }

    #[inline(always)]
    fn height_at(&self, along: f32) -> f32 {
        self.sag * (1.0 - (along / self.half).powi(2))
    }
}

impl BentView {
    /// Intersection of the ray `(x, y, 1)` with the bent board, from the intersection `flat` with a
    /// flat board. Both relative to the middle.
    #[inline(always)]
    pub(super) fn met(&self, ray: [f32; 2], flat: [f32; 2]) -> [f32; 2] {
        let (slant, _) = self.slant(ray);
        let [along, across] = self.turned(flat);
        // along' = along + slant · height(along'), a quadratic equation.
        let bend = &self.bend;
        let square = slant.along * bend.sag / (bend.half * bend.half);
        let sum = along + slant.along * bend.sag;
        let met = 2.0 * sum / (1.0 + (1.0 + 4.0 * square * sum).max(0.0).sqrt());
        self.turned([met, across + slant.across * bend.height_at(met)])
    }

    /// Derivative of [`met`](Self::met) at the result `met`, from the derivatives `by_ray` of the
    /// ray and `by_flat` of the intersection with a flat board.
    #[inline(always)]
    pub(super) fn change(
        &self,
        ray: [f32; 2],
        met: [f32; 2],
        by_ray: [f32; 2],
        by_flat: [f32; 2],
    ) -> [f32; 2] {
        let (slant, depth) = self.slant(ray);
        let ([along, _], [by_along, by_across]) = (self.turned(met), self.turned(by_flat));
        let bend = &self.bend;
        let (height, slope) =
            (bend.height_at(along), -2.0 * bend.sag * along / (bend.half * bend.half));
        let dot = |axis: &[f32; 3]| axis[0] * by_ray[0] + axis[1] * by_ray[1];
        let by_depth = dot(&self.axes[2]);
        let by_slant = |axis: &[f32; 3], slant: f32| (dot(axis) - slant * by_depth) / depth;
        let first = (by_along + height * by_slant(&self.axes[0], slant.along))
            / (1.0 - slant.along * slope);
        let second = by_across
            + slant.across * slope * first
            + height * by_slant(&self.axes[1], slant.across);
        self.turned([first, second])
    }

    /// Slant of a ray, and the ray's distance along the board's normal.
    #[inline(always)]
    fn slant(&self, [x, y]: [f32; 2]) -> (Slant, f32) {
        let dot = |axis: &[f32; 3]| axis[0] * x + axis[1] * y + axis[2];
        let depth = dot(&self.axes[2]).max(1e-3);
        (Slant { along: dot(&self.axes[0]) / depth, across: dot(&self.axes[1]) / depth }, depth)
    }

    /// Conversion of (right, down) to (along, across the bend), or back.
    #[inline(always)]
    fn turned(&self, [a, b]: [f32; 2]) -> [f32; 2] {
        let is_upright = self.bend.is_upright;
        [if is_upright { b } else { a }, if is_upright { a } else { b }]
    }
}
