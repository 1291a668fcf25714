//! Cameras through the library nokhwa: on other systems, and a second way to V4L2 cameras.

use super::backend::Backend;

pub(super) const BACKEND: Backend = Backend {
    name: "nokhwa",
    is: "the nokhwa library",
    locks: &[],
    cannot: &[
        "Frames have no numbers, so lost frames aren't counted. Time stamps are those of arrival, not of capture.",
        if cfg!(target_os = "linux") {
            "Driver error flags are lost: the end of a truncated frame holds old data. Most such frames are rejected in MJPG, none in other formats."
        } else {
            "Driver error flags are lost: damage is detected only in MJPG frames and in frames that are too short."
        },
        "Frames with padded rows can't be read, nor can GREY on Linux.",
        "A silent camera is reported lost after 2 s and isn't restarted: unplug it and plug it back in.",
        if cfg!(target_os = "linux") {
            "A camera that another program left at a frame rate such as 7.5 or in an unknown format is refused until you unplug it and plug it back in."
        } else {
            "Modes and controls aren't listed, and a camera without an address is identified by name only."
        },
    ],
    begins: if cfg!(all(target_os = "linux", feature = "live")) {
        super::v4l2::BACKEND.begins
    } else {
        &["nokhwa:"]
    },
    #[cfg(feature = "nokhwa")]
    driver: Ok(built::DRIVER),
    #[cfg(not(feature = "nokhwa"))]
    driver: Err(|| {
        let part = "camera backend nokhwa";
        crate::MissingFeature { part, feature: "nokhwa" }.into()
    }),
};

#[cfg(all(target_os = "linux", feature = "live", feature = "nokhwa"))]
mod built {
    use crate::session::camera::{
        backend::{ChosenCamera, Driver},
        v4l2::built,
    };
    use boresight_capture::nokhwa::NokhwaCamera;
    use boresight_geometry::device::Wanted;

    pub(super) const DRIVER: Driver = Driver { find, ..built::DRIVER };

    fn find(name: &str, wanted: &Wanted) -> anyhow::Result<ChosenCamera> {
        let (camera, wanted) = (built::found(name)?, *wanted);
        Ok(ChosenCamera::new(camera.stable_name(), move |_| {
            Ok(Box::new(NokhwaCamera::of(&camera, &wanted)?))
        }))
    }
}

#[cfg(all(not(all(target_os = "linux", feature = "live")), feature = "nokhwa"))]
mod built {
    use crate::session::{
        camera::{ChosenCamera, Devices, Driver, Near, NearCamera},
        devices_file::{DeviceEntry, OtherDevice},
    };
    use boresight_capture::{
        CaptureError,
        nokhwa::{NokhwaCamera, find, list},
    };
    use boresight_geometry::device::Wanted;
    use boresight_present::text::camera::{printable, with_detail};

    pub(super) const DRIVER: Driver = Driver { near, modes: |_| Vec::new(), find: chosen, devices };

    /// Lists the usable cameras. nokhwa doesn't report unusable ones.
    fn near() -> Near {
        let cameras = list().unwrap_or_default().into_iter().map(|camera| NearCamera {
            source: camera.source,
            name: printable(&camera.name),
            is_ordinary: true,
        });
        Near { cameras: cameras.collect(), unusable: Vec::new() }
    }

    fn chosen(name: &str, wanted: &Wanted) -> anyhow::Result<ChosenCamera> {
        let failed = |(fault, detail)| CaptureError::Camera { fault, detail };
        let source = find(&list().map_err(failed)?, name).map_err(failed)?.source;
        let wanted = *wanted;
        Ok(ChosenCamera::new(source.clone(), move |_| {
            Ok(Box::new(NokhwaCamera::named(&source, &wanted)?))
        }))
    }

    fn devices() -> Devices {
        let listed = match list() {
            Ok(listed) => listed,
            Err((fault, detail)) => {
                let (cause, action) = with_detail(fault, &detail);
                let line = format!("{}: {cause}. {action}", fault.code());
                let (code, detail) = (fault.code().into(), printable(&detail));
                let other = OtherDevice { node: None, code, detail };
                return Devices { cameras: Vec::new(), others: vec![(other, Some(line))] };
            }
        };
        let cameras = listed.into_iter().map(|camera| {
            let name = printable(&camera.name);
            let line = format!("{}  {name}", printable(&camera.source));
            (DeviceEntry { source: camera.source, name, v4l2: None }, vec![line])
        });
        Devices { cameras: cameras.collect(), others: Vec::new() }
    }
}
