//! Bundle adjustment and free homographies against independently computed minima.

use boresight_calibrate::{
    BundleState, LensModel, Observations, adjust,
    free_homography::{self, DistortionCentrePrior},
    zhang,
};
use boresight_geometry::{
    BROWN_PARAMETERS, Camera, Corner, Homography, frame::ImageSize, pose_from_homography,
};
use boresight_testkit::reference::{list, number, point, vectors};
use nalgebra::{Matrix3, Point2};
use serde_json::Value;

/// Reference with the middle of the picture at (960, 540).
const SIZE: ImageSize = ImageSize { width_px: 1921, height_px: 1081 };

struct Set {
    name: String,
    observations: Observations,
    image_from_board: Vec<Matrix3<f64>>,
    models: Value,
    free: Value,
}

fn sets() -> Vec<Set> {
    let (corners, ba) = (vectors("ref_corners"), vectors("ref_ba"));
    list(&corners["sets"])
        .iter()
        .zip(list(&ba["sets"]))
        .map(|(set, minima)| {
            assert_eq!(set["name"], minima["name"]);
            let board: Vec<Point2<f64>> =
                list(&set["board"]).iter().map(|p| point(p) / 1000.0).collect();
            let views: Vec<Vec<Corner>> = list(&set["corners"])
                .iter()
                .map(|view| list(view).iter().map(|p| Corner::isotropic(point(p), 1.0)).collect())
                .collect();
            let slices: Vec<&[Corner]> = views.iter().map(Vec::as_slice).collect();
            let homography = |view: &Vec<Corner>| {
                *Homography::fit(&board, view).expect("a flat board").image_from_board()
            };
            Set {
                name: set["name"].as_str().expect("name").to_owned(),
                observations: Observations::new(&board, &slices).expect("valid corners"),
                image_from_board: views.iter().map(homography).collect(),
                models: minima["models"].clone(),
                free: minima["free_homography_distortion"].clone(),
            }
        })
        .collect()
}

#[test]
fn bundle_adjustment_finds_the_reference_minima() {
    let models = [
        ("k0", LensModel::Pinhole),
        ("k1", LensModel::K1),
        ("k12", LensModel::K1K2),
        ("k12p", LensModel::K1K2P1P2),
        ("full", LensModel::K1K2P1P2K3),
    ];
    for set in sets() {
        for (name, model) in models {
            let what = format!("{} {name}", set.name);
            let camera = Camera::pinhole(1300.0, Point2::new(960.0, 540.0));
            let cam_from_board = set
                .image_from_board
                .iter()
                .map(|h| pose_from_homography(h, &camera).expect("in front"))
                .collect();
            let start = BundleState { camera, cam_from_board };
            let bundle =
                adjust(&set.observations, &model.freedom(true), None, start).expect("determined");
            assert!(bundle.converged, "{what}");
            let reference = &set.models[name];
            let theta = &reference["theta_f_cx_cy_k1_k2_p1_p2_k3"];
            let found = bundle.state.camera.lens_parameters();
            for (i, found) in found[1..BROWN_PARAMETERS].iter().enumerate() {
                let off = (found - number(&theta[i])).abs();
                // Pixels, then coefficients.
                let tolerance = [1e-7, 1e-7, 1e-7, 1e-8, 1e-8, 1e-9, 1e-9, 1e-7][i];
                assert!(off < tolerance, "{what} parameter {i}: off by {off:e}");
            }
            let cost = number(&reference["cost_sum_sq"]);
            assert!((bundle.cost - cost).abs() < 1e-10 * cost.max(1e-6), "{what} cost");
            let covariance = bundle.covariance(1.0).expect("determined");
            let wanted = list(&reference["unit_cov"]);
            for (i, row) in wanted.iter().enumerate() {
                for (j, wanted_ij) in list(row).iter().enumerate() {
                    let scale = (number(&wanted[i][i]) * number(&wanted[j][j])).sqrt();
                    let off = (covariance[(i + 1, j + 1)] - number(wanted_ij)).abs() / scale;
                    assert!(off < 1e-6, "{what} covariance {i} {j}: off by {off:e}");
                }
            }
        }
    }
}

#[test]
fn free_homographies_find_the_reference_minima() {
    for set in sets() {
        // The reference has no prior; without distortion and noise nothing else holds the centre.
        let sd_px = if set.name == "clean" { 96.0 } else { f64::INFINITY };
        let prior = DistortionCentrePrior { px: SIZE.centre_px(), sd_px };
        let free = free_homography::fit(&set.observations, prior, &set.image_from_board)
            .expect("eight tilted views");
        let reference = &set.free;
        let off = |ours: Point2<f64>, name: &str| (ours - point(&reference[name])).norm();
        let cost = number(&reference["cost"]);
        match set.name.as_str() {
            // Without distortion the centre is arbitrary, and the reference stopped along the way.
            "noisy0.3" => assert!(free.cost <= cost && off(free.pp_px, "pp_pl") < 0.5),
            name => {
                assert!(off(free.pp_px, "pp_pl") < 1e-6, "{name}: {:e}", off(free.pp_px, "pp_pl"));
                assert!(off(free.distortion_centre_px, "DC") < 2e-6, "{name}");
                assert!((free.k[0] - number(&reference["K1"])).abs() < 1e-8, "{name}");
                assert!((free.k[1] - number(&reference["K2"])).abs() < 1e-7, "{name}");
                assert!((free.cost - cost).abs() < 1e-9 * cost.max(1e-6), "{name}");
            }
        }
    }
}

#[test]
fn zhang_is_exact_on_exact_corners() {
    for set in sets().iter().filter(|set| set.name == "clean") {
        let camera = zhang::closed_form(&set.image_from_board, SIZE).expect("a camera");
        assert!((camera.f_px.x - 1400.0).abs() < 1e-6 && (camera.f_px.y - 1400.0).abs() < 1e-6);
        assert!((camera.pp_px - Point2::new(975.25, 531.5)).norm() < 1e-6);
    }
}
