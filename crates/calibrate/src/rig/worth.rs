//! Gain of a further place of the board.

use nalgebra::{DMatrix, Isometry3, Matrix2, Point2, Point3, SVector, Vector3};

use super::{
    RigCalibration,
    bundle::{LensKnown, RigProblem, RigState, SHAPE, WhitenedView, inverse, part},
    result::Minimum,
    stated::{derivatives, holds, rig_of},
};
use crate::solve::{schur_lm::Problem, whitened::Whitened};
use boresight_geometry::{LENS_PARAMETERS, LensMatrix, Rig, boards::Board, frame::ImageSize};

/// Steps across and down a picture at which a pair is judged.
const STEPS: [u32; 2] = [5, 4];
/// Least error of a corner, in pixels.
const LEAST_PX: f64 = 0.05;
/// Least cosine of the angle between the board's normal and a ray: beyond, squares are too narrow.
const LEAST_FACING: f64 = 0.4;
/// Room for the error of a person's hand at the picture's edge, as a share of its shorter side.
const LEEWAY: f64 = 0.05;

/// Gain of places of the board for the rows, or distances, of every pair of cameras.
///
/// With the information `I` of the instants and `W = Σ TᵀT` of the derivatives `T` of the pairs'
/// errors over their common part of the pictures, `v(I) = tr(W I⁻¹)`. A place with information `U`
/// has the gain `v(I) / v(I + U) − 1`, summed over the cameras that would see the board.
#[derive(Clone, Debug)]
pub struct PlaceWorth {
    state: RigState,
    sizes: Vec<ImageSize>,
    sd_px: Vec<f64>,
    board_m: Vec<Point2<f64>>,
    /// Estimated shared numbers.
    free: Vec<usize>,
    information: DMatrix<f64>,
    weight: DMatrix<f64>,
    variance: f64,
}

impl PlaceWorth {
    /// Worth beside the instants of `rig`. `None` if they leave a number open.
    pub fn of(rig: &RigCalibration, board: &Board) -> Option<Self> {
        let Minimum { state, covariance } = rig.minimum.as_ref()?;
        let free: Vec<usize> =
            (0..covariance.nrows()).filter(|row| covariance[(*row, *row)] > 0.0).collect();
        let sizes: Vec<ImageSize> = rig.cameras.iter().map(|camera| camera.image_size).collect();
        let mut weight = DMatrix::zeros(covariance.nrows(), covariance.nrows());
        for pair in &rig.pairs {
            let places = common_places(rig, pair.of);
            let (rows, errors) = errors(state, covariance, pair.of, &places);
            let gram = errors.tr_mul(&errors) / errors.nrows().max(1) as f64;
            for (i, row) in rows.iter().enumerate() {
                for (j, column) in rows.iter().enumerate() {
                    weight[(*row, *column)] += gram[(i, j)];
                }
            }
        }
        let (weight, of_free) = (part(&weight, &free), part(covariance, &free));
        let variance = (&weight * &of_free).trace();
        Some(Self {
            state: state.clone(),
            sizes,
            sd_px: rig.cameras.iter().map(|camera| camera.rms_px.max(LEAST_PX)).collect(),
            board_m: board.corners_in_board_m(),
            information: inverse(&of_free)?,
            free,
            weight,
            variance,
        })
    }

    /// Lenses and places of the cameras.
    pub fn rig(&self) -> Rig {
        rig_of(&self.state)
    }

    /// Cameras that see the whole board at a place in the rig's frame, from the front.
    pub fn seen_by(&self, rig_from_board: &Isometry3<f64>) -> Vec<usize> {
        seen_by(&self.rig(), &self.sizes, &self.board_m, rig_from_board)
    }

    /// Gain of a place in the rig's frame; 0 if fewer than two cameras see the board there.
    pub fn gain(&self, rig_from_board: &Isometry3<f64>) -> f64 {
        let cameras = self.seen_by(rig_from_board);
        if cameras.len() < 2 {
            return 0.0;
        }
        self.told(rig_from_board, &cameras).unwrap_or(0.0)
    }

    fn told(&self, rig_from_board: &Isometry3<f64>, cameras: &[usize]) -> Option<f64> {
        let state = RigState { rig_from_board: vec![*rig_from_board], ..self.state.clone() };
        let views: Vec<WhitenedView> = cameras
            .iter()
            .map(|camera| {
                let whitener = Matrix2::identity() / self.sd_px[*camera];
                let corners = self.board_m.iter().enumerate().map(|(place, board_m)| {
                    let px = state.px(*camera, 0, board_m)?;
                    Some(Whitened { place, board_m: *board_m, px, whitener, common_px: 0.0 })
                });
                let corners = corners.collect::<Option<_>>()?;
                Some(WhitenedView { instant: 0, camera: *camera, corners })
            })
            .collect::<Option<_>>()?;
        let open = LensKnown {
            free: [true; LENS_PARAMETERS],
            mean: SVector::zeros(),
            information: LensMatrix::zeros(),
        };
        let lenses = vec![open; state.cameras.len()];
        let problem = RigProblem { views: &views, lenses: &lenses, shape: [0.0; SHAPE], origin: 0 };
        let (_, equations) = problem.linearise(&state)?;
        let block = equations.instants.first()?;
        let (told, _) = block.reduced()?;
        let mut information = self.information.clone();
        let place = |row: &usize| self.free.iter().position(|free| free == row);
        let at: Vec<Option<usize>> = block.at.iter().map(place).collect();
        for (i, row) in at.iter().enumerate() {
            for (j, column) in at.iter().enumerate() {
                if let (Some(row), Some(column)) = (row, column) {
                    information[(*row, *column)] += told[(i, j)];
                }
            }
        }
        let left = (&self.weight * inverse(&information)?).trace();
        (left > 0.0).then(|| self.variance / left - 1.0)
    }
}

