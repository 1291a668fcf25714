//! Recorded bags: MCAP files, and databases (`.db3`) of ROS 2, with pictures in messages of ROS 2
//! or Foxglove.
//!
//! | file | holds |
//! |---|---|
//! | `files` | the files of a bag, and their formats |
//! | `message` | contents of a bag |
//! | `foxglove` | pictures in messages of Foxglove |
//! | `mcap`, `db3` | the messages of one topic in a file |
//! | `source` | their pictures as a frame source |
//! | `copy` | a copy of a bag with the calibration in it |

mod copy;
mod db3;
mod files;
mod foxglove;
mod mcap;
mod message;
mod source;

pub use copy::{CopiedBag, NotCopied, copy_with};
pub use source::open_bag;
