//! The camera in `session.toml`: which it is, its mode, and its controls before the session locked them.

use serde::{Deserialize, Serialize};

use super::ControlLine;
use crate::device::CameraInfo;

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
    /// As locked they stand in the journal.
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
                })
                .collect(),
        }
    }
}
