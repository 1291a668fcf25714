//! Finds wrong corners: corners in another order than the board's, and single outliers.

use crate::solve::bundle::{BundleState, Observations};
use boresight_geometry::{Corner, boards::Board};

/// Ratio of second to first difference along a row above which three corners are crooked.
/// Perspective and distortion give far less: 0.5 would mean that one step is three times as long as
/// the next.
const CROOKED: f64 = 0.5;
/// Fraction of crooked triples above which the order of the corners is wrong. A single wrong corner
/// makes at most six.
const TOO_MANY: f64 = 0.15;
/// Ratio to the median distance above which a corner is wrong. The furthest of a thousand sound
/// corners lies at 3.2 (Rayleigh distribution).
const ODD: f64 = 8.0;
/// Distance in pixels below which a corner isn't wrong, even if the other corners' errors are much
/// smaller.
const HARMLESS_PX: f64 = 0.2;

/// True if nearly all seen corners follow each other as on the board.
pub(crate) fn is_grid(corners: &[Corner], board: &Board) -> bool {
    let (mut all, mut wrong) = (0, 0);
    board.target().each_three_in_line(&mut |line, share| {
        let [a, b, c] = line.map(|place| &corners[place]);
        if a.is_seen() && b.is_seen() && c.is_seen() {
            let (a, b, c) = (a.px.coords, b.px.coords, c.px.coords);
            all += 1;
            let off = (a * (1.0 - share) + c * share - b) * 2.0;
            wrong += u32::from(off.norm() > CROOKED * (c - a).norm());
        }
    });
    f64::from(wrong) <= TOO_MANY * f64::from(all)
}

/// Corner far from the predicted position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OddCorner {
    pub(crate) view: usize,
    pub(crate) corner: usize,
    pub(super) off_px: f64,
    /// Ratio of `off_px` to the median distance in its view, or in all views if that is larger.
    pub(crate) times: f64,
}

/// Corners more than eight times as far off as the median, and by more than a fifth of a pixel,
/// furthest first.
///
/// Medians, because a wrong corner would raise a mean.
pub(crate) fn odd_corners(observations: &Observations, state: &BundleState) -> Vec<OddCorner> {
    let views: Vec<Vec<f64>> = (0..observations.view_count())
        .map(|view| {
            let pose = &state.cam_from_board[view];
            observations
                .view(view)
                .iter()
                .map(|corner| {
                    state
                        .camera
                        .project_board_point(pose, &corner.board_m)
                        .map_or(f64::INFINITY, |predicted| (corner.px - predicted.px).norm())
                })
                .collect()
        })
        .collect();
    let all: Vec<f64> = views.iter().flatten().copied().collect();
    let typical_px = median(all).max(1e-3);
    let mut odd = Vec::new();
    for (view, off_px) in views.iter().enumerate() {
        let measure_px = median(off_px.clone()).max(typical_px);
        for (index, off_px) in off_px.iter().enumerate() {
            let times = off_px / measure_px;
            if times > ODD && *off_px > HARMLESS_PX {
                let corner = observations.view(view)[index].place;
                odd.push(OddCorner { view, corner, off_px: *off_px, times });
            }
        }
    }
    odd.sort_by(|a, b| b.times.total_cmp(&a.times));
    odd
}

/// Mean over median of the squares of normal errors.
pub(crate) const OF_MEDIAN: f64 = 2.2;

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
