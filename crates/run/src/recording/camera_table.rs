//! The camera in `session.toml`: identity, mode, and controls before the session locked them.

use serde::{Deserialize, Serialize};

use super::ControlLine;
use boresight_geometry::device::{CameraInfo, ControlBefore};

/// Mirror of [`CameraInfo`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraTable {
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    usb: Option<String>,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    serial: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    place: String,
    backend: String,
    format: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rate_hz: Option<f64>,
    /// Controls before the session. The journal has them as locked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    controls_before: Vec<ControlTable>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ControlTable {
    control: ControlLine,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    value: Option<i64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    automatic: Option<bool>,
    /// The driver's numbers and values, for restoring.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    exact: Vec<(u32, i64)>,
}

impl CameraTable {
    /// Name stated by the camera; may hold anything.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// USB serial number; empty if none.
    pub fn serial(&self) -> &str {
        &self.serial
    }

    /// USB vendor and product, `vvvv:pppp` in hexadecimal; `None` for a camera not on USB.
    pub fn usb(&self) -> Option<&str> {
        self.usb.as_deref()
    }

    /// State of the controls before the session's locks.
    pub fn controls_before(&self) -> Vec<ControlBefore> {
        let before = |table: &ControlTable| ControlBefore {
            control: table.control.into(),
            value: table.value,
            automatic: table.automatic,
            exact: table.exact.clone(),
        };
        self.controls_before.iter().map(before).collect()
    }
}

impl From<CameraInfo> for CameraTable {
    fn from(facts: CameraInfo) -> Self {
        let CameraInfo { name, usb_id, serial, place, backend, mode, controls } = facts;
        Self {
            name,
            usb: usb_id.map(|(vendor, product)| format!("{vendor:04x}:{product:04x}")),
            serial,
            place,
            backend: backend.into(),
            format: mode.layout.name().into(),
            rate_hz: mode.rate_hz(),
            controls_before: controls
                .into_iter()
                .map(|before| ControlTable {
                    control: before.control.into(),
                    value: before.value,
                    automatic: before.automatic,
                    exact: before.exact,
                })
                .collect(),
        }
    }
}
