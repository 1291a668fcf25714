//! Sources that few people have: machine-vision cameras, topics of ROS 2, and recorded bags.
//!
//! | module | feature | holds |
//! |---|---|---|
//! | `gige` | `gige` | GigE Vision cameras, behind the interface of a kernel's cameras |
//! | `ros2` | `ros2` | image topics of ROS 2, and the service of a camera's driver |
//! | `bag` | `bags` | MCAP files, and databases of ROS 2 |
//! | `ros_image` | | pictures in messages of ROS 2 |
//! | `camera_time` | `gige`, `ros2` | a camera's clock on this computer's |
//!
//! The table of backends in `boresight-app` has a row for each kind of camera.

#![forbid(unsafe_code)]

#[cfg(feature = "bags")]
mod bag;
#[cfg(all(target_os = "linux", any(feature = "gige", feature = "ros2")))]
mod camera_time;
#[cfg(all(target_os = "linux", feature = "gige"))]
pub mod gige;
#[cfg(all(target_os = "linux", feature = "ros2"))]
pub mod ros2;
mod ros_image;

#[cfg(feature = "bags")]
pub use bag::{CopiedBag, NotCopied, copy_with, open_bag};
pub use ros_image::{RosHeader, RosImageType, RosImages};
