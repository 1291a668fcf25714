use super::{Coefficients, ExportedCamera, NotExpressible, number::number};

/// The intrinsics of a `transforms.json` for Nerfstudio, with no frames yet: `OPENCV` or
/// `OPENCV_FISHEYE`. Pixels count from the corner of the top-left one.
pub(super) fn nerfstudio(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let (model, coefficients) = match exported.coefficients() {
        Coefficients::None => ("OPENCV", Vec::new()),
        Coefficients::Brown([k1, k2, p1, p2, k3]) => {
            let mut named = vec![("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2)];
            named.extend((k3 != 0.0).then_some(("k3", k3)));
            ("OPENCV", named)
        }
        Coefficients::Rational(_) => return Err(NotExpressible::Lens { lens: "rational" }),
        Coefficients::Fisheye([k1, k2, k3, k4]) => {
            ("OPENCV_FISHEYE", vec![("k1", k1), ("k2", k2), ("k3", k3), ("k4", k4)])
        }
    };
    let [fx, fy, cx, cy] = exported.intrinsics();
    let numbers = [("fl_x", fx), ("fl_y", fy), ("cx", cx + 0.5), ("cy", cy + 0.5)];
    let lines: String = (numbers.into_iter().chain(coefficients))
        .map(|(name, value)| format!("  \"{name}\": {},\n", number(value)))
        .collect();
    let size = exported.image_size;
    Ok(format!(
        "{{\n  \"camera_model\": \"{model}\",\n  \"is_fisheye\": {},\n{lines}  \"w\": {},\n  \"h\": {},\n  \"frames\": []\n}}\n",
        model == "OPENCV_FISHEYE",
        size.width_px,
        size.height_px
    ))
}

/// The file of [`nerfstudio`] for instant-ngp, whose reader (`read_lens` in `src/nerf_loader.cu`)
/// takes any lens with p1 or p2, whatever their values, to have no k3 and k4, and a lens without a
/// coefficient other than zero to be a pinhole.
pub(super) fn instant_ngp(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    match exported.coefficients() {
        Coefficients::Brown([.., k3]) if k3 != 0.0 => {
            Err(NotExpressible::Coefficient { coefficient: "k3" })
        }
        Coefficients::Fisheye([0.0, 0.0, 0.0, 0.0]) => {
            Err(NotExpressible::Lens { lens: "equidistant" })
        }
        _ => nerfstudio(exported),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::{
        super::tests::{exported, fisheye, rational},
        *,
    };
    use boresight_geometry::Distortion;

    /// What instant-ngp's reader makes of a file: the model, and its four coefficients.
    fn by_ngp(text: &str) -> (&'static str, [f64; 4]) {
        let file: Value = serde_json::from_str(text).expect("JSON");
        let bent = if file["is_fisheye"] == true { "fisheye" } else { "brown" };
        let (mut model, mut coefficients) = ("pinhole", [0.0; 4]);
        let places = [("k1", 0), ("k2", 1), ("k3", 2), ("k4", 3), ("p1", 2), ("p2", 3)];
        for (name, place) in places {
            if let Some(value) = file.get(name) {
                coefficients[place] = value.as_f64().expect("a number");
                if coefficients[place] != 0.0 {
                    model = bent;
                }
            }
        }
        (model, coefficients)
    }

    #[test]
    fn instant_ngp_reads_the_lens_that_was_written_or_there_is_no_file() {
        let mut pinhole = exported(0.0);
        pinhole.camera.distortion = Distortion::default();
        let mut equidistant = fisheye();
        let kind = equidistant.camera.distortion.kind;
        equidistant.camera.distortion = Distortion { kind, ..Distortion::default() };
        let read = |lens| instant_ngp(&lens).map(|text| by_ngp(&text)).ok();
        assert_eq!(read(pinhole), Some(("pinhole", [0.0; 4])));
        assert_eq!(read(exported(0.0)), Some(("brown", [-0.3, 0.125, 0.0, -7e-4])));
        assert_eq!(read(fisheye()), Some(("fisheye", [-0.3, 0.125, 0.01, -2e-3])));
        assert_eq!([exported(-0.02), rational(), equidistant].map(read), [None; 3]);
    }
}
