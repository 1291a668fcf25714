//! Steady state of the detector: grown buffers and no allocation.

use boresight_detect::{Detector, DetectorParams, Prediction, Search};
use boresight_sim::{Scene, render_view};
use nalgebra::{Isometry3, Vector3};

#[test]
fn looking_at_another_frame_allocates_the_result_only() {
    let scene = Scene { clutter: 1.0, ..Scene::random(3) };
    let board_at =
        |x_m: f64| Isometry3::new(Vector3::new(x_m, 0.0, 0.42), Vector3::new(0.5, 0.2, 0.0));
    let pictures = [0.0, 0.01].map(|x_m| render_view(&scene, &board_at(x_m)));
    let without = render_view(&scene, &board_at(9.0));
    let mut detector = Detector::new(DetectorParams::default());
    let corners = |detector: &mut Detector, picture| -> Vec<[f64; 2]> {
        let seen = detector.detect(picture, &scene.board).expect("found");
        seen.corners.iter().map(|corner| [corner.px.x, corner.px.y]).collect()
    };
    let corners_px = corners(&mut detector, &pictures[1]);
    let near = Prediction {
        seen: vec![true; corners_px.len()],
        corners_px,
        spread_squares: 0.25,
        everywhere: false,
    };
    for picture in pictures.iter().chain([&without]) {
        // Once to grow the buffers.
        let mut look = |near| {
            let search = Search { near, ..Search::FULL };
            let seen = detector.search(picture, &scene.board, search);
            usize::from(seen.is_ok())
        };
        for near in [None, Some(&near)] {
            look(near);
            let mut results = 0;
            let count = allocation_counter::measure(|| results = look(near)).count_total;
            assert!(count <= results as u64, "{count} allocations for {results} results");
        }
    }
}
