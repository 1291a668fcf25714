//! The simulated camera's pictures agree with the truth.

use std::{sync::Arc, time::Duration};

use boresight_capture::{Arrival, FrameSource};
use boresight_geometry::frame::{CaptureTime, Frame, FrameId};
use boresight_sim::{
    Cues, Light, NoCues, Renderer, Scene, SyntheticSource, render_view,
    technician::{Cue, CueKind, Person, Technician},
};
use image::GrayImage;
use nalgebra::{Isometry3, Point2, Point3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// A frontal view turns about the camera's axes.
pub(crate) fn pose(turn_deg: [f64; 3], at_m: [f64; 3]) -> Isometry3<f64> {
    Isometry3::new(Vector3::from(at_m), Vector3::from(turn_deg).map(f64::to_radians))
}

fn tilted() -> Isometry3<f64> {
    pose([25.0, -30.0, 8.0], [0.01, -0.015, 0.36])
}

fn quiet(scene: Scene) -> Scene {
    Scene { noise_sigma: 0.0, ..scene }
}

pub(crate) fn corners_px(scene: &Scene, cam_from_board: &Isometry3<f64>) -> Vec<Point2<f64>> {
    let seen = |m: &Point2<f64>| scene.camera.px_from_board(cam_from_board, m);
    scene.board.corners_in_board_m().iter().map(|m| seen(m).expect("in front")).collect()
}

/// True grey level at a pixel, by brute force: rays spread over pixel and blur, traced
/// individually. `None` if a ray misses the squares.
fn traced(
    scene: &Scene,
    poses: &[Isometry3<f64>],
    px: &Point2<f64>,
    spread: &[Vector2<f64>],
) -> Option<f64> {
    let board = &scene.board;
    let mut sum = 0.0;
    for (i, offset) in spread.iter().enumerate() {
        let board_from_cam = poses[i % poses.len()].inverse();
        let ray = scene.camera.normalized_from_px(&(px + offset))?;
        let (eye, along) =
            (board_from_cam * Point3::origin(), board_from_cam * Vector3::new(ray.x, ray.y, 1.0));
        let hit = eye - along * (eye.z / along.z);
        let square = |m: f64, corners: usize| m / board.square_m() + (corners as f64 + 1.0) / 2.0;
        let (u, v) = (square(hit.x, board.columns()), square(hit.y, board.rows()));
        if !(0.0..board.columns() as f64 + 1.0).contains(&u)
            || !(0.0..board.rows() as f64 + 1.0).contains(&v)
        {
            return None;
        }
        let dark = (u.floor() + v.floor()) as i64 % 2 == 0;
        sum += if dark { scene.light.dark_level } else { scene.light.light_level };
    }
    Some(sum / spread.len() as f64 * scene.light.gain(px, scene.image_size))
}

fn spread(scene: &Scene, count: usize) -> Vec<Vector2<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    // Each point with its opposite, to centre the spread itself.
    (0..count / 2)
        .flat_map(|_| {
            let offset = Vector2::from_fn(|_, _| {
                rng.random_range(-0.5..0.5)
                    + scene.psf_sigma_px * rng.sample::<f64, _>(StandardNormal)
            });
            [offset, -offset]
        })
        .collect()
}

/// Compares pixels around every corner with brute force.
fn check_against_tracing(scene: &Scene, poses: &[Isometry3<f64>], mean_limit: f64) {
    let mut picture = GrayImage::new(1, 1);
    Renderer::new(scene).render(poses, 0, &mut picture);
    check_picture(scene, &picture, poses, mean_limit);
}

/// Compares pixels of `picture` around every corner with rays traced through `poses`.
fn check_picture(scene: &Scene, picture: &GrayImage, poses: &[Isometry3<f64>], mean_limit: f64) {
    let spread = spread(scene, 12_000);
    let (mut sum, mut bias, mut count) = (0.0, 0.0, 0.0);
    for corner in corners_px(scene, &poses[poses.len() / 2]) {
        for (dx, dy) in [(-3, -2), (-1, 0), (0, 0), (0, 1), (1, -1), (2, 1), (5, 0), (0, -6)] {
            let px =
                Point2::new(corner.x.round() + f64::from(dx), corner.y.round() + f64::from(dy));
            let inside = px.x >= 0.0 && px.y >= 0.0 && px.x < 1280.0 && px.y < 720.0;
            let Some(truth) = inside.then(|| traced(scene, poses, &px, &spread)).flatten() else {
                continue;
            };
            let shown = f64::from(picture.get_pixel(px.x as u32, px.y as u32)[0]);
            sum += (shown - truth).abs();
            bias += shown - truth;
            count += 1.0;
        }
    }
    assert!(count > 200.0, "{count} pixels");
    println!("mean |difference| {:.3}, mean difference {:.3}", sum / count, bias / count);
    assert!(sum / count < mean_limit, "mean |difference| {}", sum / count);
    assert!((bias / count).abs() < 0.3, "mean difference {}", bias / count);
}

