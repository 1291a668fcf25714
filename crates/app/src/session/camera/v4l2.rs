//! Cameras of Linux, found through V4L2.

use super::backend::Backend;
use boresight_geometry::device::Control;

pub(super) const BACKEND: Backend = Backend {
    name: "v4l",
    is: "the Linux kernel interface: frames are checked, time-stamped and counted by the driver; controls are locked and watched",
    locks: &Control::ALL,
    cannot: &["JPEG has no checksum: a flipped bit can go unnoticed."],
    begins: &["/dev/", "usb:", "place:"],
    #[cfg(all(target_os = "linux", feature = "live"))]
    driver: Ok(built::DRIVER),
    #[cfg(all(target_os = "linux", not(feature = "live")))]
    driver: Err(|| crate::MissingFeature::LIVE.into()),
    #[cfg(not(target_os = "linux"))]
    driver: Err(|| anyhow::anyhow!("the v4l backend is available on Linux only")),
};

#[cfg(all(target_os = "linux", feature = "live"))]
pub(super) mod built {
    use crate::session::{
        camera::{ChosenCamera, Devices, Driver, Near, NearCamera, Purpose, Unusable},
        device_entry::{describe, entry},
        devices_file::OtherDevice,
    };
    use boresight_capture::{
        CaptureError, layout,
        v4l2::{Camera, Found, Linux, LiveCamera, control_states, discover, find, kernel::Kernel},
    };
    use boresight_geometry::{
        device::{Fault, Mode, Wanted},
        frame::ImageSize,
    };
    use boresight_present::text::camera::{printable, with_detail};

    pub(in crate::session::camera) const DRIVER: Driver =
        Driver { near, modes, find: chosen, devices };

    fn near() -> Near {
        let Found { cameras, others } = discover(&mut Linux::default());
        let cameras = cameras.iter().map(|camera| NearCamera {
            source: camera.stable_name(),
            name: printable(&camera.name),
            is_ordinary: camera.is_ordinary(),
        });
        let others =
            others.into_iter().filter(|o| matches!(o.why, Fault::Busy | Fault::NotPermitted));
        let unusable = others.map(|other| Unusable {
            source: other.node.path.display().to_string(),
            fault: other.why,
            detail: other.detail,
        });
        Near { cameras: cameras.collect(), unusable: unusable.collect() }
    }

    fn modes(name: &str) -> Vec<String> {
        let camera = find(&discover(&mut Linux::default()), name);
        camera.map_or(Vec::new(), |camera| mode_names(&camera))
    }

    /// The readable modes of a camera, in the format of the settings, the largest first.
    pub(in crate::session::camera) fn mode_names(camera: &Camera) -> Vec<String> {
        let mut modes: Vec<(u32, String)> = camera
            .offers
            .iter()
            .filter_map(|offer| {
                let layout = layout(offer.fourcc)?;
                let ImageSize { width_px, height_px } = offer.size;
                let interval_secs = offer.interval.map(|fraction| (fraction.0, fraction.1));
                let mode = Mode { size: offer.size, layout, interval_secs };
                let rate = mode.rate_hz().map_or(String::new(), |hz| format!("@{}", round(hz)));
                let mode = format!("{}{rate}:{}", offer.size, layout.name());
                Some((width_px * height_px, mode))
            })
            .collect();
        modes.sort_by(|a, b| b.cmp(a));
        modes.dedup();
        modes.into_iter().map(|(_, mode)| mode).collect()
    }

    fn round(hz: f64) -> f64 {
        (100.0 * hz).round() / 100.0
    }

    /// Finds the camera `name`.
    pub(in crate::session::camera) fn found(name: &str) -> Result<Camera, CaptureError> {
        let failed = |(fault, detail)| CaptureError::Camera { fault, detail };
        find(&discover(&mut Linux::default()), name).map_err(failed)
    }

    fn chosen(name: &str, wanted: &Wanted) -> anyhow::Result<ChosenCamera> {
        let (camera, wanted) = (found(name)?, *wanted);
        Ok(ChosenCamera::new(camera.stable_name(), move |purpose| {
            let open = match purpose {
                Purpose::Session => LiveCamera::<Linux>::open,
                Purpose::Preview => LiveCamera::<Linux>::preview,
            };
            Ok(Box::new(open(Linux::default(), camera.clone(), &wanted)?))
        }))
    }

    fn devices() -> Devices {
        let mut kernel = Linux::default();
        let found = discover(&mut kernel);
        report(&mut kernel, &found)
    }

    /// Describes all cameras found by a kernel.
    pub(in crate::session::camera) fn report(kernel: &mut dyn Kernel, found: &Found) -> Devices {
        let Found { cameras, others } = found;
        let cameras = cameras.iter().map(|camera| {
            let controls = kernel.open(&camera.node.path).map_or(Vec::new(), |device| {
                let controls = control_states(kernel, device);
                kernel.close(device);
                controls
            });
            (entry(camera, &controls), describe(camera, &controls))
        });
        let cameras = cameras.collect();
        let others = others.iter().map(|other| {
            let node = other.node.path.display().to_string();
            let (cause, action) = with_detail(other.why, &other.detail);
            // Metadata nodes come with every camera; they are no news.
            let is_news = other.why != Fault::NotACamera;
            let line = format!("{node}  {}: {cause}. {action}", other.why.code());
            let other = OtherDevice {
                node: Some(node),
                code: other.why.code().into(),
                detail: printable(&other.detail),
            };
            (other, is_news.then_some(line))
        });
        Devices { cameras, others: others.collect() }
    }
}
