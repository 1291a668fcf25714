//! Files of several cameras. Each says in a comment which way its poses go.

use std::fmt::Write;

use nalgebra::{Isometry3, Matrix3, Matrix4, Vector3};

use super::{
    Coefficients, ExportedCamera, NotExpressible,
    colmap::model,
    kalibr, matlab,
    number::{number, numbers},
    opencv::{Stored, matrix},
};
use crate::RigFile;
use boresight_geometry::{Rig, frame::ImageSize};

/// Distance of two cameras, in metres, from which a place is a mistake: the moon is nearer.
const FARTHEST_M: f64 = 1e9;

/// Cameras for an export, the first in the frame of all.
#[derive(Clone, Debug)]
pub struct ExportedRig<'a> {
    cameras: Vec<(ExportedCamera<'a>, Isometry3<f64>)>,
}

impl<'a> ExportedRig<'a> {
    /// Cameras of `file`. `None` if it has none, or a place is no pose of this world.
    pub fn of(file: &'a RigFile) -> Option<Self> {
        let cameras = file.cameras.iter().map(|entry| {
            let [width_px, height_px] = entry.image_size;
            let camera = ExportedCamera {
                name: &entry.name,
                camera: entry.lens.camera(),
                image_size: ImageSize { width_px, height_px },
                rms_px: entry.lens.rms_px.unwrap_or(0.0),
            };
            Some((camera, entry.cam_from_rig.pose()?))
        });
        let mut cameras = cameras.collect::<Option<Vec<_>>>()?;
        let rig_from_first = cameras.first()?.1.inverse();
        cameras.iter_mut().for_each(|(_, cam_from_rig)| *cam_from_rig *= rig_from_first);
        let is_near =
            |(_, place): &(_, Isometry3<f64>)| place.translation.vector.norm() < FARTHEST_M;
        cameras.iter().all(is_near).then_some(Self { cameras })
    }

    /// Two cameras by their names, the first in the frame of both. `None` if one is missing.
    pub fn pair(&self, names: [&str; 2]) -> Option<Self> {
        let of = |name: &str| self.cameras.iter().find(|(camera, _)| camera.name == name);
        let [first, second] = [of(names[0])?, of(names[1])?];
        let second_from_first = second.1 * first.1.inverse();
        Some(Self {
            cameras: vec![(first.0, Isometry3::identity()), (second.0, second_from_first)],
        })
    }

    /// Camera of this name. `None` if there's none.
    pub fn camera(&self, name: &str) -> Option<ExportedCamera<'a>> {
        self.cameras.iter().map(|(camera, _)| *camera).find(|camera| camera.name == name)
    }
}

/// Row-major values of a matrix.
fn rows<const R: usize, const C: usize>(matrix: &nalgebra::SMatrix<f64, R, C>) -> Vec<f64> {
    matrix.transpose().as_slice().to_vec()
}

