//! Entry of a Linux camera in `devices`: for its file, and as lines for a person.

use crate::session::devices_file::{ControlEntry, DeviceEntry, ModeEntry, V4l2Entry};
use boresight_capture::{
    CameraMode, choose, layout,
    v4l2::{Camera, ControlState},
};
use boresight_geometry::device::{Fault, Wanted};
use boresight_present::text::camera::{self as words, printable};

/// The four printable characters of a format.
pub fn fourcc(offer: &CameraMode) -> String {
    printable(&String::from_utf8_lossy(&offer.fourcc))
}

/// Frames per second, to a tenth.
pub fn rate(offer: &CameraMode) -> Option<f64> {
    offer.interval.map(|(n, d)| (f64::from(d) / f64::from(n) * 10.0).round() / 10.0)
}

/// A mode in the format of the settings: `1280x720@30:MJPG`.
pub fn mode_name(offer: &CameraMode) -> String {
    let rate = rate(offer).map_or(String::new(), |rate| format!("@{rate}"));
    format!("{}{rate}:{}", offer.size, fourcc(offer))
}

/// The entry of a camera and controls for `devices --json`.
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

/// The lines about a camera and controls for a person.
pub fn describe(camera: &Camera, controls: &[ControlState]) -> Vec<String> {
    let mut lines = vec![format!("{}  {}", camera.stable_name(), printable(&camera.name))];
    let links: Vec<String> =
        camera.node.links.iter().map(|link| format!(", {}", link.display())).collect();
    lines.push(format!("  node      {}{}", camera.node.path.display(), links.concat()));
    for (applies, fault) in marks(camera) {
        if applies {
            lines.push(format!("  note      {}: {}", fault.code(), words::fault(fault).0));
        }
    }
    let best = choose(&camera.offers, &Wanted::default());
    for (format, sizes) in by_format(&camera.offers) {
        lines.push(format!("  {format:8}  {}", sizes.join(", ")));
    }
    if let Some(best) = best {
        lines.push(format!("  auto      {}", mode_name(&best)));
    }
    for ControlState { control, range, value, automatic } in controls {
        let value = value.map_or("?".into(), |value| value.to_string());
        let automatic = match automatic {
            Some(true) => ", automatic now",
            Some(false) => ", automatic off",
            None => "",
        };
        let name = words::control(*control);
        lines.push(format!("  {name:13} {value} of {} to {}{automatic}", range.min, range.max));
    }
    lines
}

fn marks(camera: &Camera) -> [(bool, Fault); 3] {
    [
        (camera.is_virtual, Fault::Virtual),
        (camera.is_infrared, Fault::Infrared),
        (camera.has_twin, Fault::Twin),
    ]
}

/// Sizes and rates by format; an unreadable format is marked so.
fn by_format(offers: &[CameraMode]) -> Vec<(String, Vec<String>)> {
    let mut formats: Vec<(String, Vec<String>)> = Vec::new();
    let mut last = None;
    for offer in offers {
        let mut name = fourcc(offer);
        if layout(offer.fourcc).is_none() {
            name += " (not read)";
        }
        let at = match formats.iter().position(|(known, _)| *known == name) {
            Some(at) => at,
            None => {
                formats.push((name, Vec::new()));
                formats.len() - 1
            }
        };
        let rate = rate(offer).map_or("?".into(), |rate| rate.to_string());
        let key = (offer.fourcc, offer.size);
        match formats[at].1.last_mut() {
            Some(line) if last == Some(key) => *line = format!("{line}/{rate}"),
            _ => formats[at].1.push(format!("{} at {rate}", offer.size)),
        }
        last = Some(key);
    }
    formats
}
