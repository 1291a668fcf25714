//! Mistakes in scene files, in words for people.

use serde::de::DeserializeOwned;

use boresight_files::plain_words;

/// Example value for every key of a scene: the defaults of docs/schemas.md, where there is one.
pub(super) const EXAMPLE: &str = r#"
name = "webcam"
seed = 1
board = [9, 6]
square_mm = 25.0
board_id = "ZX5N"
bend_mm = 0.5
image_size_px = [1280, 720]
f_px = 980.0
pp_px = [653.4, 348.2]
fisheye = false
distortion = [-0.12, 0.05, 0.0, 0.0, 0.0]
fps = 30.0
noise_levels = 2.0
blur_px = 0.7
exposure_ms = 8.0
readout_ms = 15.0
clutter = 0.5

[technician]
person = "usual"
reaction_secs = 0.4
reading_secs_per_word = 0.25
look_away_every_secs = 20.0
rotation_error_deg = 10.0
lateral_error_px = 40.0
distance_error = 0.15
overshoot = 0.1
max_speed_mm_per_s = 500.0
max_turn_deg_per_s = 60.0
sway_mm = 1.5
sway_deg = 0.5
tremor_mm = 0.14
tremor_deg = 0.03
sink_mm = 2.0
tiring_per_sec = 0.02
rest_after_secs = 45.0
wanders = false
hears_only = false
leaves_for_secs = 30.0
covers_every_secs = 8.0
"#;

/// Mistake in a value in the `text` of a scene, a `T`, in words for people: the line, the expected
/// value, and an example. `err` names the key.
pub(super) fn mistake<T: DeserializeOwned>(text: &str, err: &toml::de::Error) -> String {
    let words = plain_words(&err.to_string());
    // The values alone have no position in the text.
    let place = toml::from_str::<T>(text).err().and_then(|err| err.span());
    let before = place.and_then(|place| text.get(..place.start));
    let line = before
        .map_or(String::new(), |before| format!("line {}: ", 1 + before.matches('\n').count()));
    let key = words.rsplit_once(" in `").and_then(|(_, key)| key.strip_suffix('`'));
    let example = key.and_then(example).map_or(String::new(), |it| format!(", for example {it}"));
    format!("{line}{words}{example}")
}

/// Example line for `key` in a scene.
pub(super) fn example(key: &str) -> Option<String> {
    let example: toml::Table = toml::from_str(EXAMPLE).ok()?;
    let (table, name) = match key.split_once('.') {
        Some((table, name)) => (example.get(table)?.as_table()?, name),
        None => (&example, key),
    };
    table.get(name).filter(|value| !value.is_table()).map(|value| format!("{name} = {value}"))
}
