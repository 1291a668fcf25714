//! Watches installed cameras: pictures in, recorded inputs and states out.
//!
//! | file | holds |
//! |---|---|
//! | `feed`, `times` | pictures from files, folders, recordings, cameras and streams; when they were taken |
//! | `burst` | several pictures of one moment |
//! | `camera` | one camera: store, references, state; its replay |
//! | `store`, `reference_files`, `shelf` | the folder of a camera |
//! | `places` | one place, or the presets between which a camera turns |
//! | `rounds` | many cameras, each at its interval |
//! | `adjusting` | helps to push a camera back |
//! | `curve` | one camera over time, as it's drawn |
//! | `said` | the state for people, programs and Prometheus |

mod adjusting;
mod burst;
mod camera;
#[cfg(feature = "report")]
mod curve;
mod feed;
mod places;
mod reference_files;
mod rounds;
mod said;
mod shelf;
mod store;
pub mod times;

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
pub use store::{Named, Store, StoredLens, WatchFile, accept, stores_below};
