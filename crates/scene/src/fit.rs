//! Fit of the turn to the majority of patches.

use boresight_geometry::{LENS_PARAMETERS, LensMatrix, LensParameter};
use nalgebra::{Matrix2x4, Matrix4, Point2, SMatrix, Vector2, Vector3, Vector4};

use crate::turn::{Lens, Turn};

/// Initial and final scale of the weights, in standard deviations of a patch, and the factor
/// between steps: graduated non-convexity (Black and Rangarajan 1996).
const WIDEST: f64 = 16.0;
const NARROWEST: f64 = 2.5;
const SHRINK: f64 = 1.6;
const STEPS: usize = 14;
/// Squared distance, in standard deviations, up to which a patch counts for the scatter.
const NEAR: f64 = 9.0;
/// Minimum weight of an agreeing patch.
pub(crate) const AGREES: f64 = 0.5;
/// Standard deviation over median distance, for a normal distribution.
pub const SIGMA_OF_MEDIAN: f64 = 1.4826;
/// Factor on the covariance of independent patches, because patches share shadows: pictures of a
/// stationary camera scattered twice as much as stated.
pub const SHARED: f64 = 4.0;

/// Sighting of a patch: the ray in the reference, and the pixel now.
#[derive(Clone, Copy, Debug)]
pub struct Sighting {
    /// Unit ray of the reference picture, in the frame of the gallery.
    pub ray: Vector3<f64>,
    /// Pixel in the reference picture, through which the lens's own error enters.
    pub reference_px: Point2<f64>,
    /// Log focal ratio of the reference picture.
    pub log_focal: f64,
    /// Pixel now.
    pub px: Point2<f64>,
    /// Learned standard deviation, px.
    pub sigma_px: f64,
}

/// Result of a robust fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Fitted turn.
    pub turn: Turn,
    /// Covariance of pan, tilt, roll (rad) and log focal ratio, without the lens's own error.
    pub covariance: Matrix4<f64>,
    /// Weight of each sighting, 0 to 1.
    pub weights: Vec<f64>,
}

impl Fit {
    /// Number of sightings that agree with the turn.
    pub fn inliers(&self) -> usize {
        self.weights.iter().filter(|w| **w > AGREES).count()
    }
}

/// Fits a turn by graduated Geman-McClure weights. Without a `start`, the median of the offsets is
/// the first guess. `None` for fewer than four sightings, or if they don't determine a turn.
pub fn fit(lens: &Lens, sightings: &[Sighting], start: Option<Turn>) -> Option<Fit> {
    if sightings.len() < 4 {
        return None;
    }
    let mut turn = start.unwrap_or_else(|| median_turn(lens, sightings));
    let mut scale = WIDEST;
    let mut weights = vec![0.0; sightings.len()];
    let mut information = Matrix4::zeros();
    let mut squares = vec![f64::INFINITY; sightings.len()];
    for _ in 0..STEPS {
        let rotation = turn.rotation();
        information = Matrix4::identity() * 1e-9;
        let mut gradient = Vector4::zeros();
        for (i, sighting) in sightings.iter().enumerate() {
            (weights[i], squares[i]) = (0.0, f64::INFINITY);
            let Some((off, by_turn)) = residual(lens, &turn, &rotation, sighting) else { continue };
            squares[i] = off.norm_squared();
            let weight = (scale * scale / (scale * scale + squares[i])).powi(2);
            weights[i] = weight;
            information += by_turn.transpose() * by_turn * weight;
            gradient += by_turn.transpose() * off * weight;
        }
        turn = turn.stepped(&information.cholesky()?.solve(&gradient));
        scale = (scale / SHRINK).max(NARROWEST);
    }
    let near: Vec<f64> = squares.iter().copied().filter(|s| *s < NEAR).collect();
    let free = (2 * near.len()).saturating_sub(4).max(1) as f64;
    let scatter = (near.iter().sum::<f64>() / free).max(1.0);
    let covariance = information.try_inverse()? * scatter * SHARED;
    let is_finite = turn.vector().iter().chain(covariance.iter()).all(|v| v.is_finite());
    is_finite.then_some(Fit { turn, covariance, weights })
}

