//! Discovery of cameras, and lookup by name.
//!
//! A node number is the order of discovery and identifies nothing. A camera is identified by its
//! own description: USB vendor, product and serial number; two cameras with equal descriptions, by
//! their ports.

use std::path::Path;

use super::{
    kernel::{CAP_STREAMING, CAP_VIDEO_CAPTURE, Errno, Kernel, Node},
    mode::offers,
    queue::again,
};
use crate::{CameraMode, layout};
use boresight_geometry::device::{CameraInfo, ControlBefore, Fault, Mode, PixelLayout};

/// A node of a camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Camera {
    /// Present node of the camera.
    pub node: Node,
    /// Name stated by the camera; may hold anything.
    pub name: String,
    /// Name of the driver.
    pub driver: String,
    /// True if another program feeds the camera.
    pub is_virtual: bool,
    /// True if the device looks like an infrared camera.
    pub is_infrared: bool,
    /// True if another connected camera has the same description.
    pub has_twin: bool,
    /// Modes on offer; empty if another program has the camera.
    pub offers: Vec<CameraMode>,
}

/// Marks to recognise a camera by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    usb_id: Option<(u16, u16)>,
    serial: String,
    name: String,
    place: String,
    index: u32,
    by_place: bool,
}

/// A node that takes no pictures, or could not be queried.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Other {
    /// Video node without a camera.
    pub node: Node,
    /// Reason.
    pub why: Fault,
    /// The system's words, or nothing.
    pub detail: String,
}

/// Result of a discovery.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Cameras, ordered by place.
    pub cameras: Vec<Camera>,
    /// Other video nodes.
    pub others: Vec<Other>,
}

impl Camera {
    /// Marks to recognise the camera by.
    pub fn identity(&self) -> Identity {
        Identity {
            usb_id: self.node.usb_id,
            serial: self.node.serial.clone(),
            name: self.name.clone(),
            place: self.node.place.clone(),
            index: self.node.index,
            by_place: self.has_twin || self.node.usb_id.is_none(),
        }
    }

    /// Facts about the camera for a session.
    pub(crate) fn facts(
        &self,
        backend: &'static str,
        mode: Mode,
        controls: Vec<ControlBefore>,
    ) -> CameraInfo {
        CameraInfo {
            name: self.name.clone(),
            usb_id: self.node.usb_id,
            serial: self.node.serial.clone(),
            place: self.node.place.clone(),
            backend,
            mode,
            controls,
        }
    }

    /// Stable name, understood by `--source`: `usb:VENDOR:PRODUCT[:SERIAL][@PLACE][#NODE]`, or
    /// `place:PLACE[#NODE]` for a camera without USB.
    pub fn stable_name(&self) -> String {
        let (port, interface) = port_and_interface(&self.node.place);
        let node = match (interface, self.node.index) {
            ("" | "1.0", 0) => String::new(),
            (interface, index) => format!("#{}-{index}", plain(interface)),
        };
        match self.node.usb_id {
            None if !self.node.known_as.is_empty() => self.node.known_as.clone(),
            None => format!("place:{}{node}", plain(&self.node.place)),
            Some((vendor, product)) => {
                let serial = plain(&self.node.serial);
                let serial = if serial.is_empty() { serial } else { format!(":{serial}") };
                let port = port.rsplit('/').next().unwrap_or_default();
                let place = if self.has_twin { format!("@{}", plain(port)) } else { String::new() };
                format!("usb:{vendor:04x}:{product:04x}{serial}{place}{node}")
            }
        }
    }

    /// True if `auto` may choose the camera.
    pub fn is_ordinary(&self) -> bool {
        !self.is_virtual
            && !self.is_infrared
            && self.offers.iter().any(|o| layout(o.fourcc).is_some())
    }
}

/// `text` with every character replaced that would break a name: spaces, quotes, terminal commands.
fn plain(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() || c.is_whitespace() || "\"'@#".contains(c) { '_' } else { c })
        .collect()
}

