//! Causes of a rig's misfit: a camera that moved or was touched, pictures of another instant, and
//! pixels that aren't square.
//!
//! Score tests at the minimum: a cause adds numbers to the normal equations; its gain follows
//! without another fit (`docs/method.md`, 9). All sums are over the instants' own blocks, because
//! a camera's place and lens occur in its pictures only.

use nalgebra::{DMatrix, DVector};

use super::{
    bundle::{InstantBlock, OF_CAMERA, Reduced},
    fit::{Fit, Uncertainty},
};
use crate::solve::odds::{CLEAR, UNLIKELY};
use boresight_geometry::{LENS_PARAMETERS, LensParameter};

/// Instants of a camera on either side of a change.
const EITHER_SIDE: usize = 3;
/// Expected size of a move: radians and metres.
const MOVE_RAD: f64 = 2e-3;
const MOVE_M: f64 = 2e-3;
/// Expected size of a change of the lens: share of the focal length, pixels, and k1.
const FOCUS: f64 = 6e-3;
const SHIFT_PX: f64 = 5.0;
const K1: f64 = 0.05;

/// Expected deviation of pixels that aren't square.
const PIXELS: f64 = 0.1;

/// What differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The camera's place, from an instant on.
    Moved,
    /// The camera's lens, from an instant on.
    Lens,
    /// The board's place in one picture.
    OtherInstant,
    /// The shape of the cameras' pixels.
    Pixels,
}

/// Cause with its evidence.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cause {
    pub(super) kind: Kind,
    pub(super) camera: usize,
    /// The instant, or the first after a change.
    pub(super) instant: usize,
    gain: f64,
}

/// Answer of the tests.
#[derive(Clone, Copy, Debug)]
pub(super) enum Named {
    /// Nothing stands out.
    Nothing,
    /// Several causes explain the misfit alike.
    Unclear,
    /// One cause explains it.
    One(Cause),
}

/// Numbers of a hypothesis: rows of a camera, each with its share, for a column.
type Columns = Vec<(Vec<(usize, f64)>, f64)>;

/// Most likely cause, if it is clear.
pub(super) fn named(fit: &Fit, uncertainty: &Uncertainty) -> Option<Named> {
    let cameras = fit.state.cameras.len();
    let reduced =
        fit.equations.instants.iter().map(InstantBlock::reduced).collect::<Option<Vec<_>>>()?;
    let test = Test { fit, uncertainty, reduced: &reduced };
    let of_place = |i, _| if i < 3 { 0.0 } else { uncertainty.displaced_m2 };
    let displaced = DMatrix::from_diagonal(&DVector::from_fn(6, of_place));
    let mut found = Vec::new();
    for camera in 0..cameras {
        let of: Vec<usize> = test.instants_of(camera);
        for (kind, columns) in [(Kind::Moved, place_of(camera)), (Kind::Lens, lens_of(camera, fit))]
        {
            let mut sums = test.nothing(&columns);
            for (left, instant) in of.iter().enumerate().rev() {
                test.add(&mut sums, *instant, &columns);
                if left >= EITHER_SIDE && of.len() - left >= EITHER_SIDE {
                    let gain = test.gain(&sums, &columns)?;
                    found.push((kind, camera, *instant, gain));
                }
            }
        }
        let columns = pixels_of(camera, fit);
        let mut sums = test.nothing(&columns);
        of.iter().for_each(|instant| test.add(&mut sums, *instant, &columns));
        found.push((Kind::Pixels, camera, 0, test.gain(&sums, &columns)?));
        let columns = place_of(camera);
        let shared: Vec<usize> =
            of.iter().copied().filter(|instant| test.cameras_at(*instant) > 1).collect();
        for instant in &shared {
            let mut sums = test.nothing(&columns);
            test.add(&mut sums, *instant, &columns);
            let gain = test.gain_beside(&sums, &columns, &displaced)?;
            found.push((Kind::OtherInstant, camera, *instant, gain));
        }
    }
    let tried = |kind: Kind| -> f64 {
        let same = found.iter().filter(|(of, ..)| *of == kind);
        same.count().max(1) as f64
    };
    let causes: Vec<Cause> = found
        .iter()
        .map(|(kind, camera, instant, gain)| Cause {
            kind: *kind,
            camera: *camera,
            instant: *instant,
            gain: gain - UNLIKELY - 2.0 * libm::log(tried(*kind)),
        })
        .collect();
    Some(clear(&causes, cameras))
}

/// The leading cause, if it leads clearly over nothing and over each cause that means another
/// thing. A turned camera and a shifted lens look alike, and of two cameras nobody can tell which
/// one moved.
fn clear(causes: &[Cause], cameras: usize) -> Named {
    let meaning =
        |cause: &Cause| (cause.kind == Kind::OtherInstant, (cameras > 2).then_some(cause.camera));
    let Some(first) = causes.iter().max_by(|a, b| a.gain.total_cmp(&b.gain)) else {
        return Named::Nothing;
    };
    if first.gain < CLEAR {
        return Named::Nothing;
    }
    let others = causes.iter().filter(|cause| meaning(cause) != meaning(first));
    let rival = others.map(|cause| cause.gain).fold(0.0, f64::max);
    if first.gain - rival < CLEAR { Named::Unclear } else { Named::One(*first) }
}

