//! Limit for all ways of guiding: the best poses of all, found by search.
//!
//! Poses have every corner inside the picture and detectable, tilt ≤ 60°, distance ≥ 10 cm. The
//! search draws a pool of random poses and of opposed pairs about the principal point, picks the
//! best by exchange (Fedorov, "Theory of Optimal Experiments", 1972), then refines each alone. It
//! may miss the optimum by some per cent, so the limit is a bound from above.

use nalgebra::{Isometry3, Matrix2, SMatrix, Vector2};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    course::{
        F_PX, IMAGE_SIZE, WANTED_PROJECTION_SD_PX, board_held, mild_distortion, seen_margin_px,
        wanted_pp_sd_px,
    },
    estimate::prior,
    hand::least_secs,
    strategy::sample::{Wanted, place},
};
use crate::setup::chance;
use boresight_calibrate::{ProjectionJacobian, projection_jacobian};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensParameter, boards::Board};
use boresight_guide::guidance::information::{LensMatrix, square_pixels, view_information};

/// Parameters of the right model, which come first in the guidance's matrices: fy follows fx.
const PARAMETERS: [LensParameter; FREE] =
    [LensParameter::Fx, LensParameter::Cx, LensParameter::Cy, LensParameter::K1, LensParameter::K2];
const FREE: usize = 5;
type Free = SMatrix<f64, FREE, FREE>;

/// Numbers of views of the limits.
pub(super) const VIEWS: [usize; 6] = [1, 2, 3, 4, 6, 8];
const POOL: usize = 1200;
const STARTS: usize = 3;
const PASSES: usize = 6;
const ROUNDS: usize = 8;
const NEIGHBOURS: usize = 24;
const STEEPEST_RAD: f64 = std::f64::consts::FRAC_PI_3;
const NEAREST_M: f64 = 0.1;

/// Best design for a number of views.
#[derive(Clone, Debug)]
pub(super) struct Limit {
    pub(super) views: usize,
    /// Standard deviation of the principal point along the worst axis.
    pub(super) pp_sd_px: f64,
    /// Mean standard deviation of projection.
    pub(super) projection_sd_px: f64,
    /// Poses of the design.
    pub(super) design: Vec<Wanted>,
    /// Minimum time in seconds for a hand that never misses, in the best order.
    pub(super) secs: f64,
}

struct Search {
    camera: Camera,
    board: Board,
    noise_px: f64,
    jacobian: ProjectionJacobian,
    /// Mean of `MᵀM/2`: the quick measure of projection.
    weight: Free,
    prior: Free,
}

struct Candidate {
    wanted: Wanted,
    cam_from_board: Isometry3<f64>,
    information: Free,
}

/// Limit for each of [`VIEWS`], for a camera of the study with the principal point 29 px off and
/// the right model. Each design minimises the larger of both deviations, relative to the goals.
/// Deterministic.
///
/// Each view is held for `hold_secs`.
pub(super) fn limits(noise_px: f64, hold_secs: f64) -> Vec<Limit> {
    let mut rng = chance(1, 4_000_000);
    let Some(search) = Search::new(noise_px) else { return Vec::new() };
    let pool = search.pool(&mut rng);
    VIEWS
        .into_iter()
        .filter_map(|views| {
            let mut design = search.exchange(&pool, views, &mut rng)?;
            search.refine(&mut design, &mut rng);
            let covariance = search.covariance(&search.sum(&design))?;
            let poses: Vec<_> = design.iter().map(|candidate| candidate.cam_from_board).collect();
            Some(Limit {
                views,
                pp_sd_px: pp_sd_px(&covariance),
                projection_sd_px: search.projection_sd_px(&covariance),
                design: design.iter().map(|candidate| candidate.wanted).collect(),
                secs: least_secs(&poses, hold_secs, F_PX),
            })
        })
        .collect()
}

