//! Numbers from the tree of a file.

use serde_json::Value;

use super::old_calibration::NotImported;
use boresight_geometry::{Camera, Distortion, LENS_PARAMETERS, LensKind, LensParameter};

/// Coefficients in OpenCV's order, the supported ones first.
const COEFFICIENTS: [&str; 14] =
    ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"];

/// The first of `names` present in the object, ignoring capitals and underscores.
pub(super) fn first<'a>(tree: &'a Value, names: &[&str]) -> Option<&'a Value> {
    let plain = |key: &str| key.replace('_', "").to_ascii_lowercase();
    let keys = tree.as_object()?;
    names.iter().find_map(|name| keys.iter().find(|(key, _)| plain(key) == **name).map(|(_, v)| v))
}

/// A list of numbers: a list, a list of equally long rows, or a matrix with `data`. `None` if
/// anything in it is no number or `rows` and `cols` give another count.
pub(super) fn list(value: &Value) -> Option<Vec<f64>> {
    if let Some(data) = value.get("data").filter(|data| data.is_array()) {
        let numbers = list(data)?;
        let told = |name: &str| value.get(name).map_or(Some(None), |n| n.as_u64().map(Some));
        let fits = match (told("rows")?, told("cols")?) {
            (Some(rows), Some(columns)) => {
                rows.checked_mul(columns) == u64::try_from(numbers.len()).ok()
            }
            _ => true,
        };
        return fits.then_some(numbers);
    }
    let items = value.as_array()?;
    let numbers: Vec<f64> = if items.first().is_some_and(Value::is_array) {
        let rows: Vec<&Vec<Value>> = items.iter().map(Value::as_array).collect::<Option<_>>()?;
        let is_matrix = rows.iter().all(|row| row.len() == rows[0].len());
        let numbers = rows.into_iter().flatten().map(Value::as_f64).collect::<Option<_>>()?;
        is_matrix.then_some(numbers)?
    } else {
        items.iter().map(Value::as_f64).collect::<Option<_>>()?
    };
    numbers.iter().all(|number| number.is_finite()).then_some(numbers)
}

/// Reads exactly `N` numbers.
pub(super) fn exactly<const N: usize>(value: &Value) -> Option<[f64; N]> {
    list(value)?.try_into().ok()
}

/// Picture size: the file's, else the one `stated` by a person.
pub(super) fn sized(
    found: Option<[f64; 2]>,
    stated: Option<[f64; 2]>,
) -> Result<[f64; 2], NotImported> {
    found.or(stated).ok_or(NotImported::NoSize)
}

/// A pinhole with the given `fx fy cx cy`.
fn pinhole([fx, fy, cx, cy]: [f64; 4]) -> Camera {
    Camera { f_px: [fx, fy].into(), ..Camera::pinhole(fx, [cx, cy].into()) }
}

/// Lens parameters of `fx fy cx cy` and the four coefficients of OpenCV's fisheye model.
pub(super) fn fisheye_lens(
    intrinsics: [f64; 4],
    [k1, k2, k3, k4]: [f64; 4],
) -> [f64; LENS_PARAMETERS] {
    let distortion =
        Distortion { kind: LensKind::Fisheye, k1, k2, k3, k4, ..Distortion::default() };
    Camera { distortion, ..pinhole(intrinsics) }.lens_parameters()
}

/// Lens parameters of `fx fy cx cy` and OpenCV's coefficients, of any number.
pub(super) fn lens(
    intrinsics: [f64; 4],
    coefficients: &[f64],
) -> Result<[f64; LENS_PARAMETERS], NotImported> {
    let mut lens = pinhole(intrinsics).lens_parameters();
    for (i, (value, name)) in coefficients.iter().zip(COEFFICIENTS).enumerate() {
        if let Some(parameter) = LensParameter::DISTORTION.get(i) {
            lens[parameter.index()] = *value;
        } else if *value != 0.0 {
            return Err(NotImported::Coefficient { coefficient: name, value: value.to_string() });
        }
    }
    Ok(lens)
}
