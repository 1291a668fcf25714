//! A calibration session as a fold over its inputs: gain of a view, next pose, stop rule.
//!
//! A board is held where the session asks for it. Photographs are still by definition, so the first
//! one is taken:
//!
//! ```
//! use boresight_calibrate::CalibrationParams;
//! use boresight_detect::{Detection, Quality};
//! use boresight_geometry::{Corner, boards::Board, frame::{CaptureTime, FrameId, FrameKind, ImageSize}};
//! use boresight_guide::guidance::{GuidanceParams, Purpose};
//! use boresight_guide::session::{Input, Observation, Outcome, Session, SessionSetup};
//!
//! let image_size = ImageSize { width_px: 1280, height_px: 720 };
//! let mut session = Session::new(SessionSetup {
//!     board: Board::new(9, 6, 0.025)?,
//!     image_size,
//!     guidance: GuidanceParams::default(),
//!     calibration: CalibrationParams::default(),
//! });
//!
//! let target = session.target().expect("a new session asks for a pose").clone();
//! let corners = target.ghost_px.iter().map(|px| Corner::isotropic(*px, 0.05)).collect();
//! let quality = Quality { blur_px: 0.8, contrast: 80.0, glare: 0.0, motion_px: 0.0 };
//! let decision = session.handle(&Input::Observed(Observation {
//!     frame_id: FrameId(1),
//!     captured_at: CaptureTime { nanos: 0 },
//!     kind: FrameKind::Photograph,
//!     name: "first.png".into(),
//!     image_size,
//!     seen: Ok(Detection { corners, quality }),
//! }));
//!
//! assert!(matches!(decision.outcome, Outcome::Accepted { frame: 1, .. }));
//! assert!(session.target().is_some_and(|next| next.purpose == Purpose::Partner { of: 0 }));
//! # Ok::<(), boresight_geometry::boards::InvalidBoard>(())
//! ```
//!
//! # Modules
//!
//! | module | holds |
//! |---|---|
//! | [`guidance`] | measurements and gain of a view, next pose, stop rule: pure functions |
//! | [`session`] | the state of one session, and the only code to change it |
//! | [`rig`] | several sessions, led to common places of one board |
//!
//! # Features
//!
//! None of its own. With `threads` of `boresight-calibrate`, calibrations of many views use up to
//! `CalibrationParams::threads` threads.
//!
//! # Environment
//!
//! Time comes with each input: no files, clocks, random numbers, threads or unsafe code. Compiles
//! for `wasm32-unknown-unknown`.
//!
//! # Limitations
//!
//! - One board, one person.
//! - Corners may come from any detector, but their covariances must be true: noise and gain are
//!   judged by them.
//! - Another version may ask for other poses and decide otherwise. One version decides the same
//!   inputs alike, bit for bit, on every processor.
//! - `docs/versioning.md` lists the stable parts.

#![forbid(unsafe_code)]

#[cfg(test)]
extern crate self as boresight_guide;

pub mod guidance;
#[doc(hidden)]
pub mod rig;
pub mod session;

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