#[test]
fn pictures_agree_with_rays_traced_one_by_one() {
    let still = [tilted()];
    // Grey levels of 164; rounding alone costs 0.25, the random rays of the comparison about 0.4.
    check_against_tracing(&quiet(Scene::default_720p(1)), &still, 1.5);
    check_against_tracing(
        &Scene { psf_sigma_px: 0.5, ..quiet(Scene::default_720p(1)) },
        &still,
        // The sharper the lens, the more the renderer's finite samples cost.
        2.0,
    );
    check_against_tracing(&Scene { psf_sigma_px: 1.0, ..quiet(Scene::random(3)) }, &still, 1.5);
}

#[test]
fn movement_smears() {
    let poses: Vec<_> = (0..8)
        .map(|i| pose([20.0, 15.0, 5.0], [0.002 * (f64::from(i) - 3.5) / 8.0, 0.0, 0.4]))
        .collect();
    check_against_tracing(&quiet(Scene::default_720p(1)), &poses, 2.0);
}

/// 20 ms of a held board, and of a moving board, in eight poses as drawn and in 64.
#[test]
fn smear_of_a_long_exposure_is_that_of_the_hands_movement() {
    for (person, seen_at_secs, mean_limit) in
        [(Person::Usual, 6.0, 1.5), (Person::Shaky, 6.0, 1.5), (Person::Usual, 1.4, 3.0)]
    {
        let scene = Scene { technician: person.params(), ..quiet(Scene::default_720p(3)) };
        let mut technician = Technician::new(&scene);
        technician.read(show(&scene, &tilted(), 1, 0.5));
        let during = |count: u32| -> Vec<Isometry3<f64>> {
            let mut held = technician.clone();
            (0..count)
                .map(|i| (f64::from(i) + 0.5) / f64::from(count) - 0.5)
                .map(|share| held.pose_at(secs(seen_at_secs + 0.02 * share)))
                .collect()
        };
        let (drawn, true_poses) = (during(8), during(64));
        let smear_px = corners_px(&scene, &true_poses[0])
            .iter()
            .zip(corners_px(&scene, &true_poses[63]))
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max);
        println!("{person:?} at {seen_at_secs} s: smear {smear_px:.2} px");
        let mut picture = GrayImage::new(1, 1);
        Renderer::new(&scene).render(&drawn, 0, &mut picture);
        check_picture(&scene, &picture, &true_poses, mean_limit);
    }
}

#[test]
fn square_outside_corner_zero_is_dark() {
    let scene = quiet(Scene::default_720p(2));
    let (view, away) = (pose([0.0; 3], [0.0, 0.0, 0.5]), 0.3 * scene.board.square_m());
    let picture = render_view(&scene, &view);
    let corner = scene.board.corners_in_board_m()[0];
    let level = |x: f64, y: f64| {
        let at = view * Point3::new(corner.x + x * away, corner.y + y * away, 0.0);
        let px = scene.camera.project(&at).expect("in front");
        f64::from(picture.get_pixel(px.x.round() as u32, px.y.round() as u32)[0])
    };
    let middle = (scene.light.dark_level + scene.light.light_level) / 2.0;
    assert!(level(-1.0, -1.0) < middle && level(1.0, 1.0) < middle);
    assert!(level(1.0, -1.0) > middle && level(-1.0, 1.0) > middle);
}

/// Offset of an upright edge to the right of pixel `px`, from the light on the row: exact for any
/// symmetric blur.
pub(crate) fn edge_px(scene: &Scene, picture: &GrayImage, px: &Point2<f64>) -> f64 {
    let share = |dx: i32| {
        let level = picture.get_pixel((px.x as i32 + dx) as u32, px.y as u32)[0];
        (f64::from(level) - scene.light.dark_level)
            / (scene.light.light_level - scene.light.dark_level)
    };
    let light: f64 = (-6..=6).map(share).sum();
    if share(6) > 0.5 { 6.5 - light } else { light - 6.5 }
}