/// Two cameras as OpenCV's samples write them: `M1 D1 M2 D2` for the lenses, `R T E F` between the
/// cameras, `R1 R2 P1 P2 Q` of `stereoRectify` with `CALIB_ZERO_DISPARITY`. Lengths are metres.
///
/// The rectified pictures have the smaller focal length of both, and a common principal point that
/// centres both pictures (alpha −1).
pub(super) fn opencv_stereo(exported: &ExportedRig<'_>) -> Result<String, NotExpressible> {
    let [(first, _), (second, second_from_first), ..] = exported.cameras.as_slice() else {
        return Err(NotExpressible::Lens { lens: "single" });
    };
    let [one, two] = [first, second].map(Stored::of);
    if one.is_fisheye != two.is_fisheye {
        return Err(NotExpressible::Lens { lens: "mixed" });
    }
    let rig = Rig {
        cameras: vec![first.camera, second.camera],
        cam_from_rig: vec![Isometry3::identity(), *second_from_first],
    };
    let rectified = rig.rectified(0, 1).ok_or(NotExpressible::Lens { lens: "coaxial" })?;
    let turn = second_from_first.rotation.to_rotation_matrix().into_inner();
    let shift = second_from_first.translation.vector;
    let essential = shift.cross_matrix() * turn;
    let camera = |stored: &Stored| Matrix3::from_row_slice(&stored.camera);
    // Cameras of focal lengths in pixels are invertible.
    let inverse = |stored: &Stored| camera(stored).try_inverse().unwrap_or_else(Matrix3::identity);
    let fundamental = inverse(&two).transpose() * essential * inverse(&one);
    let fundamental = match fundamental[(2, 2)] {
        0.0 => fundamental,
        last => fundamental / last,
    };
    let axis = usize::from(rectified.is_vertical);
    let f_px = one.camera[4].min(two.camera[4]);
    let centre = rectified
        .centre_px([(&first.camera, first.image_size), (&second.camera, second.image_size)], f_px);
    let projection = |shift_m: f64| {
        let mut of = nalgebra::Matrix3x4::new(
            f_px, 0.0, centre.x, 0.0, 0.0, f_px, centre.y, 0.0, 0.0, 0.0, 1.0, 0.0,
        );
        of[(axis, 3)] = f_px * shift_m;
        of
    };
    // OpenCV's T of the rectified pair: the first camera in the second's frame.
    let shift_m = -rectified.second_m[axis];
    let to_points = Matrix4::new(
        1.0,
        0.0,
        0.0,
        -centre.x,
        0.0,
        1.0,
        0.0,
        -centre.y,
        0.0,
        0.0,
        0.0,
        f_px,
        0.0,
        0.0,
        -1.0 / shift_m,
        0.0,
    );
    let mut yaml = String::from("%YAML:1.0\n---\n");
    // Writing to a string cannot fail.
    let _ = writeln!(
        yaml,
        "# x2 = R x1 + T: from {} to {}, in metres. Rectified with alpha -1.",
        first.plain_name(),
        second.plain_name()
    );
    let _ = writeln!(yaml, "image_width: {}\nimage_height: {}", one.size[0], one.size[1]);
    if one.is_fisheye {
        yaml.push_str("fisheye_model: 1\n");
    }
    for (name, stored) in [("1", &one), ("2", &two)] {
        matrix(&mut yaml, &format!("M{name}"), 3, &stored.camera);
        matrix(&mut yaml, &format!("D{name}"), stored.distortion.len(), &stored.distortion);
    }
    let turned = rectified.rotations.map(|turn| turn.to_rotation_matrix().into_inner());
    let between = [
        ("R", 3, rows(&turn)),
        ("T", 1, shift.as_slice().to_vec()),
        ("E", 3, rows(&essential)),
        ("F", 3, rows(&fundamental)),
        ("R1", 3, rows(&turned[0])),
        ("R2", 3, rows(&turned[1])),
        ("P1", 4, rows(&projection(0.0))),
        ("P2", 4, rows(&projection(shift_m))),
        ("Q", 4, rows(&to_points)),
    ];
    if !between.iter().flat_map(|(_, _, values)| values).all(|value| value.is_finite()) {
        return Err(NotExpressible::NoNumber);
    }
    for (name, columns, values) in between {
        matrix(&mut yaml, name, columns, &values);
    }
    Ok(yaml)
}

/// Cameras as a Kalibr camchain: `T_cn_cnm1` leads from the *previous* camera to this one.
pub(super) fn kalibr(exported: &ExportedRig<'_>) -> Result<String, NotExpressible> {
    let count = exported.cameras.len();
    let mut yaml = String::from("# T_cn_cnm1: from the previous camera to this one, in metres.\n");
    for (index, (camera, place)) in exported.cameras.iter().enumerate() {
        let others: Vec<usize> = (0..count).filter(|other| *other != index).collect();
        let lens = kalibr::camera(camera, index, &others)?;
        let (head, rest) = lens.split_once('\n').unwrap_or((&lens, ""));
        let _ = writeln!(yaml, "{head}");
        if let Some((_, previous)) = index.checked_sub(1).and_then(|it| exported.cameras.get(it)) {
            yaml.push_str("  T_cn_cnm1:\n");
            let motion = (place * previous.inverse()).to_homogeneous();
            for row in motion.row_iter() {
                let row: Vec<f64> = row.iter().copied().collect();
                let _ = writeln!(yaml, "  - [{}]", numbers(&row));
            }
        }
        yaml.push_str(rest);
    }
    Ok(yaml)
}

