//! The threads, the links between them, and the order of ending.
//!
//! ```text
//! capture ──latest──▶ detector ──inbox──▶ session ──latest──▶ window or command line
//!    └───────────────────inbox──────────────▲  ▲ └──▶ recorder (same thread: synced before shown)
//! window or command line ─inbox────────────────┘
//! ```
//!
//! Frames are lost in exactly one place, the latest-wins slot, and counted there. The inbox is
//! ordered, bounded and lossless: a slow session holds back the detector, and old frames are
//! replaced upstream instead of piling up. The detector rests while the person has paused. Stop at
//! the source, join capture, join the detector, then `Stop`, then join the session.

mod background;
mod capture_stage;
mod detect_many;
mod detector_stage;
mod error;
mod judged_gate;
mod latest;
mod live_feed;
mod onlooker;
mod paced;
mod rest;
mod run;
mod session_stage;
mod worker;

pub use background::Background;
pub use capture_stage::SOURCE_PATIENCE;
pub use detect_many::{Seen, detect_many};
pub use detector_stage::BoardFinder;
pub use error::PipelineError;
pub use latest::{Closed, LatestReceiver, LatestSender, latest};
pub use live_feed::{AcceptedPicture, LiveFeed};
pub use onlooker::{CommandLink, NotSent, Onlooker, Onlookers};
pub use paced::Paced;
pub use run::{Finished, Pipeline, Setup};
pub use session_stage::{FrameReport, OnFrame, Recorder};