/// Offset of a sighting from the predicted pixel, with the derivative, both in the patch's standard
/// deviations.
fn residual(
    lens: &Lens,
    turn: &Turn,
    rotation: &nalgebra::UnitQuaternion<f64>,
    sighting: &Sighting,
) -> Option<(Vector2<f64>, Matrix2x4<f64>)> {
    let own = Turn { log_focal: turn.log_focal - sighting.log_focal, ..*turn };
    let seen = own.see(lens, rotation, &sighting.ray)?;
    Some(((sighting.px - seen.px) / sighting.sigma_px, seen.by_turn / sighting.sigma_px))
}

/// Offset of each sighting from the predicted pixel, px; `None` outside the field.
pub fn offsets_px(lens: &Lens, turn: &Turn, sightings: &[Sighting]) -> Vec<Option<Vector2<f64>>> {
    let rotation = turn.rotation();
    let off = |sighting: &Sighting| {
        let own = Turn { log_focal: turn.log_focal - sighting.log_focal, ..*turn };
        Some(sighting.px - own.project_by(lens, &rotation, &sighting.ray)?)
    };
    sightings.iter().map(off).collect()
}

/// Turn by the median offset, exact in the middle of the picture.
fn median_turn(lens: &Lens, sightings: &[Sighting]) -> Turn {
    let offsets = offsets_px(lens, &Turn::default(), sightings);
    let of = |axis: usize| {
        let mut all: Vec<f64> = offsets.iter().flatten().map(|off| off[axis]).collect();
        median(&mut all).unwrap_or(0.0)
    };
    Turn::by_shift(lens, &Vector2::new(of(0), of(1)))
}

/// Median of the values, which are reordered; `None` for none.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Covariance added to a fitted turn by the lens's own error: each lens parameter moves rays and
/// pixels, and the fit takes the movement for a turn. It grows with the turn and is zero for an
/// unmoved camera.
pub fn lens_covariance(
    lens: &Lens,
    turn: &Turn,
    sightings: &[Sighting],
    weights: &[f64],
) -> Matrix4<f64> {
    /// Number of sightings sufficient to represent the lens's error.
    const ENOUGH: usize = 60;
    let agreeing: Vec<&Sighting> =
        sightings.iter().zip(weights).filter(|(_, w)| **w > AGREES).map(|(s, _)| s).collect();
    let every = agreeing.len().div_ceil(ENOUGH).max(1);
    let chosen: Vec<&Sighting> = agreeing.into_iter().step_by(every).collect();
    let rotation = turn.rotation();
    let mut information = Matrix4::identity() * 1e-9;
    let mut by_lens = SMatrix::<f64, 4, LENS_PARAMETERS>::zeros();
    let parameters = lens.camera.lens_parameters();
    let steps: Vec<(usize, f64, Lens)> = LensParameter::ALL
        .iter()
        .filter_map(|p| {
            let sd = lens.covariance[(p.index(), p.index())].sqrt();
            (sd > 0.0).then(|| {
                let mut moved = parameters;
                moved[p.index()] += sd;
                let camera = lens.camera.with_lens_parameters(&moved);
                (p.index(), sd, Lens { camera, ..lens.clone() })
            })
        })
        .collect();
    for sighting in chosen {
        let own = Turn { log_focal: turn.log_focal - sighting.log_focal, ..*turn };
        let Some(ray) = lens.ray(&sighting.reference_px) else { continue };
        let Some(seen) = own.see(lens, &rotation, &ray) else { continue };
        information += seen.by_turn.transpose() * seen.by_turn;
        for (index, sd, other) in &steps {
            let moved = other
                .ray(&sighting.reference_px)
                .and_then(|ray| own.project_by(other, &rotation, &ray));
            let Some(moved) = moved else { continue };
            let change = seen.by_turn.transpose() * ((seen.px - moved) / *sd);
            let mut column = by_lens.column_mut(*index);
            column += change;
        }
    }
    let Some(inverse) = information.try_inverse() else { return Matrix4::zeros() };
    let turn_by_lens = inverse * by_lens;
    let covariance: &LensMatrix = &lens.covariance;
    turn_by_lens * covariance * turn_by_lens.transpose()
}