impl Identity {
    /// Quality of the match with `camera`: `None` for another camera, 2 if certain, 1 if everything
    /// fits but the place differs and there's no serial number.
    pub(super) fn fit(&self, camera: &Camera) -> Option<u32> {
        let node = &camera.node;
        let same = self.usb_id == node.usb_id
            && self.serial == node.serial
            && self.name == camera.name
            && self.index == node.index
            && port_and_interface(&self.place).1 == port_and_interface(&node.place).1;
        let here = self.place == node.place;
        match (same, here) {
            (false, _) => None,
            (true, true) => Some(2),
            (true, false) if self.by_place => None,
            (true, false) if self.serial.is_empty() => Some(1),
            (true, false) => Some(2),
        }
    }

    /// True if `node` may be the camera: same USB id, or same place.
    pub(super) fn may_be(&self, node: &Node) -> bool {
        self.usb_id == node.usb_id || self.place == node.place
    }

    /// True if `camera` is at the place of the identified camera.
    pub(super) fn is_place_of(&self, camera: &Camera) -> bool {
        self.place == camera.node.place && self.index == camera.node.index
    }
}

/// Lists every camera and every other video node.
pub fn discover(kernel: &mut dyn Kernel) -> Found {
    discover_those(kernel, |_| true)
}

/// Lists the cameras and other nodes accepted by `wanted`; other nodes are not opened.
pub(super) fn discover_those(kernel: &mut dyn Kernel, wanted: impl Fn(&Node) -> bool) -> Found {
    let mut found = Found::default();
    for node in kernel.nodes().into_iter().filter(wanted) {
        match look_at(kernel, &node) {
            Ok(camera) => found.cameras.push(camera),
            Err((why, detail)) => found.others.push(Other { node, why, detail }),
        }
    }
    let says = |camera: &Camera| {
        let interface = port_and_interface(&camera.node.place).1.to_owned();
        let Node { usb_id, serial, index, .. } = camera.node.clone();
        (usb_id, serial, camera.name.clone(), interface, index)
    };
    let all: Vec<_> = found.cameras.iter().map(says).collect();
    let colourful: Vec<String> = found
        .cameras
        .iter()
        .filter(|camera| !only_grey(camera))
        .map(|camera| port_and_interface(&camera.node.place).0.to_owned())
        .collect();
    for camera in &mut found.cameras {
        camera.has_twin = all.iter().filter(|other| **other == says(camera)).count() > 1;
        // Industrial cameras are grey, too, but have no colour camera in the same case.
        let port = port_and_interface(&camera.node.place).0;
        camera.is_infrared |= only_grey(camera) && colourful.iter().any(|other| other == port);
    }
    found
}

fn only_grey(camera: &Camera) -> bool {
    camera.offers.iter().all(|offer| layout(offer.fourcc) == Some(PixelLayout::Grey))
}

/// Port of a USB device, and the interface; the whole place and an empty text for a device without
/// USB.
fn port_and_interface(place: &str) -> (&str, &str) {
    match place.rsplit_once('/') {
        Some((port, last)) => match last.rsplit_once(':') {
            Some((_, interface)) => (port, interface),
            None => (place, ""),
        },
        None => (place, ""),
    }
}

/// Camera by `name`: a node, a link to one, or a stable name.
///
/// # Errors
///
/// The fault and its details.
pub fn find(found: &Found, name: &str) -> Result<Camera, (Fault, String)> {
    let path = Path::new(name);
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let is_node = |node: &Node| node.path == target || node.links.iter().any(|link| link == path);
    if let Some(camera) = found.cameras.iter().find(|camera| is_node(&camera.node)) {
        return Ok(camera.clone());
    }
    if let Some(other) = found.others.iter().find(|other| is_node(&other.node)) {
        return Err((other.why, other.detail.clone()));
    }
    // A name given before there was a twin fits both; one given beside a twin fits the remaining
    // one.
    let bare = |name: &str| match name.split_once('@') {
        Some((bare, rest)) => {
            bare.to_owned() + rest.find('#').map_or("", |node| rest.get(node..).unwrap_or_default())
        }
        None => name.to_owned(),
    };
    let exact = found.cameras.iter().filter(|camera| camera.stable_name() == name);
    let mut fitting: Vec<&Camera> = exact.collect();
    if fitting.is_empty() {
        let alike = |camera: &&Camera| bare(&camera.stable_name()) == bare(name);
        fitting = found.cameras.iter().filter(alike).collect();
        // With a port in the name, another port is another camera while there are several.
        if name.contains('@') && fitting.len() > 1 {
            fitting.clear();
        }
    }
    match fitting.as_slice() {
        [one] => Ok((*one).clone()),
        [] => Err((Fault::NotFound, format!("{name}; {}", listed(found)))),
        several => Err((
            Fault::Twin,
            several.iter().map(|camera| camera.stable_name()).collect::<Vec<_>>().join(" or "),
        )),
    }
}

