//! Formats with named numbers: ORB-SLAM3, `transforms.json`, Metashape, RealityCapture, Basalt,
//! VINS, PhotonVision, Gyroflow, Open3D.

use serde_json::Value;

use super::{
    numbers::{exactly, fisheye_lens, lens, sized},
    old_calibration::{NotImported, OldCalibration, OldFormat},
    own_corners,
};
use boresight_geometry::LensKind;

const NUMBER: &str = "a finite number";
const FOUR: [&str; 4] = ["k1", "k2", "k3", "k4"];
const INTRINSICS: [&str; 4] = ["fx", "fy", "cx", "cy"];

/// The number under `name`.
fn number(tree: &Value, name: &'static str) -> Result<f64, NotImported> {
    let number = tree[name].as_f64().filter(|number| number.is_finite());
    number.ok_or(NotImported::Missing { name, wanted: NUMBER })
}

/// The number under `name`, 0 if missing.
fn or_zero(tree: &Value, name: &'static str) -> Result<f64, NotImported> {
    if tree.get(name).is_none() { Ok(0.0) } else { number(tree, name) }
}

fn all<const N: usize>(
    tree: &Value,
    names: [&'static str; N],
    read: fn(&Value, &'static str) -> Result<f64, NotImported>,
) -> Result<[f64; N], NotImported> {
    let mut values = [0.0; N];
    for (value, name) in values.iter_mut().zip(names) {
        *value = read(tree, name)?;
    }
    Ok(values)
}

fn other_model<T>(found: &str) -> Result<T, NotImported> {
    Err(NotImported::Model { found: found.into() })
}

/// Refuses unsupported coefficients of the format unless zero.
fn only_zero(tree: &Value, names: &[&'static str]) -> Result<(), NotImported> {
    for name in names {
        let value = or_zero(tree, name)?;
        if value != 0.0 {
            return Err(NotImported::Coefficient { coefficient: name, value: value.to_string() });
        }
    }
    Ok(())
}

/// A lens of Brown's model or OpenCV's fisheye, from named coefficients of a file.
enum Named {
    Brown([f64; 5]),
    Fisheye([f64; 4]),
}

impl Named {
    fn calibration(
        self,
        format: OldFormat,
        intrinsics: [f64; 4],
        size: [f64; 2],
    ) -> Result<OldCalibration, NotImported> {
        match self {
            Self::Brown(coefficients) => {
                let lens = lens(intrinsics, &coefficients)?;
                OldCalibration::new(format, LensKind::Perspective, &lens, size)
            }
            Self::Fisheye(coefficients) => {
                let lens = fisheye_lens(intrinsics, coefficients);
                OldCalibration::new(format, LensKind::Fisheye, &lens, size)
            }
        }
    }
}

/// ORB-SLAM3's settings, of version 1.0 (`Camera1.fx`) and before (`Camera.fx`). The first camera
/// is read.
pub(super) fn orb_slam(
    tree: &Value,
    stated: Option<[f64; 2]>,
) -> Result<OldCalibration, NotImported> {
    let model = tree["Camera.type"].as_str().unwrap_or_default();
    let under = |prefix: &str| {
        let numbers = tree.as_object().into_iter().flatten();
        let named = numbers
            .filter_map(|(key, value)| Some((key.strip_prefix(prefix)?.to_owned(), value.clone())));
        Value::Object(named.collect())
    };
    let numbers = under(if tree.get("Camera1.fx").is_some() { "Camera1." } else { "Camera." });
    let lens = match model {
        "PinHole" => Named::Brown(all(&numbers, ["k1", "k2", "p1", "p2", "k3"], or_zero)?),
        "KannalaBrandt8" => Named::Fisheye(all(&numbers, FOUR, number)?),
        other => return other_model(other),
    };
    let size = sized(all(tree, ["Camera.width", "Camera.height"], number).ok(), stated)?;
    lens.calibration(OldFormat::OrbSlam3, all(&numbers, INTRINSICS, number)?, size)
}

/// `transforms.json` of Nerfstudio, which names the model, and of instant-ngp, which says
/// `is_fisheye` instead. They count pixels from the corner of the top-left one.
pub(super) fn nerf(tree: &Value, stated: Option<[f64; 2]>) -> Result<OldCalibration, NotImported> {
    // instant-ngp's lenses with other coefficients.
    for other in ["ftheta_p0", "latlong", "equirectangular"] {
        if tree.get(other).is_some() {
            return other_model(other);
        }
    }
    let is_fisheye = tree["is_fisheye"] == true;
    let usual = if is_fisheye { "OPENCV_FISHEYE" } else { "OPENCV" };
    let lens = match tree["camera_model"].as_str().unwrap_or(usual) {
        found @ ("OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE") if is_fisheye => {
            return other_model(&format!("{found} with is_fisheye"));
        }
        "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" => {
            only_zero(tree, &["k4"])?;
            Named::Brown(all(tree, ["k1", "k2", "p1", "p2", "k3"], or_zero)?)
        }
        "OPENCV_FISHEYE" => {
            only_zero(tree, &["p1", "p2"])?;
            Named::Fisheye(all(tree, FOUR, or_zero)?)
        }
        other => return other_model(other),
    };
    let [fx, fy, cx, cy] = all(tree, ["fl_x", "fl_y", "cx", "cy"], number)?;
    let size = sized(all(tree, ["w", "h"], number).ok(), stated)?;
    lens.calibration(OldFormat::Nerf, [fx, fy, cx - 0.5, cy - 0.5], size)
}

/// Metashape's `<calibration>`. It counts from the picture's middle, with pixels from the corner of
/// the top-left one.
pub(super) fn metashape(tree: &Value) -> Result<OldCalibration, NotImported> {
    only_zero(tree, &["b2", "p3", "p4", "skew"])?;
    let lens = match tree["projection"].as_str().unwrap_or_default() {
        "frame" => {
            only_zero(tree, &["k4"])?;
            // In this order they are OpenCV's p1 and p2.
            Named::Brown(all(tree, ["k1", "k2", "p2", "p1", "k3"], or_zero)?)
        }
        "fisheye" => {
            only_zero(tree, &["p1", "p2"])?;
            Named::Fisheye(all(tree, FOUR, or_zero)?)
        }
        other => return other_model(other),
    };
    let size = all(tree, ["width", "height"], number)?;
    let fy = number(tree, "f")?;
    let [b1, cx, cy] = all(tree, ["b1", "cx", "cy"], or_zero)?;
    let middle = size.map(|side| side / 2.0 - 0.5);
    lens.calibration(OldFormat::Metashape, [fy + b1, fy, cx + middle[0], cy + middle[1]], size)
}

/// RealityCapture's XMP sidecar. Its unit is the picture's longer side.
pub(super) fn realitycapture(
    tree: &Value,
    stated_size: Option<[f64; 2]>,
) -> Result<OldCalibration, NotImported> {
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    only_zero(tree, &["Skew"])?;
    if let Some(ratio) = tree["AspectRatio"].as_f64().filter(|ratio| *ratio != 1.0) {
        let coefficient = "AspectRatio";
        return Err(NotImported::Coefficient { coefficient, value: ratio.to_string() });
    }
    let model = tree["DistortionModel"].as_str().unwrap_or_default();
    // Files of some programs leave out the coefficients absent from a model.
    let stated = super::numbers::list(&tree["DistortionCoeficients"]).unwrap_or_default();
    let mut coefficients = [0.0; 6];
    for (coefficient, stated) in coefficients.iter_mut().zip(&stated) {
        *coefficient = *stated;
    }
    let [k1, k2, k3, k4, t1, t2] = coefficients;
    let lens = match (model, stated.len()) {
        ("perspective", _) => [0.0; 5],
        ("brown3" | "brown3t2", 3..=6) if k4 == 0.0 => [k1, k2, t2, t1, k3],
        ("brown3" | "brown3t2", _) => {
            return Err(missing("DistortionCoeficients", "k1 k2 k3 0 t1 t2"));
        }
        (other, _) => return other_model(other),
    };
    let size = all(tree, ["ImageWidth", "ImageLength"], number)
        .or_else(|_| all(tree, ["PixelXDimension", "PixelYDimension"], number));
    let size = sized(size.ok(), stated_size)?;
    let longer = size[0].max(size[1]);
    let [f, u, v] = all(tree, ["FocalLength35mm", "PrincipalPointU", "PrincipalPointV"], number)?;
    let f_px = f * longer / 36.0;
    let centre = [size[0] / 2.0 - 0.5 + u * longer, size[1] / 2.0 - 0.5 + v * longer];
    let intrinsics = [f_px, f_px, centre[0], centre[1]];
    Named::Brown(lens).calibration(OldFormat::Realitycapture, intrinsics, size)
}

/// Basalt's calibration: the first camera.
pub(super) fn basalt(tree: &Value) -> Result<OldCalibration, NotImported> {
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    let cameras = tree["value0"]["intrinsics"].as_array().map_or(&[][..], Vec::as_slice);
    let camera = cameras.first().ok_or(missing("intrinsics", "a list of cameras"))?;
    let numbers = &camera["intrinsics"];
    let intrinsics = all(numbers, INTRINSICS, number)?;
    let size = exactly(&tree["value0"]["resolution"][0]);
    let size = size.ok_or(missing("resolution", "2 finite numbers a camera"))?;
    let mut old = match camera["camera_type"].as_str().unwrap_or_default() {
        "pinhole" => Named::Brown([0.0; 5]).calibration(OldFormat::Basalt, intrinsics, size)?,
        "pinhole-radtan8" => {
            let names = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];
            let lens = lens(intrinsics, &all(numbers, names, number)?)?;
            OldCalibration::new(OldFormat::Basalt, LensKind::Perspective, &lens, size)?
        }
        "kb4" => {
            let lens = Named::Fisheye(all(numbers, FOUR, number)?);
            lens.calibration(OldFormat::Basalt, intrinsics, size)?
        }
        other => return other_model(other),
    };
    old.camera_count = cameras.len();
    Ok(old)
}

/// The camera file of VINS-Mono and VINS-Fusion.
pub(super) fn vins(tree: &Value) -> Result<OldCalibration, NotImported> {
    let (bent, projection) = (&tree["distortion_parameters"], &tree["projection_parameters"]);
    let (lens, intrinsics) = match tree["model_type"].as_str().unwrap_or_default() {
        "PINHOLE" => {
            let coefficients = all(bent, ["k1", "k2", "p1", "p2", "k3"], or_zero)?;
            (Named::Brown(coefficients), all(projection, INTRINSICS, number)?)
        }
        "KANNALA_BRANDT" => {
            let coefficients = all(projection, ["k2", "k3", "k4", "k5"], number)?;
            (Named::Fisheye(coefficients), all(projection, ["mu", "mv", "u0", "v0"], number)?)
        }
        other => return other_model(other),
    };
    let size = all(tree, ["image_width", "image_height"], number)?;
    let mut old = lens.calibration(OldFormat::Vins, intrinsics, size)?;
    old.source = tree["camera_name"].as_str().map(Into::into);
    Ok(old)
}

/// A lens profile of Gyroflow with the fisheye model.
pub(super) fn gyroflow(tree: &Value) -> Result<OldCalibration, NotImported> {
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    match tree["distortion_model"].as_str() {
        None | Some("opencv_fisheye" | "") => {}
        Some(other) => return other_model(other),
    }
    let lens = &tree["fisheye_params"];
    let matrix = exactly(&lens["camera_matrix"]);
    let [fx, skew, cx, m10, fy, cy, m20, m21, m22] =
        matrix.ok_or(missing("camera_matrix", "3 x 3 finite numbers"))?;
    if [skew, m10, m20, m21, m22] != [0.0, 0.0, 0.0, 0.0, 1.0] {
        return Err(missing("camera_matrix", "that of a camera without skew"));
    }
    let coefficients = exactly(&lens["distortion_coeffs"]);
    let coefficients = coefficients.ok_or(missing("distortion_coeffs", "4 finite numbers"))?;
    let size = all(&tree["calib_dimension"], ["w", "h"], number)?;
    let mut old =
        Named::Fisheye(coefficients).calibration(OldFormat::Gyroflow, [fx, fy, cx, cy], size)?;
    old.rms_px = lens["RMS_error"].as_f64();
    old.source = tree["name"].as_str().map(Into::into);
    Ok(old)
}

/// A calibration of PhotonVision.
pub(super) fn photonvision(tree: &Value) -> Result<OldCalibration, NotImported> {
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    let matrix = exactly(&tree["cameraIntrinsics"]);
    let [fx, skew, cx, m10, fy, cy, m20, m21, m22] =
        matrix.ok_or(missing("cameraIntrinsics", "3 x 3 finite numbers"))?;
    if [skew, m10, m20, m21, m22] != [0.0, 0.0, 0.0, 0.0, 1.0] {
        return Err(missing("cameraIntrinsics", "those of a camera without skew"));
    }
    let coefficients = super::numbers::list(&tree["distCoeffs"])
        .filter(|coefficients| matches!(coefficients.len(), 4 | 5 | 8 | 12 | 14))
        .ok_or(missing("distCoeffs", "5 or 8 finite numbers"))?;
    let lens = lens([fx, fy, cx, cy], &coefficients)?;
    let size = all(&tree["resolution"], ["width", "height"], number)?;
    let old = OldCalibration::new(OldFormat::Photonvision, LensKind::Perspective, &lens, size)?;
    let corners = own_corners::of_photonvision(tree);
    Ok(OldCalibration { views: corners.as_ref().map(|own| own.views.len()), corners, ..old })
}

/// Open3D's `PinholeCameraIntrinsic`.
pub(super) fn open3d(tree: &Value) -> Result<OldCalibration, NotImported> {
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    let matrix = exactly(&tree["intrinsic_matrix"]);
    let [fx, m10, m20, skew, fy, m21, cx, cy, m22] =
        matrix.ok_or(missing("intrinsic_matrix", "9 finite numbers"))?;
    if [skew, m10, m20, m21, m22] != [0.0, 0.0, 0.0, 0.0, 1.0] {
        return Err(missing("intrinsic_matrix", "a camera matrix, column by column"));
    }
    let size = all(tree, ["width", "height"], number)?;
    Named::Brown([0.0; 5]).calibration(OldFormat::Open3d, [fx, fy, cx, cy], size)
}
