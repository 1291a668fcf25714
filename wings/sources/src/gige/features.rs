//! Exposure, gain and white balance among a camera's features, by V4L2's control numbers.
//!
//! Names are those of GenICam's SFNC, today's first and then those of older cameras. Units are
//! whole microseconds for exposure, and for gain and white balance thousandths of the camera's own
//! unit, or this unit itself in cameras with whole numbers only. White balance is the ratio of red.

use std::collections::BTreeMap;

use telegenic::{AccessMode, CameraError, GenICamera, GenicamError, NodeKind};

use boresight_capture::v4l2::{
    ids,
    kernel::{ControlRange, Errno},
};

/// A control with a value: names, factor of a feature with fractions, and the selector entry above
/// it.
type Value = (&'static [&'static str], f64, Option<(&'static str, &'static str)>);

const EXPOSURE: Value = (&["ExposureTime", "ExposureTimeAbs", "ExposureTimeRaw"], 1.0, None);
const GAIN: Value = (&["Gain", "GainAbs", "GainRaw"], 1000.0, None);
const WHITE_BALANCE: Value = (
    &["BalanceRatio", "BalanceRatioAbs", "BalanceRatioRaw"],
    1000.0,
    Some(("BalanceRatioSelector", "Red")),
);
/// Automatics behind a common number: each is a bit of the value.
const EXPOSURE_AUTOMATICS: &[&str] = &["ExposureAuto"];
const GAIN_AUTOMATICS: &[&str] = &["GainAuto", "BlackLevelAuto"];
const WHITE_BALANCE_AUTOMATICS: &[&str] = &["BalanceWhiteAuto"];

/// V4L2's menu for exposure: manual, or chosen by the camera.
const BY_HAND: i64 = 1;
const BY_CAMERA: i64 = 3;

/// Values set or found, before rounding: a camera that lost them gets them back exactly.
pub(super) type Exact = BTreeMap<u32, (i64, f64)>;

fn value_of(id: u32) -> Option<Value> {
    match id {
        ids::EXPOSURE => Some(EXPOSURE),
        ids::GAIN => Some(GAIN),
        ids::WHITE_BALANCE => Some(WHITE_BALANCE),
        _ => None,
    }
}

fn automatics_of(id: u32) -> &'static [&'static str] {
    match id {
        ids::EXPOSURE_AUTOMATIC => EXPOSURE_AUTOMATICS,
        ids::GAIN_AUTOMATIC => GAIN_AUTOMATICS,
        ids::WHITE_BALANCE_AUTOMATIC => WHITE_BALANCE_AUTOMATICS,
        _ => &[],
    }
}

/// The system's number for an error: of none of them is a USB cable the cause.
pub(super) fn errno(err: &GenicamError) -> Errno {
    Errno(match err {
        GenicamError::Camera(err) => match err {
            CameraError::ControlDenied => libc::EBUSY,
            CameraError::Disconnected | CameraError::ControlLost => libc::ENODEV,
            CameraError::ConnectTimeout | CameraError::Timeout | CameraError::Io(_) => {
                libc::EHOSTUNREACH
            }
            _ => libc::EINVAL,
        },
        _ => libc::EINVAL,
    })
}

const NONE: Errno = Errno(libc::EINVAL);

/// The first of `names` present in the camera, and true if the value may have fractions.
pub(super) fn present<'a>(camera: &GenICamera, names: &[&'a str]) -> Option<(&'a str, bool)> {
    names.iter().find_map(|name| match camera.node_kind(name) {
        Ok(NodeKind::Float) => Some((*name, true)),
        Ok(NodeKind::Integer) => Some((*name, false)),
        // A register or a formula without a feature before it.
        Ok(NodeKind::Other) => Some((*name, true)),
        _ => None,
    })
}

/// Range of a control.
pub(super) fn range(camera: &mut GenICamera, id: u32) -> Result<ControlRange, Errno> {
    let automatics = automatics_of(id);
    if automatics.iter().any(|name| camera.has_feature(name)) {
        let (min, max) = if id == ids::EXPOSURE_AUTOMATIC {
            (BY_HAND, BY_CAMERA)
        } else {
            (0, (1 << automatics.len()) - 1)
        };
        return Ok(ControlRange { min, max, step: 1, default: min, writable: true });
    }
    let (names, scale, under) = value_of(id).ok_or(NONE)?;
    let (name, is_fraction) = present(camera, names).ok_or(NONE)?;
    choose(camera, under)?;
    let writable = matches!(camera.access_mode(name), Ok(AccessMode::RW));
    let (min, max, step) = if is_fraction {
        let (min, max) = camera.float_bounds(name).unwrap_or((f64::MIN, f64::MAX));
        // Inwards, so no end is refused.
        ((min * scale).ceil() as i64, (max * scale).floor() as i64, 1)
    } else {
        let (min, max) = camera.integer_bounds(name).map_err(|err| errno(&err))?;
        (min, max, camera.integer_increment(name).unwrap_or(1))
    };
    Ok(ControlRange { min, max, step, default: min, writable })
}

