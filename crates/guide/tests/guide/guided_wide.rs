//! Guided sessions with a fisheye camera: they end, with true statements; the ghost bends as the
//! lens does.

use boresight_calibrate::{CalibrationParams, LensFamily, Verdict};
use boresight_geometry::{Camera, Distortion, LensKind, boards::Board};
use boresight_guide::guidance::Progress;
use boresight_present::ghost::Card;
use boresight_testkit::{
    error_px,
    world::{SIZE, World, guided_in},
};
use nalgebra::{Isometry3, Point2, Vector2, Vector3};

/// A fisheye lens with `field_deg` across the picture, the axis off the picture's middle.
fn fisheye(field_deg: f64, seed: u64) -> Camera {
    let half_rad = (field_deg / 2.0).to_radians();
    let (kind, k1, k2) = (LensKind::Fisheye, -0.02, 0.004);
    let height = half_rad * (1.0 + k1 * half_rad.powi(2) + k2 * half_rad.powi(4));
    let direction_rad = 0.7 * seed as f64;
    let off_px = Vector2::new(direction_rad.cos(), direction_rad.sin()) * 20.0;
    Camera {
        distortion: Distortion { kind, k1, k2, ..Distortion::default() },
        ..Camera::pinhole(0.5 * f64::from(SIZE.width_px) / height, SIZE.centre_px() + off_px)
    }
}

/// Runs `few` sessions by default, and checks that all end, with bounds holding as often as stated,
/// within chance.
fn sessions_end_with_the_truth_inside_their_bound(field_deg: f64, few: u32) {
    let sessions: u32 =
        std::env::var("BORESIGHT_SESSIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(few);
    let mut inside = 0;
    for seed in 1..=u64::from(sessions) {
        let mut world = World::new(seed);
        world.camera = fisheye(field_deg, seed);
        let (world, session, attempts) = guided_in(world, CalibrationParams::default(), |_, _| ());
        let calibration = session.calibration().expect("calibrated");
        let off_px = error_px(&calibration.camera, &world.camera, SIZE);
        let bound_px = calibration.picture_bound_px().expect("every pixel has a ray");
        println!(
            "{field_deg}° {seed}: {:?} {} {} after {} views, {attempts} attempts: off {off_px:.3} px, bound {bound_px:.3} px",
            session.progress(),
            calibration.verdict.code(),
            calibration.model.code(),
            session.accepted().len(),
        );
        assert_eq!(session.progress(), Progress::Complete, "seed {seed}");
        assert_ne!(calibration.verdict, Verdict::Untrustworthy, "seed {seed}");
        assert_eq!(calibration.model.family(), LensFamily::Fisheye, "seed {seed}");
        inside += u32::from(off_px <= bound_px);
    }
    println!("{field_deg}°: bound holds in {inside} of {sessions}");
    assert!(inside + 1 >= sessions, "{inside} of {sessions}");
}

#[test]
fn sessions_at_120_degrees_end_with_the_truth_inside_their_bound() {
    sessions_end_with_the_truth_inside_their_bound(120.0, 4);
}

/// Largest distance of the points in `side` from the straight line between the ends.
fn bend_px(side: &[Point2<f64>]) -> f64 {
    let (from, to) = (side[0], side[side.len() - 1]);
    let along = (to - from).normalize();
    side.iter().map(|px| along.perp(&(px - from)).abs()).fold(0.0, f64::max)
}

#[test]
fn the_ghost_bends_as_a_fisheye_lens_shows_it() {
    let board = Board::new(9, 6, 0.025).expect("valid");
    let pose = Isometry3::new(Vector3::new(0.02, 0.0, 0.16), Vector3::new(0.5, 0.2, 0.0));
    let bends = [fisheye(170.0, 1), Camera::pinhole(430.0, SIZE.centre_px())].map(|lens| {
        let ghost_px: Vec<_> = board
            .corners_in_board_m()
            .iter()
            .map(|point| lens.px_from_board(&pose, point).expect("in front"))
            .collect();
        let card = Card::new(&ghost_px, &board, &lens).expect("a board");
        let rim = card.rim().expect("in front");
        let side: Vec<_> = rim.iter().take(rim.len() / 4 + 1).map(|(px, _)| *px).collect();
        bend_px(&side)
    });
    println!("the far side bends by {:.1} px, through a pinhole by {:.1e} px", bends[0], bends[1]);
    assert!(bends[0] > 10.0 && bends[1] < 1e-3, "{bends:?}");
}
