//! A backend as a value: its description, lockable controls, and functions to reach its cameras.

use std::{fmt, sync::Arc};

use boresight_capture::{CaptureError, FrameSource, guarded};
use boresight_geometry::device::{Control, Fault, Wanted};
use boresight_present::text::camera as words;

use crate::session::devices_file::{DeviceEntry, OtherDevice};

/// A way to cameras.
#[derive(Clone, Copy, Debug)]
pub struct Backend {
    /// Name in `--backend` and in the settings.
    pub name: &'static str,
    /// Description in a few words.
    pub is: &'static str,
    /// Controls locked and watched.
    pub locks: &'static [Control],
    /// Limits to state to a person, besides controls without a lock.
    pub cannot: &'static [&'static str],
    /// Prefixes of camera names exclusive to the backend. A backend sharing all of its prefixes
    /// with an earlier one opens the cameras listed by the earlier one.
    pub begins: &'static [&'static str],
    /// Driver, or the reason for a missing backend.
    pub(super) driver: Result<Driver, fn() -> anyhow::Error>,
}

/// Functions that reach the cameras of a backend.
#[derive(Clone, Copy, Debug)]
pub struct Driver {
    /// Lists the connected cameras. Called every second while a person chooses one.
    pub near: fn() -> Near,
    /// Lists the readable modes of a named camera, in the format of the settings, the largest
    /// first; empty if the modes or the camera are unknown.
    pub modes: fn(&str) -> Vec<String>,
    /// Finds the named camera, for use in the given mode.
    pub find: fn(&str, &Wanted) -> anyhow::Result<ChosenCamera>,
    /// Describes the connected cameras in full.
    pub devices: fn() -> Devices,
}

/// The connected cameras.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Near {
    /// Cameras that can be opened.
    pub cameras: Vec<NearCamera>,
    /// Cameras that can't be used now.
    pub unusable: Vec<Unusable>,
}

/// A camera that can be opened.
#[derive(Clone, Debug, PartialEq)]
pub struct NearCamera {
    /// Stable name, to find the camera again.
    pub source: String,
    /// Product name, for display.
    pub name: String,
    /// True for a camera to open unasked: neither virtual nor infrared.
    pub is_ordinary: bool,
}

/// A connected but unusable camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Unusable {
    /// The camera's node, or another name.
    pub source: String,
    /// The camera's fault.
    pub fault: Fault,
    /// Details; may be empty.
    pub detail: String,
}

/// The `devices` report on a backend's cameras: entries for its file, each with its lines for a
/// person.
#[derive(Clone, Debug, Default)]
pub struct Devices {
    /// Cameras that can be opened.
    pub cameras: Vec<(DeviceEntry, Vec<String>)>,
    /// Devices without or with an unusable camera, each with a line for a person unless it's no
    /// news.
    pub others: Vec<(OtherDevice, Option<String>)>,
}

/// Purpose for which a camera is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A session: locks the controls, if the backend can.
    Session,
    /// A look: sets no control.
    Preview,
}

type Opens = dyn Fn(Purpose) -> Result<Box<dyn FrameSource>, CaptureError> + Send + Sync;

/// A camera found but not yet open.
#[derive(Clone)]
pub struct ChosenCamera {
    source: String,
    opens: Arc<Opens>,
}

impl Backend {
    /// True if the build includes the backend.
    pub fn is_built(&self) -> bool {
        self.driver.is_ok()
    }

    /// True if `source` can name a camera of the backend.
    pub(super) fn knows(&self, source: &str) -> bool {
        self.begins.iter().any(|start| source.starts_with(start))
    }

    /// Limits of the backend, in sentences.
    pub fn limits(&self) -> Vec<String> {
        let free = Control::ALL.into_iter().filter(|control| !self.locks.contains(control));
        let free: Vec<&str> = free.map(words::control).collect();
        let free = match free.as_slice() {
            [] => None,
            [one] => Some(format!("{one} isn't locked or watched.")),
            [rest @ .., last] => {
                Some(format!("{} and {last} aren't locked or watched.", rest.join(", ")))
            }
        };
        let cannot = self.cannot.iter().map(|limit| (*limit).to_owned());
        free.map(|free| words::capital(&free)).into_iter().chain(cannot).collect()
    }

    pub(super) fn driver(&self) -> anyhow::Result<Driver> {
        self.driver.map_err(|missing| missing())
    }
}

impl Unusable {
    /// Reason for a camera being unusable, and the next action.
    pub fn said(&self) -> (String, String) {
        words::with_detail(self.fault, &self.detail)
    }
}

impl ChosenCamera {
    /// Wraps the found camera `source`, started by `opens`.
    pub fn new(
        source: String,
        opens: impl Fn(Purpose) -> Result<Box<dyn FrameSource>, CaptureError> + Send + Sync + 'static,
    ) -> Self {
        Self { source, opens: Arc::new(opens) }
    }

    /// Stable name, to find the camera again.
    pub fn stable_name(&self) -> String {
        self.source.clone()
    }

    /// Starts streaming.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] with the fault.
    pub fn open(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        self.open_for(Purpose::Session)
    }

    /// Starts streaming without setting any control, for a preview.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn preview(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        self.open_for(Purpose::Preview)
    }

    fn open_for(&self, purpose: Purpose) -> anyhow::Result<Box<dyn FrameSource>> {
        Ok(guarded(&self.source, || (self.opens)(purpose))?)
    }
}

impl fmt::Debug for ChosenCamera {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ChosenCamera").field(&self.source).finish()
    }
}
