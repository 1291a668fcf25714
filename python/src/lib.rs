//! boresight for Python. Results cross as JSON, the same text that the command line prints, so that both give the same
//! numbers bit for bit; pictures and corners cross as arrays. Long work is done with the interpreter's lock released.

mod calibration;
mod detection;
mod error;
mod lens;
mod picture;
mod recording;
mod session;

use pyo3::prelude::*;

#[pymodule]
fn _boresight(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<detection::Detector>()?;
    module.add_class::<lens::Lens>()?;
    module.add_class::<session::Session>()?;
    module.add_function(wrap_pyfunction!(calibration::calibrate_files, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::calibrate_corners, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::check_corners, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::calibrate_session, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::load, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::save_text, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::read_calibration, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::export, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::formats, module)?)?;
    module.add_function(wrap_pyfunction!(recording::read_session, module)?)?;
    module.add_function(wrap_pyfunction!(recording::replay, module)?)?;
    module.add_function(wrap_pyfunction!(recording::check_session, module)?)?;
    Ok(())
}
