use super::{
    numbers::{fisheye_lens, lens},
    old_calibration::{NotImported, OldCalibration, OldFormat},
};
use boresight_geometry::LensKind;

/// COLMAP's models, with the numbers of parameters.
const MODELS: [(&str, usize); 7] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("FULL_OPENCV", 12),
    ("OPENCV_FISHEYE", 8),
];

fn cameras(text: &str) -> impl Iterator<Item = Vec<&str>> {
    let lines = text.lines().map(str::trim);
    lines
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .map(|line| line.split_ascii_whitespace().collect())
}

/// True if the first nonempty line is a camera of `cameras.txt`: a number, a model in capitals,
/// numbers.
pub(super) fn recognises(text: &str) -> bool {
    let is_number = |word: &&str| word.parse::<f64>().is_ok();
    let is_name =
        |word: &str| word.bytes().all(|b| b.is_ascii_uppercase() || b"_0123".contains(&b));
    cameras(text).next().is_some_and(|words| {
        words.len() >= 7
            && is_name(words[1])
            && !is_number(&words[1])
            && is_number(&words[0])
            && words[2..].iter().all(is_number)
    })
}

/// Reads the first camera of COLMAP's `cameras.txt`, with pixels counted from the corner of the
/// top-left pixel.
pub(super) fn read(text: &str) -> Result<OldCalibration, NotImported> {
    let words = cameras(text).next().unwrap_or_default();
    let [_, model, numbers @ ..] = words.as_slice() else {
        return Err(NotImported::UnknownFormat);
    };
    let known = MODELS.into_iter().find(|(name, _)| name == model);
    let (_, count) = known.ok_or(NotImported::Model { found: (*model).into() })?;
    let missing = NotImported::Missing {
        name: "the camera's line",
        wanted: "as many finite numbers as its model has",
    };
    let numbers: Vec<f64> = numbers.iter().filter_map(|word| word.parse().ok()).collect();
    let [width, height, values @ ..] = numbers.as_slice() else { return Err(missing) };
    if values.len() != count {
        return Err(missing);
    }
    // The first models have a single focal length, and Brown's with k1 and k2 alone.
    let f_count =
        if matches!(*model, "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL") { 1 } else { 2 };
    let (f, rest) = values.split_at(f_count);
    let (pp, coefficients) = rest.split_at(2);
    let intrinsics = [f[0], f[f_count - 1], pp[0] - 0.5, pp[1] - 0.5];
    let (kind, lens) = match coefficients {
        [k1, k2, k3, k4] if *model == "OPENCV_FISHEYE" => {
            (LensKind::Fisheye, fisheye_lens(intrinsics, [*k1, *k2, *k3, *k4]))
        }
        coefficients => (LensKind::Perspective, lens(intrinsics, coefficients)?),
    };
    let mut old = OldCalibration::new(OldFormat::Colmap, kind, &lens, [*width, *height])?;
    old.camera_count = cameras(text).count();
    Ok(old)
}
