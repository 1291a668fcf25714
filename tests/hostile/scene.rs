//! Scene files: accepted ones are drawn.

use std::{fs, time::Duration};

use boresight::{
    capture::FrameSource,
    simulation::{NoCues, SceneFile, SyntheticSource},
};

use crate::harness::{only_numbers, run, scratch};

const SEED: &str = r#"
name = "office"
seed = 3
image_size_px = [160, 120]
f_px = 140.0
pp_px = [80.5, 60.5]
distortion = [-0.1, 0.02, 0.0, 0.0, 0.0]
fps = 30.0
noise_levels = 2.0
blur_px = 0.7
exposure_ms = 8.0
readout_ms = 12.0
bend_mm = 0.5
clutter = 0.5
[technician]
person = "tripod"
reaction_secs = 0.05
max_speed_mm_per_s = 3000.0
max_turn_deg_per_s = 900.0
tremor_mm = 0.5
overshoot = 0.1
wanders = false
hears_only = true
leaves_for_secs = 30.0
covers_every_secs = 8.0
"#;
/// Maximum size of a drawn picture; larger ones are accepted, but drawing them all would take too
/// long.
const MOST_PIXELS: u32 = 40_000;

#[test]
fn scenes() {
    let place = scratch();
    let file = place.path().join("scene.toml");
    let seeds = [SEED.to_owned()];
    run(
        "scene",
        |mutator| mutator.text(&seeds),
        |input| {
            fs::write(&file, input).expect("written");
            let Ok(scene) = SceneFile::load(&file) else { return Ok(false) };
            only_numbers(&scene)?;
            if scene.image_size.width_px * scene.image_size.height_px > MOST_PIXELS {
                return Ok(true);
            }
            let mut source = SyntheticSource::new(scene, Box::new(NoCues), Some(2), 2);
            for _ in 0..2 {
                source.next_frame(Duration::from_millis(1)).map_err(|err| err.to_string())?;
            }
            Ok(true)
        },
    );
}