/// Frames of the cameras as a URDF: fixed joints from `rig`, the first camera's frame, to each
/// `NAME_optical_frame`. A joint states the child's pose in the parent.
pub(super) fn urdf(exported: &ExportedRig<'_>) -> String {
    let mut xml = String::from(
        "<?xml version=\"1.0\"?>\n<!-- Each joint states the camera's pose in the frame rig: metres, radians. -->\n<robot name=\"rig\">\n  <link name=\"rig\"/>\n",
    );
    for (camera, place) in &exported.cameras {
        let name = camera.plain_name();
        let rig_from_cam = place.inverse();
        let (roll, pitch, yaw) = rig_from_cam.rotation.euler_angles();
        let list = |values: [f64; 3]| values.map(number).join(" ");
        let _ = writeln!(
            xml,
            "  <link name=\"{name}_optical_frame\"/>\n  <joint name=\"{name}_optical_joint\" type=\"fixed\">\n    <parent link=\"rig\"/>\n    <child link=\"{name}_optical_frame\"/>\n    <origin xyz=\"{}\" rpy=\"{}\"/>\n  </joint>",
            list(rig_from_cam.translation.vector.into()),
            list([roll, pitch, yaw])
        );
    }
    xml.push_str("</robot>\n");
    xml
}

/// Frames of the cameras as a launch file of ROS 2: one `static_transform_publisher` for each
/// publishes the camera's pose in the frame `rig`, the first camera's.
pub(super) fn static_transforms(exported: &ExportedRig<'_>) -> String {
    let mut xml = String::from(
        "<?xml version=\"1.0\"?>\n<!-- Each node publishes the camera's pose in the frame rig, in metres. -->\n<launch>\n",
    );
    for (camera, place) in &exported.cameras {
        let name = camera.plain_name();
        let rig_from_cam = place.inverse();
        let (at, turn) = (rig_from_cam.translation.vector, rig_from_cam.rotation);
        let named = [
            ("x", at.x),
            ("y", at.y),
            ("z", at.z),
            ("qx", turn.i),
            ("qy", turn.j),
            ("qz", turn.k),
            ("qw", turn.w),
        ];
        let pose = named.map(|(of, value)| format!("--{of} {}", number(value))).join(" ");
        let _ = writeln!(
            xml,
            "  <node pkg=\"tf2_ros\" exec=\"static_transform_publisher\" name=\"{name}_optical_transform\" args=\"{pose} --frame-id rig --child-frame-id {name}_optical_frame\"/>"
        );
    }
    xml.push_str("</launch>\n");
    xml
}

/// Two cameras as a script for MATLAB and Octave: plain variables, and MATLAB's `stereoParameters`
/// if its Computer Vision Toolbox is installed. Its `PoseCamera2` leads from the second camera to
/// the first, against `R` and `T`. Lengths are millimetres, as MATLAB's tools have them.
pub(super) fn matlab_stereo(exported: &ExportedRig<'_>) -> Result<String, NotExpressible> {
    let [(first, _), (second, second_from_first), ..] = exported.cameras.as_slice() else {
        return Err(NotExpressible::Lens { lens: "single" });
    };
    let turn = second_from_first.rotation.to_rotation_matrix().into_inner();
    let turn: Vec<String> = rows(&turn).chunks(3).map(numbers).collect();
    let shift_mm = second_from_first.translation.vector * 1000.0;
    Ok(format!(
        "{}{}% x2 = R x1 + T: from {} to {}, in millimetres.\nR = [{}];\nT = [{}]';\n\
         if exist('stereoParameters', 'class')\n\
         \x20 stereo = stereoParameters(intrinsics1, intrinsics2, rigidtform3d(R', -R' * T));\n\
         end\n",
        matlab::script(first, "1")?,
        matlab::script(second, "2")?,
        first.plain_name(),
        second.plain_name(),
        turn.join("; "),
        numbers(shift_mm.as_slice()),
    ))
}

