//! Estimates a lens from views of a board: with honest covariance, checks, and a verdict.
//!
//! ```
//! use std::f64::consts::FRAC_PI_4;
//!
//! use boresight_calibrate::{CalibrationParams, Verdict, calibrate};
//! use boresight_geometry::{Camera, Corner, boards::Board, frame::ImageSize};
//! use nalgebra::{Isometry3, Point2, Vector2, Vector3};
//!
//! let truth = Camera::pinhole(950.0, Point2::new(648.0, 353.0));
//! let board = Board::new(9, 6, 0.025)?;
//! // Eight views, tilted by 40° in eight directions; corners err by up to 0.1 px along x and y.
//! let error_px = |n: usize| 0.1 * ((n as f64).sin() * 43_758.5).fract();
//! let mut views = vec![Vec::new(); 8];
//! for (view, corners) in views.iter_mut().enumerate() {
//!     let (sin, cos) = (view as f64 * FRAC_PI_4).sin_cos();
//!     let tilt = Vector3::new(sin, -cos, 0.0) * 40_f64.to_radians();
//!     let cam_from_board = Isometry3::new(Vector3::new(0.08 * cos, 0.04 * sin, 0.3), tilt);
//!     for (index, point_m) in board.corners_in_board_m().iter().enumerate() {
//!         let px = truth.px_from_board(&cam_from_board, point_m).expect("in front of the camera");
//!         let n = 1000 * view + 2 * index;
//!         corners.push(Corner::isotropic(px + Vector2::new(error_px(n), error_px(n + 1)), 0.06));
//!     }
//! }
//!
//! let image_size = ImageSize { width_px: 1280, height_px: 720 };
//! let found = calibrate(&views, &board, image_size, &CalibrationParams::default())?;
//!
//! assert_eq!(found.verdict, Verdict::Good);
//! let sd_px = found.sd()[0];
//! assert!(sd_px < 1.0 && (found.camera.f_px.x - 950.0).abs() < 3.0 * sd_px);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! | module | holds |
//! |---|---|
//! | `solve` | corners → lens and poses, with covariance, for the lens model chosen by BIC |
//! | `check` | findings and the verdict: checks independent of the residual of the fit |
//! | `causes` | causes of a misfit, named by the views; corrects what all views share |
//! | `params`, `inputs` | settings; corners and derived inputs before adjustment |
//! | `calibrate`, `examined` | runs the stages; judges the residuals |
//! | `summary`, `result` | turns the minimum into a [`Calibration`] |
//! | `pinhole_views` | corners as a pinhole shows them, and homographies through them |
//! | `repeats` | pictures of one held pose count once |
//! | `acceptance` | judges the result by a stated need |
//! | `drift` | new views of an installed camera against its old calibration |
//! | `lens_difference` | two calibrations of one camera, by what they state |
//! | `lens_change`, `shift` | tests of a change; its displacement as an interval against a limit |
//! | `lens_flaw` | lenses that can't be right |
//! | `judge` | a calibration of another program, held to a fresh one |
//! | `rig` | several cameras and their mutual places, from one board |
//!
//! [`calibrate`] runs them all. `solve` uses none of the others, `check` uses `solve`, and the top
//! level uses both. Everything is deterministic. Findings and errors are values with numbers;
//! `text` turns them into sentences.
//!
//! # Features
//!
//! | feature | brings |
//! |---|---|
//! | `threads` (off by default) | uses [`CalibrationParams::threads`] threads; same result |
//!
//! # Requirements
//!
//! Corners in memory: no pictures, files, clocks, chance or unsafe code. The crate compiles for
//! `wasm32-unknown-unknown`.
//!
//! # Limitations
//!
//! - One flat board.
//! - A wrong square size can't be seen: it scales distances and leaves the lens unchanged.
//! - A verdict covers the boards' area only. Elsewhere, the lens is extrapolated; the covariance
//!   states the uncertainty.
//! - A rolling shutter, a shifted picture or a board that flexes is reported, not corrected.
//! - Another version may find another lens within the stated covariance, and other findings.
//!   `docs/versioning.md` lists the stable parts.

#![forbid(unsafe_code)]

mod acceptance;
mod calibrate;
mod causes;
mod check;
mod drift;
mod examined;
mod inputs;
mod judge;
mod known_lens;
mod lens_change;
mod lens_difference;
mod lens_flaw;
mod params;
mod pinhole_views;
mod repeats;
mod result;
mod rig;
mod shift;
mod solve;
mod summary;

pub use acceptance::{Acceptance, AcceptanceGoal, ErrorBound, NotAGoal, acceptance};
pub use calibrate::calibrate;
#[doc(hidden)]
pub use check::{
    finding::{CANDIDATES, FocusMotion, is_unfinished},
    leave_out,
    limits::DEFAULT_TYPICAL_GOAL_PX,
    projection_sd::{GridSd, ProjectionJacobian, projection_jacobian},
};
pub use check::{
    finding::{Finding, FindingCode, Severity, Verdict},
    limits::Limits,
    projection_sd::{ProjectionSd, ValidArea},
};
#[doc(hidden)]
pub use drift::{DRIFT_VIEWS, Drift, NoDrift, OldLens, drift};
#[doc(hidden)]
pub use judge::{
    Answer, Axes, GivenLens, Judgement, LengthError, NotJudged, Resized, WrongPart, judge,
};
#[doc(hidden)]
pub use known_lens::{Combined, KnownLens, NotHeld};
#[doc(hidden)]
pub use lens_difference::{LensDifference, StatedLens};
#[doc(hidden)]
pub use lens_flaw::LensFlaw;
pub use params::{BOARD_SCALE_SD, CalibrationParams, NotCalibrated};
pub use result::{Calibration, Focal, PrincipalPointEstimate, PrincipalPoints, ViewResult};
#[doc(hidden)]
pub use rig::{
    KnownRig, NotARig, Pair, PairBound, PairChange, PairSd, PlaceWorth, RigCalibration, RigCamera,
    RigFinding, RigInstant, RigViews, calibrate_rig, moved_camera, pair_change, seen_by,
};
#[doc(hidden)]
pub use shift::{DriftVerdict, Shift};
pub use solve::lens_model::{LensFamily, LensFreedom, LensModel, LensPrior};
#[doc(hidden)]
pub use solve::{
    bundle::{Bundle, BundleState, InvalidCorners, Observations, adjust},
    common_error,
    free_homography::{self, FreeHomographies},
    gram,
    initial_guess::ALIKE_WIDTHS,
    model_choice::ModelFit,
    zhang,
};

/// Compiles and runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
