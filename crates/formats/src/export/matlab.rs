use std::fmt::Write;

use super::{Coefficients, ExportedCamera, NotExpressible, number::number, number::numbers};

/// The calibration as a script for MATLAB and Octave: plain variables, and MATLAB's
/// `cameraIntrinsics` if its Computer Vision Toolbox is installed.
///
/// MATLAB counts pixels from 1 at the centre of the top-left one, so its principal point is one
/// pixel larger; its picture sizes are rows, then columns.
///
/// # Errors
///
/// [`NotExpressible`] for rational and fisheye lenses: MATLAB's `fisheyeIntrinsics` has another
/// model.
pub fn matlab_script(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    script(exported, "")
}

/// The script with `of` behind the name of each variable.
///
/// # Errors
///
/// As [`matlab_script`].
pub(super) fn script(exported: &ExportedCamera<'_>, of: &str) -> Result<String, NotExpressible> {
    let [fx, fy, cx, cy] = exported.intrinsics();
    let [k1, k2, p1, p2, k3] = match exported.coefficients() {
        Coefficients::None => [0.0; 5],
        Coefficients::Brown(coefficients) => coefficients,
        Coefficients::Rational(_) => return Err(NotExpressible::Lens { lens: "rational" }),
        Coefficients::Fisheye(_) => return Err(NotExpressible::Lens { lens: "fisheye" }),
    };
    let size = exported.image_size;
    let mut script = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(script, "% Camera {}. Pixels are counted from 1.", exported.plain_name());
    let _ = writeln!(script, "focal_length{of} = [{}];", numbers(&[fx, fy]));
    let _ = writeln!(script, "principal_point{of} = [{}];", numbers(&[cx + 1.0, cy + 1.0]));
    let _ = writeln!(script, "image_size{of} = [{}, {}];", size.height_px, size.width_px);
    let _ = writeln!(script, "radial_distortion{of} = [{}];", numbers(&[k1, k2, k3]));
    let _ = writeln!(script, "tangential_distortion{of} = [{}];", numbers(&[p1, p2]));
    if exported.rms_px > 0.0 {
        let _ = writeln!(script, "mean_reprojection_error{of} = {};", number(exported.rms_px));
    }
    let _ = write!(
        script,
        "intrinsic_matrix{of} = [focal_length{of}(1), 0, principal_point{of}(1); 0, focal_length{of}(2), principal_point{of}(2); 0, 0, 1];\n\
         if exist('cameraIntrinsics', 'class')\n\
         \x20 intrinsics{of} = cameraIntrinsics(focal_length{of}, principal_point{of}, image_size{of}, ...\n\
         \x20   'RadialDistortion', radial_distortion{of}, 'TangentialDistortion', tangential_distortion{of});\n\
         end\n",
    );
    Ok(script)
}

#[cfg(test)]
mod tests {
    use super::{
        super::tests::{exported, fisheye, rational},
        *,
    };

    #[test]
    fn pixels_are_counted_from_one_and_sizes_are_rows_first() {
        let script = matlab_script(&exported(-0.02)).expect("Brown's");
        let pp = format!("principal_point = [{}];\n", numbers(&[653.25, 352.5]));
        assert!(script.contains(&pp), "{script}");
        assert!(script.contains("image_size = [720, 1280];\n"));
        let radial = format!("radial_distortion = [{}];\n", numbers(&[-0.3, 0.125, -0.02]));
        assert!(script.contains(&radial));
        assert!(script.is_ascii());
        for wide in [fisheye(), rational()] {
            assert!(matches!(matlab_script(&wide), Err(NotExpressible::Lens { .. })));
        }
    }
}
