//! Watches installed cameras: pictures in, recorded inputs and states out.
//!
//! | file | holds |
//! |---|---|
//! | `feed` | pictures from files, folders, recordings, cameras and streams |
//! | `times` | times of pictures |
//! | `burst` | several pictures of a moment |
//! | `camera` | one camera: store, references, state; its replay |
//! | `store`, `store_lines`, `reference_files`, `shelf` | the folder of a camera |
//! | `places` | a single place, or the presets of a camera |
//! | `rounds` | many cameras, each at its interval |
//! | `adjusting` | helps to push a camera back |
//! | `curve` | one camera over time, as it's drawn |
//! | `heard` | a command at each change, and Prometheus |
//! | `said`, `words` | the state for people, programs and Prometheus |
//! | `report` | a drawing of one camera over time |
//! | `window_page`, `phone_page` | the way back of a camera that was pushed, in the window and on a phone |
//! | `street` | a simulated street, day and night |
//! | `command` | `boresight watch` |

#![forbid(unsafe_code)]

mod adjusting;
mod burst;
mod camera;
pub mod command;
#[cfg(feature = "report")]
mod curve;
mod feed;
mod heard;
#[cfg(feature = "serve")]
mod phone_page;
mod places;
mod reference_files;
#[cfg(feature = "report")]
pub mod report;
mod rounds;
mod said;
mod shelf;
mod store;
mod store_lines;
pub mod street;
pub mod times;
#[cfg(feature = "window")]
mod window_page;
pub mod words;

pub use adjusting::{Step, adjust, say_aloud};
pub use camera::{WatchedCamera, reference_lens, replayed};
#[cfg(feature = "report")]
pub use curve::curve;
pub use feed::{Feed, Moment, Taken};
pub use places::Places;
pub use rounds::{Round, run, say_left_out};
pub use said::{
    Amounts, CameraMetrics, FindingLine, StateLine, exit, lines, metrics, with_scale, worst,
};
pub use store::{
    Access, Named, Recovered, Store, StoredLens, WatchFile, accept, recover, stores_below,
};
pub use store_lines::{InUse, StoreLine};
#[cfg(feature = "window")]
pub use window_page::{AdjustPage, Link, WayBack};
