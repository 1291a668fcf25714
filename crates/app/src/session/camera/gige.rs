//! Machine-vision cameras on the network (GigE Vision), behind the interface of a kernel's cameras.

use super::backend::Backend;
use boresight_geometry::device::Control;

pub(super) const BACKEND: Backend = Backend {
    name: "gige",
    is: "GigE Vision, machine-vision cameras on the network: packets are counted and asked for again; controls are locked and watched; pictures have the camera's time",
    locks: &[Control::Exposure, Control::Gain, Control::WhiteBalance],
    cannot: &[
        "Focus and zoom are turned by hand on such lenses: fix their screws.",
        "Of white balance, the ratio of red is watched. Black level is locked with gain, and only its automatic is watched.",
    ],
    begins: &["gige:"],
    #[cfg(all(target_os = "linux", feature = "gige"))]
    driver: Ok(built::DRIVER),
    #[cfg(all(target_os = "linux", not(feature = "gige")))]
    driver: Err(|| crate::MissingFeature::GIGE.into()),
    #[cfg(not(target_os = "linux"))]
    driver: Err(|| anyhow::anyhow!("the gige backend is available on Linux only")),
};

#[cfg(all(target_os = "linux", feature = "gige"))]
mod built {
    use boresight_capture::{
        CaptureError,
        v4l2::{LiveCamera, discover},
    };
    use boresight_geometry::device::{Fault, Wanted};
    use boresight_present::text::camera::printable;
    use boresight_sources::gige::{self, Network};

    use crate::session::camera::{
        ChosenCamera, Devices, Driver, Near, NearCamera, Purpose, Unusable,
        v4l2::built::{mode_names, report},
    };

    pub(in crate::session::camera) const DRIVER: Driver =
        Driver { near, modes, find: chosen, devices };

    fn near() -> Near {
        let mut near = Near::default();
        for seen in gige::near() {
            let (source, name) = (seen.node.known_as, printable(&seen.name));
            if seen.is_reachable {
                // Others may share the network: no camera is opened unasked.
                near.cameras.push(NearCamera { source, name, is_ordinary: false });
            } else {
                let detail = format!("{name} at {}", seen.node.path.display());
                near.unusable.push(Unusable { source, fault: Fault::Unreachable, detail });
            }
        }
        near
    }

    fn modes(name: &str) -> Vec<String> {
        gige::find(name).map_or(Vec::new(), |camera| mode_names(&camera))
    }

    fn chosen(name: &str, wanted: &Wanted) -> anyhow::Result<ChosenCamera> {
        let failed = |(fault, detail)| CaptureError::Camera { fault, detail };
        let (camera, wanted) = (gige::find(name).map_err(failed)?, *wanted);
        Ok(ChosenCamera::new(camera.stable_name(), move |purpose| {
            let open = match purpose {
                Purpose::Session => LiveCamera::<Network>::open,
                Purpose::Preview => LiveCamera::<Network>::preview,
            };
            Ok(Box::new(open(Network::of_camera(&camera), camera.clone(), &wanted)?))
        }))
    }

    fn devices() -> Devices {
        let mut network = Network::default();
        let found = discover(&mut network);
        report(&mut network, &found)
    }
}
