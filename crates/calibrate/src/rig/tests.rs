//! Rigs with known truth: two or three cameras that look at one board.

use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};

use super::*;
use crate::DriftVerdict;
use boresight_geometry::{Camera, Distortion, Rig};

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };
const NOISE_PX: f64 = 0.05;

/// Truth of a rig, and how its pictures are taken.
struct World {
    rig: Rig,
    board: Board,
    /// Turn of the last camera about its y axis from instant 8 on, in radians.
    turned_rad: f64,
    /// Shift of the board between the cameras' pictures of instant 5, in metres.
    late_m: f64,
    /// Standard deviation of the board's displacement between the cameras' pictures, in metres.
    displaced_m: f64,
}

impl World {
    fn of(cameras: usize, board: Board) -> Self {
        let lens = |f_px: f64| Camera {
            distortion: Distortion { k1: -0.08, ..Distortion::default() },
            ..Camera::pinhole(f_px, Point2::new(645.0, 352.0))
        };
        let place = |camera: usize| {
            let at = camera as f64;
            Isometry3::new(Vector3::new(-0.12 * at, 0.004 * at, 0.0), Vector3::y() * (-0.08 * at))
        };
        let rig = Rig {
            cameras: (0..cameras).map(|camera| lens(900.0 + 20.0 * camera as f64)).collect(),
            cam_from_rig: (0..cameras).map(place).collect(),
        };
        Self { rig, board, turned_rad: 0.0, late_m: 0.0, displaced_m: 0.0 }
    }

    /// Pictures of `instants` instants, seen by every camera; numbered from 1.
    fn pictures(&self, instants: usize, seed: u64) -> Vec<RigViews> {
        let mut state = seed;
        // Uniform in (0, 1), by a linear congruential generator (Knuth's MMIX).
        let mut uniform = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        let mut normal = move || {
            let (a, b) = (uniform(), uniform());
            (-2.0 * a.ln()).sqrt() * (core::f64::consts::TAU * b).cos()
        };
        let last = self.rig.cameras.len() - 1;
        let of_camera = |camera: usize, normal: &mut dyn FnMut() -> f64| {
            let views = (0..instants).map(|instant| {
                let mut place = self.place(instant);
                if instant == 5 && camera == last {
                    place.translation.vector.x += self.late_m;
                }
                if camera == last && self.displaced_m > 0.0 {
                    let by = Vector3::new(normal(), normal(), normal());
                    place.translation.vector += by * self.displaced_m;
                }
                let mut cam_from_rig = self.rig.cam_from_rig[camera];
                if instant >= 8 && camera == last {
                    let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * self.turned_rad);
                    cam_from_rig = Isometry3::from_parts(
                        cam_from_rig.translation,
                        turn * cam_from_rig.rotation,
                    );
                }
                let corner = |point: &Point2<f64>| {
                    let px = self.rig.cameras[camera].px_from_board(&(cam_from_rig * place), point);
                    let noise = Vector2::new(normal(), normal()) * NOISE_PX;
                    Corner::isotropic(px.expect("in front") + noise, NOISE_PX)
                };
                let corners = self.board.corners_in_board_m().iter().map(corner).collect();
                (instant as u64 + 1, corners)
            });
            RigViews { image_size: SIZE, views: views.collect(), known_lens: None }
        };
        (0..=last).map(|camera| of_camera(camera, &mut normal)).collect()
    }

    /// Place of the board: tilted towards eight directions, turned in the picture.
    fn place(&self, instant: usize) -> Isometry3<f64> {
        let (sin, cos) = (0.785 * instant as f64).sin_cos();
        let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(sin, -cos, 0.0) * 0.6);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * (0.5 * instant as f64));
        let near = 0.45 + 0.05 * (instant % 3) as f64;
        let at = Vector3::new(0.06 + 0.05 * cos, 0.04 * sin, near);
        Isometry3::from_parts(at.into(), tilt * turn)
    }

    fn calibrated(&self, instants: usize, seed: u64) -> Result<RigCalibration, NotARig> {
        let params = CalibrationParams::default();
        calibrate_rig(&self.pictures(instants, seed), &self.board, &params)
    }
}

