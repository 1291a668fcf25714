//! Errors as exceptions. The classes are Python's own, so that they pickle.

use std::ffi::CString;

use boresight::fleet::{error_code, explain};

use pyo3::{exceptions::PyUserWarning, import_exception, prelude::*};

import_exception!(boresight._errors, BoresightError);
import_exception!(boresight._errors, ArgumentError);

/// Turns an error of the library into the exception, with the code and the next action of the command line.
pub(crate) fn raised(err: &anyhow::Error) -> PyErr {
    BoresightError::new_err((format!("{err:#}"), error_code(err), explain(err)))
}

/// An exception for an argument that doesn't fit.
pub(crate) fn wrong(message: impl Into<String>) -> PyErr {
    ArgumentError::new_err((message.into(),))
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
