//! Every calibration of every camera: which drift, which are due.
//!
//! The index is derived: [`Index::add`] reads session folders, and an index that was deleted is made again by adding
//! the same folders.
//!
//! | file | holds |
//! |---|---|
//! | `entry` | what a session folder says of one calibration |
//! | `index` | the entries in SQLite |
//! | `trend` | one camera over time: the statistic of a check between its oldest and its newest calibrations |

mod entry;
mod index;
mod trend;

pub use entry::{Entry, NotAnEntry};
pub use index::{Index, IndexError};
pub use trend::{CameraHistory, Step, Trend, histories};