#[test]
fn edges_are_where_the_lens_puts_them() {
    // A pinhole and even light: the light on a row tells the position of its edge in any
    // orientation.
    let mut scene = quiet(Scene::default_720p(1));
    scene.camera.distortion = Default::default();
    scene.light = Light { gradient: 0.0, vignette: 0.0, ..scene.light };
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
    for turn_deg in [0.0, 0.3, 3.0, -7.0, 20.0] {
        let view = pose([0.0, 0.0, turn_deg], [0.0013, -0.0021, 0.37]);
        let picture = render_view(&scene, &view);
        for corner in scene.board.corners_in_board_m() {
            // Half a square below a corner runs a straight edge.
            let on_edge = |y: f64| {
                let at = view * Point3::new(corner.x, corner.y + y, 0.0);
                scene.camera.project(&at).expect("in front")
            };
            let (px, end) = (on_edge(0.4 * 0.025), on_edge(0.6 * 0.025));
            let start = Point2::new(px.x.round(), px.y.round());
            let slope = (end.x - px.x) / (end.y - px.y);
            let truth = px.x + slope * (start.y - px.y) - start.x;
            let off = edge_px(&scene, &picture, &start) - truth;
            sum += off;
            squares += off * off;
            count += 1.0;
        }
    }
    let (mean, rms) = (sum / count, f64::sqrt(squares / count));
    println!("edge offset: mean {mean:.4} px, rms {rms:.4} px over {count}");
    assert!(mean.abs() < 0.002 && rms < 0.015, "mean {mean}, rms {rms}");
}

#[test]
fn noise_has_its_strength_and_its_index() {
    let scene = Scene { noise_sigma: 3.0, clutter: 0.0, ..Scene::default_720p(4) };
    let mut renderer = Renderer::new(&scene);
    let mut frame = |index: u64| {
        let mut picture = GrayImage::new(1, 1);
        renderer.render(&[tilted()], index, &mut picture);
        picture
    };
    let (a, b, again) = (frame(1), frame(2), frame(1));
    assert!(a == again && a != b);
    let squares: f64 =
        a.iter().zip(b.iter()).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    let sigma = (squares / (2.0 * a.len() as f64)).sqrt();
    assert!((sigma - 3.0).abs() < 0.1, "{sigma}");
}

#[test]
fn a_board_out_of_view_or_behind_leaves_the_room() {
    let scene = quiet(Scene::default_720p(1));
    let room = render_view(&scene, &pose([0.0; 3], [0.0, 9.0, 0.5]));
    for hidden in [
        pose([180.0, 0.0, 0.0], [0.0, 0.0, 0.5]),
        pose([0.0; 3], [0.0, 0.0, -0.5]),
        pose([0.0, 90.0, 0.0], [0.0, 0.0, 0.5]),
    ] {
        assert_eq!(render_view(&scene, &hidden), room);
    }
    assert_ne!(render_view(&scene, &tilted()), room);
}

#[test]
fn every_random_scene_shows_its_whole_picture() {
    for seed in 0..200 {
        let scene = Scene::random(seed);
        for (x, y) in [(0.0, 0.0), (1279.0, 0.0), (0.0, 719.0), (1279.0, 719.0)] {
            assert!(scene.camera.normalized_from_px(&Point2::new(x, y)).is_some(), "seed {seed}");
        }
        let off = scene.camera.pp_px - scene.image_size.centre_px();
        assert!(off.norm() <= 60.0 && (800.0..1400.0).contains(&scene.camera.f_px.x));
    }
    assert_ne!(Scene::random(1).camera, Scene::random(2).camera);
}

pub(crate) fn secs(secs: f64) -> CaptureTime {
    CaptureTime { nanos: (secs * 1e9) as u64 }
}

pub(crate) fn show(scene: &Scene, wanted: &Isometry3<f64>, target: u64, at_secs: f64) -> Cue {
    let kind = CueKind::Show { ghost_px: corners_px(scene, wanted), target };
    Cue { seen_at: secs(at_secs), kind }
}