fn board(columns: u16, rows: u16) -> Board {
    Board::new(columns, rows, 0.025).expect("a board")
}

/// Root mean square of the errors of baseline and rows over what is stated, in twenty recordings.
fn errors_over_stated(world: &World) -> [f64; 2] {
    let truth_m = world.rig.baseline_m(0, 1);
    let (mut squares, mut rows) = (0.0, 0.0);
    for seed in 0..20 {
        let found = world.calibrated(12, seed).expect("a rig");
        assert_eq!((found.verdict, found.findings.as_slice()), (Verdict::Good, &[][..]));
        let sd = found.pairs[0].sd.expect("twelve instants");
        squares += ((found.rig.baseline_m(0, 1) - truth_m) / sd.baseline_m).powi(2);
        // The row error of true pictures of a point.
        let point = Point3::new(0.08, 0.03, 0.5);
        let px = [0, 1].map(|camera| {
            let in_cam = world.rig.cam_from_rig[camera] * point;
            world.rig.cameras[camera].project(&in_cam).expect("in front")
        });
        let off_px = found.rig.row_error_px([0, 1], px).expect("rows");
        rows += (off_px / sd.row_px.expect("rows")).powi(2);
    }
    [squares, rows].map(|sum| (sum / 20.0).sqrt())
}

#[test]
fn a_rig_is_as_stated_in_twenty_recordings() {
    let still = World::of(2, board(9, 6));
    let trembling = World { displaced_m: 3e-5, ..World::of(2, board(9, 6)) };
    for world in [still, trembling] {
        let [baseline_z, row_z] = errors_over_stated(&world);
        assert!(
            (0.4..1.4).contains(&baseline_z) && (0.3..1.4).contains(&row_z),
            "{} m: {baseline_z} {row_z}",
            world.displaced_m
        );
    }
}

#[test]
fn cameras_that_number_a_board_from_its_two_ends_agree() {
    let world = World::of(2, board(9, 7));
    let mut pictures = world.pictures(10, 3);
    for (number, corners) in &mut pictures[1].views {
        if *number % 3 == 0 {
            corners.reverse();
        }
    }
    let found = calibrate_rig(&pictures, &world.board, &CalibrationParams::default());
    let found = found.expect("a rig");
    assert_eq!(found.verdict, Verdict::Good);
    assert!((found.rig.baseline_m(0, 1) - world.rig.baseline_m(0, 1)).abs() < 5e-4);
}

#[test]
fn a_camera_that_moved_is_named_with_the_first_instant_after() {
    for (cameras, named) in [(2, None), (3, Some(2))] {
        let world = World { turned_rad: 2e-3, ..World::of(cameras, board(9, 6)) };
        let found = world.calibrated(16, 1).expect("a rig");
        assert_eq!(found.findings[0], RigFinding::Touched { camera: named, from: 9 });
        assert!(found.verdict == Verdict::Untrustworthy && !found.is_unfinished());
    }
}

#[test]
fn pictures_of_another_instant_tell_of_the_lenses_only() {
    let world = World { late_m: 4e-3, ..World::of(2, board(9, 6)) };
    let found = world.calibrated(12, 2).expect("a rig");
    assert_eq!(found.findings, [RigFinding::OtherInstant { camera: None, instant: 6 }]);
    assert_eq!((found.verdict, found.pairs[0].instants), (Verdict::Good, 11));
    let plain = World::of(2, board(9, 6)).calibrated(12, 2).expect("a rig");
    assert!((found.rig.baseline_m(0, 1) - plain.rig.baseline_m(0, 1)).abs() < 3e-4);
}

#[test]
fn pictures_of_other_moments_are_no_rig() {
    let world = World::of(2, board(9, 6));
    let mut pictures = world.pictures(12, 4);
    // Each picture of the second camera is of the next instant but three.
    let corners: Vec<_> = pictures[1].views.iter().map(|(_, corners)| corners.clone()).collect();
    for (place, (_, own)) in pictures[1].views.iter_mut().enumerate() {
        own.clone_from(&corners[(place + 4) % 12]);
    }
    let refused = calibrate_rig(&pictures, &world.board, &CalibrationParams::default());
    assert!(matches!(refused, Err(NotARig::NotPairs { of: [0, 1], .. })), "{refused:?}");
}

