//! Pictures to corners.

use boresight::{
    app::commands::json::DetectedLine,
    detection::{Detector as Finder, DetectorParams},
};
use numpy::{
    PyArray2, PyArray3, PyReadonlyArray2,
    ndarray::{Array2, Array3},
};
use pyo3::prelude::*;

use crate::{
    error::raised,
    picture::{Named, board, picture},
};

/// Detection: JSON as of `detect --json`, positions, covariances.
type Found<'py> = (String, Option<Bound<'py, PyArray2<f64>>>, Option<Bound<'py, PyArray3<f64>>>);

/// A detector that keeps its buffers from picture to picture.
#[pyclass(frozen)]
pub(crate) struct Detector {
    finder: std::sync::Mutex<Finder>,
}

#[pymethods]
impl Detector {
    #[new]
    fn new() -> Self {
        Self { finder: std::sync::Mutex::new(Finder::new(DetectorParams::default())) }
    }

    /// Searches a grey picture (rows × columns of uint8) for a board. Other threads may run
    /// meanwhile.
    fn detect<'py>(
        &self,
        py: Python<'py>,
        image: PyReadonlyArray2<'py, u8>,
        named: Named,
    ) -> PyResult<Found<'py>> {
        let board = board(&named)?;
        let image = picture(&image)?;
        let seen = py.detach(|| {
            let mut finder = self.finder.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            finder.detect(&image, &board)
        });
        let text = serde_json::to_string(&DetectedLine::of("", &board, &seen, 0.0))
            .map_err(|err| raised(&err.into()))?;
        let Ok(detection) = seen else { return Ok((text, None, None)) };
        let corners = &detection.corners;
        let px = Array2::from_shape_fn((corners.len(), 2), |(i, axis)| corners[i].px[axis]);
        let covariance = Array3::from_shape_fn((corners.len(), 2, 2), |(i, row, column)| {
            corners[i].covariance_px2[(row, column)]
        });
        let px = PyArray2::from_owned_array(py, px);
        Ok((text, Some(px), Some(PyArray3::from_owned_array(py, covariance))))
    }
}
