//! Facts in the system's files: the video nodes, their devices, and programs with the nodes open.

use std::{
    ffi::OsStr,
    fs,
    os::unix::ffi::OsStrExt,
    path::{Path, PathBuf},
};

use super::kernel::Node;

/// Reads the video nodes from sysfs; `dev` holds the nodes and their links.
pub(super) fn nodes(class: &Path, dev: &Path) -> Vec<Node> {
    let links = links(dev);
    let mut nodes = Vec::new();
    for entry in fs::read_dir(class).into_iter().flatten().flatten() {
        let name = entry.file_name();
        // Radios, sub-devices and decoders have other names.
        let number = name.as_bytes().strip_prefix(b"video");
        if !number.is_some_and(|n| !n.is_empty() && n.iter().all(u8::is_ascii_digit)) {
            continue;
        }
        let folder = entry.path();
        let device = fs::canonicalize(folder.join("device"));
        let place = match &device {
            Ok(device) => device.clone(),
            // Virtual nodes have no device.
            Err(_) => fs::canonicalize(&folder).unwrap_or_else(|_| folder.clone()),
        };
        let usb = device.ok().and_then(|device| usb_device(&device));
        let read = |file: &str| usb.as_ref().map_or(String::new(), |usb| word(&usb.join(file)));
        let number = |file: &str| u16::from_str_radix(&read(file), 16).ok();
        let path = dev.join(&name);
        nodes.push(Node {
            links: links
                .iter()
                .filter(|(_, target)| *target == path)
                .map(|(link, _)| link.clone())
                .collect(),
            path,
            known_as: String::new(),
            place: place.strip_prefix("/sys/devices").unwrap_or(&place).to_string_lossy().into(),
            index: word(&folder.join("index")).parse().unwrap_or(0),
            usb_id: number("idVendor").zip(number("idProduct")),
            serial: read("serial"),
        });
    }
    nodes.sort_by(|a, b| {
        (a.path.as_os_str().len(), &a.path).cmp(&(b.path.as_os_str().len(), &b.path))
    });
    nodes
}

/// USB device of an interface.
fn usb_device(interface: &Path) -> Option<PathBuf> {
    interface.ancestors().take(4).find(|folder| folder.join("idVendor").is_file()).map(Into::into)
}

/// Contents of a small file, without the line's end.
fn word(path: &Path) -> String {
    let bytes = fs::read(path).unwrap_or_default();
    text(&bytes[..bytes.len().min(256)])
}

/// Stable names of nodes.
fn links(dev: &Path) -> Vec<(PathBuf, PathBuf)> {
    let mut found = Vec::new();
    for folder in ["v4l/by-id", "v4l/by-path"] {
        for entry in fs::read_dir(dev.join(folder)).into_iter().flatten().flatten() {
            if let Ok(target) = fs::canonicalize(entry.path()) {
                found.push((entry.path(), target));
            }
        }
    }
    found.sort();
    found
}

/// Other programs with `path` open.
pub(super) fn holders(path: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let own = std::process::id().to_string();
    for process in fs::read_dir("/proc").into_iter().flatten().flatten() {
        let id = process.file_name();
        let is_number = id.as_bytes().iter().all(u8::is_ascii_digit);
        if !is_number || id == OsStr::new(&own) {
            continue;
        }
        let holds = fs::read_dir(process.path().join("fd"))
            .into_iter()
            .flatten()
            .flatten()
            .any(|open| fs::read_link(open.path()).is_ok_and(|target| target == path));
        if holds {
            let name = word(&process.path().join("comm"));
            found.push(format!("{name}, process {}", id.to_string_lossy()));
        }
    }
    found
}

/// Text up to the first zero byte. Names can be cut inside a character.
pub(super) fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim().to_owned()
}
