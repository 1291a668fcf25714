//! A simulated camera: a printed board in a lit room, seen through a known lens.
//!
//! Everything follows from the [`Scene`], its seed, and the cues the person in front of the camera
//! reads. No clocks: frame times are counted.

mod backdrop;
mod blur;
#[cfg(all(target_os = "linux", feature = "live", any(test, feature = "simulated-kernel")))]
pub mod kernel;
mod print;
mod renderer;
mod scene;
mod scene_file;
mod source;
pub mod technician;
mod technician_params;

use image::GrayImage;
use nalgebra::Isometry3;

pub use renderer::Renderer;
pub use scene::{Light, Scene};
pub use scene_file::SceneFile;
pub use source::{Cues, NoCues, SyntheticSource, Truth, TruthLog};

/// One still picture of the scene's board at `cam_from_board`.
pub fn render_view(scene: &Scene, cam_from_board: &Isometry3<f64>) -> GrayImage {
    let mut picture = GrayImage::new(scene.image_size.width_px, scene.image_size.height_px);
    Renderer::new(scene).render(&[*cam_from_board], 0, &mut picture);
    picture
}
