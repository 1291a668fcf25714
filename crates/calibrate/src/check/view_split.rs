//! Searches for the split of the views that best explains a misfit: another camera for some, or
//! another focus from one view on.

use nalgebra::{Matrix4, Vector4};

use crate::solve::{bundle::Bundle, schur_lm::inverse};
use boresight_geometry::{LensMatrix, LensParameter, LensParts};

/// Parameters that differ between two cameras, as in `Cause::Mixed`.
const DIFFERENCE: [LensParameter; 4] =
    [LensParameter::Fx, LensParameter::Cx, LensParameter::Cy, LensParameter::K1];

/// Splits the views into the two groups with the largest difference in f, the principal point and
/// k1, and marks the smaller group.
///
/// With `I` and `g` the information and gradient of each view, splitting into A and B gains
/// `gₐᵀ(Iₐ⁻¹ + I_b⁻¹)gₐ`. Tries consecutive views, and views sorted by the shift of each parameter;
/// then improves the best split view by view. `None` with fewer than four views.
pub(super) fn likeliest_split(bundle: &Bundle) -> Option<Vec<bool>> {
    let views: Vec<Pull> = bundle
        .view_information()
        .iter()
        .map(|(information, gradient)| Pull {
            information: information.block(DIFFERENCE, DIFFERENCE),
            gradient: DIFFERENCE.map(|of| gradient[of.index()]).into(),
        })
        .collect();
    let count = views.len();
    if count < 4 {
        return None;
    }
    let all = views.iter().fold(Pull::zero(), |sum, view| sum.with(view, 1.0));
    let gain = |odd: &Pull| -> Option<f64> {
        let (first, second) =
            (inverse(&(all.information - odd.information))?, inverse(&odd.information)?);
        Some((odd.gradient.transpose() * (first + second) * odd.gradient).x)
    };
    let mut orders: Vec<Vec<usize>> = vec![(0..count).collect()];
    for i in 0..DIFFERENCE.len() {
        let mut order: Vec<usize> = (0..count).collect();
        let pull = |view: usize| {
            views[view].gradient[i] / views[view].information[(i, i)].max(f64::MIN_POSITIVE)
        };
        order.sort_by(|a, b| pull(*a).total_cmp(&pull(*b)));
        orders.push(order);
    }
    let mut best: Option<(f64, Vec<bool>)> = None;
    for order in orders {
        let mut group = Pull::zero();
        let mut most: Option<(f64, usize)> = None;
        for (taken, view) in order.iter().take(count - 1).enumerate() {
            group = group.with(&views[*view], 1.0);
            if let Some(gain) = gain(&group)
                && most.is_none_or(|(most, _)| gain > most)
            {
                most = Some((gain, taken + 1));
            }
        }
        if let Some((gain, taken)) = most
            && best.as_ref().is_none_or(|(most, _)| gain > *most)
        {
            let mut odd = vec![false; count];
            order[..taken].iter().for_each(|view| odd[*view] = true);
            best = Some((gain, odd));
        }
    }
    let (mut most, mut odd) = best?;
    let marked = views.iter().zip(&odd).filter(|(_, odd)| **odd);
    let mut group = marked.fold(Pull::zero(), |sum, (view, _)| sum.with(view, 1.0));
    let mut changed = true;
    while changed {
        changed = false;
        for view in 0..count {
            let moved = group.with(&views[view], if odd[view] { -1.0 } else { 1.0 });
            if let Some(better) = gain(&moved).filter(|gain| *gain > most * (1.0 + 1e-9)) {
                (most, group, changed) = (better, moved, true);
                odd[view] = !odd[view];
            }
        }
    }
    if 2 * odd.iter().filter(|odd| **odd).count() > count {
        odd.iter_mut().for_each(|odd| *odd = !*odd);
    }
    Some(odd)
}

/// Information of some views about [`DIFFERENCE`].
#[derive(Clone, Copy)]
struct Pull {
    information: Matrix4<f64>,
    gradient: Vector4<f64>,
}

impl Pull {
    fn zero() -> Self {
        Self { information: Matrix4::zeros(), gradient: Vector4::zeros() }
    }

    fn with(&self, other: &Self, times: f64) -> Self {
        Self {
            information: self.information + other.information * times,
            gradient: self.gradient + other.gradient * times,
        }
    }
}

/// First view, `1..N`, with another focal length by the likeliest jump. `None` with fewer than four
/// views.
///
/// With `I` and `g` the information and gradient of each view for the lens, and `J` the sum of `I`
/// from that view on, a change of f from there on gains `(Σ g_f)² / (J_ff − J_fθ I⁻¹ J_θf)`, with
/// the other lens parameters refitted.
pub(super) fn likeliest_jump(bundle: &Bundle) -> Option<usize> {
    let views = bundle.view_information();
    if views.len() < 4 {
        return None;
    }
    let settled = bundle.covariance(1.0)?;
    let mut after = views.iter().map(|(information, _)| information).sum::<LensMatrix>();
    let f = LensParameter::Fx.index();
    let mut pull = views.iter().map(|(_, gradient)| gradient[f]).sum::<f64>();
    let mut best: Option<(f64, usize)> = None;
    for (view, (information, gradient)) in views.iter().enumerate().take(views.len() - 1) {
        after -= information;
        pull -= gradient[f];
        let cross = after.column(f);
        let left = after[(f, f)] - cross.dot(&(settled * cross));
        let gain = pull * pull / left;
        if left > 0.0 && gain.is_finite() && best.is_none_or(|(most, _)| gain > most) {
            best = Some((gain, view + 1));
        }
    }
    best.map(|(_, view)| view)
}
