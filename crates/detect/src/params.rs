/// Bounds and thresholds of the detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectorParams {
    /// Least corner response, in grey levels summed over the ring. A corner with a brightness step
    /// of 20 levels has about 200.
    pub min_response: i16,
    /// Most corner candidates kept at a level of the search, strongest first.
    pub max_candidates: usize,
    /// Most grids started at a level of the search.
    pub max_seeds: usize,
    /// Least contrast, [`Quality::contrast`](super::Quality::contrast), in grey levels.
    pub min_contrast: f64,
    /// Widest blur, [`Quality::blur_px`](super::Quality::blur_px), in pixels.
    pub max_blur_px: f64,
    /// Shortest side of a square, in pixels of the full-size picture.
    pub min_square_px: f64,
    /// Largest root mean square residual of the edge model, as a fraction of the contrast.
    pub max_residual: f64,
}

impl Default for DetectorParams {
    fn default() -> Self {
        Self {
            min_response: 90,
            max_candidates: 2500,
            max_seeds: 60,
            min_contrast: 6.0,
            max_blur_px: 6.0,
            min_square_px: 4.0,
            max_residual: 0.5,
        }
    }
}