fn place_of(camera: usize) -> Columns {
    let row = |i: usize| {
        let size = if i < 3 { MOVE_RAD } else { MOVE_M };
        (vec![(OF_CAMERA * camera + LENS_PARAMETERS + i, 1.0)], size)
    };
    (0..6).map(row).collect()
}

fn lens_of(camera: usize, fit: &Fit) -> Columns {
    let f_px = fit.state.cameras[camera].f_px;
    let row = |parameter: LensParameter| OF_CAMERA * camera + parameter.index();
    vec![
        (vec![(row(LensParameter::Fx), f_px.x), (row(LensParameter::Fy), f_px.y)], FOCUS),
        (vec![(row(LensParameter::Cx), 1.0)], SHIFT_PX),
        (vec![(row(LensParameter::Cy), 1.0)], SHIFT_PX),
        (vec![(row(LensParameter::K1), 1.0)], K1),
    ]
}

fn pixels_of(camera: usize, fit: &Fit) -> Columns {
    let row = OF_CAMERA * camera + LensParameter::Fy.index();
    vec![(vec![(row, fit.state.cameras[camera].f_px.y)], PIXELS)]
}

struct Test<'a> {
    fit: &'a Fit,
    uncertainty: &'a Uncertainty,
    reduced: &'a [Reduced],
}

/// Products of a hypothesis's columns with themselves, the shared numbers and the residuals.
struct Sums {
    own: DMatrix<f64>,
    shared: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Test<'_> {
    /// Instants of a camera, in order.
    fn instants_of(&self, camera: usize) -> Vec<usize> {
        let views = self.fit.views.iter().filter(|view| view.camera == camera);
        let mut of: Vec<usize> = views.map(|view| view.instant).collect();
        of.sort_unstable();
        of
    }

    fn cameras_at(&self, instant: usize) -> usize {
        self.fit.views.iter().filter(|view| view.instant == instant).count()
    }

    fn nothing(&self, columns: &Columns) -> Sums {
        let (count, size) = (columns.len(), self.uncertainty.of_model.nrows());
        Sums {
            own: DMatrix::zeros(count, count),
            shared: DMatrix::zeros(count, size),
            gradient: DVector::zeros(count),
        }
    }

    fn add(&self, sums: &mut Sums, instant: usize, columns: &Columns) {
        let block = &self.fit.equations.instants[instant];
        let (information, gradient) = &self.reduced[instant];
        let place = |row: usize| block.at.iter().position(|at| *at == row);
        let combined: Vec<DVector<f64>> = columns
            .iter()
            .map(|(rows, _)| {
                let mut sum = DVector::zeros(block.at.len());
                for (row, share) in rows {
                    if let Some(at) = place(*row) {
                        sum[at] += *share;
                    }
                }
                sum
            })
            .collect();
        let variance = self.fit.variance;
        for (i, of_i) in combined.iter().enumerate() {
            let by_all = information * of_i / variance;
            for (at, row) in block.at.iter().enumerate() {
                sums.shared[(i, *row)] += by_all[at];
            }
            for (j, of_j) in combined.iter().enumerate() {
                sums.own[(i, j)] += by_all.dot(of_j);
            }
            sums.gradient[i] += gradient.dot(of_i) / variance;
        }
    }

    /// Twice the logarithm of the odds, before what is unlikely. `None` if singular.
    fn gain(&self, sums: &Sums, columns: &Columns) -> Option<f64> {
        self.gain_beside(sums, columns, &DMatrix::zeros(columns.len(), columns.len()))
    }

    /// As [`Self::gain`], where numbers with the covariance `usual` differ at every instant.
    fn gain_beside(&self, sums: &Sums, columns: &Columns, usual: &DMatrix<f64>) -> Option<f64> {
        let Uncertainty { of_model, overcount, .. } = self.uncertainty;
        let mut left = &sums.own - &sums.shared * of_model * sums.shared.transpose();
        let trace = left.trace();
        for i in 0..columns.len() {
            left[(i, i)] += 1e-9 * trace;
        }
        let noise = left.cholesky()?.inverse();
        let differs = &noise * &sums.gradient;
        let known = (noise * *overcount + usual).cholesky()?.inverse();
        let told = differs.dot(&(&known * &differs));
        let occam = DMatrix::from_fn(columns.len(), columns.len(), |i, j| {
            let expected = columns[i].1 * columns[j].1 * known[(i, j)];
            if i == j { 1.0 + expected } else { expected }
        });
        let occam = 2.0 * occam.cholesky()?.l().diagonal().map(libm::log).sum();
        Some(told - occam)
    }
}
