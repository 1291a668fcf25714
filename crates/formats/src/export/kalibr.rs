use std::fmt::Write;

use super::{Coefficients, ExportedCamera, NotExpressible, number::numbers};

/// The calibration as a Kalibr camchain of a single camera: `pinhole` with `radtan` (`k1 k2 p1 p2`)
/// or `equidistant` (`k1 k2 k3 k4`).
///
/// # Errors
///
/// [`NotExpressible`] if k3 is not zero, since `radtan` ends with k2, and for a rational lens.
///
/// ```
/// # use boresight_formats::export::{ExportedCamera, kalibr_camchain};
/// # use boresight_geometry::{Camera, frame::ImageSize};
/// # use nalgebra::Point2;
/// # let camera = Camera::pinhole(900.0, Point2::new(640.0, 360.0));
/// # let image_size = ImageSize { width_px: 1280, height_px: 720 };
/// let mut exported = ExportedCamera { name: "left", camera, image_size, rms_px: 0.0 };
/// assert!(kalibr_camchain(&exported)?.contains("distortion_model: radtan"));
/// exported.camera.distortion.k3 = 0.01;
/// assert!(kalibr_camchain(&exported).is_err());
/// # Ok::<(), boresight_formats::export::NotExpressible>(())
/// ```
pub fn kalibr_camchain(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    camera(exported, 0, &[])
}

/// Camera `index` of a camchain, which overlaps with the cameras `overlaps`.
pub(super) fn camera(
    exported: &ExportedCamera<'_>,
    index: usize,
    overlaps: &[usize],
) -> Result<String, NotExpressible> {
    let (model, coefficients) = match exported.coefficients() {
        Coefficients::None => ("radtan", [0.0; 4]),
        Coefficients::Brown([k1, k2, p1, p2, 0.0]) => ("radtan", [k1, k2, p1, p2]),
        Coefficients::Brown(_) => {
            return Err(NotExpressible::Coefficient { coefficient: "k3" });
        }
        Coefficients::Rational(_) => return Err(NotExpressible::Lens { lens: "rational" }),
        Coefficients::Fisheye(coefficients) => ("equidistant", coefficients),
    };
    let mut yaml = format!("cam{index}:\n  cam_overlaps: {overlaps:?}\n  camera_model: pinhole\n");
    // Writing to a string cannot fail.
    let _ = writeln!(yaml, "  distortion_coeffs: [{}]", numbers(&coefficients));
    let _ = writeln!(yaml, "  distortion_model: {model}");
    let _ = writeln!(yaml, "  intrinsics: [{}]", numbers(&exported.intrinsics()));
    let size = exported.image_size;
    let _ = writeln!(yaml, "  resolution: [{}, {}]", size.width_px, size.height_px);
    let _ =
        writeln!(yaml, "  rostopic: /{}/image_raw", exported.plain_name().replace(['-', '.'], "_"));
    Ok(yaml)
}

#[cfg(test)]
mod tests {
    use super::{
        super::tests::{exported, fisheye, rational},
        *,
    };

    #[test]
    fn camchain_has_one_camera_and_never_loses_a_coefficient() {
        let yaml = kalibr_camchain(&exported(0.0)).expect("without k3");
        assert!(yaml.contains("  distortion_model: radtan\n"), "{yaml}");
        assert!(yaml.contains("  resolution: [1280, 720]\n"));
        assert!(yaml.contains("  rostopic: /front_camera/image_raw\n"));
        let refused = kalibr_camchain(&exported(-0.02));
        assert_eq!(refused, Err(NotExpressible::Coefficient { coefficient: "k3" }));
        let refused = kalibr_camchain(&rational());
        assert_eq!(refused, Err(NotExpressible::Lens { lens: "rational" }));
        let yaml = kalibr_camchain(&fisheye()).expect("equidistant");
        assert!(yaml.contains("  distortion_model: equidistant\n"), "{yaml}");
    }
}