/// Short list of the found cameras.
fn listed(found: &Found) -> String {
    if found.cameras.is_empty() {
        return "there is no camera".into();
    }
    let names: Vec<String> =
        found.cameras.iter().map(|c| format!("{} ({})", c.stable_name(), c.name)).collect();
    format!("there is {}", names.join(", "))
}

fn look_at(kernel: &mut dyn Kernel, node: &Node) -> Result<Camera, (Fault, String)> {
    let device = open(kernel, &node.path)?;
    let capability = again(|| kernel.capability(device));
    let offered = offers(kernel, device);
    kernel.close(device);
    let capability = capability.map_err(|errno| (Fault::NotACamera, errno.words()))?;
    let wanted = CAP_VIDEO_CAPTURE | CAP_STREAMING;
    let offered = match offered {
        Ok(offered) if capability.node_caps & wanted == wanted => offered,
        _ => return Err((Fault::NotACamera, String::new())),
    };
    if offered.is_empty() {
        return Err((Fault::NoFormat, String::new()));
    }
    let name = capability.card.to_ascii_lowercase();
    let says_infrared =
        name.contains("infrared") || name.split(|c: char| !c.is_alphanumeric()).any(|w| w == "ir");
    let is_virtual = node.place.starts_with("virtual/")
        || node.place.contains("/virtual/")
        || ["v4l2 loopback", "v4l2loopback", "vivid"].contains(&capability.driver.as_str());
    Ok(Camera {
        node: node.clone(),
        name: capability.card,
        driver: capability.driver,
        is_virtual,
        is_infrared: says_infrared,
        has_twin: false,
        offers: offered,
    })
}

/// Opens a node, or returns the fault.
pub(super) fn open(
    kernel: &mut dyn Kernel,
    path: &Path,
) -> Result<super::kernel::Handle, (Fault, String)> {
    again(|| kernel.open(path)).map_err(|errno| {
        let holders = if errno.0 == libc::EBUSY { kernel.holders(path) } else { Vec::new() };
        (fault_of(errno), detail_of(path, errno, &holders))
    })
}

/// Camera fault for an error of the system.
pub(super) fn fault_of(errno: Errno) -> Fault {
    match errno.0 {
        libc::ENOENT => Fault::NotFound,
        libc::EACCES | libc::EPERM => Fault::NotPermitted,
        libc::EBUSY => Fault::Busy,
        libc::ENOTTY => Fault::NotACamera,
        libc::EHOSTUNREACH | libc::ENETUNREACH => Fault::Unreachable,
        libc::ENOSPC => Fault::NoBandwidth,
        libc::ENODEV | libc::ENXIO | libc::EBADF | libc::ESHUTDOWN => Fault::Unplugged,
        libc::EIO
        | libc::EPROTO
        | libc::EPIPE
        | libc::EILSEQ
        | libc::ETIMEDOUT
        | libc::EREMOTEIO => Fault::Transfer,
        _ => Fault::DriverBroken,
    }
}

/// The node, the system's words, and the programs at work on the node.
pub(super) fn detail_of(path: &Path, errno: Errno, holders: &[String]) -> String {
    let mut detail = format!("{}: {}", path.display(), errno.words());
    if !holders.is_empty() {
        detail = format!("{detail}; used by {}", holders.join(" and "));
    }
    detail
}