impl Search {
    fn new(noise_px: f64) -> Option<Self> {
        let pp_px = IMAGE_SIZE.centre_px() + Vector2::new(25.0, -15.0);
        let camera = Camera { distortion: mild_distortion(), ..Camera::pinhole(F_PX, pp_px) };
        let jacobian = projection_jacobian(&camera, IMAGE_SIZE)?;
        let mut weight = LensMatrix::zeros();
        for jac_lens in &jacobian.jac_lens {
            let joined = square_pixels(jac_lens);
            weight += joined.transpose() * joined;
        }
        weight /= 2.0 * jacobian.jac_lens.len() as f64;
        let prior = prior().information;
        let prior = Free::from_fn(|i, j| if i == j { prior[PARAMETERS[i].index()] } else { 0.0 });
        let weight = weight.fixed_view::<FREE, FREE>(0, 0).into_owned();
        Some(Self { camera, board: board_held(), noise_px, jacobian, weight, prior })
    }

    /// Candidate at a pose; `None` if invisible.
    fn candidate(&self, wanted: Wanted) -> Option<Candidate> {
        let size = (&self.camera, IMAGE_SIZE);
        let pose = place(size, &self.board, &wanted, seen_margin_px())?;
        if self.nearest_m(&pose) < NEAREST_M {
            return None;
        }
        let full = view_information(&pose, &self.board, &self.camera, self.noise_px)?;
        let information = full.fixed_view::<FREE, FREE>(0, 0).into_owned();
        Some(Candidate { wanted, cam_from_board: pose, information })
    }

    fn nearest_m(&self, pose: &Isometry3<f64>) -> f64 {
        let depth = |m: &nalgebra::Point2<f64>| (pose * nalgebra::Point3::new(m.x, m.y, 0.0)).z;
        self.board.corners_in_board_m().iter().map(depth).fold(f64::MAX, f64::min)
    }

    fn pool(&self, rng: &mut ChaCha8Rng) -> Vec<Candidate> {
        let pp = [
            self.camera.pp_px.x / f64::from(IMAGE_SIZE.width_px),
            self.camera.pp_px.y / f64::from(IMAGE_SIZE.height_px),
        ];
        let turn = std::f64::consts::TAU;
        let opposed = (0..48).flat_map(|step| {
            [0.62, 0.7, 0.78, 0.86].map(|tilt_rad| Wanted {
                slot_rad: turn * f64::from(step) / 48.0,
                tilt_rad,
                roll_rad: 0.0,
                centre: pp,
                fill: 1.0,
            })
        });
        let mut wanted: Vec<Wanted> = opposed.collect();
        wanted.extend((0..POOL).map(|_| Wanted {
            slot_rad: rng.random_range(0.0..turn),
            tilt_rad: rng.random_range(0.0..STEEPEST_RAD),
            roll_rad: rng.random_range(-0.35..0.35),
            centre: [rng.random_range(0.1..0.9), rng.random_range(0.1..0.9)],
            fill: rng.random_range(0.55..1.0),
        }));
        wanted.into_iter().filter_map(|wanted| self.candidate(wanted)).collect()
    }

    /// Larger of both deviations, as multiples of the goals.
    fn score(&self, information: &Free) -> f64 {
        self.covariance(information).map_or(f64::INFINITY, |covariance| {
            let projection = (self.weight * covariance).trace().max(0.0).sqrt();
            (pp_sd_px(&covariance) / wanted_pp_sd_px()).max(projection / WANTED_PROJECTION_SD_PX)
        })
    }

    fn covariance(&self, information: &Free) -> Option<Free> {
        Some(information.cholesky()?.inverse())
    }

    fn sum(&self, design: &[Candidate]) -> Free {
        design.iter().fold(self.prior, |sum, candidate| sum + candidate.information)
    }

    fn projection_sd_px(&self, covariance: &Free) -> f64 {
        let mut full = SMatrix::<f64, LENS_PARAMETERS, LENS_PARAMETERS>::zeros();
        for i in LensParameter::ALL {
            for j in LensParameter::ALL {
                if let (Some(a), Some(b)) = (place_of(i), place_of(j)) {
                    full[(i.index(), j.index())] = covariance[(a, b)];
                }
            }
        }
        self.jacobian.sd(&full).mean_px
    }

