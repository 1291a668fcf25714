//! Stop rule: judges if the session has enough views.

use super::{
    independence::{lacks_partner, partner_of},
    params::{GuidanceParams, Plan},
    view::View,
};

/// Fewest views of a board small in the picture, and fewest for a forecast by the square root law:
/// with fewer, each further view still brings much more.
const FORECAST_VIEWS: usize = 8;

/// Fewest views in opposed pairs: two pairs fix the principal point.
const LEAST_IN_PAIRS: usize = 4;

/// Precision of the calibration so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// Standard deviation of the principal point, worse axis.
    pub pp_sigma_px: f64,
    /// Mean standard deviation of projection over the picture.
    pub projection_sigma_px: f64,
    /// Largest standard deviation of projection in the picture: in a corner, as a rule.
    pub corner_sigma_px: f64,
    /// Focal length in picture widths.
    pub f_to_width: f64,
    /// Error over the lens's share of the person's own goal; met at 1. Replaces the limits of both
    /// standard deviations. `None` without such a goal.
    pub goal_excess: Option<f64>,
    /// True if no trust check, except the check of projection over the picture, found anything bad
    /// or anything for further views to fix.
    pub trusted: bool,
    /// True if projection is known well enough in enough of the picture.
    pub covered: bool,
    /// True if the trust checks within reach of a board small in the picture passed.
    pub trusted_far: bool,
}

impl Precision {
    /// True if the goal is met; without a goal, if both standard deviations are small enough to
    /// stop. See [`Self::excess`].
    pub(crate) fn is_reached(&self, params: &GuidanceParams) -> bool {
        self.excess(params) <= 1.0
    }

    /// Factor by which the uncertainty must shrink before the session may stop; at most 1 if it
    /// may. For a board small in the picture, only the standard deviation of projection counts.
    pub fn excess(&self, params: &GuidanceParams) -> f64 {
        self.goal_excess.unwrap_or_else(|| {
            let projection = self.projection_sigma_px / params.stop_projection_sigma_px;
            let pp = self.pp_sigma_px / params.pp_goal_px(self.f_to_width);
            if params.is_far() { projection } else { projection.max(pp) }
        })
    }

    /// True if projection in the picture's corners is too uncertain, and boards beyond the edge may
    /// help. Never with a goal of the person's own.
    pub(crate) fn lacks_corners(&self, params: &GuidanceParams) -> bool {
        self.goal_excess.is_none()
            && params.leaves_picture()
            && params.stop_corner_sigma_px.is_some_and(|limit_px| self.corner_sigma_px > limit_px)
    }
}

/// Missing part of an incomplete session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lack {
    /// Views.
    Views,
    /// Opposed partners of views.
    Opposites,
    /// Calibration that passes the trust checks fixable by further views.
    Trust,
    /// Required precision.
    Precision,
    /// Enough of the picture with a well known projection.
    Coverage,
    /// Boards in the picture's corners.
    Corners,
}

/// Progress of a session.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "progress")]
pub enum Progress {
    /// More views are needed.
    Collecting,
    /// The plan is complete, the precision reached.
    Complete,
    /// No further pose is possible, and the required precision isn't reached.
    Exhausted,
}

/// End of a session when no further pose is possible. Coverage beyond improvement by any pose stays
/// a finding of the calibration; it doesn't fail the session.
pub(crate) fn final_progress(precision: Option<&Precision>, params: &GuidanceParams) -> Progress {
    let is_trusted = |p: &Precision| if params.is_far() { p.trusted_far } else { p.trusted };
    if precision.is_some_and(|precision| is_trusted(precision) && precision.is_reached(params)) {
        Progress::Complete
    } else {
        Progress::Exhausted
    }
}

/// Decides whether to stop: enough views, two opposed pairs or those of the plan and, for the
/// adaptive plan, the required precision with the trust checks passed. Source: `docs/method.md`,
/// section 3.5.
pub fn progress(
    accepted: &[View],
    precision: Option<&Precision>,
    params: &GuidanceParams,
) -> Progress {
    let views = accepted.len();
    let Some(lack) = lack(accepted, precision, params) else { return Progress::Complete };
    // Where more views help so little, a person would wait in vain.
    let hopeless = views >= FORECAST_VIEWS
        && precision.is_some_and(|p| views_by_noise(views, p, params) > params.max_views);
    let planned = !matches!(lack, Lack::Views | Lack::Opposites);
    let lacks_precision = lack == Lack::Precision || (params.is_far() && planned);
    if views >= params.max_views || (lacks_precision && hopeless) {
        Progress::Exhausted
    } else {
        Progress::Collecting
    }
}

