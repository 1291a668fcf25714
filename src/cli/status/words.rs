//! Lines beside the drawing.

use boresight_guide::session::Snapshot;
use boresight_present::{
    instruction::{Instruction, Moment},
    reading::reading,
    text::{terminal as words, window},
};

/// Characters of the hold's bar.
const BAR: usize = 10;

/// Sentence, mirrored for a person facing the camera if `mirrored`; measurements, hold, views and,
/// with `keys`, the keys.
pub(super) fn lines(
    now: &Instruction,
    snapshot: &Snapshot,
    mirrored: bool,
    keys: bool,
) -> Vec<String> {
    let measured = |gauge| {
        let reading = reading(gauge, snapshot);
        (reading.value, reading.aim)
    };
    let pose = match now.moment {
        Moment::Approach | Moment::Match | Moment::Hold | Moment::BeyondEdge => {
            let (tilt, size) = (measured(window::Gauge::Tilt), measured(window::Gauge::Size));
            words::pose(tilt, size)
        }
        _ => window::other_board(snapshot).map(|(what, _)| what).unwrap_or_default(),
    };
    let hold = now.hold.map_or(String::new(), |hold| {
        let full = (hold * BAR as f64).round() as usize;
        format!("[{}{}]", "#".repeat(full.min(BAR)), ".".repeat(BAR - full.min(BAR)))
    });
    let views = words::views(snapshot.views.len(), snapshot.views_to_go);
    let keys =
        if keys { words::keys(snapshot.paused, snapshot.removed.is_some()) } else { String::new() };
    vec![now.sentence(mirrored), pose, hold, views, keys]
}
