//! Everything that runs while pictures come: threads, cameras of the simulated kernel, streams
//! through ffmpeg.

#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../common/cameras.rs"]
mod cameras;

#[cfg(target_os = "linux")]
mod camera_controls;
mod damaged_frames;
mod deep_pictures;
mod device_faults;
mod failing_calls;
#[cfg(unix)]
mod ffmpeg;
#[cfg(target_os = "linux")]
mod long_runs;
#[cfg(unix)]
mod network_cameras;
mod odd_videos;
#[cfg(feature = "serve")]
mod phone;
#[cfg(feature = "serve")]
mod phone_browser;
#[cfg(all(feature = "serve", target_os = "linux"))]
mod phone_load;
#[cfg(all(feature = "serve", unix))]
mod phone_program;
#[cfg(feature = "serve")]
mod phone_rig;
mod pipeline;
#[cfg(target_os = "linux")]
mod slow_cameras;

use boresight_testkit::{pictures, world};
