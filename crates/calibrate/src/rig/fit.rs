//! Joint fit of a rig with noise by the residuals, and its covariance by the scatter of instants.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Isometry3, Point2, Point3, SVector, Vector2};

use super::{
    View,
    bundle::{
        InstantBlock, LensKnown, OF_CAMERA, RigEquations, RigProblem, RigState, WhitenedView,
        inverse, part,
    },
    noise::{CameraNoise, Residuals},
};
use crate::{
    check::odd_corners::{OF_MEDIAN, median},
    known_lens::KnownLens,
    solve::{
        lens_model::LensModel,
        schur_lm::{Limits, minimise},
        view_scatter::{Scatter, averaged},
        whitened::whiten,
    },
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensKind, LensMatrix, LensParameter};

/// Rounds of noise and fit, as in the bundle of one camera.
const ROUNDS: usize = 3;
/// Squared distance, in variances, counted for an outlier.
const OUTLIER: f64 = 14.0;
/// Standard deviation of the logarithm of the pixels' aspect: square ones.
const SQUARE_SD: f64 = 1e-3;
/// The same for pixels that a camera's own views show not to be square.
const STRETCHED_SD: f64 = 0.1;
/// Standard deviation of the stretch of a print, and of its sag at the edge over half its size.
const STRETCH_SD: f64 = 1e-3;
const SAG_SD: f64 = 0.01;
/// Instants below which no uncertainty is stated: halves of four instants understate it fivefold.
const STATED_FROM: usize = 8;
/// The same where every lens is known.
const STATED_FROM_KNOWN: usize = 4;

/// Instants below which no uncertainty is stated; `is_known` if every lens is.
pub(super) fn stated_from(is_known: bool) -> usize {
    if is_known { STATED_FROM_KNOWN } else { STATED_FROM }
}

/// Lens before the instants: any of the kind, by weak priors.
///
/// Its coefficients are those of the richest of the `allowed` models of the family.
pub(super) fn open_lens(camera: &Camera, model: LensModel, allowed: &[LensModel]) -> LensKnown {
    let own = allowed.iter().filter(|other| other.family() == model.family());
    let richest = own.max().copied().unwrap_or(model);
    let free = richest.freedom(false).free;
    let parameters = camera.lens_parameters();
    let mut mean = SVector::from(parameters);
    let mut information = LensMatrix::zeros();
    let own = richest.own_prior();
    for parameter in LensParameter::ALL.into_iter().filter(|it| it.is_distortion()) {
        let i = parameter.index();
        let is_perspective = camera.distortion.kind == LensKind::Perspective;
        let sd = match parameter {
            LensParameter::P1 | LensParameter::P2 => 2e-3,
            LensParameter::K3 if is_perspective => 0.5,
            _ => 1.0,
        };
        (mean[i], information[(i, i)]) = match own.as_ref().map(|own| own.information[i]) {
            Some(of_own) if of_own > 0.0 => (own.as_ref().map_or(0.0, |own| own.mean[i]), of_own),
            _ => (0.0, 1.0 / (sd * sd)),
        };
    }
    let sd = if parameters[0] == parameters[1] { SQUARE_SD } else { STRETCHED_SD };
    LensKnown { free, mean, information }.with_pixels(camera, sd)
}

impl LensKnown {
    /// Lens whose pixels have any shape near that of `camera`.
    pub(super) fn with_free_pixels(&self, camera: &Camera) -> Self {
        self.clone().with_pixels(camera, STRETCHED_SD)
    }

    /// Replaces what is known of the focal lengths by their ratio in `camera`, with `sd` of its
    /// logarithm.
    fn with_pixels(mut self, camera: &Camera, sd: f64) -> Self {
        let rows = LensParameter::F.map(LensParameter::index);
        let across = [-1.0 / camera.f_px.x, 1.0 / camera.f_px.y].map(|by| by / sd);
        for (i, of_i) in rows.into_iter().zip(across) {
            for (j, of_j) in rows.into_iter().zip(across) {
                self.information[(i, j)] = of_i * of_j;
            }
            self.mean[i] = camera.lens_parameters()[i];
        }
        self
    }
}

