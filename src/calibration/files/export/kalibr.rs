use std::fmt::Write;

use super::{ExportedCamera, NotExpressible, number::numbers};

/// The calibration as a Kalibr camchain of one camera: `pinhole` with `radtan` (`k1 k2 p1 p2`).
///
/// # Errors
///
/// [`NotExpressible`] if k3 is not zero: `radtan` ends with k2.
pub fn kalibr_camchain(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = exported.camera.lens_parameters();
    if k3 != 0.0 {
        return Err(NotExpressible::Coefficient { coefficient: "k3" });
    }
    let mut yaml = String::from("cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n");
    // Writing to a string cannot fail.
    let _ = writeln!(yaml, "  distortion_coeffs: [{}]", numbers(&[k1, k2, p1, p2]));
    let _ = writeln!(yaml, "  distortion_model: radtan");
    let _ = writeln!(yaml, "  intrinsics: [{}]", numbers(&[fx, fy, cx, cy]));
    let size = exported.image_size;
    let _ = writeln!(yaml, "  resolution: [{}, {}]", size.width_px, size.height_px);
    let _ =
        writeln!(yaml, "  rostopic: /{}/image_raw", exported.plain_name().replace(['-', '.'], "_"));
    Ok(yaml)
}

#[cfg(test)]
mod tests {
    use super::{super::tests::exported, *};

    #[test]
    fn camchain_has_one_camera_and_never_loses_a_coefficient() {
        let yaml = kalibr_camchain(&exported(0.0)).expect("without k3");
        assert!(yaml.contains("  distortion_model: radtan\n"), "{yaml}");
        assert!(yaml.contains("  resolution: [1280, 720]\n"));
        assert!(yaml.contains("  rostopic: /front_camera/image_raw\n"));
        let refused = kalibr_camchain(&exported(-0.02));
        assert_eq!(refused, Err(NotExpressible::Coefficient { coefficient: "k3" }));
    }
}
