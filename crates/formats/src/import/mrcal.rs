use serde_json::Value;

use super::{
    numbers::{exactly, lens, list},
    old_calibration::{NotImported, OldCalibration, OldFormat},
};
use boresight_geometry::LensKind;

/// Reads an mrcal `.cameramodel`: `LENSMODEL_PINHOLE` and `LENSMODEL_OPENCV…`. The camera's pose is
/// ignored.
pub(super) fn read(tree: &Value) -> Result<OldCalibration, NotImported> {
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    let model =
        tree["lensmodel"].as_str().ok_or(missing("lensmodel", "the name of a lens model"))?;
    let coefficients = match model {
        "LENSMODEL_PINHOLE" => 0,
        "LENSMODEL_OPENCV4" => 4,
        "LENSMODEL_OPENCV5" => 5,
        "LENSMODEL_OPENCV8" => 8,
        "LENSMODEL_OPENCV12" => 12,
        _ => return Err(NotImported::Model { found: model.into() }),
    };
    let wanted = "as many finite numbers as the lens model has";
    let intrinsics = list(&tree["intrinsics"])
        .filter(|intrinsics| intrinsics.len() == 4 + coefficients)
        .ok_or(missing("intrinsics", wanted))?;
    let [fx, fy, cx, cy, coefficients @ ..] = &intrinsics[..] else {
        return Err(missing("intrinsics", wanted));
    };
    let size = exactly(&tree["imagersize"]).ok_or(missing("imagersize", "2 finite numbers"))?;
    let lens = lens([*fx, *fy, *cx, *cy], coefficients)?;
    OldCalibration::new(OldFormat::Mrcal, LensKind::Perspective, &lens, size)
}