/// Lens of an earlier calibration. `None` if its covariance isn't positive.
pub(super) fn known_lens(lens: &KnownLens) -> Option<LensKnown> {
    let covariance = lens.covariance();
    let of = |i: usize| covariance[(i, i)];
    let [x, y] = LensParameter::F.map(LensParameter::index);
    // With square pixels, both focal lengths are one number.
    let own: Vec<usize> = (0..LENS_PARAMETERS).filter(|i| of(*i) > 0.0).collect();
    let tiny = |i: usize| {
        if i == x || i == y { (0.1 * SQUARE_SD).powi(2) * lens.parameters[i].powi(2) } else { 0.0 }
    };
    let whole = DMatrix::from_fn(own.len(), own.len(), |i, j| {
        covariance[(own[i], own[j])] + if i == j { tiny(own[i]) } else { 0.0 }
    });
    let of_own = inverse(&whole)?;
    let (mut free, mut information) = ([false; LENS_PARAMETERS], LensMatrix::zeros());
    for (i, row) in own.iter().enumerate() {
        free[*row] = true;
        for (j, column) in own.iter().enumerate() {
            information[(*row, *column)] = of_own[(i, j)];
        }
    }
    Some(LensKnown { free, mean: SVector::from(lens.parameters), information })
}

/// Minimum of the joint bundle.
pub(super) struct Fit {
    pub(super) state: RigState,
    pub(super) views: Vec<View>,
    /// Measured corners of the views, with whole errors.
    pub(super) whitened: Vec<WhitenedView>,
    pub(super) equations: RigEquations,
    /// Variance of the corners as a multiple of the estimated one.
    pub(super) variance: f64,
}

/// Fits from `state`. `None` if the views leave a number undetermined.
pub(super) fn fit(
    views: Vec<View>,
    mut state: RigState,
    (board_m, lenses, origin): (&[Point2<f64>], &[LensKnown], usize),
) -> Option<Fit> {
    let reach_m = board_m.iter().map(|point| point.coords.amax()).fold(0.0, f64::max);
    let sag_sd = SAG_SD / reach_m;
    let shape = [STRETCH_SD, sag_sd, sag_sd, sag_sd].map(|sd| 1.0 / (sd * sd));
    let mut found = None;
    for _ in 0..ROUNDS {
        let whitened = whitened(&views, &noise(&views, &state, board_m, lenses.len())?, board_m)?;
        let problem = RigProblem { views: &whitened, lenses, shape, origin };
        let minimum = minimise(&problem, state, Limits::ROUGH)?;
        state = minimum.state;
        found = Some((whitened, minimum.normal));
    }
    let (whitened, equations) = found?;
    let mut squares = 0.0;
    let mut coordinates = 0;
    for view in &whitened {
        for corner in &view.corners {
            let off = corner.px - state.px(view.camera, view.instant, &corner.board_m)?;
            squares += (corner.whitener * off).norm_squared().min(OUTLIER);
            coordinates += 2;
        }
    }
    let numbers = equations.free.len() + 6 * state.rig_from_board.len();
    let freedom = coordinates - numbers.min(coordinates - 1);
    let variance = (squares / freedom as f64).max(1e-6);
    Some(Fit { state, views, whitened, equations, variance })
}

fn noise(
    views: &[View],
    state: &RigState,
    board_m: &[Point2<f64>],
    cameras: usize,
) -> Option<Vec<CameraNoise>> {
    let of_camera = |camera: usize| {
        let own = views.iter().filter(|view| view.camera == camera);
        own.map(|view| residuals(view, state, board_m)).collect::<Option<Vec<Residuals>>>()
    };
    (0..cameras).map(|camera| of_camera(camera).map(|of| CameraNoise::of(&of))).collect()
}

/// Residuals of a view. `None` if a corner lies outside the field.
pub(super) fn residuals(
    view: &View,
    state: &RigState,
    board_m: &[Point2<f64>],
) -> Option<Residuals> {
    let seen = view.corners.iter().zip(board_m).filter(|(corner, _)| corner.is_seen());
    seen.map(|(corner, point)| {
        let off: Vector2<f64> = corner.px - state.px(view.camera, view.instant, point)?;
        Some((off, 0.5 * corner.covariance_px2.trace()))
    })
    .collect()
}

