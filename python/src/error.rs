//! Errors as exceptions. The classes are Python's own, so that they pickle.

use boresight::fleet::{error_code, explain};

use pyo3::{import_exception, prelude::*};

import_exception!(boresight._errors, BoresightError);
import_exception!(boresight._errors, ArgumentError);

/// Turns an error of the library into the exception, with the code and the next action of the
/// command line.
pub(crate) fn raised(err: &anyhow::Error) -> PyErr {
    BoresightError::new_err((format!("{err:#}"), error_code(err), explain(err)))
}

/// An exception for an argument that doesn't fit.
pub(crate) fn wrong(message: impl Into<String>) -> PyErr {
    ArgumentError::new_err((message.into(),))
}