pub(crate) fn wanted_poses() -> Vec<Isometry3<f64>> {
    let mut poses: Vec<_> = (0..8)
        .map(|slot| {
            let (sin, cos) = (f64::from(slot) * 45.0_f64).to_radians().sin_cos();
            pose([40.0 * cos, 40.0 * sin, 0.0], [0.03 * sin, 0.02 * cos, 0.4])
        })
        .collect();
    poses.push(pose([0.0, 35.0, 90.0], [0.0, 0.0, 0.45]));
    poses
}

/// Sends each cue once the frame before has been judged; judges only on every second call if
/// `slow`.
struct Script {
    cues: Vec<Cue>,
    slow: bool,
    asked: u64,
    judged: Option<FrameId>,
}

impl Cues for Script {
    fn wait_judged(&mut self, published: Option<FrameId>, _patience: Duration) -> bool {
        self.asked += 1;
        self.judged = published;
        !self.slow || self.asked.is_multiple_of(2)
    }

    fn next_cue(&mut self) -> Option<Cue> {
        let seen = self.judged.map_or(0, |id| (id.0 + 1) * 1_000_000_000 / 30);
        (self.cues.first()?.seen_at.nanos <= seen).then(|| self.cues.remove(0))
    }
}

/// Checksums of the pictures, the truth, and the frames if kept.
struct Played {
    sums: Vec<u32>,
    poses: Vec<(FrameId, Isometry3<f64>)>,
    kept: Vec<Arc<Frame>>,
}

fn played(slow: bool, keep: bool) -> Played {
    let scene = Scene { technician: Person::Tripod.params(), ..Scene::default_720p(21) };
    let cues = vec![show(&scene, &wanted_poses()[1], 1, 0.1)];
    let script = Script { cues, slow, asked: 0, judged: None };
    let mut source = SyntheticSource::new(scene, Box::new(script), Some(25), 3);
    let truth = source.truth();
    let (mut sums, mut kept) = (Vec::new(), Vec::new());
    loop {
        match source.next_frame(Duration::from_millis(1)).expect("never breaks") {
            Arrival::Frame(frame) => {
                sums.push(crc32fast::hash(&frame.image));
                if keep {
                    kept.push(frame);
                }
            }
            Arrival::NothingYet => assert!(slow),
            Arrival::Event(event) => unreachable!("{event:?}"),
            Arrival::End => break,
        }
    }
    Played { sums, poses: truth.snapshot().poses, kept }
}

#[test]
fn frames_do_not_depend_on_how_quickly_they_are_judged_or_let_go() {
    let Played { sums, poses, .. } = played(false, false);
    assert_eq!(sums.len(), 25);
    assert_eq!(poses.len(), 25);
    let Played { sums: slow_sums, poses: slow_poses, kept } = played(true, true);
    assert_eq!(sums, slow_sums);
    assert_eq!(poses, slow_poses);
    // Held frames are not overwritten.
    let kept_sums: Vec<u32> = kept.iter().map(|frame| crc32fast::hash(&frame.image)).collect();
    assert_eq!(kept_sums, sums);
    let ids: Vec<u64> = kept.iter().map(|frame| frame.id.0).collect();
    assert_eq!(ids, (0..25).collect::<Vec<u64>>());
    assert!(kept.windows(2).all(|pair| pair[0].captured_at < pair[1].captured_at));
    // The board has started to move by the end: 0.1 s + 0.4 s is frame 15.
    let way = |a: usize, b: usize| {
        (poses[a].1.translation.vector - poses[b].1.translation.vector).norm()
            + poses[a].1.rotation.angle_to(&poses[b].1.rotation)
    };
    assert!(way(0, 12) < 0.003 && way(12, 24) > 0.02, "{} {}", way(0, 12), way(12, 24));
}

#[test]
fn without_guidance_the_board_is_held_up_in_view() {
    for (seed, person) in (0..20).zip(Person::ALL.into_iter().cycle()) {
        let scene = Scene { technician: person.params(), ..Scene::random(seed) };
        let start = Technician::new(&scene).pose_at(secs(0.0));
        let corners = corners_px(&scene, &start);
        let inside = |px: &Point2<f64>| px.x > 20.0 && px.x < 1260.0 && px.y > 20.0 && px.y < 700.0;
        assert!(corners.iter().all(inside), "seed {seed}");
    }
    let mut source = SyntheticSource::new(Scene::default_720p(1), Box::new(NoCues), Some(0), 2);
    assert!(matches!(source.next_frame(Duration::ZERO), Ok(Arrival::End)));
    assert_eq!(source.identity().name, "sim:webcam");
}
