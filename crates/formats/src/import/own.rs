use nalgebra::Point2;
use serde_json::Value;

use super::old_calibration::{LockedLens, NotImported, OldCalibration, OldFormat};
use crate::{
    calibration_file::{CalibrationFile, LensEntry},
    named_covariance::{LensCovariance, NamedCovariance},
    schema::NotRead,
};
use boresight_geometry::BoardOutline;

/// Reads `boresight.calibration/1`.
pub(super) fn read(tree: &Value) -> Result<OldCalibration, NotImported> {
    let file = CalibrationFile::read(tree).map_err(|err| match err {
        NotRead::Schema { found, .. } => NotImported::Schema { found },
        NotRead::Field { reason } => NotImported::Malformed { reason },
    })?;
    let lens = file.result.as_ref().ok_or(NotImported::NoResult)?;
    let size = file.image_size.map(f64::from);
    let camera = lens.camera();
    let kind = camera.distortion.kind;
    let mut old = OldCalibration::new(OldFormat::Own, kind, &camera.lens_parameters(), size)?;
    old.rms_px = lens.rms_px;
    old.covariance = covariance(lens);
    old.outlines = file
        .views
        .iter()
        .filter_map(|view| BoardOutline::around(view.outline_px?.map(Point2::from)))
        .collect();
    old.verdict = file.known_verdict();
    old.board = file.checkerboard();
    old.focal_varies = lens.focal_varies();
    if let Some(camera) = file.camera.flatten() {
        old.locked = LockedLens { focus: camera.focus, zoom: camera.zoom };
    }
    old.source = file.source;
    Ok(old)
}

/// Covariance of all parameters if given. The doubt about coefficients held at zero is correlated
/// with the others' doubt: without it, theirs would grow.
fn covariance(lens: &LensEntry) -> Option<LensCovariance> {
    let named = |named: &Option<NamedCovariance>| named.as_ref()?.full();
    named(&lens.covariance_all).or_else(|| named(&lens.covariance))
}