    /// Best `views` of the pool: from several starts, each view is exchanged for the most helpful
    /// one until none helps.
    fn exchange(
        &self,
        pool: &[Candidate],
        views: usize,
        rng: &mut ChaCha8Rng,
    ) -> Option<Vec<Candidate>> {
        let mut best: Option<(f64, Vec<usize>)> = None;
        if pool.is_empty() {
            return None;
        }
        for _ in 0..STARTS {
            let mut chosen: Vec<usize> =
                (0..views).map(|_| rng.random_range(0..pool.len())).collect();
            let mut last = f64::INFINITY;
            for _ in 0..PASSES {
                let mut now = last;
                for place in 0..views {
                    let others = chosen
                        .iter()
                        .enumerate()
                        .filter(|(other, _)| *other != place)
                        .fold(self.prior, |sum, (_, index)| sum + pool[*index].information);
                    let scored = pool
                        .iter()
                        .enumerate()
                        .map(|(index, c)| (self.score(&(others + c.information)), index));
                    if let Some((score, index)) = scored.min_by(|a, b| a.0.total_cmp(&b.0)) {
                        (now, chosen[place]) = (score, index);
                    }
                }
                let settled = now > last * (1.0 - 1e-3);
                last = now;
                if settled {
                    break;
                }
            }
            if best.as_ref().is_none_or(|(least, _)| last < *least) {
                best = Some((last, chosen));
            }
        }
        let (_, chosen) = best?;
        let copy = |index: usize| Candidate {
            wanted: pool[index].wanted,
            cam_from_board: pool[index].cam_from_board,
            information: pool[index].information,
        };
        Some(chosen.into_iter().map(copy).collect())
    }

    /// Moves each view in turn to the best of some neighbours, in shrinking steps.
    fn refine(&self, design: &mut [Candidate], rng: &mut ChaCha8Rng) {
        let mut best = self.score(&self.sum(design));
        let mut step = 1.0;
        for _ in 0..ROUNDS {
            for place in 0..design.len() {
                let others = self.sum(design) - design[place].information;
                for _ in 0..NEIGHBOURS {
                    let near = neighbour(&design[place].wanted, step, rng);
                    let Some(candidate) = self.candidate(near) else { continue };
                    let score = self.score(&(others + candidate.information));
                    if score < best {
                        (best, design[place]) = (score, candidate);
                    }
                }
            }
            step *= 0.8;
        }
    }
}

fn neighbour(wanted: &Wanted, step: f64, rng: &mut ChaCha8Rng) -> Wanted {
    let mut normal = |sd: f64| -> f64 {
        let value: f64 = StandardNormal.sample(rng);
        sd * step * value
    };
    Wanted {
        slot_rad: (wanted.slot_rad + normal(0.3)).rem_euclid(std::f64::consts::TAU),
        tilt_rad: (wanted.tilt_rad + normal(0.15)).clamp(0.0, STEEPEST_RAD),
        roll_rad: wanted.roll_rad + normal(0.15),
        centre: [wanted.centre[0] + normal(0.04), wanted.centre[1] + normal(0.07)],
        fill: (wanted.fill + normal(0.06).abs()).min(1.0),
    }
}

fn pp_sd_px(covariance: &Free) -> f64 {
    let is_pp = |i: usize| LensParameter::PP.contains(&PARAMETERS[i]);
    let places: Vec<usize> = (0..FREE).filter(|i| is_pp(*i)).collect();
    let pp = Matrix2::from_fn(|i, j| covariance[(places[i], places[j])]);
    pp.symmetric_eigenvalues().max().max(0.0).sqrt()
}

/// Index of a lens parameter among the free ones: fx's index for fy. `None` for a fixed parameter.
fn place_of(parameter: LensParameter) -> Option<usize> {
    let own = if parameter == LensParameter::Fy { LensParameter::Fx } else { parameter };
    PARAMETERS.iter().position(|free| *free == own)
}
