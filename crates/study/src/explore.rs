//! The paper's effect to play with: a board that is moved, its principal line, its opposed partner, all
//! slots, and slots left out.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Point2, Vector2};

use super::{
    directionality::{self, deflection},
    estimate::{View, by_principal_lines, view},
    setup::{SLOTS, Setup},
};
use boresight_calibrate::check::leave_out::consecutive;
use boresight_geometry::PrincipalLine;

/// Settings of the exploration.
#[derive(Clone, Debug)]
pub struct ExploreSetup {
    /// Camera, board, distance and tilt.
    pub setup: Setup,
    /// Direction of the board.
    pub slot_rad: f64,
    /// Shift of the board: across its principal line, and along it.
    pub shift_m: Vector2<f64>,
    /// Boards that stand beside it.
    pub boards: Boards,
    /// Slots left out, of eight.
    pub skipped: usize,
}

/// Set of boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Boards {
    /// One board alone.
    One,
    /// The board and its opposed partner.
    Pair,
    /// Two pairs at right angles.
    TwoPairs,
    /// All eight slots.
    Eight,
}

/// A board as the camera sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Board {
    /// Direction of the board.
    pub slot_rad: f64,
    /// Corners of the board, in numbering order.
    pub corners_px: Vec<Point2<f64>>,
    /// Principal line of the corners as seen; counted from the true principal point. `None` if the board faces the
    /// camera.
    pub line: Option<PrincipalLine>,
    /// Signed distance of the line from the true principal point, along the normal of the first board's.
    pub offset_px: Option<f64>,
}

/// The drawing, and the numbers beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// The boards that are in front of the camera; the one to be moved first.
    pub boards: Vec<Board>,
    /// Effect of the first board's shift on its line.
    pub deflection: Option<directionality::Row>,
    /// Angle between the first line and its partner's.
    pub pair_angle_rad: Option<f64>,
    /// Sum of the offsets of the first board's line and its partner's: none if they cancel.
    pub pair_sum_px: Option<f64>,
    /// Intersection of all lines.
    pub meet_px: Option<Point2<f64>>,
    /// Intersections with slots left out, once from each slot on.
    pub skipped_px: Vec<Point2<f64>>,
    /// Root mean square distance of those from the true principal point.
    pub skipped_rms_px: Option<f64>,
}

impl Boards {
    /// Directions, the first board's first.
    fn slots_rad(self, first_rad: f64) -> Vec<f64> {
        let count: &[f64] = match self {
            Self::One => &[0.0],
            Self::Pair => &[0.0, 0.5],
            Self::TwoPairs => &[0.0, 0.5, 0.25, 0.75],
            Self::Eight => {
                return (0..SLOTS).map(|i| first_rad + TAU * i as f64 / SLOTS as f64).collect();
            }
        };
        count.iter().map(|share| first_rad + TAU * share).collect()
    }
}

impl ExploreSetup {
    /// Pose of the board of direction `slot_rad`.
    fn pose(&self, slot_rad: f64) -> Isometry3<f64> {
        self.setup.pose(slot_rad, &self.shift_m, &Vector2::zeros())
    }

    /// The shift that brings the middle of the first board onto a pixel, as far as a pinhole would.
    pub fn shift_to(&self, px: &Point2<f64>) -> Vector2<f64> {
        let setup = &self.setup;
        let ray = (px - setup.camera.pp_px).component_div(&setup.camera.f_px) * setup.distance_m;
        let (sin, cos) = self.slot_rad.sin_cos();
        Vector2::new(cos * ray.x + sin * ray.y, cos * ray.y - sin * ray.x)
    }
}

