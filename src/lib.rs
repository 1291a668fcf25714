//! Live pose guidance for camera calibration with principal lines.
//!
//! A person holds a checkerboard in front of a camera. boresight finds the board in every frame, computes
//! the view's *principal line* (the board's axis of symmetry in the picture, which passes through the
//! principal point), says which pose to show next, takes the views that add something, and ends with a
//! calibration whose uncertainty is stated and checked.
//!
//! # The program is a fold
//!
//! [`session::Session::handle`] applies one input and says what it decided; everything else feeds it or
//! shows its state. Live, replayed and tested sessions run the same loop over the same inputs and decide
//! the same, bit for bit.
//!
//! ```text
//!  capture ──latest frame──▶ detector ──observations──▶ session ──snapshots──▶ window, terminal
//!  (camera, files,           (board → corners           (judge, hold,    │
//!   simulation)               with covariance)           accept, solve)  └──▶ recorder: frame, then
//!                                                                             journal line, synced
//! ```
//!
//! # The house, bottom up
//!
//! | module | is | uses |
//! |---|---|---|
//! | [`board`], [`frame`] | the checkerboard; a picture and when it was taken | – |
//! | [`device`] | what is known about a live camera, and everything that can go wrong with it | frame |
//! | `panic_message` | the message of a caught panic | – |
//! | [`geometry`] | homography, principal line, principal point, lens, pose: pure functions of numbers | frame |
//! | [`detection`] | picture → corners, or the reason why not | geometry, board |
//! | [`calibration`] | views → lens with covariance, models, honesty checks | geometry, board |
//! | [`guidance`] | what is this view worth, what should come next, are we done | geometry, board |
//! | [`capture`] | frames in: folders, recordings, live cameras, the simulated camera and its technician | geometry, board, device |
//! | [`session`] | the state of one session, and the only code that changes it | all of the above but capture |
//! | [`config`] | TOML → parameters; the only place with mm and degrees | session and below |
//! | [`recording`] | sessions as bytes: journal, frames, replay | session, config |
//! | [`pipeline`] | the threads | recording and below |
//! | [`target`] | the board as PDF, SVG and PNG in true size, in millimetres | – |
//! | [`text`] | every sentence a person reads in a session | all of the above |
//! | `chart` | drawings as SVG text | – |
//! | [`study`] | the paper's experiments, and strategies of guidance compared | chart, capture, guidance and below |
//! | [`report`] | a calibration as one page to read and print | chart, text, calibration and below |
//! | [`ui`] | the window: panels that see the newest snapshot and picture | pipeline, text and below |
//! | [`cli`] | one subcommand a file | everything |
//!
//! # Invariants
//!
//! - Below `recording` nothing reads a clock, a file, chance or another thread. `tests/layering.rs`
//!   holds that and the table above.
//! - Nothing is taken from a camera that is lost, frozen, or whose focus or zoom has moved; a frame that
//!   is not whole never becomes a picture.
//! - A view is shown as taken only after its picture and its journal line are on disk.
//! - Frames are dropped in one place, the slot between capture and detector, and counted; sources that
//!   can wait are never dropped from.
//! - Pixel (0, 0) is the centre of the top-left pixel. Inside it is metres, radians and pixels, and names
//!   say so.

pub mod app;
pub mod board;
pub mod calibration;
pub mod capture;
#[cfg(any(feature = "report", feature = "study"))]
mod chart;
pub mod cli;
pub mod config;
pub mod detection;
pub mod device;
pub mod frame;
pub mod geometry;
pub mod guidance;
mod panic_message;
pub mod pipeline;
pub mod recording;
#[cfg(feature = "report")]
pub mod report;
pub mod session;
pub mod simulation;
#[cfg(feature = "study")]
pub mod study;
pub mod target;
pub mod text;
#[cfg(feature = "window")]
pub mod ui;
