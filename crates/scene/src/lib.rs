//! Pictures of a scene that stands still, compared through the lens.
//!
//! ```text
//! picture ─ level ─▶ View ─ reference ─▶ patches ─ find ─▶ sightings ─ fit ─▶ Turn
//!              another View ────────────────────┘
//! ```
//!
//! Boards aren't needed: patches of one picture are found in another by normalised correlation,
//! and their majority tells by how much the camera turned and its focal length changed. Nothing
//! here reads a clock, a file, or another thread. The formulas are in `docs/method.md`, section 8.
//!
//! | module | holds |
//! |---|---|
//! | `level` | a picture with levelled local brightness and contrast, in three sizes |
//! | `patches`, `reference` | patches at corners, found by normalised correlation |
//! | `texture` | sharpness and contrast of a patch |
//! | `shift` | the shift between two thumbnails |
//! | `turn`, `fit` | pan, tilt, roll, focal ratio through any lens model; the robust fit |
//! | `still` | the scale of the scene behind a board, as a witness of the focal length |
//! | `outline` | edges to draw over a live picture |
//! | `measure` | turn of a picture since its references, and whether it is evidence |
#![forbid(unsafe_code)]

mod fit;
mod level;
mod measure;
mod outline;
mod patches;
mod reference;
mod shift;
mod still;
mod texture;
mod turn;

pub use fit::{Fit, SHARED, SIGMA_OF_MEDIAN, Sighting, fit, lens_covariance, median, offsets_px};
pub use level::{COARSE, Thumb, View};
pub use measure::{
    APART_PX, Causes, FEWEST_FOUND, LEAST_AGREEING, Measured, Weak, credible, motion_besides,
    spread,
};
pub use patches::{
    COARSE_HALF, COARSE_SEARCH, FINE_HALF, FINE_SEARCH, GRID, Patch, cell_of, corners,
};
pub use reference::{Found, Landmark, Reference, UNKNOWN_SIGMA_PX};
pub use shift::{Shift, best_shift, bilinear, turned};
pub use still::{WithBoard, scene_scales};
pub use texture::Texture;
pub use turn::{Lens, Turn, px_per_turn};
