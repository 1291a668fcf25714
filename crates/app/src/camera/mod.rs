//! Live cameras: the table of backends, and which camera a name means.
//!
//! A backend is a way to cameras: a frame source in [`boresight_capture`], a file here that lists and opens its cameras,
//! and its line in [`BACKENDS`]. A build that leaves it out still knows its name, and which feature adds it.
//!
//! | file | cameras |
//! |---|---|
//! | `v4l2` | of Linux, with the feature `live` |
//! | `nokhwa` | of other systems, and a second way to those of Linux, with the feature `nokhwa` |

mod nokhwa;
mod v4l2;

use std::{fmt, sync::Arc};

use anyhow::{Context, bail};

use super::{
    Announcer,
    devices_file::{DeviceEntry, OtherDevice},
};
use boresight_capture::{CaptureError, FrameSource};
use boresight_geometry::device::{Control, Fault, Wanted};
use boresight_present::text::camera as words;
use boresight_run::config::{self, Config};

/// Every backend that boresight knows, the usual one first.
pub const BACKENDS: [Backend; 2] = [v4l2::BACKEND, nokhwa::BACKEND];

/// A way to cameras.
#[derive(Clone, Copy, Debug)]
pub struct Backend {
    /// What `--backend` and the settings call it.
    pub name: &'static str,
    /// What it is.
    pub is: &'static str,
    /// The controls that it locks and watches.
    pub locks: &'static [Control],
    /// What it cannot promise, besides the other controls.
    pub cannot: &'static [&'static str],
    /// How a name begins that can only mean one of its cameras. A backend whose names another one before it knows, too,
    /// opens the cameras that that one lists.
    pub begins: &'static [&'static str],
    /// How its cameras are reached; the reason if this build can't.
    driver: Result<Driver, fn() -> anyhow::Error>,
}

/// How the cameras of a backend are reached.
#[derive(Clone, Copy, Debug)]
pub struct Driver {
    /// The connected cameras. It's called every second while a person chooses one.
    pub near: fn() -> Near,
    /// Modes of the camera called so that can be read, as the settings name them, the largest first; none if they or the
    /// camera aren't known.
    pub modes: fn(&str) -> Vec<String>,
    /// The camera called so, used in that mode.
    pub find: fn(&str, &Wanted) -> anyhow::Result<ChosenCamera>,
    /// The connected cameras, and all that is known of them.
    pub devices: fn() -> Devices,
}

/// The connected cameras.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Near {
    /// Those that can be opened.
    pub cameras: Vec<NearCamera>,
    /// Those that can't be used now.
    pub unusable: Vec<Unusable>,
}

/// A camera that can be opened.
#[derive(Clone, Debug, PartialEq)]
pub struct NearCamera {
    /// The name that finds it again.
    pub source: String,
    /// Its product name, which may be shown.
    pub name: String,
    /// Whether it may be taken unasked: it's neither virtual nor infrared.
    pub is_ordinary: bool,
}

/// A camera that is there and can't be used.
#[derive(Clone, Debug, PartialEq)]
pub struct Unusable {
    /// Its node, or what else it's called.
    pub source: String,
    /// Why.
    pub fault: Fault,
    /// Details; may be empty.
    pub detail: String,
}

/// What `devices` says of a backend's cameras: entries for its file, each with its lines for a person.
#[derive(Clone, Debug, Default)]
pub struct Devices {
    /// Cameras that can be opened.
    pub cameras: Vec<(DeviceEntry, Vec<String>)>,
    /// Devices that are no camera or can't be used; no line for those that are no news.
    pub others: Vec<(OtherDevice, Option<String>)>,
}

/// What a camera is opened for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A session: its controls are locked, if the backend can.
    Session,
    /// A look: no control is set.
    Preview,
}

type Opens = dyn Fn(Purpose) -> Result<Box<dyn FrameSource>, CaptureError> + Send + Sync;

/// A camera that was found but isn't open yet.
#[derive(Clone)]
pub struct ChosenCamera {
    source: String,
    opens: Arc<Opens>,
}

