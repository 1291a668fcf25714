//! boresight for Python. Results cross as JSON, the same text that the command line prints, so that
//! both give the same numbers bit for bit; pictures and corners cross as arrays. Long work is done
//! with the interpreter's lock released.

mod calibration;
mod detection;
mod error;
mod lens;
mod picture;
mod recording;
mod session;
mod tools;

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
    module.add_function(wrap_pyfunction!(calibration::judge, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::calibrate_session, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::load, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::save_text, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::read_calibration, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::export, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::formats, module)?)?;
    module.add_function(wrap_pyfunction!(recording::read_session, module)?)?;
    module.add_function(wrap_pyfunction!(recording::replay, module)?)?;
    module.add_function(wrap_pyfunction!(recording::check_session, module)?)?;
    module.add_function(wrap_pyfunction!(tools::sheet, module)?)?;
    module.add_function(wrap_pyfunction!(tools::board_plan, module)?)?;
    module.add_function(wrap_pyfunction!(tools::report_page, module)?)?;
    module.add_function(wrap_pyfunction!(tools::batch_plan, module)?)?;
    module.add_function(wrap_pyfunction!(tools::batch_work, module)?)?;
    module.add_function(wrap_pyfunction!(tools::batch_rows, module)?)?;
    module.add_function(wrap_pyfunction!(tools::history_add, module)?)?;
    module.add_function(wrap_pyfunction!(tools::history_cameras, module)?)?;
    module.add_function(wrap_pyfunction!(tools::history_due, module)?)?;
    module.add_function(wrap_pyfunction!(tools::history_page, module)?)?;
    // A decoder that hostile files make panic says nothing.
    boresight::geometry::panic_message::caught_in_silence();
    Ok(())
}
