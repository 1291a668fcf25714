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
//! | [`geometry`], [`board`], [`markers`], [`board_code`], [`frame`], [`device`] | `boresight-geometry` | homography, principal line and point, lens, pose; boards; pictures; what is known about a live camera |
//! | [`files`] | `boresight-files` | the only place that opens and writes files |
//! | [`detection`] | `boresight-detect` | picture → corners, or the reason why not |
//! | [`calibration`] | `boresight-calibrate`, `boresight-formats` | views → lens with covariance; checks and verdict; calibration files |
//! | [`guidance`], [`session`] | `boresight-guide` | what a view is worth, what to show next, when to stop; the state of one session |
//! | [`watch`] | `boresight-watch` | an installed camera watched without a board: picture → turn, turns → state |
//! | [`capture`] | `boresight-capture` | frames in: folders, videos, recordings, live cameras |
//! | [`config`], [`recording`], [`pipeline`] | `boresight-run` | TOML → parameters; sessions as bytes; the threads |
//! | [`simulation`] | `boresight-sim` | a camera and a technician with known truth |
//! | [`text`], [`speech`], [`ghost`], [`target`], `report` | `boresight-present` | what a person reads, hears and sees |
//! | [`app`] | `boresight-app` | what the program does, without a command line and without a window |
//! | `serve` | `boresight-phone` | the page for a phone |
//! | [`fleet`] | `boresight-fleet` | many sessions at once, many cameras over time |
//! | `ui`, [`cli`] | this one | the window; arguments and printing |
//!
//! # Invariants
//!
//! - Up to `session` nothing reads a clock, a file, chance or another thread. `tests/core/layering`
//!   enforces this.
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
//! | principal line | image of the plane that contains the optical axis and the board's normal; the board's axis of symmetry in the picture. Without distortion it passes through the principal point. See [`geometry::PrincipalLine`] |
//! | tilt | angle between the board and the image plane |
//! | tilt azimuth | direction in the image, modulo 2π, in which the board recedes |
//! | slot | one of the plan's eight tilt azimuths, 45° apart: 22.5°, 67.5°, … |
//! | opposed pair | two views whose tilt azimuths differ by 180° and whose boards are point reflections of each other about the principal point. Their distortion errors cancel; their principal lines are parallel by design, so the pair counts as one unit |
//! | partner | the other view of an opposed pair |
//! | independent | two principal lines that cross at a large enough angle, also in terms of their uncertainty |
//! | span fraction | the larger of the shares of the picture's width and height that the corners span |
//! | view | one picture of the board with its measurements; *accepted* once it takes part in the calibration |
//! | frame | one picture of a source, with number and time; a few frames become views |
//! | photograph | a picture by itself, such as a file in a folder: it needs no hold |
//! | gate | the conditions that a view must meet whatever the other views are |
//! | role | what a view is for: a new direction, a partner, or forced by the person |
//! | worth | what a view tells about the lens, as a share of what the pose asked for would tell |
//! | smear | how far the corners move while the shutter is open |
//! | far board | a board that stays small in the picture, as in front of an installed camera |
//! | hold | a good view kept still: it grows with every good frame and fades with every other; its sharpest frame is accepted |
//! | refusal | why a view isn't accepted, with what was measured and what is wanted |
//! | miss | why no board was found in a picture |
//! | target | the pose to show next; it's drawn on the picture as the *card*, which the board should match |
//! | advice | the one thing that the person should do now, by the newest frame |
//! | instruction | what a person is shown and told after a decision: sentence, sign, card, ring and spoken words, as one value |
//! | plan | how many views to ask for: quick, full, or adaptive |
//! | lens estimate | the camera as known so far; a guess until two views are accepted |
//! | noise factor | σ₀: actual error of the corners over the error they claim |
//! | free homographies | the independent check: homographies that share only a radial distortion |
//! | finding | something a person should know about a calibration, with a stable code and a severity |
//! | verdict | the worst finding: good, usable with care, or not trustworthy. For an installed camera: OK, watch, or recalibrate |
//! | fault | what is wrong with a camera, with a stable code |
//! | control lock | focus, zoom, exposure, gain or white balance held at a value and read back |
//! | input, decision | what can happen to a session; what it led to. The journal records both |
//! | snapshot | what a window or terminal shows: plain data, replaced by the next one |
//! | technician | the simulated person who follows the guidance |

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
pub use boresight_fleet as fleet;
pub use boresight_geometry::{self as geometry, board, board_code, device, frame, markers};
pub use boresight_guide::{guidance, session};
#[cfg(feature = "serve")]
pub use boresight_phone as serve;
#[cfg(feature = "report")]
pub use boresight_present::report;
pub use boresight_present::{ghost, instruction, reading, speech, target, text};
pub use boresight_run::{config, pipeline, recording};
pub use boresight_sim as simulation;
pub use boresight_watch as watch;

pub mod cli;
#[cfg(feature = "schemas")]
pub mod schemas;
#[cfg(feature = "window")]
pub mod ui;
#[cfg(feature = "window")]
pub mod window_host;
