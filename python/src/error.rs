//! Errors as exceptions.

use std::ffi::CString;

use boresight::app::{error_code, explain};

use pyo3::{
    create_exception,
    exceptions::{PyException, PyUserWarning},
    prelude::*,
};

create_exception!(
    _boresight,
    BoresightError,
    PyException,
    "Something couldn't be done: `message`, a stable `code`, and `next`, what to do about it (or None)."
);

/// Turns an error of the library into the exception, with the code and the next action of the command line.
pub(crate) fn raised(err: &anyhow::Error) -> PyErr {
    BoresightError::new_err((format!("{err:#}"), error_code(err), explain(err)))
}

/// An exception for an argument that doesn't fit.
pub(crate) fn wrong(message: impl Into<String>) -> PyErr {
    pyo3::exceptions::PyValueError::new_err(message.into())
}

/// Passes each note on as a `UserWarning`.
///
/// # Errors
///
/// If Python is told to raise warnings as exceptions.
pub(crate) fn warn(py: Python<'_>, notes: &[String]) -> PyResult<()> {
    notes.iter().try_for_each(|note| {
        let category = py.get_type::<PyUserWarning>();
        PyErr::warn(py, &category, &CString::new(note.as_str())?, 1)
    })
}