impl Backend {
    /// Whether this build has it.
    pub fn is_built(&self) -> bool {
        self.driver.is_ok()
    }

    /// Whether `source` can mean one of its cameras.
    fn knows(&self, source: &str) -> bool {
        self.begins.iter().any(|start| source.starts_with(start))
    }

    /// What it cannot promise, in sentences.
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

    /// The backend that the settings ask for; `None` for `auto`.
    ///
    /// # Errors
    ///
    /// If there is none of that name: the names to choose from.
    pub fn asked(by: &config::Backend) -> anyhow::Result<Option<Self>> {
        let Some(name) = by.name() else { return Ok(None) };
        let found = BACKENDS.into_iter().find(|backend| backend.name == name);
        let names = || BACKENDS.map(|backend| backend.name).join(", ");
        let found = found.with_context(|| {
            format!("no camera backend {name:?}: it's auto, or one of {}", names())
        });
        found.map(Some)
    }

    fn driver(&self) -> anyhow::Result<Driver> {
        self.driver.map_err(|missing| missing())
    }
}

/// The backends of this build, the usual one first.
pub fn backends() -> impl Iterator<Item = Backend> {
    BACKENDS.into_iter().filter(Backend::is_built)
}

/// Drivers of this build that list cameras, or that of the backend that is asked for.
fn drivers(asked: &config::Backend) -> anyhow::Result<Vec<Driver>> {
    if let Some(backend) = Backend::asked(asked)? {
        return Ok(vec![backend.driver()?]);
    }
    let built: Vec<Backend> = backends().collect();
    let lists = |(at, backend): (usize, &Backend)| {
        let is_listed = |start| built[..at].iter().any(|before| before.begins.contains(start));
        if backend.begins.iter().all(is_listed) { None } else { backend.driver.ok() }
    };
    Ok(built.iter().enumerate().filter_map(lists).collect())
}

/// Whether `name` can only mean a live camera, which this build may not be able to open.
pub fn is_name(name: &str) -> bool {
    BACKENDS.iter().any(|backend| backend.knows(name))
}

/// The connected cameras; none if the backend that is asked for isn't there.
pub fn near(asked: &config::Backend) -> Near {
    let mut all = Near::default();
    for driver in drivers(asked).unwrap_or_default() {
        let Near { cameras, unusable } = (driver.near)();
        all.cameras.extend(cameras);
        all.unusable.extend(unusable);
    }
    all
}

/// The modes of the camera called `name` that can be read, as the settings name them; none if they or the camera aren't
/// known.
pub fn modes(name: &str) -> Vec<String> {
    let driver = backends().find(|backend| backend.knows(name)).and_then(|it| it.driver.ok());
    driver.map_or(Vec::new(), |driver| (driver.modes)(name))
}

/// The connected cameras of every backend, and all that is known of them.
pub fn devices() -> Devices {
    let mut all = Devices::default();
    for driver in drivers(&config::Backend::default()).unwrap_or_default() {
        let Devices { cameras, others } = (driver.devices)();
        all.cameras.extend(cameras);
        all.others.extend(others);
    }
    all
}

impl Unusable {
    /// Why it can't be used, and what to do.
    pub fn said(&self) -> (String, String) {
        words::with_detail(self.fault, &self.detail)
    }
}

impl ChosenCamera {
    /// The camera called `source`, which `opens` starts; it's found already.
    pub fn new(
        source: String,
        opens: impl Fn(Purpose) -> Result<Box<dyn FrameSource>, CaptureError> + Send + Sync + 'static,
    ) -> Self {
        Self { source, opens: Arc::new(opens) }
    }

    /// The camera that `name` means, through the backend and in the mode that `config` asks for.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if there is no such camera; [`super::MissingFeature`] if this build leaves its backend out.
    pub fn named(name: &str, config: &Config) -> anyhow::Result<Self> {
        let backend = match Backend::asked(&config.camera.backend)? {
            Some(asked) => Some(asked),
            None => backends().chain(BACKENDS).find(|backend| backend.knows(name)),
        };
        let backend = backend.with_context(|| format!("{name:?} isn't the name of a camera"))?;
        let driver = backend.driver()?;
        if !backend.knows(name) {
            bail!("the {} backend has no camera {name:?}", backend.name);
        }
        // The mode was checked when it was read.
        (driver.find)(name, &config.camera.wanted().unwrap_or_default())
    }

