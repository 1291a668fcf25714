//! `boresight.devices/1`: the cameras of a computer, as `devices --json` prints them.

use serde::{Deserialize, Serialize};

/// Name and version of the format.
pub const DEVICES_SCHEMA: &str = "boresight.devices/1";

/// Cameras, other devices, and the ways to a camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct DevicesFile {
    /// [`DEVICES_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.devices/1")))]
    pub schema: String,
    /// Cameras that can be opened.
    pub cameras: Vec<DeviceEntry>,
    /// Devices that are no camera or can't be used.
    pub others: Vec<OtherDevice>,
    /// The ways to a camera on this system, the usual one first.
    pub backends: Vec<BackendEntry>,
}

/// A camera. Systems other than Linux name no more than `source` and `name`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct DeviceEntry {
    /// What to give `--source`: stays right after a restart.
    pub source: String,
    /// The driver's name for the camera.
    pub name: String,
    /// Details that only Linux knows.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub v4l2: Option<V4l2Entry>,
}

/// A V4L2 camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct V4l2Entry {
    /// Path of the device node.
    pub node: String,
    /// Paths of symbolic links to it.
    pub links: Vec<String>,
    /// Name of the driver.
    pub driver: String,
    /// USB vendor and product, `vvvv:pppp` in hexadecimal; null if not on USB.
    pub usb: Option<String>,
    /// Serial number; empty if it has none.
    pub serial: String,
    /// Where it's plugged in.
    pub place: String,
    /// Whether a program stands behind it instead of a camera.
    #[serde(rename = "virtual")]
    pub is_virtual: bool,
    /// Whether it sees infrared light.
    pub infrared: bool,
    /// Whether another camera of this computer has the same name and serial number.
    pub twin: bool,
    /// The mode that `auto` takes, `WIDTHxHEIGHT@RATE:FORMAT`; null if none can be read.
    pub auto_mode: Option<String>,
    /// Every mode that the driver offers.
    pub modes: Vec<ModeEntry>,
    /// Controls of lens and exposure.
    pub controls: Vec<ControlEntry>,
}

/// A mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct ModeEntry {
    /// Pixel format, V4L2's four characters.
    pub format: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Frames per second; null if the driver doesn't say.
    pub fps: Option<f64>,
    /// Whether this program can read the format.
    pub readable: bool,
}

/// A control, in the driver's units.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct ControlEntry {
    /// Its name.
    pub control: String,
    /// Its value; null if it can't be read.
    pub value: Option<i64>,
    /// Smallest value.
    pub min: i64,
    /// Largest value.
    pub max: i64,
    /// Difference between values.
    pub step: i64,
    /// The driver's default.
    pub default: i64,
    /// Whether the camera sets it by itself; null if the camera can't.
    pub automatic: Option<bool>,
}

/// A device that is no camera or can't be used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct OtherDevice {
    /// Path of the device node, on Linux.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub node: Option<String>,
    /// Stable code of the reason.
    pub code: String,
    /// Details, such as the kernel's error text; may be empty.
    pub detail: String,
}

/// A way to a camera.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct BackendEntry {
    /// What `--backend` calls it.
    pub name: String,
    /// What it is.
    pub is: String,
    /// True for the default backend.
    #[serde(rename = "default")]
    pub is_default: bool,
    /// What it can't promise.
    pub cannot: Vec<String>,
}
