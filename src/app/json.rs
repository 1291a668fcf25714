//! What machines read on stdout. The schema is in the README; more fields may come, none go.

use nalgebra::SMatrix;
use serde_json::{Value, json};

use crate::{
    board::Checkerboard,
    calibration::{
        Calibration, Focal, ModelFit, NotCalibrated, PrincipalPointEstimate, ViewResult,
    },
    detection::{Detection, Miss, Quality},
    frame::ImageSize,
    geometry::{BoardOutline, Camera, LENS_PARAMETERS},
    text,
};

/// Name and fate of a picture, beside the numbers of its view.
pub struct ViewName {
    /// File name of the picture.
    pub name: String,
    /// Why it was not used; `None` if it was.
    pub reason: Option<String>,
}

/// `boresight.calibration/1`.
pub fn calibration(
    result: Result<&Calibration, &NotCalibrated>,
    image_size: ImageSize,
    board: &Checkerboard,
    names: &[ViewName],
) -> Value {
    let image_size = json!([image_size.width_px, image_size.height_px]);
    let shown = json!({
        "columns": board.columns(), "rows": board.rows(), "square_mm": 1000.0 * board.square_m(),
    });
    let calibration = match result {
        Ok(calibration) => calibration,
        Err(reason) => {
            let (message, action) = text::not_calibrated(reason);
            let unused: Vec<Value> = names
                .iter()
                .map(|view| json!({ "name": view.name, "used": false, "reason": view.reason }))
                .collect();
            return json!({
                "schema": "boresight.calibration/1", "image_size": image_size, "board": shown,
                "verdict": "untrustworthy",
                "findings": [{ "code": reason.code(), "severity": "bad", "message": message, "action": action }],
                "result": null, "principal_point": null, "views": unused,
            });
        }
    };
    let findings: Vec<Value> = calibration
        .findings
        .iter()
        .map(|finding| {
            let (message, action) = text::finding(finding);
            json!({
                "code": finding.code.code(), "severity": finding.severity.code(),
                "message": message, "action": action,
            })
        })
        .collect();
    let grid: Vec<[f64; 3]> = calibration
        .projection_sd
        .grid
        .iter()
        .map(|point| [point.px.x, point.px.y, point.sd_px])
        .collect();
    json!({
        "schema": "boresight.calibration/1",
        "image_size": image_size,
        "board": shown,
        "verdict": calibration.verdict.code(),
        "findings": findings,
        "result": lens(calibration),
        "candidates": calibration.candidates.iter().map(candidate).collect::<Vec<_>>(),
        "principal_point": principal_points(calibration),
        "projection_sd_px": { "mean": calibration.projection_sd.mean_px, "max": calibration.projection_sd.max_px, "grid": grid },
        "coverage": calibration.coverage,
        "views": views(calibration, board, names),
    })
}

fn lens(calibration: &Calibration) -> Value {
    const NAMES: [&str; LENS_PARAMETERS] = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"];
    let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = calibration.camera.lens_parameters();
    let sd = calibration.sd();
    let square = sd[0] == sd[1] && fx == fy;
    // The free parameters; one f for square pixels.
    let free: Vec<usize> =
        (0..LENS_PARAMETERS).filter(|&i| sd[i] > 0.0 && !(square && i == 1)).collect();
    let block = |matrix: &SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>, of: &[usize]| {
        let row = |row: usize| of.iter().map(|&column| matrix[(row, column)]).collect();
        of.iter().map(|&i| row(i)).collect::<Vec<Vec<f64>>>()
    };
    let all: Vec<usize> = (0..LENS_PARAMETERS).filter(|&i| !(square && i == 1)).collect();
    let named = |of: &[usize]| -> Vec<&str> {
        of.iter().map(|&i| if square && i == 0 { "f" } else { NAMES[i] }).collect()
    };
    json!({
        "model": calibration.model.code(),
        "focal": focal(calibration.focal),
        "f_px": [fx, fy], "pp_px": [cx, cy],
        "distortion": { "k1": k1, "k2": k2, "p1": p1, "p2": p2, "k3": k3 },
        "sigma": {
            "f_px": [sd[0], sd[1]], "pp_px": [sd[2], sd[3]],
            "k1": sd[4], "k2": sd[5], "p1": sd[6], "p2": sd[7], "k3": sd[8],
        },
        "covariance": { "order": named(&free), "matrix": block(&calibration.covariance, &free) },
        "covariance_all": { "order": named(&all), "matrix": block(&calibration.covariance_all, &all) },
        "rms_px": calibration.rms_px, "noise_px": calibration.noise_px,
        "excess_px": calibration.excess_px, "noise_factor": calibration.noise_factor,
    })
}

/// A lens model that was tried.
fn candidate(fit: &ModelFit) -> Value {
    let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = fit.camera.lens_parameters();
    json!({
        "model": fit.model.code(), "weight": fit.weight,
        "cost": fit.cost, "noise_factor": fit.noise_factor,
        "f_px": [fx, fy], "pp_px": [cx, cy],
        "distortion": { "k1": k1, "k2": k2, "p1": p1, "p2": p2, "k3": k3 },
    })
}

