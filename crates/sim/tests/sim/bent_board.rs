//! A simulated bent board is drawn at bent corners.

use boresight_detect::{DetectorParams, detect};
use boresight_geometry::boards::Board;
use boresight_sim::{Scene, render_view};

use crate::simulation::{corners_px, pose};

#[test]
fn corners_of_a_bent_board_are_found_where_it_is_bent_to() {
    let upright = Board::new(6, 9, 0.025).expect("valid");
    for (bend_m, board, turn_deg) in [
        (0.001, Scene::default_720p(1).board, [25.0, -30.0, 8.0]),
        (-0.001, Scene::default_720p(1).board, [0.0, 40.0, 0.0]),
        (0.001, upright, [-35.0, 10.0, 90.0]),
        (0.0, upright, [-35.0, 10.0, 90.0]),
    ] {
        let scene =
            Scene { bend_m, board, clutter: 0.0, noise_sigma: 0.5, ..Scene::default_720p(7) };
        let view = pose(turn_deg, [0.01, -0.015, 0.4]);
        let found = detect(&render_view(&scene, &view), &board, DetectorParams::default())
            .expect("a large board");
        let bent = scene.corners_as_bent_m();
        let flat_px = corners_px(&scene, &view);
        let (mut off, mut bend_px) = (0.0_f64, 0.0_f64);
        for ((corner, at), flat_px) in found.corners.iter().zip(&bent).zip(&flat_px) {
            let bent_px = scene.camera.project(&(view * at)).expect("in front");
            off += (corner.px - bent_px).norm_squared() / (2.0 * bent.len() as f64);
            bend_px = bend_px.max((bent_px - flat_px).norm());
        }
        let rms_px = off.sqrt();
        println!("bent by {bend_m} m: {bend_px:.2} px at most, corners {rms_px:.4} px off");
        assert!(rms_px < 0.02, "{rms_px} px");
        assert_eq!(bend_m != 0.0, bend_px > 0.3, "{bend_px} px");
        // The corners at the ends of the longer side stay in place.
        assert!(bent[0].z.abs() < 1e-9 && bent[bent.len() - 1].z.abs() < 1e-9);
    }
}
