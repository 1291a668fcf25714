//! Two groups of views with different lenses: a mixture, as a view left out has an unknown group.

use nalgebra::{DMatrix, DVector};

use super::columns::solve;
use super::model::{Fit, as_matrix};

/// Parts into which the views are divided to be left out.
const FOLDS: usize = 8;
/// Rounds in which views change their groups.
const ROUNDS: usize = 6;
/// Shares of the views in the second group from which the search starts.
const SHARES: [f64; 5] = [0.15, 0.3, 0.5, 0.7, 0.85];

/// Likeliest division of the views.
pub(super) struct TwoCameras {
    /// True for views of the second group.
    pub(super) is_second: Vec<bool>,
    /// Minus twice the log likelihood of each view, predicted by the others.
    pub(super) predicted: Vec<f64>,
}

/// Search by `fit`, whose last `own` parameters are those of the second group, with course 1.
struct Search<'a> {
    fit: &'a Fit,
    own: usize,
}

/// Likeliest division in two groups of at least two views. `None` if there is none, or with fewer
/// than [`FOLDS`] views. `pulls` orders the views by their residuals: one list a parameter.
pub(super) fn two_cameras(fit: &Fit, own: usize, pulls: &[Vec<f64>]) -> Option<TwoCameras> {
    let count = fit.views.len();
    if count < FOLDS {
        return None;
    }
    let search = Search { fit, own };
    let starts = starts(pulls, count);
    let every = vec![true; count];
    let (is_second, _) = search.likeliest(&every, &starts)?;
    let mirrored = is_second.iter().map(|it| !it).collect();
    let few: Vec<Vec<bool>> = [is_second.clone(), mirrored]
        .into_iter()
        .chain(starts.iter().step_by(6).cloned())
        .collect();
    let mut predicted = vec![f64::NAN; count];
    for fold in 0..FOLDS {
        let is_used: Vec<bool> = (0..count).map(|view| view % FOLDS != fold).collect();
        let (groups, value) = search.likeliest(&is_used, &few)?;
        let used = is_used.iter().filter(|it| **it).count() as f64;
        let second = is_used.iter().zip(&groups).filter(|it| *it.0 && *it.1).count() as f64;
        let share = (second + 1.0) / (used + 2.0);
        for view in (0..count).filter(|view| !is_used[*view]) {
            let [first, other] = search.costs(view, &value);
            let least = first.min(other);
            let likely = (1.0 - share) * libm::exp(-0.5 * (first - least))
                + share * libm::exp(-0.5 * (other - least));
            predicted[view] = least - 2.0 * libm::log(likely);
        }
    }
    Some(TwoCameras { is_second, predicted })
}

/// Divisions from which the search starts: by number, and by the views' pull at each parameter.
fn starts(pulls: &[Vec<f64>], count: usize) -> Vec<Vec<bool>> {
    let by_number: Vec<f64> = (0..count).map(|view| view as f64).collect();
    let mut starts = Vec::new();
    for key in std::iter::once(&by_number).chain(pulls) {
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| key[*a].total_cmp(&key[*b]));
        for share in SHARES {
            let first = ((share * count as f64) as usize).max(2);
            let mut groups = vec![false; count];
            order[..first].iter().for_each(|view| groups[*view] = true);
            starts.push(groups);
        }
    }
    starts
}

impl Search<'_> {
    /// Likeliest groups of the views in use from several starts, with the parameters.
    fn likeliest(
        &self,
        is_used: &[bool],
        starts: &[Vec<bool>],
    ) -> Option<(Vec<bool>, DVector<f64>)> {
        let used = is_used.iter().filter(|it| **it).count();
        let mut best: Option<(f64, Vec<bool>, DVector<f64>)> = None;
        for start in starts {
            let mut groups = start.clone();
            let (mut gain, mut value) = self.solve(&groups, is_used)?;
            for _ in 0..ROUNDS {
                let again: Vec<bool> = (0..groups.len())
                    .map(|view| {
                        let [first, other] = self.costs(view, &value);
                        other < first
                    })
                    .collect();
                if again == groups {
                    break;
                }
                groups = again;
                (gain, value) = self.solve(&groups, is_used)?;
            }
            let second = groups.iter().zip(is_used).filter(|it| *it.0 && *it.1).count();
            let is_division = second >= 2 && second + 2 <= used;
            if is_division && best.as_ref().is_none_or(|best| gain > best.0) {
                best = Some((gain, groups, value));
            }
        }
        best.map(|(_, groups, value)| (groups, value))
    }

    /// Gain and parameters of the views in use, divided into `groups`.
    fn solve(&self, groups: &[bool], is_used: &[bool]) -> Option<(f64, DVector<f64>)> {
        let count = self.fit.precision.len();
        let first = count - self.own;
        let mut information = DMatrix::from_diagonal(&self.fit.precision);
        let mut gradient = DVector::zeros(count);
        for (view, of_view) in self.fit.views.iter().enumerate().filter(|(view, _)| is_used[*view])
        {
            let taken = if groups[view] { count } else { first };
            let mut sum = information.view_mut((0, 0), (taken, taken));
            sum += of_view.information.view((0, 0), (taken, taken));
            let mut sum = gradient.rows_mut(0, taken);
            sum += of_view.gradient.rows(0, taken);
        }
        let value = solve(&information, &as_matrix(gradient.clone()))?.column(0).into_owned();
        Some((gradient.dot(&value), value))
    }

    /// Costs of a view in the first and in the second group.
    fn costs(&self, view: usize, value: &DVector<f64>) -> [f64; 2] {
        let mut first = value.clone();
        first.rows_mut(value.len() - self.own, self.own).fill(0.0);
        [&first, value].map(|value| self.fit.views[view].cost_at(value))
    }
}
