//! Watches installed cameras: pictures in, recorded inputs and states out.
//!
//! | file | holds |
//! |---|---|
//! | `feed` | pictures from files, folders, recordings, cameras and streams |
//! | `times` | times of pictures |
//! | `burst` | several pictures of a moment |
//! | `camera` | one camera: store, references, state; its replay |
//! | `store`, `reference_files`, `shelf` | the folder of a camera |
//! | `places` | a single place, or the presets of a camera |
//! | `rounds` | many cameras, each at its interval |
//! | `adjusting` | helps to push a camera back |
//! | `curve` | a camera over time, for drawing |
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
