use serde_json::Value;

use super::{
    numbers::{exactly, lens, list},
    old_calibration::{NotImported, OldCalibration, OldFormat},
};

/// Reads the first camera of a Kalibr camchain: `pinhole` with `radtan` (k1 k2 p1 p2) or no distortion.
pub(super) fn read(tree: &Value) -> Result<OldCalibration, NotImported> {
    let camera = &tree["cam0"];
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    let named = |name| {
        camera[name].as_str().ok_or(NotImported::Missing { name, wanted: "the name of a model" })
    };
    let model = named("camera_model")?;
    let distortion = named("distortion_model")?;
    if model != "pinhole" || !matches!(distortion, "radtan" | "none") {
        return Err(NotImported::Model { found: format!("{model}-{distortion}") });
    }
    let intrinsics =
        exactly(&camera["intrinsics"]).ok_or(missing("cam0's intrinsics", "4 finite numbers"))?;
    let coefficients = if distortion == "none" {
        Vec::new()
    } else {
        list(&camera["distortion_coeffs"])
            .filter(|coefficients| coefficients.len() == 4)
            .ok_or(missing("cam0's distortion_coeffs", "4 finite numbers"))?
    };
    let size =
        exactly(&camera["resolution"]).ok_or(missing("cam0's resolution", "2 finite numbers"))?;
    let mut old = OldCalibration::new(OldFormat::Kalibr, &lens(intrinsics, &coefficients)?, size)?;
    old.source = camera["rostopic"].as_str().map(Into::into);
    old.camera_count = (0..).take_while(|i| tree.get(format!("cam{i}")).is_some()).count();
    Ok(old)
}
