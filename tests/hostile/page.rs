//! Report of an edited calibration: well-formed, only numbers, no foreign code.

use std::fs;

use boresight::{
    app::session::report::of_file,
    calibration::{
        CalibrationParams, calibrate,
        files::{CalibrationFile, ViewName},
    },
    config::CertificateConfig,
    report::page,
    text,
};
use serde_json::Value;

use crate::{
    harness::{run, scratch},
    world::guided,
};

/// A calibration of a guided session.
pub(crate) fn calibration() -> Value {
    let (world, session, _) = guided(3, |_, _| ());
    let corners: Vec<_> = session.accepted().iter().map(|view| view.view.corners.clone()).collect();
    let size = session.setup().image_size;
    let result = calibrate(&corners, &world.board, size, &CalibrationParams::default());
    let names: Vec<ViewName> = (0..corners.len())
        .map(|at| ViewName { name: format!("{at}.png"), number: None, reason: None })
        .collect();
    CalibrationFile::of(result.as_ref(), size, &world.board, &names, text::FINDING_WORDS)
        .to_json()
        .expect("JSON")
}

#[test]
fn pages() {
    let good = calibration();
    let stated = CertificateConfig::default();
    let place = scratch();
    let file = place.path().join("calibration.json");
    run(
        "page",
        |mutator| {
            let mut tree = good.clone();
            let times = 1 + mutator.below(6);
            mutator.json(&mut tree, times);
            tree.to_string().into_bytes()
        },
        |input| {
            fs::write(&file, input).expect("written");
            let Ok(report) = of_file(&file, "boresight report".into(), &stated) else {
                return Ok(false);
            };
            let html = page(&report);
            if html.contains("<script") {
                return Err("a script came through".into());
            }
            for no_number in ["NaN", ">inf", "\"inf", "-inf", " inf"] {
                if let Some(at) = html.find(no_number) {
                    let from = html[..at].char_indices().rev().nth(120).map_or(0, |(from, _)| from);
                    return Err(format!("no number: {}{no_number}", &html[from..at]));
                }
            }
            let xml = html.trim_start_matches("<!DOCTYPE html>");
            roxmltree::Document::parse(xml).map_err(|err| format!("not well-formed: {err}"))?;
            Ok(true)
        },
    );
}
