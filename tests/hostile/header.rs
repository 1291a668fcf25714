//! `session.toml` from elsewhere.

use std::fs;

use boresight::{
    config::Config,
    frame::ImageSize,
    recording::{Header, SessionFolder},
};

use crate::{
    harness::{run, scratch},
    settings::makes_sense,
};

#[test]
fn headers() {
    let place = scratch();
    let size = ImageSize { width_px: 320, height_px: 240 };
    let header = Header::new("sim", size, Config::load(None, &[]).expect("defaults"));
    let path = place.path().join("session");
    drop(SessionFolder::create(&path, &header).expect("created"));
    let file = path.join("session.toml");
    let seeds = [fs::read_to_string(&file).expect("there")];
    run(
        "header",
        |mutator| mutator.text(&seeds),
        |input| {
            fs::write(&file, input).expect("written");
            match SessionFolder::header(&path) {
                Err(_) => Ok(false),
                Ok(header) => {
                    if header.image_size().width_px == 0 {
                        return Err("no picture has that size".into());
                    }
                    makes_sense(&header.config)
                }
            }
        },
    );
}
