//! Errors as exceptions.

use boresight::app::{error_code, explain};
use pyo3::{create_exception, exceptions::PyException, prelude::*};

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
