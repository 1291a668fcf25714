use std::fmt::Write;

use super::{
    Coefficients, ExportedCamera, NotExpressible,
    mrcal_inputs::{SolvedView, optimization_inputs},
    number::numbers,
};
use boresight_geometry::boards::Board;

/// The calibration as an mrcal `.cameramodel` at the origin of the reference frame:
/// `LENSMODEL_PINHOLE`, `LENSMODEL_OPENCV5`, or `LENSMODEL_OPENCV8` for a rational lens.
///
/// mrcal counts pixels from the centre of the top-left one, as we do.
///
/// # Errors
///
/// [`NotExpressible`] for a fisheye lens.
pub fn mrcal_cameramodel(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    cameramodel(exported, |_, _| None)
}

/// The model of [`mrcal_cameramodel`] with the `views` of `board` behind the calibration, for
/// mrcal's own estimate of uncertainty (`mrcal.projection_uncertainty`). The views are left out
/// together if their corners aren't the board's, or are too many.
///
/// # Errors
///
/// As there.
pub fn mrcal_cameramodel_with_views(
    exported: &ExportedCamera<'_>,
    board: &Board,
    views: &[SolvedView<'_>],
) -> Result<String, NotExpressible> {
    let size_px = [exported.image_size.width_px, exported.image_size.height_px];
    cameramodel(exported, |model, intrinsics| {
        optimization_inputs(model, intrinsics, size_px, board, views)
    })
}

fn cameramodel(
    exported: &ExportedCamera<'_>,
    inputs: impl FnOnce(&str, &[f64]) -> Option<String>,
) -> Result<String, NotExpressible> {
    let coefficients = exported.coefficients();
    let (model, coefficients): (_, &[f64]) = match &coefficients {
        Coefficients::None => ("LENSMODEL_PINHOLE", &[]),
        Coefficients::Brown(brown) => ("LENSMODEL_OPENCV5", brown),
        Coefficients::Rational(rational) => ("LENSMODEL_OPENCV8", rational),
        Coefficients::Fisheye(_) => return Err(NotExpressible::Lens { lens: "fisheye" }),
    };
    let intrinsics = [&exported.intrinsics(), coefficients].concat();
    let size = exported.image_size;
    let mut text = String::from("{\n");
    // Writing to a string cannot fail.
    let _ = writeln!(text, "    'lensmodel':  '{model}',\n");
    let _ = writeln!(text, "    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....");
    let _ = writeln!(text, "    'intrinsics': [ {},],\n", numbers(&intrinsics));
    let _ = writeln!(text, "    # extrinsics are rt_fromref");
    let _ = writeln!(text, "    'extrinsics': [ {},],\n", numbers(&[0.0; 6]));
    let _ = writeln!(text, "    'imagersize': [ {}, {},],", size.width_px, size.height_px);
    if let Some(inputs) = inputs(model, &intrinsics) {
        let _ = writeln!(
            text,
            "\n    'icam_intrinsics': 0,\n\n    'optimization_inputs': b'{inputs}',"
        );
    }
    text.push_str("}\n");
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::{
        super::tests::{exported, fisheye, rational},
        *,
    };
    use boresight_geometry::Distortion;

    #[test]
    fn the_model_names_its_numbers() {
        let text = mrcal_cameramodel(&exported(-0.02)).expect("Brown's");
        assert!(text.contains("'lensmodel':  'LENSMODEL_OPENCV5'"));
        assert!(text.contains("'imagersize': [ 1280, 720,]"));
        let intrinsics = text.lines().find(|line| line.contains("'intrinsics'")).expect("a line");
        assert_eq!(intrinsics.matches(", ").count(), 8, "{intrinsics}");
        let mut pinhole = exported(0.0);
        pinhole.camera.distortion = Distortion::default();
        assert!(mrcal_cameramodel(&pinhole).expect("none").contains("LENSMODEL_PINHOLE"));
        assert!(mrcal_cameramodel(&rational()).expect("eight").contains("LENSMODEL_OPENCV8"));
        assert_eq!(mrcal_cameramodel(&fisheye()), Err(NotExpressible::Lens { lens: "fisheye" }));
    }
}