fn whitened(
    views: &[View],
    noise: &[CameraNoise],
    board_m: &[Point2<f64>],
) -> Option<Vec<WhitenedView>> {
    let mut next = vec![0; noise.len()];
    views
        .iter()
        .map(|view| {
            let picture = next[view.camera];
            next[view.camera] += 1;
            let seen = view.corners.iter().zip(board_m).enumerate();
            let corners = seen
                .filter(|(_, (corner, _))| corner.is_seen())
                .map(|(place, (corner, point))| {
                    whiten(place, &noise[view.camera].applied(picture, corner), point)
                })
                .collect::<Option<_>>()?;
            Some(WhitenedView { instant: view.instant, camera: view.camera, corners })
        })
        .collect()
}

/// Covariance of the shared numbers, and what score tests need.
pub(super) struct Uncertainty {
    /// By the noise, and averaged with the scatter of the instants; zero where fixed.
    pub(super) covariance: DMatrix<f64>,
    /// By the noise alone.
    pub(super) of_model: DMatrix<f64>,
    /// See [`Scatter::overcount`].
    pub(super) overcount: f64,
    /// Variance of the board's displacement between the pictures of most instants, along an axis.
    pub(super) displaced_m2: f64,
}

/// Displacement of the board between the pictures of an instant.
struct Displacement {
    instant: usize,
    /// Rows of the shifts among the free numbers.
    rows: Vec<usize>,
    by_m: DVector<f64>,
    /// Its variance by the corners' noise.
    noise_m2: DVector<f64>,
}

impl Displacement {
    /// Square of each shift, with the variance by the noise.
    fn squares(&self) -> impl Iterator<Item = (f64, f64)> {
        self.by_m.iter().zip(&self.noise_m2).map(|(by_m, noise_m2)| (by_m * by_m, *noise_m2))
    }
}

/// Variance of displacements alike along all axes and at all instants; zero for too few.
fn mean_m2(all: &[Displacement]) -> f64 {
    let squares = || all.iter().flat_map(Displacement::squares);
    let weight = |noise_m2: f64| 1.0 / (noise_m2 * noise_m2);
    let total: f64 = squares().map(|(_, noise_m2)| weight(noise_m2)).sum();
    let excess = squares().map(|(square, noise_m2)| weight(noise_m2) * (square - noise_m2));
    let count = all.len() as f64;
    // Two instants' worth is fitted by the mutual places.
    if count < 3.0 { 0.0 } else { (excess.sum::<f64>() / total * count / (count - 2.0)).max(0.0) }
}

/// Variance of displacements by their median, which a few of another moment don't change.
fn median_m2(all: &[Displacement]) -> f64 {
    let excess = |(square, noise_m2): (f64, f64)| OF_MEDIAN * square - noise_m2;
    median(all.iter().flat_map(Displacement::squares).map(excess).collect()).max(0.0)
}

impl Fit {
    /// Points of the board that were seen, in metres.
    pub(super) fn board_m(&self) -> Vec<Point3<f64>> {
        let corners = self.whitened.iter().flat_map(|view| &view.corners);
        let named: BTreeMap<usize, Point2<f64>> =
            corners.map(|corner| (corner.place, corner.board_m)).collect();
        named.values().map(|point| self.state.on_board(point)).collect()
    }

    /// Number of instants with at least two cameras.
    pub(super) fn shared_instants(&self) -> usize {
        let seen_by =
            |instant: usize| self.views.iter().filter(|view| view.instant == instant).count();
        (0..self.state.rig_from_board.len()).filter(|instant| seen_by(*instant) > 1).count()
    }

