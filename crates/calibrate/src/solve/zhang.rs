//! Baseline method: Zhang, "A flexible new technique for camera calibration", IEEE PAMI 2000.
//! Closed form and refinement.

use nalgebra::{DMatrix, Isometry3, Matrix3, Point2, Vector2};

use super::{
    bundle::{Bundle, BundleState, Observations, adjust_from},
    lens_model::LensModel,
    schur_lm::Limits,
};
use boresight_geometry::{Camera, Distortion, frame::ImageSize};

/// Zhang's closed form with zero skew (section 3.1 and appendix B), from at least two homographies,
/// board → pixels.
///
/// Each `image_from_board = [h₁ h₂ h₃]` gives two linear equations `h₁ᵀ B h₂ = 0` and
/// `h₁ᵀ B h₁ = h₂ᵀ B h₂` in the image of the absolute conic `B ∝ K⁻ᵀ K⁻¹`. Pixels are centred and
/// scaled first. `None` with fewer than two homographies, or if the solution isn't a camera:
/// parallel boards, or too much noise.
pub fn closed_form(image_from_board: &[Matrix3<f64>], image_size: ImageSize) -> Option<Camera> {
    if image_from_board.len() < 2 {
        return None;
    }
    let centre = image_size.centre_px();
    let scale_px = f64::from(image_size.width_px.max(image_size.height_px)) / 2.0;
    let normalized_from_image = Matrix3::new(
        1.0 / scale_px,
        0.0,
        -centre.x / scale_px,
        0.0,
        1.0 / scale_px,
        -centre.y / scale_px,
        0.0,
        0.0,
        1.0,
    );
    // At least five rows, so that the null vector of two views is among the singular vectors.
    let mut equations = DMatrix::<f64>::zeros((2 * image_from_board.len()).max(5), 5);
    for (view, image_from_board) in image_from_board.iter().enumerate() {
        let h = normalized_from_image * image_from_board;
        let h = h / (h.column(0).norm_squared() + h.column(1).norm_squared()).sqrt();
        let product = |i: usize, j: usize| {
            let (a, b) = (h.column(i), h.column(j));
            [
                a[0] * b[0],
                a[1] * b[1],
                a[2] * b[0] + a[0] * b[2],
                a[2] * b[1] + a[1] * b[2],
                a[2] * b[2],
            ]
        };
        let (cross, first, second) = (product(0, 1), product(0, 0), product(1, 1));
        for k in 0..5 {
            equations[(2 * view, k)] = cross[k];
            equations[(2 * view + 1, k)] = first[k] - second[k];
        }
    }
    if equations.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let svd = equations.try_svd(false, true, 1e-15, 10_000)?;
    let v_transposed = svd.v_t.as_ref()?;
    let smallest = svd.singular_values.imin();
    let conic = v_transposed.row(smallest);
    let (b11, b22, b13, b23, b33) = (conic[0], conic[1], conic[2], conic[3], conic[4]);
    let lambda = b33 - b13 * b13 / b11 - b23 * b23 / b22;
    let f = Vector2::new((lambda / b11).sqrt(), (lambda / b22).sqrt());
    let pp = Point2::new(-b13 / b11, -b23 / b22);
    let plausible = |f: f64| (0.05..1000.0).contains(&f);
    if !(plausible(f.x) && plausible(f.y) && pp.coords.norm() < 100.0) {
        return None;
    }
    Some(Camera {
        f_px: f * scale_px,
        pp_px: centre + pp.coords * scale_px,
        distortion: Distortion::default(),
    })
}

/// Zhang's complete method: refines `start` by minimising the reprojection error with free fx, fy
/// and no priors (section 3.2).
///
/// `None` if the fit doesn't converge to a camera.
pub fn refined(
    observations: &Observations,
    model: LensModel,
    start: Camera,
    cam_from_board: Vec<Isometry3<f64>>,
) -> Option<Bundle> {
    let state = BundleState { camera: start, cam_from_board };
    refined_from(observations, model, state, Limits::GUESS)
}

/// [`refined`] from the minimum of a bundle with the same lens model.
pub(crate) fn refined_near(
    observations: &Observations,
    model: LensModel,
    state: BundleState,
) -> Option<Bundle> {
    refined_from(observations, model, state, Limits::NEAR)
}

fn refined_from(
    observations: &Observations,
    model: LensModel,
    state: BundleState,
    limits: Limits,
) -> Option<Bundle> {
    let bundle = adjust_from(observations, &model.freedom(false), None, state, limits)?;
    let camera = &bundle.state.camera;
    (bundle.converged && camera.f_px.iter().all(|f| f.is_finite() && *f > 0.0)).then_some(bundle)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn homography(camera: &Camera, pose: &Isometry3<f64>) -> Matrix3<f64> {
        let rotation = pose.rotation.to_rotation_matrix();
        let k = Matrix3::new(
            camera.f_px.x,
            0.0,
            camera.pp_px.x,
            0.0,
            camera.f_px.y,
            camera.pp_px.y,
            0.0,
            0.0,
            1.0,
        );
        k * Matrix3::from_columns(&[
            rotation.matrix().column(0).into(),
            rotation.matrix().column(1).into(),
            pose.translation.vector,
        ])
    }

    #[test]
    fn exact_homographies_give_the_camera_back() {
        let size = ImageSize { width_px: 1280, height_px: 720 };
        let camera = Camera {
            f_px: Vector2::new(900.0, 910.0),
            pp_px: Point2::new(652.3, 351.8),
            distortion: Distortion::default(),
        };
        let turns = [(0.7, 0.1, 0.0), (-0.1, 0.6, 0.2), (-0.5, -0.4, 0.1), (0.3, -0.6, 0.0)];
        let homographies = turns.map(|(x, y, z)| {
            homography(
                &camera,
                &Isometry3::new(Vector3::new(0.02, -0.03, 0.8), Vector3::new(x, y, z)),
            )
        });
        for count in 3..=4 {
            let found = closed_form(&homographies[..count], size).expect("a camera");
            assert!((found.f_px - camera.f_px).norm() < 1e-8);
            assert!((found.pp_px - camera.pp_px).norm() < 1e-8);
        }
        assert_eq!(closed_form(&homographies[..1], size), None);
    }

    #[test]
    fn parallel_boards_do_not_panic() {
        let size = ImageSize { width_px: 1280, height_px: 720 };
        let camera = Camera::pinhole(900.0, size.centre_px());
        let frontal = homography(&camera, &Isometry3::translation(0.1, 0.0, 0.8));
        // Every result is finite.
        if let Some(camera) = closed_form(&[frontal, frontal, frontal], size) {
            assert!(camera.f_px.iter().all(|f| f.is_finite()));
        }
        assert_eq!(closed_form(&[Matrix3::zeros(), Matrix3::zeros()], size), None);
    }
}
