//! `boresight devices`.

use clap::Args;

use super::terminal::{print, say};
#[cfg(all(target_os = "linux", feature = "live"))]
use boresight_app::device_entry::{entry, fourcc, mode_name, rate};
use boresight_app::{
    Exit,
    devices_file::{BackendEntry, DEVICES_SCHEMA, DeviceEntry, DevicesFile, OtherDevice},
};
use boresight_capture::{
    CameraMode, choose, layout,
    v4l2::{Camera, ControlState, Found, Linux, control_states, discover, kernel::Kernel},
};
use boresight_geometry::device::Fault;
use boresight_geometry::device::Wanted;
use boresight_present::text::{
    self,
    backend::BackendWords,
    camera::{self as words, printable},
};

/// List cameras with stable names, modes and controls.
///
/// Also lists the limits of each backend.
///
/// Cameras are identified by USB vendor, product and serial number, and identical cameras by USB port, so the name
/// stays valid after a restart. Virtual and infrared cameras are listed but never chosen automatically. Exits
/// with 1 if there is no camera.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Print one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight devices
  boresight devices --json";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let found = list(!self.json);
        if self.json {
            print(&serde_json::to_value(&found)?.to_string())?;
        }
        Ok(if found.cameras.is_empty() { Exit::Failed } else { Exit::Good })
    }
}

/// The cameras; announces them if `tell`.
#[cfg(not(all(target_os = "linux", feature = "live")))]
fn list(tell: bool) -> DevicesFile {
    let (cameras, others) = match boresight_capture::nokhwa::list() {
        Ok(cameras) => (cameras, Vec::new()),
        Err((fault, detail)) => {
            let (cause, action) = words::with_detail(fault, &detail);
            if tell {
                say(&format!("{}: {cause}. {action}", fault.code()));
            }
            let other =
                OtherDevice { node: None, code: fault.code().into(), detail: printable(&detail) };
            (Vec::new(), vec![other])
        }
    };
    if tell {
        for camera in &cameras {
            say(&format!("{}  {}", printable(&camera.source), printable(&camera.name)));
        }
        if cameras.is_empty() {
            tell_none();
        }
        tell_backends();
    }
    let entry = |camera: &boresight_capture::nokhwa::Listed| DeviceEntry {
        source: camera.source.clone(),
        name: printable(&camera.name),
        v4l2: None,
    };
    devices_file(cameras.iter().map(entry).collect(), others)
}

fn tell_none() {
    let (cause, action) = ("No camera found", words::fault(Fault::NotFound).1);
    say(&format!("{}: {cause}. {action}", Fault::NotFound.code()));
}

/// Says through what cameras are read, and what that cannot promise.
fn tell_backends() {
    for BackendWords { name, is, is_default, cannot } in text::backend::backends() {
        let default = if is_default { ", the default" } else { "" };
        say(&format!("backend {name}{default}: {is}. Limits:"));
        for limit in cannot {
            say(&format!("  - {limit}"));
        }
    }
}

fn devices_file(cameras: Vec<DeviceEntry>, others: Vec<OtherDevice>) -> DevicesFile {
    let backends = text::backend::backends().into_iter().map(backend).collect();
    DevicesFile { schema: DEVICES_SCHEMA.into(), cameras, others, backends }
}

fn backend(words: BackendWords) -> BackendEntry {
    BackendEntry {
        name: words.name.into(),
        is: words.is.into(),
        is_default: words.is_default,
        cannot: words.cannot.iter().map(|limit| (*limit).to_owned()).collect(),
    }
}

#[cfg(all(target_os = "linux", feature = "live"))]
fn list(tell: bool) -> DevicesFile {
    let mut kernel = Linux::default();
    let Found { cameras, others } = discover(&mut kernel);
    let mut listed = Vec::new();
    for camera in &cameras {
        let controls = kernel.open(&camera.node.path).map_or(Vec::new(), |device| {
            let controls = control_states(&mut kernel, device);
            kernel.close(device);
            controls
        });
        if tell {
            describe(camera, &controls);
        }
        listed.push(entry(camera, &controls));
    }
    if tell {
        if cameras.is_empty() {
            tell_none();
        }
        // Metadata nodes come with every camera; they are no news.
        for other in others.iter().filter(|other| other.why != Fault::NotACamera) {
            let (cause, action) = words::with_detail(other.why, &other.detail);
            let node = other.node.path.display();
            say(&format!("{node}  {}: {cause}. {action}", other.why.code()));
        }
        tell_backends();
    }
    let others = others
        .iter()
        .map(|other| OtherDevice {
            node: Some(other.node.path.display().to_string()),
            code: other.why.code().into(),
            detail: printable(&other.detail),
        })
        .collect();
    devices_file(listed, others)
}

#[cfg(all(target_os = "linux", feature = "live"))]
fn describe(camera: &Camera, controls: &[ControlState]) {
    say(&format!("{}  {}", camera.stable_name(), printable(&camera.name)));
    let links: Vec<String> =
        camera.node.links.iter().map(|link| format!(", {}", link.display())).collect();
    say(&format!("  node      {}{}", camera.node.path.display(), links.concat()));
    for (applies, fault) in marks(camera) {
        if applies {
            say(&format!("  note      {}: {}", fault.code(), words::fault(fault).0));
        }
    }
    let best = choose(&camera.offers, &Wanted::default());
    for (format, lines) in by_format(&camera.offers) {
        say(&format!("  {format:8}  {}", lines.join(", ")));
    }
    if let Some(best) = best {
        say(&format!("  auto      {}", mode_name(&best)));
    }
    for ControlState { control, range, value, automatic } in controls {
        let value = value.map_or("?".into(), |value| value.to_string());
        let automatic = match automatic {
            Some(true) => ", automatic now",
            Some(false) => ", automatic off",
            None => "",
        };
        let name = words::control(*control);
        say(&format!("  {name:13} {value} of {} to {}{automatic}", range.min, range.max));
    }
}

#[cfg(all(target_os = "linux", feature = "live"))]
fn marks(camera: &Camera) -> [(bool, Fault); 3] {
    [
        (camera.is_virtual, Fault::Virtual),
        (camera.is_infrared, Fault::Infrared),
        (camera.has_twin, Fault::Twin),
    ]
}

/// Sizes with their rates by format; formats that cannot be read are said to be so.
#[cfg(all(target_os = "linux", feature = "live"))]
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
            _ => {
                let size = offer.size;
                formats[at].1.push(format!("{}x{} at {rate}", size.width_px, size.height_px));
            }
        }
        last = Some(key);
    }
    formats
}
