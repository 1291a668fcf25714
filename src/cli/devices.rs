//! `boresight devices`.

use anyhow::bail;
use clap::Args;

use boresight_app::{
    Exit, MissingFeature,
    session::{
        camera::{self, Backend, Devices},
        devices_file::{BackendEntry, DEVICES_SCHEMA, DevicesFile},
    },
};
use boresight_geometry::device::Fault;
use boresight_present::text::camera as words;
use boresight_terminal::{print, say};

/// List cameras with stable names, modes and controls.
///
/// With `--json`, also lists the limits of each backend.
///
/// Cameras are identified by USB vendor, product and serial number, identical cameras by USB port,
/// and machine-vision cameras on the network by serial number, so the name stays valid after a
/// restart. Virtual and infrared cameras are listed but never chosen automatically. Exits with 1 if
/// there is no camera.
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
        if camera::backends().next().is_none() {
            bail!(MissingFeature::LIVE);
        }
        let found = camera::devices();
        let exit = if found.cameras.is_empty() { Exit::Failed } else { Exit::Good };
        if self.json {
            print(&serde_json::to_value(file(found))?.to_string())?;
        } else {
            tell(&found);
        }
        Ok(exit)
    }
}

/// Prints the cameras, and other devices with the reason for leaving them out.
fn tell(found: &Devices) {
    let cameras = found.cameras.iter().flat_map(|(_, lines)| lines);
    cameras.for_each(|line| say(line));
    if found.cameras.is_empty() {
        say(&format!("{}: {}", Fault::NotFound.code(), words::NO_CAMERA));
    }
    found.others.iter().filter_map(|(_, line)| line.as_ref()).for_each(|line| say(line));
}

fn file(found: Devices) -> DevicesFile {
    let backend = |(index, backend): (usize, Backend)| BackendEntry {
        name: backend.name.into(),
        is: backend.is.into(),
        is_default: index == 0,
        cannot: backend.limits(),
    };
    DevicesFile {
        schema: DEVICES_SCHEMA.into(),
        cameras: found.cameras.into_iter().map(|(entry, _)| entry).collect(),
        others: found.others.into_iter().map(|(other, _)| other).collect(),
        backends: camera::backends().enumerate().map(backend).collect(),
    }
}
