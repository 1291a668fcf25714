//! A step is a step, and no creep.

use boresight_geometry::{Camera, frame::ImageSize};
use boresight_watch::{Answer, Finding, Input, Lens, Picture, State, Watch};
use nalgebra::Point2;

#[test]
fn a_push_and_its_way_back_are_no_creep() {
    let image_size = ImageSize { width_px: 640, height_px: 480 };
    let lens = Lens::new(Camera::pinhole(417.0, Point2::new(320.0, 240.0)), None, image_size);
    let mut watch = Watch::new(&lens);
    let mut moved = 0;
    for hour in 0..24 * 40 {
        let day = f64::from(hour) / 24.0;
        // Pushed for five days, and then for good.
        let pushed_px = if (18.0..23.0).contains(&day) || day > 36.0 { 2.5 } else { 0.0 };
        let chance_px = 0.1 * (f64::from((hour * 7919) % 97) / 97.0 - 0.5);
        let answer = Answer {
            turn: [1e6 * (pushed_px + chance_px) / lens.camera.f_px.x, 0.0, 0.0, 0.0],
            cov: [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.01, 0.0, 0.01],
            patches: [180, 140],
            sharp: None,
            contrast: None,
            cells: None,
            shake: None,
            causes: None,
        };
        let picture = Picture { at: 3600.0 * f64::from(hour), answer: Some(answer), none: None };
        let decision = watch.handle(&Input::Picture(Box::new(picture)));
        moved += u32::from(matches!(decision.state, State::Moved(_)));
        let creeps = decision.findings.iter().any(|f| matches!(f, Finding::Creeps { .. }));
        assert!(!creeps, "day {day:.1}: {decision:?}");
    }
    assert!(moved > 24 * 7, "{moved} hours");
}