/// First missing part of an incomplete session, by the rule of [`progress`]; `None` if complete.
pub(crate) fn lack(
    accepted: &[View],
    precision: Option<&Precision>,
    params: &GuidanceParams,
) -> Option<Lack> {
    let views = accepted.len();
    if views < planned_views(params) {
        return Some(Lack::Views);
    }
    let in_pairs = (0..views).filter(|&i| partner_of(i, accepted).is_some()).count();
    if in_pairs < params.plan.views().unwrap_or(LEAST_IN_PAIRS) {
        return Some(Lack::Opposites);
    }
    if params.plan != Plan::Adaptive {
        return None;
    }
    let Some(precision) = precision else { return Some(Lack::Trust) };
    let is_far = params.is_far();
    let is_trusted = if is_far { precision.trusted_far } else { precision.trusted };
    if !is_trusted {
        return Some(Lack::Trust);
    }
    if !precision.is_reached(params) {
        return Some(Lack::Precision);
    }
    if !is_far && !precision.covered {
        return Some(Lack::Coverage);
    }
    asks_for_corners(views, precision, params).then_some(Lack::Corners)
}

/// True if boards in the picture's corners are worth a longer session: at most as many views as the
/// pairs beyond the edge would add to the fewest of a session.
fn asks_for_corners(views: usize, precision: &Precision, params: &GuidanceParams) -> bool {
    let most_views = params.min_views + 2 * params.pairs_beyond_edge;
    views < most_views && precision.lacks_corners(params)
}

/// Number of views of the plan before precision counts.
fn planned_views(params: &GuidanceParams) -> usize {
    let least =
        if params.is_far() { params.min_views.max(FORECAST_VIEWS) } else { params.min_views };
    params.plan.views().unwrap_or(least)
}

/// Number of views to bring the standard deviations down to the goals, by the square root law.
pub fn views_by_noise(views: usize, precision: &Precision, params: &GuidanceParams) -> usize {
    let excess = precision.excess(params);
    (views as f64 * excess * excess).min(10_000.0).ceil() as usize
}

/// Forecast of the views still to take: the missing partners, then enough, in whole pairs, to bring
/// the standard deviations down by the square root law. `None` once the session is over. Source:
/// `docs/method.md`, section 3.5.
pub fn forecast(
    accepted: &[View],
    precision: Option<&Precision>,
    params: &GuidanceParams,
) -> Option<usize> {
    if progress(accepted, precision, params) != Progress::Collecting {
        return None;
    }
    let views = accepted.len();
    let unpaired = (0..views).filter(|&i| lacks_partner(i, accepted)).count();
    let planned = planned_views(params);
    let complete = planned.max(views + unpaired);
    let wanted = match (params.plan, precision) {
        // While partners are missing, noise doesn't fall with the square root of the number of
        // views.
        (Plan::Adaptive, Some(precision)) if views >= planned => {
            let by_noise = views_by_noise(views, precision, params).min(params.max_views);
            // At least one more pair while a trust check fails, or the picture's edge needs boards.
            let is_settled = precision.trusted
                && precision.covered
                && !asks_for_corners(views, precision, params);
            let doubts = usize::from(!is_settled) * 2;
            complete.max(by_noise).max(views + unpaired + doubts)
        }
        _ => complete,
    };
    Some((wanted.next_multiple_of(2).min(params.max_views).max(views + 1)) - views)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRECISE: Precision = Precision {
        f_to_width: 0.9,
        trusted_far: true,
        pp_sigma_px: 0.1,
        projection_sigma_px: 0.01,
        corner_sigma_px: 0.02,
        goal_excess: None,
        trusted: true,
        covered: true,
    };

    #[test]
    fn corners_ask_for_no_more_views_than_the_pairs_beyond_the_edge() {
        let params = GuidanceParams::default();
        let unknown_corners = Precision { corner_sigma_px: 2.0, ..PRECISE };
        assert!(asks_for_corners(9, &unknown_corners, &params));
        assert!(!asks_for_corners(10, &unknown_corners, &params));
        assert!(!asks_for_corners(9, &PRECISE, &params));
    }

    #[test]
    fn a_goal_replaces_both_standard_deviations() {
        let params = GuidanceParams::default();
        assert!(PRECISE.is_reached(&params));
        assert!(!Precision { goal_excess: Some(1.01), ..PRECISE }.is_reached(&params));
        let coarse = Precision { pp_sigma_px: 5.0, goal_excess: Some(0.9), ..PRECISE };
        assert!(coarse.is_reached(&params));
        // A length that doesn't fit into the picture.
        assert!(!Precision { goal_excess: Some(f64::INFINITY), ..PRECISE }.is_reached(&params));
    }

    #[test]
    fn an_empty_session_is_as_far_away_as_its_plan() {
        let params = GuidanceParams::default();
        assert_eq!(forecast(&[], None, &params), Some(4));
        assert_eq!(forecast(&[], None, &GuidanceParams { plan: Plan::Full, ..params }), Some(8));
    }
}