#[cfg(test)]
mod tests {
    use boresight_geometry::{Camera, Distortion, LensKind, LensParts, frame::ImageSize};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn lenses() -> [Lens; 3] {
        let size = ImageSize { width_px: 1280, height_px: 720 };
        let centre = Point2::new(630.0, 350.0);
        let narrow = Camera::pinhole(1800.0, centre);
        let mut wide = Camera::pinhole(600.0, centre);
        wide.distortion = Distortion { k1: -0.2, k2: 0.03, p1: 1e-3, ..Distortion::default() };
        let mut fisheye = Camera::pinhole(420.0, centre);
        fisheye.distortion =
            Distortion { kind: LensKind::Fisheye, k1: 0.02, ..Distortion::default() };
        [narrow, wide, fisheye].map(|camera| Lens::new(camera, None, size))
    }

    fn sightings(lens: &Lens, turn: &Turn, wrong: f64, rng: &mut ChaCha8Rng) -> Vec<Sighting> {
        let mut all = Vec::new();
        while all.len() < 120 {
            let reference_px =
                Point2::new(rng.random_range(30.0..1250.0), rng.random_range(30.0..690.0));
            let Some(ray) = lens.ray(&reference_px) else { continue };
            let Some(mut px) = turn.project(lens, &ray) else { continue };
            px += Vector2::new(rng.random_range(-0.3..0.3), rng.random_range(-0.3..0.3));
            if rng.random_bool(wrong) {
                px += Vector2::new(rng.random_range(-30.0..30.0), rng.random_range(-30.0..30.0));
            }
            all.push(Sighting { ray, reference_px, log_focal: 0.0, px, sigma_px: 0.3 });
        }
        all
    }

    #[test]
    fn a_turn_is_found_through_any_lens_among_a_third_of_wrong_patches() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for lens in lenses() {
            let pan_rad = 8.0 / lens.camera.f_px.x;
            let truth = Turn { pan_rad, tilt_rad: -pan_rad, roll_rad: 0.004, log_focal: 0.003 };
            let seen = sightings(&lens, &truth, 0.33, &mut rng);
            let found = fit(&lens, &seen, None).expect("a fit");
            let off = (found.turn.vector() - truth.vector())
                .component_mul(&crate::turn::px_per_turn(&lens));
            assert!(off.amax() < 0.12, "{off}");
            assert!((70..=90).contains(&found.inliers()), "{}", found.inliers());
            let sd = found.covariance.diagonal().map(f64::sqrt);
            let errors = (found.turn.vector() - truth.vector()).component_div(&sd);
            assert!(errors.amax() < 4.0, "{errors}");
        }
    }

    #[test]
    fn the_lens_error_grows_with_the_turn_and_is_none_without() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let [mut lens, ..] = lenses();
        // A focal length wrong by 1 % makes a pan wrong by 1 %.
        lens.covariance = LensMatrix::zeros();
        let f = (0.01 * 1800.0_f64).powi(2);
        lens.covariance.set_block(
            LensParameter::F,
            LensParameter::F,
            &nalgebra::Matrix2::repeat(f),
        );
        for (pan_rad, wanted) in [(0.0, 0.0), (0.01, 1e-4), (0.1, 1e-3)] {
            let turn = Turn { pan_rad, ..Turn::default() };
            let seen = sightings(&lens, &turn, 0.0, &mut rng);
            let sd = lens_covariance(&lens, &turn, &seen, &vec![1.0; seen.len()])[(0, 0)].sqrt();
            assert!((sd - wanted).abs() <= 0.3 * wanted + 1e-9, "{pan_rad}: {sd}");
        }
    }

    #[test]
    fn too_few_sightings_fix_nothing() {
        let [lens, ..] = lenses();
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let seen = sightings(&lens, &Turn::default(), 0.0, &mut rng);
        assert!(fit(&lens, &seen[..3], None).is_none());
    }
}
