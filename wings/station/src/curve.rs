//! A watched camera over time, from the store, for drawing.

use std::path::Path;

use nalgebra::Vector4;

use super::{
    said::StateLine,
    store::{Store, inputs},
    times::{day_in_words, in_words},
};
use crate::report::{WatchedCurve, WatchedEvent, WatchedPoint};
use boresight_watch::{Input, Lens, Watch, turn_of};

/// Time, seconds since 1970; pan, tilt, roll and focal ratio; usual values and smallest visible
/// change at that time, once known.
type Estimate = (f64, [f64; 4], Option<[[f64; 4]; 2]>);

/// Curve of the camera in `folder`, with other events in `happened`, such as calibrations: time,
/// seconds since 1970, and text.
///
/// # Errors
///
/// If there is no store, or a line is damaged.
pub fn curve(folder: &Path, happened: &[(f64, String)]) -> anyhow::Result<WatchedCurve> {
    let name = Store::read(folder)?.map_or(String::new(), |file| file.name);
    let (lens, inputs) = inputs(folder)?;
    let mut watch = Watch::new(&lens);
    let mut events: Vec<(f64, String)> = happened.to_vec();
    let mut points: Vec<Estimate> = Vec::new();
    let (mut learned_from, mut before, mut sentence) = (0, "LEARNING", String::new());
    for (n, input) in inputs.iter().enumerate() {
        let decision = watch.handle(input);
        match input {
            Input::Picture(picture) => {
                if let Some(answer) = &picture.answer {
                    let value_px = answer.turn().in_px(&lens);
                    let is_known = watch.scatter_px().is_some();
                    let usual = is_known.then(|| {
                        [watch.target_px(picture.at), decision.smallest_visible_px]
                            .map(|px| units(&px, &lens))
                    });
                    points.push((picture.at, units(&value_px, &lens), usual));
                }
            }
            Input::Learned { samples, .. } => {
                // Estimates by fewer references had another zero.
                points.truncate(learned_from);
                points.extend(samples.iter().map(|sample| {
                    (sample.at, units(&turn_of(&sample.turn).in_px(&lens), &lens), None)
                }));
            }
            Input::Accepted { at, reason } => {
                events.push((*at, format!("Accepted: {reason}")));
                learned_from = points.len();
            }
        }
        let code = decision.state.code();
        let at = match input {
            Input::Picture(picture) => picture.at,
            Input::Learned { at, .. } | Input::Accepted { at, .. } => *at,
        };
        let line = || StateLine::of_decision(&name, &lens, &decision, Some(at), [0, 0]);
        if code != before {
            let StateLine { state, sentence, .. } = line();
            events.push((at, format!("{state}. {sentence}")));
            before = code;
        }
        if n + 1 == inputs.len() {
            let StateLine { state, sentence: said, action, .. } = line();
            sentence = format!("{state}. {said} {action}").trim_end().to_owned();
        }
    }
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let began = points.first().map_or(0.0, |(at, ..)| *at);
    Ok(WatchedCurve {
        name,
        sentence,
        began: day_in_words(began),
        points: points
            .into_iter()
            .map(|(at, value, usual)| WatchedPoint { day: (at - began) / 86_400.0, value, usual })
            .collect(),
        events: events
            .into_iter()
            .map(|(at, what)| WatchedEvent {
                secs: (at - began).round() as i64,
                when: in_words(at),
                what,
            })
            .collect(),
    })
}

/// Pan and tilt in px, roll in degrees, focal length in per cent.
fn units(px: &Vector4<f64>, lens: &Lens) -> [f64; 4] {
    let half = lens.half_diagonal_px();
    [px[0], px[1], (px[2] / half).to_degrees(), 100.0 * px[3] / half]
}
