//! Live cameras: the table of backends, and the search for a camera by name.
//!
//! A backend is a way to cameras: a frame source in [`boresight_capture`], a file here to list and
//! open its cameras, and its line in [`BACKENDS`]. A build without a backend still knows its name
//! and its feature.
//!
//! | file | holds |
//! |---|---|
//! | `backend` | types of a backend and its cameras |
//! | `v4l2` | cameras of Linux, with the feature `live` |
//! | `gige` | machine-vision cameras on the network, with the feature `gige` |
//! | `pipe` | output of another program, with the feature `live` |
//! | `ros2` | image topics of ROS 2, with the feature `ros2` |
//! | `nokhwa` | cameras of other systems and Linux, with the feature `nokhwa` |

mod backend;
mod gige;
mod nokhwa;
mod pipe;
mod ros2;
mod v4l2;

use anyhow::{Context, bail};

pub use backend::{Backend, ChosenCamera, Devices, Driver, Near, NearCamera, Purpose, Unusable};
#[cfg(all(target_os = "linux", feature = "ros2"))]
pub(crate) use ros2::built::domain as ros2_domain;

use crate::Announcer;
use boresight_capture::{CaptureError, is_command, listed};
use boresight_geometry::panic_message::caught;
use boresight_run::config::{self, Config};

/// All known backends, the default first.
pub const BACKENDS: [Backend; 5] =
    [v4l2::BACKEND, gige::BACKEND, pipe::BACKEND, ros2::BACKEND, nokhwa::BACKEND];

impl Backend {
    /// Requested backend; `None` for `auto`.
    ///
    /// # Errors
    ///
    /// If there is none of this name: the names to choose from.
    pub fn asked(by: &config::Backend) -> anyhow::Result<Option<Self>> {
        let Some(name) = by.name() else { return Ok(None) };
        let found = BACKENDS.into_iter().find(|backend| backend.name == name);
        let names = || BACKENDS.map(|backend| backend.name).join(", ");
        let found = found.with_context(|| {
            format!("no camera backend {name:?}: it's auto, or one of {}", names())
        });
        found.map(Some)
    }
}

/// Backends in the build, the default first.
pub fn backends() -> impl Iterator<Item = Backend> {
    BACKENDS.into_iter().filter(Backend::is_built)
}

/// Drivers of the build with a camera list, or the driver of the requested backend.
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

/// True if `name` can only mean a live camera, perhaps of a backend missing from the build.
pub fn is_name(name: &str) -> bool {
    BACKENDS.iter().any(|backend| backend.knows(name))
}

/// Lists the connected cameras; empty if the requested backend is missing.
pub fn near(asked: &config::Backend) -> Near {
    let mut all = Near::default();
    for driver in drivers(asked).unwrap_or_default() {
        // Answers of cameras are read by third-party code.
        let Near { cameras, unusable } = caught(driver.near).unwrap_or_default();
        all.cameras.extend(cameras);
        all.unusable.extend(unusable);
    }
    all
}

/// Lists the readable modes of the camera `name`, in the format of the settings; empty if the modes
/// or the camera are unknown.
pub fn modes(name: &str) -> Vec<String> {
    let driver = backends().find(|backend| backend.knows(name)).and_then(|it| it.driver.ok());
    driver.and_then(|it| caught(|| (it.modes)(name)).ok()).unwrap_or_default()
}

/// Describes the connected cameras of every backend.
pub fn devices() -> Devices {
    let mut all = Devices::default();
    for driver in drivers(&config::Backend::default()).unwrap_or_default() {
        let Devices { cameras, others } = caught(driver.devices).unwrap_or_default();
        all.cameras.extend(cameras);
        all.others.extend(others);
    }
    all
}

impl ChosenCamera {
    /// Finds the camera `name`, with the backend and mode of `config`.
    ///
    /// # Errors
    ///
    /// [`boresight_capture::CaptureError::Camera`] if there is no such camera;
    /// [`crate::MissingFeature`] if its backend isn't in this build.
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
        if is_command(name) {
            return pipe::chosen(name, config.camera.raw_form()?);
        }
        // The settings validate the mode.
        let wanted = config.camera.wanted().unwrap_or_default();
        caught(|| (driver.find)(name, &wanted))
            .map_err(|reason| CaptureError::GaveUp { reason, name: name.into() })?
    }

    /// Finds the only camera neither virtual nor infrared; `None` if there is none. Announces its
    /// name, or the fault of a connected but unusable one.
    ///
    /// # Errors
    ///
    /// If there are several: the names to choose from.
    pub fn only(config: &Config, announcer: &Announcer) -> anyhow::Result<Option<Self>> {
        let Near { mut cameras, unusable } = near(&config.camera.backend);
        cameras.retain(|camera| camera.is_ordinary);
        match cameras.as_slice() {
            [] => {
                // Announce an unusable connected camera instead of skipping it silently.
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
                let line = |camera: &NearCamera| format!("{}  {}", camera.source, camera.name);
                let lines: Vec<String> = several.iter().map(line).collect();
                let lines = listed(&lines, "\n  ");
                bail!("there are several cameras; say which with --source:\n  {lines}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use boresight_geometry::device::Control;

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
        let all = "auto, or one of v4l, gige, pipe, ros2, nokhwa";
        assert!(unknown.to_string().contains(all), "{unknown}");
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