    /// Covariance at the minimum. `None` if the information is singular.
    pub(super) fn uncertainty(&self) -> Option<Uncertainty> {
        let RigEquations { prior, free, instants } = &self.equations;
        let size = prior.1.len();
        let mut place = vec![None; size];
        free.iter().enumerate().for_each(|(i, row)| place[*row] = Some(i));
        let of_instants = instants
            .iter()
            .map(|block| {
                let (information, gradient) = block.reduced()?;
                let mut whole = DMatrix::zeros(free.len(), free.len());
                let mut pull = DVector::zeros(free.len());
                for (i, row) in block.at.iter().enumerate() {
                    let Some(row) = place[*row] else { continue };
                    pull[row] += gradient[i] / self.variance;
                    for (j, column) in block.at.iter().enumerate() {
                        let Some(column) = place[*column] else { continue };
                        whole[(row, column)] += information[(i, j)] / self.variance;
                    }
                }
                Some((whole, pull))
            })
            .collect::<Option<Vec<_>>>()?;
        let of_prior = part(&prior.0, free);
        let information = of_instants.iter().fold(of_prior.clone(), |sum, (of, _)| sum + of);
        let of_model = inverse(&information)?;
        let scatter = Scatter::of(&of_instants, &of_prior)?;
        let count = instants.len();
        // The noise's covariance counts as a scatter alike in all directions: on real boards, the
        // print and the board's shape outweigh the noise of the corners. Between the cameras'
        // pictures of an instant, the board may have moved, too.
        let displaced = self.displacements(free, &of_instants);
        let variance_m2 = mean_m2(&displaced);
        let mut pulls = DMatrix::zeros(free.len(), free.len());
        for Displacement { instant, rows, .. } in &displaced {
            let columns = of_instants[*instant].0.select_columns(rows);
            pulls += &columns * columns.transpose() * variance_m2;
        }
        let alike = of_model.clone() * scatter.mean().max(1.0) + &of_model * pulls * &of_model;
        let of_free = averaged(alike, scatter.covariance()?, count);
        let wide = |of_free: &DMatrix<f64>| {
            DMatrix::from_fn(size, size, |i, j| match (place[i], place[j]) {
                (Some(i), Some(j)) => of_free[(i, j)],
                _ => 0.0,
            })
        };
        Some(Uncertainty {
            covariance: wide(&of_free),
            of_model: wide(&of_model),
            overcount: scatter.overcount(count),
            displaced_m2: median_m2(&displaced),
        })
    }

    /// Displacements of the board between the pictures of an instant, along three axes for each
    /// camera but an instant's first: a displacement moves a camera for one instant.
    fn displacements(
        &self,
        free: &[usize],
        of_instants: &[(DMatrix<f64>, DVector<f64>)],
    ) -> Vec<Displacement> {
        let shifts = |block: &InstantBlock| -> Vec<usize> {
            let is_shift = |row: &usize| {
                *row < OF_CAMERA * self.state.cameras.len()
                    && *row % OF_CAMERA >= LENS_PARAMETERS + 3
            };
            let rows = block.at.iter().filter(|row| is_shift(row));
            rows.filter_map(|row| free.iter().position(|own| own == row)).collect()
        };
        let of = |(instant, block): (usize, &InstantBlock)| {
            let (rows, (information, pull)) = (shifts(block), &of_instants[instant]);
            let is_shared = !rows.is_empty() && block.at.len() >= 2 * OF_CAMERA;
            let noise = inverse(&part(information, &rows)).filter(|_| is_shared)?;
            let by_m = &noise * DVector::from_fn(rows.len(), |i, _| pull[rows[i]]);
            Some(Displacement { instant, rows, by_m, noise_m2: noise.diagonal() })
        };
        self.equations.instants.iter().enumerate().filter_map(of).collect()
    }

    /// Start with another camera in the place of `camera` from an instant on.
    pub(super) fn with_two_cameras(&self, camera: usize, from: usize) -> (Vec<View>, RigState) {
        let (mut views, mut state) = (self.views.clone(), self.state.clone());
        let other = state.cameras.len();
        state.cameras.push(state.cameras[camera]);
        state.cam_from_rig.push(state.cam_from_rig[camera]);
        for view in views.iter_mut().filter(|view| view.camera == camera) {
            view.camera = if view.instant >= from { other } else { camera };
        }
        (views, state)
    }

    /// Start with the board of view `view` in a place of its own, so that it tells of its camera's
    /// lens only.
    pub(super) fn without_pair(&self, view: usize) -> (Vec<View>, RigState) {
        let (mut views, mut state) = (self.views.clone(), self.state.clone());
        let place: Isometry3<f64> = state.rig_from_board[views[view].instant];
        views[view].instant = state.rig_from_board.len();
        state.rig_from_board.push(place);
        (views, state)
    }
}
