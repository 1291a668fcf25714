//! Every calibration of every camera, to find drifting cameras and due ones.
//!
//! The index is derived: its lines are rows read by [`crate::batch::recorded`] from session
//! folders, and can be restored from the same folders. `batch gather` prints the same rows: its
//! table of calibrated sessions is an index, too.
//!
//! | file | holds |
//! |---|---|
//! | `entry` | calibration of a row |
//! | `index` | the rows as lines of JSON |
//! | `add` | results of session folders into the index |
//! | `told`, `page` | a camera in words and as JSON; all of them as one page |
//! | `trend` | a camera over time: its oldest against its newest calibrations |

mod add;
pub mod command;
mod entry;
mod index;
mod page;
pub mod report;
mod told;
mod trend;

pub use add::{Added, add};
pub use entry::Entry;
pub use index::{Index, IndexError};
pub use page::{days_ago, page};
pub use told::{
    ComparedEntry, DifferenceEntry, HISTORY_SCHEMA, HistoryFile, StepEntry, StepLens, name, trend,
};
pub use trend::{CameraHistory, Step, Trend, histories};
