//! Several pictures of a moment: median of their estimates, and shake of the camera.

use image::GrayImage;
use nalgebra::{Matrix4, Vector4};

use boresight_watch::{
    Looked, NoAnswer, Picture, SIGMA_OF_MEDIAN, Shelf, Station, Turn, View, Watch, px_per_turn,
};

/// Shake limit of a usable burst, px.
const TOO_MUCH_PX: f64 = 2.0;

/// Looks at a burst. Its middle picture is used for learning.
pub(super) fn of_burst(
    station: &mut Station,
    mut burst: Vec<GrayImage>,
    at_secs: f64,
    watch: &Watch,
    shelf: &mut dyn Shelf,
) -> Looked {
    if burst.len() < 2 {
        let Some(grey) = burst.pop() else {
            let picture =
                Picture { at: at_secs, late: false, answer: None, none: Some(NoAnswer::NoPicture) };
            let inputs = vec![boresight_watch::Input::Picture(Box::new(picture))];
            return Looked { inputs, references_changed: false };
        };
        return station.look(grey, at_secs, watch, shelf);
    }
    let middle = burst.len() / 2;
    let views: Vec<View> = burst.into_iter().map(View::of).collect();
    let mut turns = Vec::new();
    let mut measured = Vec::new();
    for view in &views {
        let one = station.measure(view);
        turns.extend(one.as_ref().ok().map(|m| m.turn.vector()));
        measured.push(one);
    }
    let enough = 2 * turns.len() > views.len();
    let chosen = if enough && measured[middle].is_err() {
        measured.iter().position(Result::is_ok).unwrap_or(middle)
    } else {
        middle
    };
    let view = &views[chosen];
    let px = px_per_turn(&station.lens);
    let mut one = measured.swap_remove(chosen);
    let mut shake_px = None;
    if let (Ok(one), true) = (&mut one, enough) {
        let median = per_part(&turns, |turn, i| turn[i]);
        let off = per_part(&turns, |turn, i| (turn[i] - median[i]).abs() * px[i]);
        shake_px = Some(SIGMA_OF_MEDIAN * off.amax());
        one.turn = Turn::from_vector(&median);
        // The scatter of the burst is known, and reduced by the median.
        let sd = off.component_div(&px) * SIGMA_OF_MEDIAN;
        let mean_variance = sd.component_mul(&sd) / turns.len() as f64;
        one.covariance += Matrix4::from_diagonal(&mean_variance);
    }
    let one = match one {
        Ok(_) if !enough => {
            Err(NoAnswer::Disagree { agree: turns.len() as u32, found: views.len() as u32 })
        }
        Ok(_) if shake_px.is_some_and(|shake| shake > TOO_MUCH_PX) => Err(NoAnswer::Shakes),
        other => other,
    };
    let mut answer = one.as_ref().ok().map(|m| station.answer(view, m));
    if let (Some(answer), Some(shake_px)) = (&mut answer, shake_px) {
        answer.shake = Some((shake_px * 1e3).round() / 1e3);
    }
    let picture = Picture { at: at_secs, late: false, none: one.as_ref().err().copied(), answer };
    station.learn_and_adopt(view, &one, picture, watch.decision(), shelf)
}

fn per_part(turns: &[Vector4<f64>], of: impl Fn(&Vector4<f64>, usize) -> f64) -> Vector4<f64> {
    Vector4::from_fn(|i, _| {
        let mut all: Vec<f64> = turns.iter().map(|turn| of(turn, i)).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    })
}
