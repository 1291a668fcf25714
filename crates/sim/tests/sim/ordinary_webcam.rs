//! The default simulated camera is an ordinary webcam.

use boresight_detect::{DetectorParams, detect};
use boresight_sim::{Renderer, Scene};
use image::GrayImage;
use nalgebra::{Isometry3, Vector2};

use crate::simulation::pose;

/// Rms scatter per axis of the corners of a still board, from picture to picture, and mean stated
/// sd.
fn corner_noise_px(scene: &Scene, view: &Isometry3<f64>) -> Option<(f64, f64)> {
    let mut renderer = Renderer::new(scene);
    let mut seen: Vec<Vec<Vector2<f64>>> = Vec::new();
    let mut stated = 0.0;
    for index in 0..24 {
        let mut picture = GrayImage::new(1, 1);
        renderer.render(&[*view], index, &mut picture);
        let Ok(found) = detect(&picture, &scene.board, DetectorParams::default()) else { continue };
        stated = (found.corners.iter().map(|c| 0.5 * c.covariance_px2.trace()).sum::<f64>()
            / found.corners.len() as f64)
            .sqrt();
        seen.push(found.corners.iter().map(|corner| corner.px.coords).collect());
    }
    if seen.len() < 20 {
        return None;
    }
    let count = seen.len() as f64;
    let mut squares = 0.0;
    for corner in 0..scene.board.corner_count() {
        let mean = seen.iter().map(|corners| corners[corner]).sum::<Vector2<f64>>() / count;
        squares += seen.iter().map(|c| (c[corner] - mean).norm_squared()).sum::<f64>()
            / (2.0 * (count - 1.0));
    }
    Some(((squares / scene.board.corner_count() as f64).sqrt(), stated))
}

#[test]
fn corners_of_an_ordinary_webcam_scatter_by_a_tenth_of_a_pixel() {
    let scene = Scene::ordinary_webcam(1);
    let mut all = Vec::new();
    for (turn_deg, depth_m) in [(0.0, 0.35), (35.0, 0.4), (35.0, 0.6), (0.0, 0.8)] {
        let view = pose([0.0, turn_deg, 3.0], [0.0, 0.0, depth_m]);
        let (scatter_px, stated_px) = corner_noise_px(&scene, &view).expect("it is found");
        println!("{turn_deg}° at {depth_m} m: {scatter_px:.3} px, {stated_px:.3} px stated");
        assert!((0.06..0.15).contains(&scatter_px), "{scatter_px} px");
        all.push(scatter_px);
    }
    let mean_px = all.iter().sum::<f64>() / all.len() as f64;
    assert!((0.085..0.115).contains(&mean_px), "{mean_px} px");
}
