//! Discovery of cameras on the network, and their names.

use std::{net::Ipv4Addr, path::PathBuf, time::Duration};

use telegenic::gige::discovery::{
    DiscoveredDevice, DiscoveryConfig, NetworkAdapter, discover, enumerate_adapters, is_reachable,
};

use boresight_capture::v4l2::kernel::Node;

/// Time for answers. Cameras answer at once; the standard lets a crowd of them take turns for a
/// second.
const ANSWERED_WITHIN: Duration = Duration::from_millis(500);

/// A camera found by its answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen {
    /// Names of the camera: the path is `gige:` and its address, the links are `gige:` and its
    /// serial number, the name given by its owner, and its hardware address.
    pub node: Node,
    /// Maker and model stated by the camera; may hold anything.
    pub name: String,
    /// True if this computer has an address on the camera's network.
    pub is_reachable: bool,
}

/// Cameras answering now. None is opened.
pub fn near() -> Vec<Seen> {
    seen(None)
}

/// Cameras answering a broadcast, and at `address`.
pub(super) fn seen(address: Option<Ipv4Addr>) -> Vec<Seen> {
    let alone = |name: &str, ip, netmask, broadcast| NetworkAdapter {
        name: name.into(),
        ip,
        netmask,
        broadcast,
    };
    let mut adapters = enumerate_adapters().unwrap_or_default();
    // Simulated cameras, and those behind a router, out of reach of a broadcast.
    let own = Ipv4Addr::new(255, 0, 0, 0);
    adapters.push(alone("lo", Ipv4Addr::LOCALHOST, own, Ipv4Addr::new(127, 255, 255, 255)));
    let any = Ipv4Addr::UNSPECIFIED;
    adapters.extend(address.map(|address| alone("", any, any, address)));
    let asked = DiscoveryConfig {
        adapters: Some(adapters),
        recv_window: ANSWERED_WITHIN,
        ..DiscoveryConfig::default()
    };
    let devices = discover(&asked).unwrap_or_default();
    let mut seen: Vec<Seen> = devices.iter().map(|device| seen_as(device, &devices)).collect();
    seen.sort_by(|a, b| a.node.known_as.cmp(&b.node.known_as));
    seen
}

fn seen_as(device: &DiscoveredDevice, all: &[DiscoveredDevice]) -> Seen {
    let info = &device.info;
    let serial = info.serial.trim();
    let hardware = info.mac.map(|byte| format!("{byte:02x}")).join("-");
    let is_own =
        !serial.is_empty() && all.iter().filter(|d| d.info.serial.trim() == serial).count() == 1;
    let known_as = format!("gige:{}", if is_own { plain(serial) } else { hardware.clone() });
    let given = [serial, info.user_defined_name.trim(), &hardware];
    let node = Node {
        path: PathBuf::from(format!("gige:{}", info.ip)),
        place: known_as.clone(),
        serial: serial.into(),
        links: given
            .into_iter()
            .filter(|name| !name.is_empty())
            .map(|name| PathBuf::from(format!("gige:{}", plain(name))))
            .collect(),
        known_as,
        ..Node::default()
    };
    let name = format!("{} {}", info.manufacturer.trim(), info.model.trim()).trim().to_owned();
    Seen { node, name, is_reachable: is_reachable(device) }
}

/// `text` with every character replaced that would break a name on a command line.
fn plain(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() || c.is_whitespace() || "\"'@#".contains(c) { '_' } else { c })
        .collect()
}

/// The address in the name `gige:ADDRESS`.
pub(super) fn address(name: &str) -> Option<Ipv4Addr> {
    name.strip_prefix("gige:")?.parse().ok()
}

/// True if `name` is one of the camera's names.
pub(super) fn is_called(node: &Node, name: &str) -> bool {
    let same = |own: &PathBuf| own.to_string_lossy().eq_ignore_ascii_case(name);
    same(&node.path) || node.links.iter().any(same)
}
