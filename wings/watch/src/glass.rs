//! Front glass and focus: sharpness and contrast of the patches against those of the references.

use crate::gallery::Gallery;
use boresight_scene::{FEWEST_FOUND, Measured, Texture, View, median};

/// Glass against the references: logarithms, 0 if unchanged.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Glass {
    /// Median change of sharpness.
    pub sharpness: f64,
    /// Median change of contrast.
    pub contrast: f64,
}

impl Glass {
    /// Judges the glass by the agreeing patches. `None` with too few of them, or for a picture
    /// turned back, which is less sharp than as taken.
    pub fn of(measured: &Measured, gallery: &Gallery, view: &View) -> Option<Self> {
        if measured.turned_back.is_some() {
            return None;
        }
        let (mut sharpness, mut contrast) = (Vec::new(), Vec::new());
        for ((reference, patch), sighting) in measured.agreeing() {
            let px = [sighting.px.x, sighting.px.y].map(|v| v.round() as i64);
            let Some(now) = Texture::at(&view.grey, px) else { continue };
            let then = gallery.references[reference].landmarks[patch].texture;
            sharpness.push(now.sharpness - then.sharpness);
            contrast.push(now.contrast - then.contrast);
        }
        if sharpness.len() < FEWEST_FOUND {
            return None;
        }
        Some(Self { sharpness: median(&mut sharpness)?, contrast: median(&mut contrast)? })
    }
}
