use serde_json::Value;

use super::{
    numbers::{exactly, fisheye_lens, lens},
    old_calibration::{NotImported, OldCalibration, OldFormat},
};
use boresight_geometry::LensKind;

/// Reads the first camera of a Kalibr camchain: `pinhole` with `radtan` (k1 k2 p1 p2),
/// `equidistant` (k1 k2 k3 k4) or no distortion.
pub(super) fn read(tree: &Value) -> Result<OldCalibration, NotImported> {
    let camera = &tree["cam0"];
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    let named = |name| {
        camera[name].as_str().ok_or(NotImported::Missing { name, wanted: "the name of a model" })
    };
    let model = named("camera_model")?;
    let distortion = named("distortion_model")?;
    if model != "pinhole" || !matches!(distortion, "radtan" | "equidistant" | "none") {
        return Err(NotImported::Model { found: format!("{model}-{distortion}") });
    }
    let intrinsics =
        exactly(&camera["intrinsics"]).ok_or(missing("cam0's intrinsics", "4 finite numbers"))?;
    let coefficients = if distortion == "none" {
        [0.0; 4]
    } else {
        exactly(&camera["distortion_coeffs"])
            .ok_or(missing("cam0's distortion_coeffs", "4 finite numbers"))?
    };
    let (kind, lens) = if distortion == "equidistant" {
        (LensKind::Fisheye, fisheye_lens(intrinsics, coefficients))
    } else {
        (LensKind::Perspective, lens(intrinsics, &coefficients)?)
    };
    let size =
        exactly(&camera["resolution"]).ok_or(missing("cam0's resolution", "2 finite numbers"))?;
    let mut old = OldCalibration::new(OldFormat::Kalibr, kind, &lens, size)?;
    old.source = camera["rostopic"].as_str().map(Into::into);
    old.camera_count = (0..).take_while(|i| tree.get(format!("cam{i}")).is_some()).count();
    Ok(old)
}
