//! Settings files and single settings.

use std::fs;

use boresight::{
    config::{Config, DEFAULT_TOML},
    frame::ImageSize,
    session::Session,
};

use crate::harness::{Outcome, only_numbers, run, scratch};

/// Checks that a session can begin with the settings.
pub(crate) fn makes_sense(config: &Config) -> Outcome {
    only_numbers(config)?;
    let size = ImageSize { width_px: 320, height_px: 240 };
    let setup = config.session(size).map_err(|err| format!("checked, but {err}"))?;
    // Some target exists.
    Ok(Session::new(setup).target().is_some())
}

#[test]
fn files() {
    let place = scratch();
    let file = place.path().join("settings.toml");
    let seeds = [DEFAULT_TOML.to_owned()];
    run(
        "settings",
        |mutator| mutator.text(&seeds),
        |input| {
            fs::write(&file, input).expect("written");
            match Config::load(Some(&file), &[]) {
                Err(err) if err.to_string().is_empty() => Err("no words".into()),
                Err(_) => Ok(false),
                Ok(config) => makes_sense(&config),
            }
        },
    );
}

#[test]
fn single_settings() {
    let keys: Vec<String> = DEFAULT_TOML
        .lines()
        .filter_map(|line| Some(line.split_once(" = ")?.0.trim_start_matches("# ").to_owned()))
        .collect();
    run(
        "setting",
        |mutator| {
            let group =
                *mutator.one(&["guidance", "guidance", "board", "camera", "calibration", ""]);
            let key = mutator.one(&keys).clone();
            let value = mutator.text(&["0".to_owned(), "1.5".to_owned(), "quick".to_owned()]);
            format!("{group}.{key}={}", String::from_utf8_lossy(&value)).into_bytes()
        },
        |input| match Config::load(None, &[String::from_utf8_lossy(input).into_owned()]) {
            Err(_) => Ok(false),
            Ok(config) => makes_sense(&config),
        },
    );
}
