//! Pictures rectified by another program: the effect of interpolation on the corners isn't a lens.

use boresight_calibrate::{CalibrationParams, LensFamily, calibrate};
use boresight_geometry::{Camera, Corner, Distortion, boards::Board, frame::ImageSize};
use boresight_testkit::error_px;
use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 960 };
/// Maximum displacement of an edge by interpolation between pixels, by distance from a whole pixel:
/// about that of OpenCV's `remap` for edges of 0.7 px, linear and cubic.
const LINEAR_PX: f64 = 0.008;
const CUBIC_PX: f64 = -0.024;
/// Radius of the pixels used for a corner.
const WINDOW_PX: i32 = 4;

fn pinhole() -> Camera {
    Camera::pinhole(900.0, Point2::new(652.0, 471.0))
}

/// Displacement by interpolation of a corner at `px` in the rectified picture.
fn moved_px(px: &Point2<f64>, largest_px: f64) -> Vector2<f64> {
    let distortion =
        Distortion { k1: -0.22, k2: 0.08, p1: 6e-4, p2: -4e-4, ..Distortion::default() };
    let original = Camera { distortion, ..pinhole() };
    let window = || -WINDOW_PX..=WINDOW_PX;
    let moves = window().flat_map(|dx| window().map(move |dy| (dx, dy))).map(|(dx, dy)| {
        let to = Point2::new(px.x.round() + f64::from(dx), px.y.round() + f64::from(dy));
        let ray = pinhole().ray_from_px(&to).expect("a pinhole has all rays");
        let from = original.project(&Point3::from(ray)).expect("in front of the camera");
        (from - to).map(|by| (std::f64::consts::TAU * by).sin())
    });
    moves.sum::<Vector2<f64>>() * (largest_px / f64::from((2 * WINDOW_PX + 1).pow(2)))
}

/// Views of a board tilted by 30° in all directions, in several places.
fn views(board: &Board, count: u32, noise_px: f64, largest_px: f64) -> Vec<Vec<Corner>> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let noise = Normal::new(0.0, noise_px).expect("positive");
    let view = |view: u32| {
        let (sin, cos) = (f64::from(view) * 2.4).sin_cos();
        let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(sin, cos, 0.0) * 0.52);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * (0.5 * sin));
        let aim_m = Vector3::new(0.03 * cos, 0.02 * (sin + cos), 0.235);
        let pose = Isometry3::from_parts(Translation3::from(aim_m), tilt * turn);
        let corner = |point_m: &Point2<f64>| {
            let px = pinhole().px_from_board(&pose, point_m).expect("in front of the camera");
            let error = Vector2::new(noise.sample(&mut rng), noise.sample(&mut rng));
            Corner::isotropic(px + moved_px(&px, largest_px) + error, noise_px)
        };
        board.corners_in_board_m().iter().map(corner).collect()
    };
    (0..count).map(view).collect()
}

#[test]
fn interpolation_of_rectified_pictures_isnt_taken_for_a_lens() {
    let board = Board::new(9, 6, 0.02).expect("valid");
    // More views reduce the independent errors, but not the shared ones.
    for (count, noise_px, largest_px) in
        [(10, 0.004, LINEAR_PX), (10, 0.004, CUBIC_PX), (40, 0.02, CUBIC_PX)]
    {
        let views = views(&board, count, noise_px, largest_px);
        let found = calibrate(&views, &board, SIZE, &CalibrationParams::default()).expect("fits");
        let off_px = error_px(&found.camera, &pinhole(), SIZE);
        let bound_px = found.picture_bound_px().expect("every pixel has a ray");
        let model = found.model.code();
        println!(
            "{count} views, {largest_px} px: {model}, off {off_px:.3}, bound {bound_px:.3} px"
        );
        assert_eq!(found.model.family(), LensFamily::Brown, "{model}");
        assert!(off_px <= bound_px, "{off_px} px, stated {bound_px} px");
    }
}