    /// The only camera that isn't virtual or infrared; `None` if there is none. Announces which, or why one that is
    /// connected can't be used.
    ///
    /// # Errors
    ///
    /// If there are several: the names to choose from.
    pub fn only(config: &Config, announcer: &Announcer) -> anyhow::Result<Option<Self>> {
        let Near { mut cameras, unusable } = near(&config.camera.backend);
        cameras.retain(|camera| camera.is_ordinary);
        match cameras.as_slice() {
            [] => {
                // A camera that is there and cannot be used must not be passed over in silence.
                for other in unusable {
                    let (cause, action) = other.said();
                    announcer.say(&format!("{}: {cause}. {action}", other.fault.code()));
                }
                Ok(None)
            }
            [NearCamera { source, name, .. }] => {
                announcer.say(&format!("Camera: {name} ({source})"));
                Self::named(source, config).map(Some)
            }
            several => {
                let line = |camera: &NearCamera| format!("  {}  {}", camera.source, camera.name);
                let lines: Vec<String> = several.iter().map(line).collect();
                bail!("there are several cameras; say which with --source:\n{}", lines.join("\n"))
            }
        }
    }

    /// The name that finds it again.
    pub fn stable_name(&self) -> String {
        self.source.clone()
    }

    /// Starts streaming.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] with the fault.
    pub fn open(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        Ok((self.opens)(Purpose::Session)?)
    }

    /// Starts streaming without setting any control: somebody only looks.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn preview(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        Ok((self.opens)(Purpose::Preview)?)
    }
}

impl fmt::Debug for ChosenCamera {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ChosenCamera").field(&self.source).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(backend: &str) -> Config {
        let mut config = Config::load(None, &[]).expect("defaults");
        config.camera.backend = config::Backend::named(backend);
        config
    }

    #[test]
    fn a_backend_is_asked_for_by_its_name() {
        for backend in BACKENDS {
            let asked = Backend::asked(&config::Backend::named(backend.name)).expect("a name");
            assert_eq!(asked.map(|it| it.name), Some(backend.name));
            assert!(!backend.is.is_empty() && !backend.begins.is_empty(), "{backend:?}");
        }
        assert!(Backend::asked(&config::Backend::default()).expect("auto").is_none());
        let unknown = ChosenCamera::named("/dev/video0", &with("gstreamer")).expect_err("none");
        assert!(unknown.to_string().contains("auto, or one of v4l, nokhwa"), "{unknown}");
    }

    #[test]
    fn a_backend_that_this_build_leaves_out_says_so() {
        for backend in BACKENDS.into_iter().filter(|backend| !backend.is_built()) {
            let name = format!("{}0", backend.begins[0]);
            let refused = ChosenCamera::named(&name, &with(backend.name)).expect_err("left out");
            assert!(refused.to_string().contains(backend.name) || cfg!(target_os = "linux"));
            assert!(is_name(&name), "{name}");
        }
    }

    #[test]
    fn a_second_way_to_the_same_cameras_does_not_list_them_twice() {
        let lists = drivers(&config::Backend::default()).expect("auto").len();
        let names = || backends().map(|backend| backend.begins[0]);
        assert_eq!(lists, names().collect::<std::collections::BTreeSet<_>>().len());
    }

    #[test]
    fn controls_that_a_backend_does_not_lock_are_a_limit() {
        let backend = |locks| Backend { locks, cannot: &["More."], ..v4l2::BACKEND };
        let none = "Focus, zoom, exposure, gain and white balance aren't locked or watched.";
        assert_eq!(backend(&[]).limits(), [none, "More."]);
        assert_eq!(backend(&Control::ALL).limits(), ["More."]);
        assert_eq!(backend(&Control::ALL[1..]).limits()[0], "Focus isn't locked or watched.");
    }
}
