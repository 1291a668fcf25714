//! The demonstration: a whole session without a camera, a board or a display.

use serde_json::Value;
use tempfile::TempDir;

use crate::person::{ended, program, says};

/// `BORESIGHT_SESSIONS=6` shows six people; one by default.
#[test]
fn a_session_is_shown_to_its_good_end_and_marked_as_simulated() {
    let people = std::env::var("BORESIGHT_SESSIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    for seed in 1..=people {
        let place = TempDir::new().expect("folder");
        let seed = seed.to_string();
        let arguments = ["demo", "--fast", "--seed", &seed, "--out", "shown", "--json"];
        let mut demo = program(place.path(), &arguments);
        for display in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            demo.env_remove(display);
        }
        let ended = ended(demo);
        says(
            &ended,
            0,
            &["SIMULATED camera", "Taken: view 1", "Good (SIMULATED)", "boresight target"],
        );
        let result: Value = serde_json::from_str(ended.stdout.trim()).expect("JSON");
        assert_eq!(
            (&result["verdict"], &result["source"]),
            (&"good".into(), &format!("sim:demo:{seed}").into())
        );
        // As of a decent webcam: neither perfect nor poor.
        let rms_px = result["result"]["rms_px"].as_f64().expect("a number");
        let views = result["views"].as_array().expect("views").len();
        println!("seed {seed}: {views} views, RMS {rms_px:.3} px");
        assert!((0.03..0.09).contains(&rms_px), "{rms_px} px");
        let page =
            std::fs::read_to_string(place.path().join("shown/report.html")).expect("written");
        assert!(page.contains("SIMULATED CAMERA"));
    }
}
