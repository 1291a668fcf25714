//! Front glass and focus: sharpness and contrast of the patches against those of the references.

use crate::{
    fit::{AGREES, median},
    gallery::Gallery,
    level::View,
    measure::{FEWEST_FOUND, Measured},
    texture::Texture,
    turn::Lens,
};

/// Columns and rows of the map of the glass.
pub const CELLS: [usize; 2] = [8, 6];
/// Minimum number of patches for a statement about a cell.
const FEWEST_IN_CELL: usize = 2;

/// Glass against the references: logarithms, 0 if unchanged.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Glass {
    /// Median change of sharpness.
    pub sharpness: f64,
    /// Median change of contrast.
    pub contrast: f64,
    /// Change of contrast in each cell against the median, row by row; `None` with too few patches.
    pub cells: Vec<Option<f64>>,
}

impl Glass {
    /// Judges the glass by the agreeing patches. `None` with too few of them, or for a picture
    /// turned back, which is less sharp than as taken.
    pub fn of(measured: &Measured, gallery: &Gallery, view: &View, lens: &Lens) -> Option<Self> {
        if measured.turned_back.is_some() {
            return None;
        }
        let size = lens.image_size;
        let (mut sharpness, mut contrast) = (Vec::new(), Vec::new());
        let mut by_cell = vec![Vec::new(); CELLS[0] * CELLS[1]];
        for (&(reference, patch), (sighting, weight)) in
            measured.tags.iter().zip(measured.sightings.iter().zip(&measured.weights))
        {
            if *weight <= AGREES {
                continue;
            }
            let px = [sighting.px.x, sighting.px.y].map(|v| v.round() as i64);
            let Some(now) = Texture::at(&view.grey, px) else { continue };
            let then = gallery.references[reference].landmarks[patch].texture;
            sharpness.push(now.sharpness - then.sharpness);
            contrast.push(now.contrast - then.contrast);
            let cell = |px: i64, parts: usize, length: u32| {
                (px as usize * parts / length as usize).min(parts - 1)
            };
            let (column, row) =
                (cell(px[0], CELLS[0], size.width_px), cell(px[1], CELLS[1], size.height_px));
            by_cell[row * CELLS[0] + column].push(now.contrast - then.contrast);
        }
        if sharpness.len() < FEWEST_FOUND {
            return None;
        }
        let sharpness = median(&mut sharpness)?;
        let contrast = median(&mut contrast)?;
        let cells = by_cell.iter_mut().map(|cell| {
            (cell.len() >= FEWEST_IN_CELL).then(|| median(cell)).flatten().map(|own| own - contrast)
        });
        Some(Self { sharpness, contrast, cells: cells.collect() })
    }
}