/// Whether `f_px` is every view's or only their mean.
fn focal(focal: Focal) -> Value {
    match focal {
        Focal::Common => json!({ "varies": false }),
        Focal::Varying { scatter_px } => json!({ "varies": true, "scatter_px": scatter_px }),
    }
}

fn principal_points(calibration: &Calibration) -> Value {
    let points = &calibration.principal_point;
    let estimate = |estimate: &Option<PrincipalPointEstimate>| {
        estimate.as_ref().map(|estimate| {
            let mut value = json!({ "px": [estimate.px.x, estimate.px.y] });
            if let Some(c) = &estimate.covariance_px2 {
                value["sigma_px"] = json!([c[(0, 0)].max(0.0).sqrt(), c[(1, 1)].max(0.0).sqrt()]);
                value["covariance_px2"] = json!([[c[(0, 0)], c[(0, 1)]], [c[(1, 0)], c[(1, 1)]]]);
            }
            if let Some(f) = &estimate.f_px {
                value["f_px"] = if f.x == f.y { json!(f.x) } else { json!([f.x, f.y]) };
            }
            value
        })
    };
    json!({
        "pl_unweighted": estimate(&points.pl_unweighted),
        "pl_weighted": estimate(&points.pl_weighted),
        "pl_ring": estimate(&points.pl_ring),
        "free_homography": estimate(&points.free_homography),
        "bundle": estimate(&points.bundle),
        "zhang": estimate(&points.zhang),
    })
}

/// One object per picture: those used carry their numbers, in the order of the solver's views.
fn views(calibration: &Calibration, board: &Checkerboard, names: &[ViewName]) -> Vec<Value> {
    let mut results = calibration.views.iter().enumerate();
    names
        .iter()
        .map(|view| {
            let result = if view.reason.is_none() { results.next() } else { None };
            let Some((number, result)) = result else {
                return json!({ "name": view.name, "used": false, "reason": view.reason });
            };
            let line = result.principal_line.as_ref().map(|line| {
                let foot = line.origin_px + line.normal() * line.c_px;
                json!({
                    "phi_rad": line.phi_rad, "c_px": line.c_px,
                    "sigma_phi_rad": line.sigma_phi_rad(), "sigma_c_px": line.sigma_c_px(),
                    "x0_px": [line.origin_px.x, line.origin_px.y], "foot_px": [foot.x, foot.y],
                })
            });
            let t = &result.cam_from_board.translation.vector;
            let q = result.cam_from_board.rotation.quaternion();
            json!({
                "name": view.name, "used": true, "reason": null,
                "cam_from_board": {
                    "rotation_wxyz": [q.w, q.i, q.j, q.k], "translation_m": [t.x, t.y, t.z],
                },
                "outline_px": outline_px(&calibration.camera_of(number), board, result),
                "tilt_deg": result.tilt_rad.to_degrees(), "slot_deg": result.tilt_azimuth_rad.to_degrees(),
                "rms_px": result.residual_rms_px,
                "pl": line, "pl_residual_px": result.pl_residual_px,
                "focal_px": result.focal.map(|focal| focal.f_px),
                "focal_sigma_px": result.focal.map(|focal| focal.sigma_px),
                "focal_as_seen_px": result.focal_as_seen.map(|focal| focal.f_px),
            })
        })
        .collect()
}

/// Where the board's outermost inner corners are, in order around it.
fn outline_px(camera: &Camera, board: &Checkerboard, view: &ViewResult) -> Option<[[f64; 2]; 4]> {
    let seen =
        |point_m| camera.project_board_point(&view.cam_from_board, point_m).map(|seen| seen.px);
    let px: Vec<_> = board.corners_in_board_m().iter().map(seen).collect::<Option<_>>()?;
    let outline = BoardOutline::of(&px, board.columns())?;
    Some(outline.corners_px().map(|px| [px.x, px.y]))
}

/// One line of `detect --json`.
pub fn detection(
    file: &str,
    board: &Checkerboard,
    seen: &Result<Detection, Miss>,
    millis: f64,
) -> Value {
    let corners: Option<Vec<Value>> = seen.as_ref().ok().map(|detection| {
        detection
            .corners
            .iter()
            .enumerate()
            .map(|(i, corner)| {
                let (column, row) = (i % board.columns(), i / board.columns());
                json!([column, row, corner.px.x, corner.px.y, corner.sigma_px()])
            })
            .collect()
    });
    let quality = seen.as_ref().ok().map(|detection| {
        let Quality { blur_px, contrast, glare, motion_px } = detection.quality;
        json!({ "blur_px": blur_px, "contrast": contrast, "glare": glare, "motion_px": motion_px })
    });
    json!({
        "file": file, "found": seen.is_ok(), "reason": seen.as_ref().err().map(text::miss),
        "board": [board.columns(), board.rows()], "corners": corners, "quality": quality,
        "millis": millis,
    })
}