/// Cameras of `rig`, with pictures of `sizes`, that see the whole board at a place in the rig's
/// frame from the front.
pub fn seen_by(
    rig: &Rig,
    sizes: &[ImageSize],
    board_m: &[Point2<f64>],
    rig_from_board: &Isometry3<f64>,
) -> Vec<usize> {
    let is_seen = |camera: &usize| {
        let cam_from_board = rig.cam_from_rig[*camera] * rig_from_board;
        let away = cam_from_board.rotation * Vector3::z();
        let ImageSize { width_px, height_px } = sizes[*camera];
        let margin_px = (LEEWAY * f64::from(width_px.min(height_px))).round();
        let less = |count: u32| count.saturating_sub(margin_px as u32);
        let inner = ImageSize { width_px: less(width_px), height_px: less(height_px) };
        board_m.iter().all(|point| {
            let in_cam = cam_from_board * Point3::new(point.x, point.y, 0.0);
            let px = rig.cameras[*camera].project(&in_cam);
            in_cam.coords.normalize().dot(&away) >= LEAST_FACING
                && px.is_some_and(|px| px.coords.min() >= margin_px && holds(&inner, &px))
        })
    };
    (0..sizes.len()).filter(is_seen).collect()
}

/// Points in front of both cameras, over their common part of the picture, as near and as far as
/// the boards were.
fn common_places(rig: &RigCalibration, of: [usize; 2]) -> Vec<Point3<f64>> {
    let [a, b] = of;
    let rig_from_first = rig.rig.cam_from_rig[a].inverse();
    let depths = rig.instants.iter().map(|instant| {
        (rig.rig.cam_from_rig[a] * instant.rig_from_board).translation.vector.norm()
    });
    let (near, far) = depths
        .fold((f64::INFINITY, 0.0_f64), |(near, far), depth| (near.min(depth), far.max(depth)));
    let ImageSize { width_px, height_px } = rig.cameras[a].image_size;
    let mut places = Vec::new();
    for down in 0..STEPS[1] {
        for across in 0..STEPS[0] {
            let share = |step: u32, steps: u32| (f64::from(step) + 0.5) / f64::from(steps);
            let px = Point2::new(
                share(across, STEPS[0]) * f64::from(width_px),
                share(down, STEPS[1]) * f64::from(height_px),
            );
            let Some(ray) = rig.rig.cameras[a].ray_from_px(&px) else { continue };
            for depth in [near, far] {
                let point = rig_from_first * Point3::from(ray.normalize() * depth);
                let other = rig.rig.cameras[b].project(&(rig.rig.cam_from_rig[b] * point));
                if other.is_some_and(|px| holds(&rig.cameras[b].image_size, &px)) {
                    places.push(point);
                }
            }
        }
    }
    places
}

/// Derivatives of the row errors of a pair at `places`, in pixels; of its distances, times the
/// focal length, where the cameras have no common rows.
fn errors(
    state: &RigState,
    covariance: &DMatrix<f64>,
    of: [usize; 2],
    places: &[Point3<f64>],
) -> (Vec<usize>, DMatrix<f64>) {
    let now = rig_of(state);
    let px = |camera: usize, place: &Point3<f64>| {
        now.cameras[camera].project(&(now.cam_from_rig[camera] * place))
    };
    let seen: Vec<[Point2<f64>; 2]> =
        places.iter().filter_map(|place| Some([px(of[0], place)?, px(of[1], place)?])).collect();
    let rows = derivatives(state, covariance, of, &|state| {
        let rig = rig_of(state);
        seen.iter().map(|px| rig.row_error_px(of, *px).unwrap_or(f64::NAN)).collect()
    });
    if rows.1.nrows() > 0 {
        return rows;
    }
    let f_px = now.cameras[of[0]].f_px.x;
    derivatives(state, covariance, of, &|state| {
        let rig = rig_of(state);
        let far = |px: &[Point2<f64>; 2]| {
            let point = rig.triangulate(&[(of[0], px[0]), (of[1], px[1])])?;
            Some(f_px * libm::log((rig.cam_from_rig[of[0]] * point).coords.norm()))
        };
        seen.iter().map(|px| far(px).unwrap_or(f64::NAN)).collect()
    })
}
