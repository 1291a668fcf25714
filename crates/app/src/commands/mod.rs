//! Work of commands that is done at once, without a session.
//!
//! | file | does |
//! |---|---|
//! | `calibration_views` | views of a calibration without a session, from pictures or a corner table |
//! | `judgement` | a calibration of any program held to a fresh lens |
//! | `rig` | pictures of several cameras, sorted into instants |
//! | `redetect` | corners of a recording, found again |
//! | `doctor`, `bundle` | a recording verified; contents of a bug report, in one file |
//! | `plan_board`, `board_sheet` | a board for a distance; the printed sheet |
//! | `bag_copy`, `camera_driver` | a calibration in a copy of a recorded bag, and for the camera's driver |
//! | `weighed_picture` | a picture with the grids weighed by the detector |
//! | `json`, `paths` | results for programs; places of files |

mod bag_copy;
pub mod board_sheet;
pub mod bundle;
pub mod calibration_views;
mod camera_driver;
pub mod doctor;
pub mod json;
pub mod judgement;
pub mod paths;
pub mod plan_board;
pub mod redetect;
pub mod rig;
mod weighed_picture;

pub use bag_copy::BagCopy;
pub use camera_driver::{Lines, set_camera_info, state_topic};
pub use weighed_picture::weighed_picture;
