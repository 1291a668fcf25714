//! Image topics of ROS 2, without an installation of ROS 2.

use super::backend::Backend;

pub(super) const BACKEND: Backend = Backend {
    name: "ros2",
    is: "an image topic of ROS 2 (ros2:/TOPIC), without ROS: messages are counted by their numbers; pictures have the times in their headers",
    locks: &[],
    cannot: &[
        "A message that gets lost isn't sent again, as ROS 2 has it for sensors. Times are as good as the camera's driver states them.",
    ],
    begins: &["ros2:"],
    #[cfg(all(target_os = "linux", feature = "ros2"))]
    driver: Ok(built::DRIVER),
    #[cfg(all(target_os = "linux", not(feature = "ros2")))]
    driver: Err(|| crate::MissingFeature::ROS2.into()),
    #[cfg(not(target_os = "linux"))]
    driver: Err(|| anyhow::anyhow!("the ros2 backend is available on Linux only")),
};

#[cfg(all(target_os = "linux", feature = "ros2"))]
pub(crate) mod built {
    use std::time::Duration;

    use crate::session::{
        camera::{ChosenCamera, Devices, Driver, Near, NearCamera},
        devices_file::DeviceEntry,
    };
    use boresight_capture::CaptureError;
    use boresight_geometry::device::Wanted;
    use boresight_present::text::camera::printable;
    use boresight_sources::ros2::{Domain, ImageTopic, Ros2, topics};

    pub(in crate::session::camera) const DRIVER: Driver =
        Driver { near, modes: |_| Vec::new(), find: chosen, devices };

    /// Domain of ROS 2 from the environment.
    pub(crate) fn domain() -> Result<Domain, CaptureError> {
        Domain::of(|variable| std::env::var(variable).ok())
    }

    /// Time for others to announce topics, for a single listing.
    const ANSWERED_WITHIN: Duration = Duration::from_secs(2);

    /// Topics as sourceswith names.
    fn published(patience: Duration) -> Vec<(String, String)> {
        let topics = domain().map_or(Vec::new(), |domain| topics(domain, patience));
        let described = |ImageTopic { name, kind, publishers }: ImageTopic| {
            let several = if publishers > 1 {
                format!(" from {publishers} publishers")
            } else {
                String::new()
            };
            (format!("{}{}", Ros2::PREFIX, printable(&name)), format!("{}{several}", kind.name()))
        };
        topics.into_iter().map(described).collect()
    }

    fn near() -> Near {
        // Others may share the network: no topic is taken unasked.
        let near = |(source, name)| NearCamera { source, name, is_ordinary: false };
        Near {
            cameras: published(Duration::ZERO).into_iter().map(near).collect(),
            unusable: Vec::new(),
        }
    }

    fn chosen(name: &str, _: &Wanted) -> anyhow::Result<ChosenCamera> {
        let (name, domain) = (Ros2::full_name(name), domain()?);
        Ok(ChosenCamera::new(name.clone(), move |_| Ok(Box::new(Ros2::open(&name, domain)?))))
    }

    fn devices() -> Devices {
        let entry = |(source, name): (String, String)| {
            let line = format!("{source}  {name}");
            (DeviceEntry { source, name, v4l2: None }, vec![line])
        };
        Devices {
            cameras: published(ANSWERED_WITHIN).into_iter().map(entry).collect(),
            others: Vec::new(),
        }
    }
}
