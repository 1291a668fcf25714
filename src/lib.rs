//! Live pose guidance for camera calibration with principal lines.
//!
//! A person holds a checkerboard in front of a camera. boresight finds the board in every frame,
//! computes the view's *principal line* (the board's axis of symmetry in the picture, through the
//! principal point), shows the next pose, takes the informative views, and ends with a calibration
//! of stated and checked uncertainty.
//!
//! # The program is a fold
//!
//! [`session::Session::handle`] applies an input and returns its decision; everything else feeds it
//! or shows its state. Live, replayed and tested sessions run the same loop over the same inputs
//! with the same decisions: bit for bit with one build on one processor, up to rounding elsewhere.
//!
//! ```text
//!  capture ──latest frame──▶ detector ──observations──▶ session ──snapshots──▶ window, terminal
//!  (camera, files,           (board → corners           (judge, hold,    │
//!   simulation)               with covariance)           accept, solve)  └──▶ recorder: frame, then
//!                                                                             journal line, synced
//! ```
//!
//! # The crates
//!
//! This crate is the program, and a facade: it re-exports the crates of the workspace under the
//! names of their rooms.
//!
//! | module | crate | holds |
//! |---|---|---|
//! | [`geometry`] | `boresight-geometry` | homography, principal line and point, lens, pose |
//! | [`boards`], [`markers`], [`board_code`] | `boresight-geometry` | boards |
//! | [`frame`], [`device`] | `boresight-geometry` | pictures; state of a live camera |
//! | [`files`] | `boresight-files` | the only place to open and write files |
//! | [`detection`] | `boresight-detect` | picture → corners, or the reason for a miss |
//! | [`calibration`] | `boresight-calibrate` | views → lens with covariance; checks, verdict |
//! | [`calibration::files`] | `boresight-formats` | calibration files |
//! | [`guidance`] | `boresight-guide` | worth of a view, next target, stop rule |
//! | [`session`] | `boresight-guide` | state of a session |
//! | [`capture`] | `boresight-capture` | frames in: folders, videos, recordings, live cameras |
//! | [`config`], [`recording`] | `boresight-run` | TOML → parameters; sessions as bytes |
//! | [`pipeline`] | `boresight-run` | the threads |
//! | [`simulation`] | `boresight-sim` | a camera and a technician with known truth |
//! | [`text`], [`speech`], [`ghost`] | `boresight-present` | sentences, voice and card |
//! | [`sheet`], `report` | `boresight-present` | printed boards; reports |
//! | [`app`] | `boresight-app` | the program without command line and window |
//! | `serve` | `boresight-phone` | the page for a phone |
//! | [`terminal`] | `boresight-terminal` | lines, progress and arguments that commands share |
//! | `ui` | `boresight-window` | the window |
//! | [`cli`] | this one | the commands |
//!
//! # The wings
//!
//! Each is a Cargo feature, and brings its own commands or sources. The program works without them.
//!
//! | module | crate | holds |
//! |---|---|---|
//! | `watch`, `station` | `boresight-watch`, `boresight-station` | an installed camera watched without a board |
//! | `fleet` | `boresight-fleet` | many sessions at once, many cameras over time |
//! | | `boresight-sources` | GigE Vision, topics of ROS 2 and recorded bags, below `app` |
//!
//! # Invariants
//!
//! - Up to `session` nothing reads a clock, a file, chance or another thread.
//!   `tests/house/layering` enforces this.
//! - Nothing is taken from a camera while lost, frozen, or with moved focus or zoom; an incomplete
//!   frame never becomes a picture.
//! - A view is shown as taken only after its picture and its journal line are on disk.
//! - Frames are dropped in one place, the slot between capture and detector, and counted; waiting
//!   sources never lose a frame.
//! - Pixel (0, 0) is the centre of the top-left pixel. Internal units are metres, radians and
//!   pixels, and names say so.
//!
//! # Glossary
//!
//! Words of camera calibration keep their usual meaning: homography, principal point, reprojection
//! error, bundle adjustment, distortion. These are ours, or narrower than usual:
//!
//! | word | means |
//! |---|---|
//! | principal line | a board's axis of symmetry in the picture; see [`geometry::PrincipalLine`] |
//! | tilt | angle between the board and the image plane |
//! | tilt azimuth | direction of the board's recession in the image, modulo 2π |
//! | slot | one of the plan's eight tilt azimuths, 45° apart: 22.5°, 67.5°, … |
//! | opposed pair | two views, point reflections about the principal point; one unit (below) |
//! | partner | the other view of an opposed pair |
//! | independent | principal lines crossing at a large angle, also relative to its uncertainty |
//! | span fraction | share of the picture's width or height spanned by corners, if larger |
//! | view | a measured picture of the board; *accepted* once part of the calibration |
//! | frame | a picture of a source, with number and time; a few frames become views |
//! | photograph | a single picture, such as a file in a folder: it needs no hold |
//! | gate | the conditions on a view, independent of other views |
//! | role | purpose of a view: a new direction, a partner, or forced by the person |
//! | worth | a view's information on the lens, as a share of the target's |
//! | smear | motion of the corners while the shutter is open |
//! | far board | a board constantly small in the picture, as before an installed camera |
//! | hold | a good view kept still: grows with good frames, fades with others; gives the sharpest |
//! | refusal | reason for not accepting a view, with measured and required values |
//! | miss | reason for finding no board in a picture |
//! | target | the pose to show next, drawn on the picture as the *card* to match |
//! | advice | the person's next action, by the newest frame |
//! | instruction | sentence, sign, card, ring and spoken words after a decision, as one value |
//! | plan | number of views: quick, full, or adaptive |
//! | lens estimate | the camera as known so far; a guess until two views are accepted |
//! | noise factor | σ₀: actual error of the corners over the error they claim |
//! | free homographies | the independent check: homographies with a shared radial distortion |
//! | finding | a fact about a calibration for the person, with a stable code and a severity |
//! | verdict | the worst finding: good, usable with care, not trustworthy; OK, watch, recalibrate |
//! | fault | error of a camera, with a stable code |
//! | control lock | focus, zoom, exposure, gain or white balance held at a value and read back |
//! | input, decision | event of a session, and its consequence; the journal records both |
//! | snapshot | contents of a window or terminal: plain data, replaced by the next one |
//! | technician | the simulated person following the guidance |
//!
//! A principal line is the image of the plane of the optical axis and the board's normal. Without
//! distortion it passes through the principal point. The tilt azimuths of an opposed pair differ by
//! 180°; its distortion errors cancel, and its principal lines are parallel by design. The verdicts
//! OK, watch and recalibrate are those of an installed camera.

#![forbid(unsafe_code)]

pub use boresight_app as app;
/// Views to a lens with covariance; checks and verdict; calibration files.
pub mod calibration {
    pub use boresight_calibrate::*;
    pub use boresight_formats as files;
    pub use boresight_formats::{export, import};
}
pub use boresight_capture as capture;
pub use boresight_detect as detection;
pub use boresight_files as files;
#[cfg(feature = "batch")]
pub use boresight_fleet as fleet;
pub use boresight_geometry::{self as geometry, board_code, boards, device, frame, markers};
pub use boresight_guide::{guidance, session};
#[cfg(feature = "serve")]
pub use boresight_phone as serve;
#[cfg(feature = "report")]
pub use boresight_present::report;
pub use boresight_present::{ghost, instruction, reading, sheet, speech, text};
pub use boresight_run::{config, pipeline, recording};
pub use boresight_sim as simulation;
#[cfg(feature = "watch")]
pub use boresight_station as station;
pub use boresight_terminal as terminal;
#[cfg(feature = "watch")]
pub use boresight_watch as watch;
#[cfg(feature = "window")]
pub use boresight_window as ui;

pub mod cli;
#[cfg(feature = "schemas")]
pub mod schemas;
