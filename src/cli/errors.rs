//! Names and next actions of errors: those of the program and of its wings.

/// Stable name of an error, for programs; `FAILED` if it has none.
pub(super) fn error_code(err: &anyhow::Error) -> &'static str {
    #[cfg(feature = "batch")]
    return boresight_fleet::error_code(err);
    #[cfg(not(feature = "batch"))]
    boresight_app::error_code(err)
}

/// The next action for an error, if one is known.
pub(super) fn explain(err: &anyhow::Error) -> Option<String> {
    #[cfg(feature = "batch")]
    return boresight_fleet::explain(err);
    #[cfg(not(feature = "batch"))]
    boresight_app::explain(err)
}
