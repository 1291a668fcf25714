//! Image topics of ROS 2, without ROS: through a library for DDS, its usual middleware.
//!
//! | file | is |
//! |---|---|
//! | `node` | this program on the network: joining, and the list of topics |
//! | `raw` | messages as bytes, and waiting for them |
//! | `source` | the pictures of one topic as a frame source |
//! | `driver` | the service of a camera's driver to take a calibration |
//! | `words` | lines of text for other nodes |
//!
//! Names of topics and types in DDS:
//! <https://design.ros2.org/articles/topic_and_service_names.html>.

mod driver;
mod node;
mod raw;
mod source;
mod words;

pub use driver::{Answer, NotSet, set_camera_info};
pub use node::{Domain, ImageTopic, topics};
pub use source::Ros2;
pub use words::Words;