/// Cameras as COLMAP's `rig_config.json`. Pictures of a camera are in a folder of its name.
pub(super) fn colmap(exported: &ExportedRig<'_>) -> String {
    let of = |(index, (camera, place)): (usize, &(ExportedCamera<'_>, Isometry3<f64>))| {
        let (model, parameters) = model(camera);
        let place = if index == 0 {
            "\"ref_sensor\": true".to_owned()
        } else {
            let turn = place.rotation;
            format!(
                "\"cam_from_rig_rotation\": [{}],\n        \"cam_from_rig_translation\": [{}]",
                numbers(&[turn.w, turn.i, turn.j, turn.k]),
                numbers(place.translation.vector.as_slice())
            )
        };
        format!(
            "      {{\n        \"image_prefix\": \"{}/\",\n        {place},\n        \"camera_model_name\": \"{model}\",\n        \"camera_params\": [{}]\n      }}",
            camera.plain_name(),
            numbers(&parameters)
        )
    };
    let cameras: Vec<String> = exported.cameras.iter().enumerate().map(of).collect();
    format!("[\n  {{\n    \"cameras\": [\n{}\n    ]\n  }}\n]\n", cameras.join(",\n"))
}

/// Cameras as Anipose's `calibration.toml`: rotation vector and translation (millimetres) from the
/// world, the first camera's frame, to the camera.
pub(super) fn anipose(exported: &ExportedRig<'_>) -> Result<String, NotExpressible> {
    let mut toml = String::from("# rotation, translation: from the world to the camera, in mm.\n");
    for (index, (camera, place)) in exported.cameras.iter().enumerate() {
        let stored = Stored::of(camera);
        if matches!(camera.coefficients(), Coefficients::Rational(_)) {
            return Err(NotExpressible::Lens { lens: "rational" });
        }
        let rows = stored.camera.chunks(3).map(|row| format!("[{}]", numbers(row)));
        let turn: Vector3<f64> = place.rotation.scaled_axis();
        let shift_mm = place.translation.vector * 1000.0;
        let _ = writeln!(
            toml,
            "[cam_{index}]\nname = \"{}\"\nsize = [{}, {}]\nmatrix = [{}]\ndistortions = [{}]\nrotation = [{}]\ntranslation = [{}]\nfisheye = {}\n",
            camera.plain_name(),
            stored.size[0],
            stored.size[1],
            rows.collect::<Vec<_>>().join(", "),
            numbers(&stored.distortion),
            numbers(turn.as_slice()),
            numbers(shift_mm.as_slice()),
            stored.is_fisheye
        );
    }
    toml.push_str("[metadata]\nadjusted = true\n");
    Ok(toml)
}

#[cfg(test)]
mod tests {
    use super::{super::tests::exported as camera, *};

    /// Two cameras, the second 12 cm to the right and turned.
    fn rig() -> ExportedRig<'static> {
        let second = Isometry3::new(Vector3::new(-0.12, 0.003, 0.01), Vector3::new(0.02, 0.1, 0.3));
        let named = |name| ExportedCamera { name, ..camera(0.0) };
        ExportedRig {
            cameras: vec![(named("left"), Isometry3::identity()), (named("right"), second)],
        }
    }

    fn values(text: &str, key: &str) -> Vec<f64> {
        let after = text.split_once(key).expect("the key").1;
        let list = after.split_once('[').expect("a list").1.split_once(']').expect("its end").0;
        list.split(',').map(|value| value.trim().parse().expect("a number")).collect()
    }

    #[test]
    fn rectified_rows_of_a_point_agree_in_opencvs_projections() {
        let rig = rig();
        let yaml = opencv_stereo(&rig).expect("two cameras");
        let matrix = |key: &str| values(&yaml, &format!("\n{key}: "));
        let point = Vector3::new(0.1, -0.2, 1.5);
        let in_second = rig.cameras[1].1 * nalgebra::Point3::from(point);
        let [r, t] = ["R", "T"].map(matrix);
        let by_file = Matrix3::from_row_slice(&r) * point + Vector3::from_column_slice(&t);
        assert!((by_file - in_second.coords).norm() < 1e-12);
        let px = |turn: &str, projection: &str| {
            let p = nalgebra::Matrix3x4::from_row_slice(&matrix(projection));
            // P maps points of the first rectified camera.
            let turned = Matrix3::from_row_slice(&matrix(turn)) * point;
            let px = p * turned.push(1.0);
            px.xy() / px.z
        };
        let [one, two] = [px("R1", "P1"), px("R1", "P2")];
        assert!((one.y - two.y).abs() < 1e-9);
        // Q leads back to the point in the first rectified camera.
        let q = Matrix4::from_row_slice(&matrix("Q"));
        let back = q * nalgebra::Vector4::new(one.x, one.y, one.x - two.x, 1.0);
        let turned = Matrix3::from_row_slice(&matrix("R1")) * point;
        assert!((back.xyz() / back.w - turned).norm() < 1e-9);
        let [e, f] = ["E", "F"].map(|key| Matrix3::from_row_slice(&matrix(key)));
        assert!((in_second.coords.transpose() * e * point).x.abs() < 1e-12);
        let m = Matrix3::from_row_slice(&matrix("M1"));
        let [a, b] = [m * point, m * in_second.coords];
        assert!((b.transpose() * f * a).x.abs() < 1e-6 * a.norm() * b.norm());
    }

    #[test]
    fn no_stereo_file_has_an_infinite_number() {
        let mut one_place = rig();
        one_place.cameras[1].1.translation.vector = Vector3::zeros();
        assert_eq!(opencv_stereo(&one_place), Err(NotExpressible::Lens { lens: "coaxial" }));
        let mut endless = rig();
        endless.cameras[1].1.translation.vector.x = -1000.0;
        for (camera, _) in &mut endless.cameras {
            camera.camera.f_px = nalgebra::Vector2::repeat(1e307);
        }
        assert_eq!(opencv_stereo(&endless), Err(NotExpressible::NoNumber));
    }

    #[test]
    fn each_format_carries_a_point_to_the_second_camera() {
        let rig = rig();
        let second = rig.cameras[1].1;
        let point = nalgebra::Point3::new(0.1, -0.2, 1.5);
        let wanted = second * point;
        let chain = kalibr(&rig).expect("no k3");
        let rows: Vec<Vec<f64>> = chain
            .lines()
            .filter_map(|line| line.strip_prefix("  - "))
            .map(|row| values(row, ""))
            .collect();
        let motion = Matrix4::from_row_slice(&rows.concat());
        assert!((motion.transform_point(&point) - wanted).norm() < 1e-9, "{chain}");
        assert!(chain.contains("cam1:\n  T_cn_cnm1:\n"));
        let json: serde_json::Value = serde_json::from_str(&colmap(&rig)).expect("JSON");
        let entry = &json[0]["cameras"][1];
        assert_eq!(json[0]["cameras"][0]["ref_sensor"], true);
        let list = |key: &str| -> Vec<f64> {
            entry[key]
                .as_array()
                .expect("a list")
                .iter()
                .filter_map(serde_json::Value::as_f64)
                .collect()
        };
        let [q, t] = ["cam_from_rig_rotation", "cam_from_rig_translation"].map(list);
        let turn = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
            q[0], q[1], q[2], q[3],
        ));
        let by_colmap = turn * point.coords + Vector3::from_column_slice(&t);
        assert!((by_colmap - wanted.coords).norm() < 1e-9);
        let toml = anipose(&rig).expect("no rational lens");
        let of_second = toml.split_once("[cam_1]").expect("the second").1;
        let [turn, shift_mm] = ["rotation = ", "translation = "]
            .map(|key| Vector3::from_column_slice(&values(of_second, key)));
        let by_anipose = nalgebra::Rotation3::new(turn) * point.coords + shift_mm / 1000.0;
        assert!((by_anipose - wanted.coords).norm() < 1e-9);
        let launch = static_transforms(&rig);
        let args = launch.split_once("right_optical_transform").expect("the node").1;
        let [x, y, z, i, j, k, w] = ["x", "y", "z", "qx", "qy", "qz", "qw"].map(|of| -> f64 {
            let text = args.split_once(&format!("--{of} ")).expect("the value").1;
            text.split(' ').next().expect("it ends").parse().expect("a number")
        });
        let turn = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
        let published = Isometry3::from_parts(Vector3::new(x, y, z).into(), turn);
        assert!((published * wanted - point).norm() < 1e-9, "{launch}");
        let script = matlab_stereo(&rig).expect("Brown's");
        let shift_mm = Vector3::from_column_slice(&values(&script, "\nT = "));
        let turn = script.split_once("\nR = [").expect("R").1.split_once(']').expect("its end").0;
        let turn: Vec<f64> =
            turn.split([',', ';']).map(|it| it.trim().parse().expect("a number")).collect();
        let by_matlab = Matrix3::from_row_slice(&turn) * point.coords + shift_mm / 1000.0;
        assert!((by_matlab - wanted.coords).norm() < 1e-9, "{script}");
        let xml = urdf(&rig);
        let joint = xml.split_once("right_optical_joint").expect("the joint").1;
        let list = |key: &str| -> Vec<f64> {
            let text = joint.split_once(key).expect("the key").1.split('"').next();
            text.expect("values").split(' ').map(|it| it.parse().expect("a number")).collect()
        };
        let [xyz, rpy] = ["xyz=\"", "rpy=\""].map(list);
        let rig_from_cam = Isometry3::from_parts(
            Vector3::from_column_slice(&xyz).into(),
            nalgebra::UnitQuaternion::from_euler_angles(rpy[0], rpy[1], rpy[2]),
        );
        assert!((rig_from_cam * wanted - point).norm() < 1e-9);
    }
}
