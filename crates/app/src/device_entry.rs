//! A camera of Linux as `devices` lists it.

use super::devices_file::{ControlEntry, DeviceEntry, ModeEntry, V4l2Entry};
use boresight_capture::{
    CameraMode, choose, layout,
    v4l2::{Camera, ControlState},
};
use boresight_geometry::device::Wanted;
use boresight_present::text::camera::{self as words, printable};

/// The four characters of a format, as they can be printed.
pub fn fourcc(offer: &CameraMode) -> String {
    printable(&String::from_utf8_lossy(&offer.fourcc))
}

/// Pictures per second, to a tenth.
pub fn rate(offer: &CameraMode) -> Option<f64> {
    offer.interval.map(|(n, d)| (f64::from(d) / f64::from(n) * 10.0).round() / 10.0)
}

/// A mode as the settings name it: `1280x720@30:MJPG`.
pub fn mode_name(offer: &CameraMode) -> String {
    let rate = rate(offer).map_or(String::new(), |rate| format!("@{rate}"));
    format!("{}x{}{rate}:{}", offer.size.width_px, offer.size.height_px, fourcc(offer))
}

/// What `devices --json` says about a camera and its controls.
pub fn entry(camera: &Camera, controls: &[ControlState]) -> DeviceEntry {
    let modes = camera
        .offers
        .iter()
        .map(|offer| ModeEntry {
            format: fourcc(offer),
            size: [offer.size.width_px, offer.size.height_px],
            fps: rate(offer),
            readable: layout(offer.fourcc).is_some(),
        })
        .collect();
    let controls = controls
        .iter()
        .map(|ControlState { control, range, value, automatic }| ControlEntry {
            control: words::control(*control).into(),
            value: *value,
            min: range.min,
            max: range.max,
            step: range.step,
            default: range.default,
            automatic: *automatic,
        })
        .collect();
    let v4l2 = V4l2Entry {
        node: camera.node.path.display().to_string(),
        links: camera.node.links.iter().map(|link| link.display().to_string()).collect(),
        driver: printable(&camera.driver),
        usb: camera.node.usb_id.map(|(vendor, product)| format!("{vendor:04x}:{product:04x}")),
        serial: printable(&camera.node.serial),
        place: camera.node.place.clone(),
        is_virtual: camera.is_virtual,
        infrared: camera.is_infrared,
        twin: camera.has_twin,
        auto_mode: choose(&camera.offers, &Wanted::default()).map(|offer| mode_name(&offer)),
        modes,
        controls,
    };
    DeviceEntry { source: camera.stable_name(), name: printable(&camera.name), v4l2: Some(v4l2) }
}