/// Computes the drawing of `wish`, and the numbers beside it.
pub fn look(wish: &ExploreSetup) -> Seen {
    let setup = &wish.setup;
    let pp = setup.camera.pp_px;
    let seen: Vec<(f64, Vec<Point2<f64>>, View)> = wish
        .boards
        .slots_rad(wish.slot_rad)
        .into_iter()
        .filter_map(|slot_rad| {
            let corners_px = setup.corners_px(&wish.pose(slot_rad))?;
            let view = view(&setup.board, &corners_px, pp, 1e-6)?;
            Some((slot_rad.rem_euclid(TAU), corners_px, view))
        })
        .collect();
    let first = seen.first().and_then(|(.., view)| view.line.clone());
    let offset_px = |line: &PrincipalLine| {
        let sign = first.as_ref().map_or(1.0, |first| first.normal().dot(&line.normal()).signum());
        sign * line.c_px
    };
    let views: Vec<&View> = seen.iter().map(|(.., view)| view).collect();
    let skipped_px: Vec<Point2<f64>> = match wish.boards {
        Boards::Eight if views.len() == SLOTS => consecutive(SLOTS, wish.skipped)
            .iter()
            .filter_map(|kept| {
                by_principal_lines(&kept.iter().map(|i| views[*i]).collect::<Vec<_>>())
            })
            .collect(),
        _ => Vec::new(),
    };
    let squares: f64 = skipped_px.iter().map(|px| (px - pp).norm_squared()).sum();
    let skipped_rms_px =
        (!skipped_px.is_empty()).then(|| (squares / skipped_px.len() as f64).sqrt());
    let meet_px = by_principal_lines(&views);
    let boards: Vec<Board> = seen
        .into_iter()
        .map(|(slot_rad, corners_px, view)| {
            let offset_px = view.line.as_ref().map(offset_px);
            Board { slot_rad, corners_px, line: view.line, offset_px }
        })
        .collect();
    let partner = boards.iter().skip(1).find(|board| {
        let turn = (board.slot_rad - wish.slot_rad - PI).rem_euclid(TAU);
        turn.min(TAU - turn) < 1e-9
    });
    let line = |board: Option<&Board>| board.and_then(|board| board.line.clone());
    let lines = line(boards.first()).zip(line(partner));
    let offsets = boards.first().and_then(|b| b.offset_px).zip(partner.and_then(|b| b.offset_px));
    Seen {
        deflection: deflection(setup, wish.shift_m.norm(), wish.shift_m.y.atan2(wish.shift_m.x)),
        pair_angle_rad: lines.map(|(one, other)| one.angle_to(&other)),
        pair_sum_px: offsets.map(|(one, other)| one + other),
        boards,
        meet_px,
        skipped_px,
        skipped_rms_px,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Params;

    fn wish(across_m: f64, boards: Boards, skipped: usize) -> ExploreSetup {
        ExploreSetup {
            setup: Setup::of(&Params::default()),
            slot_rad: 0.0,
            shift_m: Vector2::new(across_m, 0.0),
            boards,
            skipped,
        }
    }

    #[test]
    fn the_numbers_are_those_of_the_papers_figures() {
        for (shift_m, offset_px, angle_deg) in [
            (0.05, 8.47, 0.303),
            (0.1, 16.95, 0.607),
            (0.15, 25.48, 0.913),
            (0.2, 34.06, 1.220),
            (0.3, 51.46, 1.845),
            (0.4, 69.33, 2.488),
        ] {
            // At every direction of the dial.
            for slot_rad in [0.0, 1.0, 4.0] {
                let seen = look(&ExploreSetup { slot_rad, ..wish(shift_m, Boards::One, 0) });
                let row = seen.deflection.expect("a line");
                assert!((row.offset_px.abs() - offset_px).abs() < 0.005, "{}", row.offset_px);
                assert!((row.angle_rad.abs().to_degrees() - angle_deg).abs() < 5e-4);
                let drawn = seen.boards[0].offset_px.expect("a line").abs();
                assert!((drawn - row.offset_px.abs()).abs() < 1e-9, "{drawn}");
            }
        }
        let along = ExploreSetup { shift_m: Vector2::new(0.0, 0.2), ..wish(0.0, Boards::One, 0) };
        assert!(look(&along).deflection.expect("a line").offset_px.abs() < 1e-9);
    }

    #[test]
    fn the_partner_cancels_the_offset_and_two_pairs_meet_in_the_principal_point() {
        let pair = look(&wish(0.05, Boards::Pair, 0));
        assert!(pair.pair_sum_px.expect("a pair").abs() < 1e-9);
        assert!(pair.meet_px.is_none_or(|meet| meet.coords.norm() < 1e6));
        let two = look(&wish(0.05, Boards::TwoPairs, 0));
        let pp = wish(0.05, Boards::One, 0).setup.camera.pp_px;
        assert!((two.meet_px.expect("two directions") - pp).norm() < 1e-9);
    }

    #[test]
    fn slots_left_out_drift_as_in_the_papers_figure() {
        for (shift_m, known) in
            [(0.05, [2.82, 6.82, 10.22, 11.06, 10.22]), (0.2, [11.35, 27.4, 41.1, 44.5, 41.1])]
        {
            for (skipped, known_px) in (1..).zip(known) {
                let rms = look(&wish(shift_m, Boards::Eight, skipped)).skipped_rms_px;
                let rms = rms.expect("eight slots");
                assert!((rms - known_px).abs() < 0.005 * known_px, "{skipped}: {rms} {known_px}");
            }
        }
    }

    #[test]
    fn the_board_goes_where_it_is_dragged() {
        let mut wish = wish(0.0, Boards::One, 0);
        wish.slot_rad = 0.7;
        let px = Point2::new(700.0, 400.0);
        wish.shift_m = wish.shift_to(&px);
        let seen = look(&wish);
        let corners = &seen.boards[0].corners_px;
        let middle =
            corners.iter().fold(Vector2::zeros(), |s, p| s + p.coords) / corners.len() as f64;
        // Distortion and perspective move the mean corner a little off.
        assert!((middle - px.coords).norm() < 25.0, "{middle}");
    }
}
