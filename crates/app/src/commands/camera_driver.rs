//! Publishes to other nodes of ROS 2: a calibration for the camera's own driver
//! (`set_camera_info`), and the progress of a session.

use std::path::Path;

use crate::Announcer;
#[cfg(not(all(target_os = "linux", feature = "ros2")))]
use crate::MissingFeature;

/// Asks the driver behind `source`, `ros2:/TOPIC`, to take the result in `input`, a session folder
/// or a calibration in any readable format, and announces the answer. True if the calibration must
/// not be used: then no driver gets it.
///
/// # Errors
///
/// If the result can't be read, or if no driver took it.
#[cfg(all(target_os = "linux", feature = "ros2"))]
pub fn set_camera_info(input: &Path, source: &str, announcer: &Announcer) -> anyhow::Result<bool> {
    use anyhow::bail;

    use crate::session::{camera::ros2_domain, export::result_of};
    use boresight_formats::export::RosCameraInfo;
    use boresight_present::text::{camera::printable, source as said};
    use boresight_sources::ros2::{Answer, set_camera_info};

    let (camera, untrustworthy) = result_of(input, announcer)?;
    if untrustworthy {
        announcer.say(said::NOT_FOR_THE_DRIVER);
        return Ok(true);
    }
    // The camera's driver states stamp and frame itself.
    let info = RosCameraInfo::of(&camera).message(0, "");
    let Answer { service, is_taken, words } = set_camera_info(source, ros2_domain()?, &info)?;
    let words = printable(&words);
    if !is_taken {
        bail!("{service} refuses the calibration: {words}");
    }
    announcer.say(&said::driver_has_it(&service, &words));
    Ok(false)
}

/// Fails in builds without ROS 2.
///
/// # Errors
///
/// [`MissingFeature::ROS2`].
#[cfg(not(all(target_os = "linux", feature = "ros2")))]
pub fn set_camera_info(_: &Path, _: &str, _: &Announcer) -> anyhow::Result<bool> {
    Err(MissingFeature::ROS2.into())
}

/// Sink for a session's events: one call for each line.
pub type Lines = Box<dyn Fn(&str) + Send>;

/// Publishes lines on `/boresight/state`, as `std_msgs/msg/String`.
///
/// # Errors
///
/// If the program can't join the network of ROS 2.
#[cfg(all(target_os = "linux", feature = "ros2"))]
pub fn state_topic() -> anyhow::Result<Lines> {
    let words = boresight_sources::ros2::Words::on(
        "/boresight/state",
        crate::session::camera::ros2_domain()?,
    );
    let words = words.map_err(|err| anyhow::anyhow!("ROS 2 can't be reached: {err}"))?;
    Ok(Box::new(move |line| words.say(line)))
}

/// Fails in builds without ROS 2.
///
/// # Errors
///
/// [`MissingFeature::ROS2`].
#[cfg(not(all(target_os = "linux", feature = "ros2")))]
pub fn state_topic() -> anyhow::Result<Lines> {
    Err(MissingFeature::ROS2.into())
}
