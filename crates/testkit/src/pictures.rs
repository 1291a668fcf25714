//! Rendered views of a board, with the truth.

use boresight_geometry::{Camera, frame::ImageSize};
use boresight_sim::{Scene, render_view};
use image::GrayImage;
use nalgebra::{Isometry3, Point2, Vector3};

/// Three opposed pairs: tilt and slot in degrees.
pub const PAIRS: [(f64, f64); 6] =
    [(40.0, 0.0), (40.0, 180.0), (40.0, 90.0), (40.0, 270.0), (40.0, 45.0), (40.0, 225.0)];

/// A VGA camera of 560 px focal length with principal point at (322, 236), and a board of 9×6.
pub fn scene() -> Scene {
    Scene {
        image_size: ImageSize { width_px: 640, height_px: 480 },
        camera: Camera::pinhole(560.0, Point2::new(322.0, 236.0)),
        clutter: 0.2,
        ..Scene::default_720p(5)
    }
}

/// A view tipped by `tilt_deg`, receding towards `slot_deg`.
pub fn picture(tilt_deg: f64, slot_deg: f64) -> GrayImage {
    picture_at(0.34, tilt_deg, slot_deg)
}

/// A view at a distance in metres.
pub fn picture_at(distance_m: f64, tilt_deg: f64, slot_deg: f64) -> GrayImage {
    let (sin, cos) = slot_deg.to_radians().sin_cos();
    let turn = Vector3::new(sin, -cos, 0.0) * tilt_deg.to_radians();
    render_view(&scene(), &Isometry3::new(Vector3::new(0.002, -0.001, distance_m), turn))
}
