//! Stated standard deviations of the closed forms against the spread from noise.

use boresight_geometry::{
    Camera, Corner, Homography, PrincipalLine, boards::Board, intersect_unweighted,
    intersect_weighted, principal_line_and_ring,
};
use nalgebra::{Isometry3, Matrix2, Point2, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const CENTRE: Point2<f64> = Point2::new(639.5, 359.5);
const PP: Point2<f64> = Point2::new(662.0, 341.0);
const F_PX: f64 = 1100.0;
const NOISE_PX: f64 = 0.1;
/// Enough for 3 % on a standard deviation.
const TRIALS: usize = 2000;

struct World {
    board_m: Vec<Point2<f64>>,
    camera: Camera,
    rng: ChaCha8Rng,
}

impl World {
    fn new(seed: u64) -> Self {
        Self {
            board_m: Board::new(9, 6, 0.025).expect("valid").corners_in_board_m(),
            camera: Camera::pinhole(F_PX, PP),
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    fn line(&mut self, tilt_deg: f64, slot_deg: f64) -> Option<PrincipalLine> {
        let (sin, cos) = slot_deg.to_radians().sin_cos();
        let turn = Vector3::new(sin, -cos, 0.0) * tilt_deg.to_radians();
        let pose = Isometry3::new(Vector3::new(0.01, -0.02, 0.45), turn);
        let mut sum = Vector2::zeros();
        let corners: Vec<Corner> = self
            .board_m
            .iter()
            .map(|m| {
                let px = self.camera.px_from_board(&pose, m);
                let mut normal = || self.rng.sample::<f64, _>(StandardNormal) * NOISE_PX;
                let px = px.expect("in front") + Vector2::new(normal(), normal());
                sum += px.coords;
                Corner::isotropic(px, NOISE_PX)
            })
            .collect();
        let mean = Point2::from(sum / corners.len() as f64);
        let homography = Homography::fit(&self.board_m, &corners).expect("a view");
        PrincipalLine::of(&homography, CENTRE, mean).ok()
    }
}

/// Root mean square of (found − truth) over the stated standard deviation: 1 if honest.
#[derive(Default)]
struct Normalised {
    squares: f64,
    count: f64,
}

impl Normalised {
    fn add(&mut self, off: f64, sigma: f64) {
        self.squares += (off / sigma).powi(2);
        self.count += 1.0;
    }

    #[track_caller]
    fn is_honest(&self, what: &str) {
        let ratio = (self.squares / self.count).sqrt();
        println!("{what}: observed over stated {ratio:.3}");
        assert!((ratio - 1.0).abs() < 0.15, "{what}: observed over stated {ratio}");
    }
}

#[test]
fn direction_offset_and_focal_length_of_one_view() {
    for (seed, tilt_deg) in [(1, 10.0), (2, 20.0), (3, 40.0), (4, 60.0)] {
        let mut world = World::new(seed);
        let (mut phi, mut c, mut f) =
            (Normalised::default(), Normalised::default(), Normalised::default());
        // The truth: the normal is across the slot, and the line passes through PP.
        let slot_deg = 35.0_f64;
        let n = Vector2::new(-slot_deg.to_radians().sin(), slot_deg.to_radians().cos());
        for _ in 0..TRIALS {
            let line = world.line(tilt_deg, slot_deg).expect("tilted");
            let sign = n.dot(&line.normal()).signum();
            phi.add(n.perp(&(line.normal() * sign)), line.sigma_phi_rad());
            c.add(sign * line.c_px - n.dot(&(PP - CENTRE)), line.sigma_c_px());
            if tilt_deg >= 20.0 {
                let focal = line.focal_length(&PP, &Matrix2::zeros()).expect("real");
                f.add(focal.f_px - F_PX, focal.sigma_px);
            }
        }
        phi.is_honest(&format!("phi at {tilt_deg}°"));
        c.is_honest(&format!("c at {tilt_deg}°"));
        if tilt_deg >= 20.0 {
            f.is_honest(&format!("f at {tilt_deg}°"));
        }
    }
}

#[test]
fn the_principal_point_from_several_views() {
    let mut world = World::new(9);
    // Unequal tilts, to make weights matter.
    let views = [(15.0, 0.0), (45.0, 180.0), (40.0, 90.0), (25.0, 270.0), (35.0, 45.0)];
    let mut axes: [[Normalised; 2]; 3] = Default::default();
    let mut ring_f = Normalised::default();
    for _ in 0..TRIALS / 2 {
        let lines: Vec<PrincipalLine> =
            views.iter().filter_map(|(tilt, slot)| world.line(*tilt, *slot)).collect();
        let unweighted = intersect_unweighted(&lines).expect("a point");
        let weighted = intersect_weighted(&lines).expect("a point");
        let ring = principal_line_and_ring(&lines).expect("a camera");
        for axis in 0..2 {
            let off = |px: &Point2<f64>| px[axis] - PP[axis];
            axes[0][axis].add(off(&unweighted.px), unweighted.covariance_px2[(axis, axis)].sqrt());
            axes[1][axis].add(off(&weighted.px), weighted.covariance_px2[(axis, axis)].sqrt());
            axes[2][axis].add(off(&ring.pp_px), ring.covariance[(axis + 1, axis + 1)].sqrt());
        }
        ring_f.add(ring.f_px - F_PX, ring.covariance[(0, 0)].sqrt());
    }
    for (method, axes) in ["unweighted", "weighted", "ring"].iter().zip(&axes) {
        axes[0].is_honest(&format!("{method} x"));
        axes[1].is_honest(&format!("{method} y"));
    }
    ring_f.is_honest("ring f");
}
