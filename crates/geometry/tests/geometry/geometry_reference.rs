//! Closed forms against independently computed reference vectors.

use boresight_geometry::{
    Corner, Homography, PrincipalLine, intersect_unweighted, intersect_weighted,
    principal_line_and_ring,
};
use boresight_testkit::reference::{list, number, point, vectors};
use nalgebra::{Matrix3, Point2, Vector2};
use serde_json::Value;

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_fn(|r, c| number(&value[r][c]))
}

#[track_caller]
fn close(ours: f64, reference: f64, relative: f64, what: &str) {
    let scale = reference.abs().max(1e-3);
    assert!((ours - reference).abs() <= relative * scale, "{what}: {ours} is not {reference}");
}

#[test]
fn homography_to_principal_line() {
    let reference = vectors("ref_H_to_PL");
    for case in list(&reference["cases"]) {
        let homography = Homography::from_matrix(&matrix(&case["H"])).expect("valid");
        let line =
            PrincipalLine::of(&homography, point(&case["x0"]), point(&case["pp"])).expect("tilted");
        let n = Vector2::new(number(&case["n"][0]), number(&case["n"][1]));
        let sign = n.dot(&line.normal()).signum();
        close(sign * line.normal().x, n.x, 1e-9, "n.x");
        close(sign * line.normal().y, n.y, 1e-9, "n.y");
        close(sign * line.c_px, number(&case["c"]), 1e-9, "c");
        close(line.d_px, number(&case["D"]), 1e-9, "D");
        let pp = point(&case["pp"]);
        close((pp - line.vanishing_point_px).norm(), number(&case["d"]), 1e-9, "d");
        close(
            line.tilt_rad(&pp).expect("fits").to_degrees(),
            number(&case["tilt_deg"]),
            1e-6,
            "tilt",
        );
        let focal = line.focal_length(&pp, &nalgebra::Matrix2::zeros()).expect("real");
        close(focal.f_px, number(&case["f_from_pl"]), 1e-9, "f");
        assert!(line.distance_px(&pp).abs() < 1e-6);
    }
}

#[test]
fn corners_to_principal_point() {
    let reference = vectors("ref_corners");
    for set in list(&reference["sets"]) {
        let x0 = point(&set["x0"]);
        let board: Vec<_> = list(&set["board"]).iter().map(point).collect();
        let mut lines = Vec::new();
        for (i, corners) in list(&set["corners"]).iter().enumerate() {
            let what = format!("{} view {i}", set["name"]);
            let corners: Vec<_> =
                list(corners).iter().map(|c| Corner::isotropic(point(c), 1.0)).collect();
            let mean = corners.iter().fold(Vector2::zeros(), |sum, c| sum + c.px.coords)
                / corners.len() as f64;
            let homography = Homography::fit(&board, &corners).expect("a plane");
            let h = matrix(&set["H_ml"][i]);
            for (ours, theirs) in homography.image_from_board().iter().zip((h / h[(2, 2)]).iter()) {
                assert!(
                    (ours - theirs).abs() <= 1e-9 * theirs.abs().max(1e-3),
                    "{what}: H {ours} {theirs}"
                );
            }
            let line = PrincipalLine::of(&homography, x0, mean.into()).expect("tilted");
            let n = Vector2::new(number(&set["n"][i][0]), number(&set["n"][i][1]));
            let sign = n.dot(&line.normal()).signum();
            close(sign * line.c_px, number(&set["c"][i]), 1e-7, &what);
            close(line.d_px, number(&set["D"][i]), 1e-8, &what);
            let scale = |k: usize| number(&set["cov_phi_c_v_D_unit_sigma"][i][k][k]).sqrt();
            // Turning n by half a turn changes the sign of c and v.
            let turned = [1.0, sign, sign, 1.0];
            for r in 0..4 {
                for c in 0..4 {
                    let theirs = number(&set["cov_phi_c_v_D_unit_sigma"][i][r][c]);
                    let ours = turned[r] * turned[c] * line.covariance[(r, c)];
                    assert!(
                        (ours - theirs).abs() <= 1e-6 * scale(r) * scale(c),
                        "{what} cov {r}{c}: {ours} {theirs}"
                    );
                }
            }
            lines.push(line);
        }
        let near = |ours: Point2<f64>, name: &str| {
            let theirs = point(&set[name]);
            assert!(
                (ours - theirs).norm() < 1e-6,
                "{} {name}: {ours} is not {theirs}",
                set["name"]
            );
        };
        let plain = intersect_unweighted(&lines).expect("crossing");
        let weighted = intersect_weighted(&lines).expect("crossing");
        let ring = principal_line_and_ring(&lines).expect("enough");
        near(plain.px, "pp_unweighted");
        near(weighted.px, "pp_weighted");
        near(ring.pp_px, "pp_pl_ring");
        close(ring.f_px, number(&set["f_pl_ring"]), 1e-9, "f ring");
        for r in 0..2 {
            for c in 0..2 {
                let close = |ours: f64, name: &str| {
                    let theirs = number(&set[name][r][c]);
                    assert!(
                        (ours - theirs).abs() < 1e-5,
                        "{} {name}: {ours} {theirs}",
                        set["name"]
                    );
                };
                close(plain.covariance_px2[(r, c)], "pp_unweighted_cov_unit");
                close(weighted.covariance_px2[(r, c)], "pp_weighted_cov_unit");
            }
        }
        for (line, i) in lines.iter().zip(0_usize..) {
            let focal = line.focal_length(&weighted.px, &nalgebra::Matrix2::zeros()).expect("real");
            close(focal.f_px, number(&set["f_per_image_at_pp_weighted"][i]), 1e-9, "f per image");
            let variance = number(&set["f_per_image_var_unit"][i]);
            close(focal.sigma_px.powi(2), variance, 1e-6, "variance of f per image");
        }
    }
}
