//! A simulated camera: a printed board in a lit room, seen through a known lens.
//!
//! Everything follows from the [`Scene`], its seed, and the cues read by the person in front of the
//! camera. No clocks: frame times are counted.
//!
//! ```
//! use std::time::Duration;
//!
//! use boresight_capture::{Arrival, FrameSource};
//! use boresight_sim::{NoCues, Scene, SyntheticSource};
//!
//! // Three frames of an ordinary webcam; no technician follows any guidance.
//! let mut camera = SyntheticSource::new(Scene::ordinary_webcam(1), Box::new(NoCues), Some(3), 2);
//! let mut sizes_px = Vec::new();
//! while let Arrival::Frame(frame) = camera.next_frame(Duration::from_secs(1))? {
//!     sizes_px.push(frame.image.dimensions());
//! }
//! assert_eq!(sizes_px, [(1280, 720); 3]);
//! // The simulation knows the lens that a calibration should find.
//! assert!(camera.truth().snapshot().camera.f_px.x > 0.0);
//! # Ok::<(), boresight_capture::CaptureError>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | `scene`, `scene_file`, `scene_mistake` | the scene, its TOML, and mistakes in the TOML |
//! | `renderer`, `shutter`, `backdrop`, `blur` | a picture of the scene |
//! | `print`, `bend`, `printed_*` | the printed board in the picture |
//! | `source`, `track` | the camera with its shutter, and the truth behind its pictures |
//! | [`technician`] | the person in front of the camera |
//! | `hands` | the person's board, before one or several cameras |
//! | `rng_stream` | random numbers, by seed |
//! | `kernel` | simulated V4L2 kernel for tests, with the feature `simulated-kernel` |

#![forbid(unsafe_code)]

mod backdrop;
mod bend;
mod blur;
mod exposure;
mod hands;
#[cfg(all(target_os = "linux", feature = "simulated-kernel"))]
pub mod kernel;
mod print;
mod printed_circles;
mod printed_code;
mod printed_markers;
mod printed_tags;
mod renderer;
mod rng_stream;
mod scene;
mod scene_file;
mod scene_mistake;
mod sheet_view;
mod shutter;
mod source;
pub mod technician;
mod track;

use image::GrayImage;
use nalgebra::Isometry3;

pub use renderer::Renderer;
pub use scene::{Light, Scene};
pub use scene_file::{SceneError, SceneFile};
pub use source::{Cues, NoCues, SyntheticSource, Truth, TruthLog};

/// Still picture of the scene's board at `cam_from_board`.
pub fn render_view(scene: &Scene, cam_from_board: &Isometry3<f64>) -> GrayImage {
    let mut picture = GrayImage::new(scene.image_size.width_px, scene.image_size.height_px);
    Renderer::new(scene).render(&[*cam_from_board], 0, &mut picture);
    picture
}