#[test]
fn the_error_of_a_distance_grows_with_its_square() {
    let world = World::of(2, board(9, 6));
    let found = world.calibrated(12, 3).expect("a rig");
    let sizes = [found.cameras[0].image_size, found.cameras[1].image_size];
    let covariance = found.covariance.clone().expect("enough instants");
    let known = KnownRig { rig: found.rig.clone(), covariance };
    let sd_m = |at_m: f64| Some(at_m * known.distance_sd([0, 1], sizes, at_m)?);
    let stated = found.pairs[0].sd.expect("an uncertainty");
    let there = sd_m(stated.at_m).expect("both see it") / (stated.at_m * stated.distance);
    assert!((0.3..1.5).contains(&there), "beside the boards' places: {there}");
    let [near, far] = [4.0, 8.0].map(|times| sd_m(times * stated.at_m).expect("both see it"));
    assert!((3.5..4.5).contains(&(far / near)), "{near} {far}");
    assert_eq!(sd_m(1e-3), None, "between the cameras");
}

#[test]
fn few_instants_state_no_uncertainty_and_none_is_no_rig() {
    let world = World::of(2, board(9, 6));
    let found = world.calibrated(7, 5).expect("a rig");
    assert_eq!(found.findings, [RigFinding::InstantsFew { instants: 7, wanted: 8 }]);
    assert!(found.is_unfinished() && found.covariance.is_none() && found.pairs[0].sd.is_none());
    let mut pictures = world.pictures(12, 5);
    pictures[0].views.truncate(6);
    pictures[1].views.drain(..6);
    let refused = calibrate_rig(&pictures, &world.board, &CalibrationParams::default());
    assert_eq!(refused.expect_err("no common instant").code(), "UNLINKED");
}

#[test]
fn one_common_place_starts_from_the_tilts_that_fit_best() {
    for seed in 1..=6 {
        let world = World::of(3, board(9, 6));
        let mut pictures = world.pictures(9, seed);
        for (camera, pictures) in (0..).zip(&mut pictures) {
            // Each camera shares one place with the next.
            pictures.views.retain(|(number, _)| (1 + 3 * camera..=4 + 3 * camera).contains(number));
        }
        let found = calibrate_rig(&pictures, &world.board, &CalibrationParams::default());
        let found = found.expect("a rig");
        assert_eq!(found.findings, [RigFinding::InstantsFew { instants: 2, wanted: 8 }]);
    }
}

#[test]
fn instants_left_out_count_for_no_uncertainty() {
    let world = World { late_m: 4e-3, ..World::of(2, board(9, 6)) };
    let found = world.calibrated(8, 5).expect("a rig");
    assert_eq!(found.pairs[0].instants, 7);
    assert!(found.findings.contains(&RigFinding::InstantsFew { instants: 7, wanted: 8 }));
    assert!(found.covariance.is_none() && found.pairs[0].sd.is_none());
}

#[test]
fn a_place_where_no_board_was_is_worth_more_than_one_where_it_was() {
    let world = World::of(2, board(9, 6));
    let found = world.calibrated(6, 5).expect("a rig");
    let worth = PlaceWorth::of(&found, &world.board).expect("six instants");
    let again = found.instants[0].rig_from_board;
    let flat = Isometry3::translation(0.06, 0.0, 0.45);
    let tipped = |x: f64| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.7, 0.0));
        Isometry3::from_parts(Vector3::new(x, -0.1, 0.6).into(), turn)
    };
    let [again, flat, new] = [again, flat, tipped(0.2)].map(|place| worth.gain(&place));
    assert!(0.0 < flat && flat < new && again < new, "{flat} {again} {new}");
    assert_eq!(worth.seen_by(&tipped(0.2)), [0, 1]);
    // Beside the picture, and from behind.
    let behind = Isometry3::new(Vector3::new(0.06, 0.0, 0.5), Vector3::y() * 3.1);
    assert_eq!([tipped(1.5), behind].map(|place| worth.gain(&place)), [0.0; 2]);
    // The gain is what the place brings.
    let seven = world.calibrated(7, 5).expect("a rig");
    let brought = PlaceWorth::of(&seven, &world.board).expect("seven instants");
    assert!(brought.gain(&tipped(0.2)) < new);
}

