//! Files of several cameras: their places, lenses and page.

use boresight::{
    calibration::{
        export::{ExportedRig, RigFormat},
        files::RigFile,
    },
    report::{Certificate, rig_page},
};
use serde_json::{Value, json};

use crate::{
    harness::{only_numbers, run},
    page::calibration,
};

/// A file of two cameras with the same lens.
fn good() -> Value {
    let one = calibration();
    let camera = |name: &str, x: f64| {
        json!({"name": name, "image_size": [1280, 720], "lens": one["result"], "views": 9,
            "cam_from_rig": {"rotation_wxyz": [1.0, 0.0, 0.0, 0.0], "translation_m": [x, 0.0, 0.0]},
            "alone_rms_px": 0.1})
    };
    let place = json!({"rotation_wxyz": [0.99, 0.1, 0.05, 0.0], "translation_m": [0.0, 0.1, 0.8]});
    let order = ["right.turn_x", "right.turn_y", "right.shift_x", "board.stretch"];
    let diagonal = |i: usize| (0..4).map(|j| if i == j { 1e-8 } else { 0.0 }).collect::<Vec<_>>();
    json!({
        "schema": "boresight.rig/1", "board": one["board"], "stretch": 1.0, "verdict": "good",
        "findings": [{"code": "x", "severity": "care", "message": "words", "action": "more"}],
        "cameras": [camera("left", 0.0), camera("right", -0.12)],
        "pairs": [{"of": ["left", "right"], "instants": 9, "second_from_first": place,
            "baseline_m": 0.12, "baseline_sd_m": 1e-4, "row_rms_px": 0.1, "row_sd_px": 0.02,
            "distance_sd": 0.001, "at_m": 0.8, "length_bound_m": 0.001,
            "covariance": (0..6).map(|_| vec![1e-9; 6]).collect::<Vec<_>>()}],
        "instants": [{"number": 1, "rig_from_board": place,
            "residual_px": {"left": 0.1, "right": 0.2}}],
        "covariance": {"order": order, "matrix": (0..4).map(diagonal).collect::<Vec<_>>()},
    })
}

#[test]
fn rigs() {
    let good = good();
    assert!(RigFile::read(&good).expect("a rig").known().is_some());
    run(
        "rig",
        |mutator| {
            let mut tree = good.clone();
            let times = 1 + mutator.below(5);
            mutator.json(&mut tree, times);
            tree.to_string().into_bytes()
        },
        |input| {
            let Ok(tree) = serde_json::from_slice(input) else { return Ok(false) };
            let Ok(rig) = RigFile::read(&tree) else { return Ok(false) };
            if let Some(known) = rig.known() {
                only_numbers(&known.rig)?;
            }
            for camera in &rig.cameras {
                let _ = camera.known_lens();
            }
            if let Some(exported) = ExportedRig::of(&rig) {
                for format in RigFormat::ALL {
                    let Ok(text) = format.write(&exported) else { continue };
                    let is_endless = |word: &str| matches!(word, "inf" | "-inf" | "NaN");
                    if text.split([' ', ',', '[', ']', '"']).any(is_endless) {
                        return Err(format!("{}: {text}", format.code()));
                    }
                }
            }
            let html = rig_page("rig.json", &rig, None, &Certificate::default());
            for no_number in ["NaN", ">inf", "\"inf", "-inf", " inf", "<script"] {
                if let Some(at) = html.find(no_number) {
                    let from = html[..at].char_indices().rev().nth(120).map_or(0, |(from, _)| from);
                    return Err(format!("in the page: {}{no_number}", &html[from..at]));
                }
            }
            let xml = html.trim_start_matches("<!DOCTYPE html>");
            roxmltree::Document::parse(xml).map_err(|err| format!("not well-formed: {err}"))?;
            Ok(true)
        },
    );
}
