//! Several pictures of a moment: median of their estimates, and shake of the camera.

use image::GrayImage;
use nalgebra::{Matrix4, Vector4};

use boresight_watch::{
    Looked, Measured, NoAnswer, Picture, SIGMA_OF_MEDIAN, Shelf, Station, Turn, View, Watch,
    px_per_turn,
};

/// Shake limit of a usable burst, px.
const TOO_MUCH_PX: f64 = 2.0;

/// Measured picture of a moment.
pub(super) struct Seen {
    view: View,
    measured: Result<Measured, NoAnswer>,
    /// Record of it.
    pub(super) picture: Picture,
}

/// Looks at a moment. The middle picture of a burst is used for learning.
pub(super) fn of_burst(
    station: &mut Station,
    burst: Vec<GrayImage>,
    at_secs: f64,
    watch: &Watch,
    shelf: &mut dyn Shelf,
) -> Looked {
    let Some(Seen { view, measured, picture }) = seen(station, burst, at_secs) else {
        let none = Some(NoAnswer::NoPicture);
        let picture = Picture { at: at_secs, late: false, answer: None, none };
        let inputs = vec![boresight_watch::Input::Picture(Box::new(picture))];
        return Looked { inputs, references_changed: false };
    };
    station.learn_and_adopt(&view, &measured, picture, watch.decision(), shelf)
}

/// Measures a moment; `None` without a picture.
pub(super) fn seen(station: &Station, burst: Vec<GrayImage>, at_secs: f64) -> Option<Seen> {
    let middle = burst.len() / 2;
    let mut views: Vec<View> = burst.into_iter().map(View::of).collect();
    let mut all: Vec<_> = views.iter().map(|view| station.measure(view)).collect();
    let turns: Vec<_> = all.iter().flatten().map(|one| one.turn.vector()).collect();
    let enough = 2 * turns.len() > all.len();
    let first = all.iter().position(Result::is_ok);
    let is_lost = enough && all.get(middle).is_some_and(Result::is_err);
    let chosen = first.filter(|_| is_lost).unwrap_or(middle);
    if views.is_empty() {
        return None;
    }
    let count = views.len();
    let (view, mut one) = (views.swap_remove(chosen), all.swap_remove(chosen));
    let px = px_per_turn(&station.lens);
    let mut shake_px = None;
    if let (Ok(one), true) = (&mut one, enough && count > 1) {
        let median = per_part(&turns, |turn, i| turn[i]);
        let off = per_part(&turns, |turn, i| (turn[i] - median[i]).abs() * px[i]);
        shake_px = Some(SIGMA_OF_MEDIAN * off.amax());
        one.turn = Turn::from_vector(&median);
        // The scatter of the burst is known, and reduced by the median.
        let sd = off.component_div(&px) * SIGMA_OF_MEDIAN;
        let mean_variance = sd.component_mul(&sd) / turns.len() as f64;
        one.covariance += Matrix4::from_diagonal(&mean_variance);
    }
    let measured = match one {
        Ok(_) if !enough => {
            Err(NoAnswer::Disagree { agree: turns.len() as u32, found: count as u32 })
        }
        Ok(_) if shake_px.is_some_and(|shake| shake > TOO_MUCH_PX) => Err(NoAnswer::Shakes),
        other => other,
    };
    let mut answer = measured.as_ref().ok().map(|m| station.answer(&view, m));
    if let (Some(answer), Some(shake_px)) = (&mut answer, shake_px) {
        answer.shake = Some((shake_px * 1e3).round() / 1e3);
    }
    let none = measured.as_ref().err().copied();
    let picture = Picture { at: at_secs, late: false, none, answer };
    Some(Seen { view, measured, picture })
}

fn per_part(turns: &[Vector4<f64>], of: impl Fn(&Vector4<f64>, usize) -> f64) -> Vector4<f64> {
    Vector4::from_fn(|i, _| {
        let mut all: Vec<f64> = turns.iter().map(|turn| of(turn, i)).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    })
}