#[test]
fn cameras_in_a_chain_are_linked_and_the_chain_is_less_certain() {
    let world = World::of(3, board(9, 6));
    let mut pictures = world.pictures(20, 6);
    pictures[0].views.truncate(12);
    pictures[2].views.drain(..12);
    let found = calibrate_rig(&pictures, &world.board, &CalibrationParams::default());
    let found = found.expect("a rig");
    let [first, ends, second] = [0, 1, 2].map(|pair| found.pairs[pair]);
    assert_eq!([first.instants, ends.instants, second.instants], [12, 0, 8]);
    let sd = |pair: Pair| pair.sd.expect("enough instants").baseline_m;
    assert!(sd(ends) > sd(first), "{} {}", sd(ends), sd(first));
    let off_m = found.rig.baseline_m(0, 2) - world.rig.baseline_m(0, 2);
    assert!(off_m.abs() < 4.0 * sd(ends), "{off_m}");
}

#[test]
fn a_known_lens_needs_no_views_of_its_own() {
    let world = World::of(2, board(9, 6));
    let params = CalibrationParams::default();
    let own = world.pictures(20, 7);
    let mut pictures = world.pictures(4, 8);
    for (camera, own) in pictures.iter_mut().zip(own) {
        let views: Vec<_> = own.views.into_iter().map(|(_, corners)| corners).collect();
        let found = calibrate(&views, &world.board, SIZE, &params).expect("a lens");
        camera.known_lens = Some(KnownLens::new(&found.camera, &found.covariance_all));
    }
    let found = calibrate_rig(&pictures, &world.board, &params).expect("a rig");
    let sd = found.pairs[0].sd.expect("four instants do with known lenses");
    let off_m = found.rig.baseline_m(0, 1) - world.rig.baseline_m(0, 1);
    assert!(off_m.abs() < 3.0 * sd.baseline_m, "{off_m} {}", sd.baseline_m);
    pictures.iter_mut().for_each(|camera| camera.known_lens = None);
    let without = calibrate_rig(&pictures, &world.board, &params).expect("a rig");
    assert_eq!(without.findings[0].code(), "INSTANTS-FEW");
}

#[test]
fn a_camera_that_has_moved_since_is_told_from_those_that_have_not() {
    let world = World::of(3, board(9, 6));
    let params = CalibrationParams::default();
    let old = world.calibrated(16, 11).expect("a rig");
    let covariance = old.covariance.clone().expect("sixteen instants");
    let earlier = KnownRig { rig: old.rig.clone(), covariance };
    let since = |turned_rad: f64| {
        let mut later = World::of(3, board(9, 6));
        later.rig.cam_from_rig[2] =
            Isometry3::rotation(Vector3::x() * turned_rad) * later.rig.cam_from_rig[2];
        let mut pictures = later.pictures(6, 12);
        for (camera, (of, lens)) in
            pictures.iter_mut().zip(old.cameras.iter().zip(&old.rig.cameras))
        {
            let covariance = of.covariance.as_ref().expect("sixteen instants");
            camera.known_lens = Some(KnownLens::new(lens, covariance));
        }
        let new = calibrate_rig(&pictures, &world.board, &params).expect("a rig");
        let changes: Vec<PairChange> =
            new.pairs.iter().filter_map(|pair| pair_change(&new, &earlier, pair.of, 0.5)).collect();
        assert_eq!(changes.len(), 3);
        changes
    };
    let still = since(0.0);
    assert!(still.iter().all(|change| change.verdict == DriftVerdict::Ok), "{still:?}");
    assert_eq!(moved_camera(&still), None);
    // 2 mrad about the x axis are 1.9 px.
    let moved = since(2e-3);
    assert_eq!(moved_camera(&moved), Some(2));
    let [least, most] = moved[1].interval_px;
    assert!(
        least > 1.7 && most < 2.1 && (least..most).contains(&moved[1].displaced_px),
        "{moved:?}"
    );
}