/// Present value of a control, read from the camera.
pub(super) fn get(camera: &mut GenICamera, id: u32) -> Result<i64, Errno> {
    forget(camera)?;
    let automatics = automatics_of(id);
    if automatics.is_empty() {
        return raw(camera, id).map(|(value, _)| value);
    }
    let mut on = 0;
    let mut any = false;
    for (bit, name) in automatics.iter().enumerate() {
        if !camera.has_feature(name) {
            continue;
        }
        let entry = camera.get_enum(name).map_err(|err| errno(&err))?;
        any = true;
        on |= i64::from(entry != "Off") << bit;
    }
    match (any, id) {
        (false, _) => Err(NONE),
        (true, ids::EXPOSURE_AUTOMATIC) => Ok(if on == 0 { BY_HAND } else { BY_CAMERA }),
        (true, _) => Ok(on),
    }
}

/// Sets a control. An unchanged control isn't written, because writing a rounded value would move
/// it.
pub(super) fn set(
    camera: &mut GenICamera,
    exact: &mut Exact,
    id: u32,
    value: i64,
) -> Result<(), Errno> {
    let automatics = automatics_of(id);
    if !automatics.is_empty() {
        let on = if id == ids::EXPOSURE_AUTOMATIC { i64::from(value != BY_HAND) } else { value };
        for (bit, name) in automatics.iter().enumerate() {
            if camera.has_feature(name) {
                let entry = if on >> bit & 1 == 1 { "Continuous" } else { "Off" };
                camera.set_enum(name, entry).map_err(|err| errno(&err))?;
            }
        }
        return Ok(());
    }
    forget(camera)?;
    let (standing, as_it_is) = raw(camera, id)?;
    if standing == value {
        exact.insert(id, (value, as_it_is));
        return Ok(());
    }
    let (names, scale, under) = value_of(id).ok_or(NONE)?;
    let (name, is_fraction) = present(camera, names).ok_or(NONE)?;
    choose(camera, under)?;
    let known = exact.get(&id).filter(|(known, _)| *known == value);
    let set = if is_fraction {
        camera.set_float(name, known.map_or(value as f64 / scale, |(_, exact)| *exact))
    } else {
        camera.set_integer(name, value)
    };
    set.map_err(|err| errno(&err))
}

/// A control's value, rounded and exact.
fn raw(camera: &mut GenICamera, id: u32) -> Result<(i64, f64), Errno> {
    let (names, scale, under) = value_of(id).ok_or(NONE)?;
    let (name, is_fraction) = present(camera, names).ok_or(NONE)?;
    choose(camera, under)?;
    if is_fraction {
        let value = camera.get_float(name).map_err(|err| errno(&err))?;
        return Ok(((value * scale).round() as i64, value));
    }
    let value = camera.get_integer(name).map_err(|err| errno(&err))?;
    Ok((value, value as f64))
}

/// Clears the cache, so the next answers come from the camera.
fn forget(camera: &mut GenICamera) -> Result<(), Errno> {
    camera.invalidate_caches().map_err(|err| errno(&err))
}

fn choose(camera: &mut GenICamera, under: Option<(&str, &str)>) -> Result<(), Errno> {
    let Some((selector, entry)) = under.filter(|(selector, _)| camera.has_feature(selector)) else {
        return Ok(());
    };
    camera.set_enum(selector, entry).map_err(|err| errno(&err))
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    /// Numbers by which the advice speaks of USB: of bandwidth, cables and hubs.
    const OF_USB: [i32; 7] = [
        libc::ENOSPC,
        libc::EIO,
        libc::EPROTO,
        libc::EPIPE,
        libc::EILSEQ,
        libc::ETIMEDOUT,
        libc::EREMOTEIO,
    ];

    #[test]
    fn no_error_of_a_network_camera_is_one_of_a_usb_cable() {
        let of_system = OF_USB.map(|number| CameraError::Io(io::Error::from_raw_os_error(number)));
        let others = [
            CameraError::ConnectTimeout,
            CameraError::Disconnected,
            CameraError::Timeout,
            CameraError::ControlDenied,
            CameraError::ControlLost,
            CameraError::Protocol("short".into()),
            CameraError::Unsupported("this"),
            CameraError::Spawn("no thread".into()),
        ];
        for err in of_system.into_iter().chain(others) {
            let err = GenicamError::Camera(err);
            assert!(!OF_USB.contains(&errno(&err).0), "{err}");
        }
        assert!(!OF_USB.contains(&errno(&GenicamError::NotFound("Gain".into())).0));
    }
}
