//! Pictures composed of two, and merely smeared pictures: only the former are called torn.

use boresight::{
    calibration::{CalibrationParams, FindingCode, calibrate},
    detection::{Detector, DetectorParams},
    geometry::Corner,
    simulation::{Renderer, Scene as Rendered},
};
use image::GrayImage;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::trust::{SIZE, Scene, board};

/// Number of rendered sessions, sessions with smeared views, and the number in each.
const SESSIONS: u64 = 5;
const SMEARED_SESSIONS: u64 = 2;
const SMEARED: usize = 40;
/// Poses within an exposure.
const STEPS: i32 = 9;

/// The camera of `scene` in pictures.
struct Pictures {
    renderer: Renderer,
    detector: Detector,
    picture: GrayImage,
    taken: u64,
}

impl Pictures {
    fn of(scene: &Scene, seed: u64) -> Self {
        let rendered =
            Rendered { camera: scene.camera, clutter: 0.0, ..Rendered::default_720p(seed) };
        Self {
            renderer: Renderer::new(&rendered),
            detector: Detector::new(DetectorParams::default()),
            picture: GrayImage::new(SIZE.width_px, SIZE.height_px),
            taken: 0,
        }
    }

    /// Corners of the board moving through `poses` during the exposure; `None` if not found.
    fn corners(&mut self, poses: &[Isometry3<f64>]) -> Option<Vec<Corner>> {
        self.taken += 1;
        self.renderer.render(poses, self.taken, &mut self.picture);
        Some(self.detector.detect(&self.picture, &board()).ok()?.corners)
    }
}

/// Motion of a hand through an exposure by `metres` and `radians`, faster at the end than at the
/// beginning.
fn smear(
    scene: &mut Scene,
    pose: &Isometry3<f64>,
    metres: f64,
    radians: f64,
) -> Vec<Isometry3<f64>> {
    let mut draw = |size: f64| Vector3::from_fn(|_, _| scene.normal(size));
    let (along, turn) = (draw(metres), draw(radians));
    let (bend, twist) = (draw(metres), draw(radians));
    (0..STEPS)
        .map(|step| {
            let time = f64::from(step) / f64::from(STEPS - 1) - 0.5;
            let square = time * time - 1.0 / 12.0;
            Isometry3::from_parts(
                Translation3::from(pose.translation.vector + along * time + bend * square),
                UnitQuaternion::from_scaled_axis(turn * time + twist * square) * pose.rotation,
            )
        })
        .collect()
}

/// Eight poses, and the corners in pictures of the board held still in each.
fn held_still(scene: &mut Scene, seed: u64) -> (Vec<Isometry3<f64>>, Pictures, Vec<Vec<Corner>>) {
    let plan = scene.plan(8);
    let poses = scene.poses(&plan);
    let mut pictures = Pictures::of(scene, seed);
    let corners = |pose: &Isometry3<f64>| pictures.corners(&[*pose]).expect("the board is seen");
    let sharp = poses.iter().map(corners).collect();
    (poses, pictures, sharp)
}

#[test]
fn a_smeared_view_is_not_called_torn() {
    let (mut smeared, mut torn) = (0, 0);
    for seed in 0..SMEARED_SESSIONS {
        let mut scene = Scene::ordinary(7000 + seed);
        let (poses, mut pictures, sharp) = held_still(&mut scene, seed);
        for attempt in 0..SMEARED {
            let view = attempt % poses.len();
            let size = 0.2 + 0.8 * (attempt / poses.len()) as f64 / 4.0;
            let way = smear(&mut scene, &poses[view], 3e-3 * size, 0.02 * size);
            let Some(corners) = pictures.corners(&way) else { continue };
            let mut views = sharp.clone();
            views[view] = corners;
            let result = calibrate(&views, &board(), SIZE, &CalibrationParams::default());
            let findings = result.expect("calibrates").findings;
            smeared += 1;
            for finding in findings {
                if let FindingCode::ViewTorn { view: named, shift_px, .. } = finding.code {
                    println!("#{seed}.{attempt}: view {named} of {view} torn by {shift_px:.2} px");
                    torn += 1;
                }
            }
        }
    }
    println!("{torn} of {smeared} smeared views called torn");
    assert!(smeared >= 72, "{smeared}");
    assert_eq!(torn, 0);
}

/// Two moments of a still hand, one above the other, with the same pictures and detector.
#[test]
fn a_torn_picture_is_called_torn() {
    let (mut all, mut named) = (0, 0);
    for seed in 0..SESSIONS {
        let mut scene = Scene::ordinary(7100 + seed);
        let (poses, mut pictures, sharp) = held_still(&mut scene, seed);
        for view in 0..poses.len() {
            let later = *smear(&mut scene, &poses[view], 6e-4, 1e-3).last().expect("steps");
            pictures.corners(&[later]);
            let lower = pictures.picture.clone();
            pictures.corners(&[poses[view]]);
            let (ys, half) = (sharp[view].iter().map(|c| c.px.y), SIZE.height_px / 2);
            let middle = 0.5 * (ys.clone().fold(f64::MAX, f64::min) + ys.fold(0.0, f64::max));
            let row = if view % 2 == 0 { middle as u32 } else { half };
            for y in row..SIZE.height_px {
                for x in 0..SIZE.width_px {
                    pictures.picture.put_pixel(x, y, *lower.get_pixel(x, y));
                }
            }
            let found = pictures.detector.detect(&pictures.picture, &board());
            let Ok(found) = found else { continue };
            let mut views = sharp.clone();
            views[view] = found.corners;
            let result = calibrate(&views, &board(), SIZE, &CalibrationParams::default());
            let findings = result.expect("calibrates").findings;
            let mut torn = findings.iter().filter_map(|finding| match finding.code {
                FindingCode::ViewTorn { view, .. } => Some(view),
                _ => None,
            });
            all += 1;
            if torn.next() == Some(view) {
                named += 1;
            } else {
                let codes: Vec<_> = findings.iter().map(|f| f.code.code()).collect();
                println!("#{seed}: view {view}: {codes:?}");
            }
        }
    }
    println!("{named} of {all} torn views named");
    assert!(all >= 36 && named * 4 >= all * 3, "{named} of {all}");
}
