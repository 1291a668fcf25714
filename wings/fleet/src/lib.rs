//! Many sessions at once, and many cameras over time.

#![forbid(unsafe_code)]

pub mod batch;
#[cfg(feature = "history")]
pub mod history;

/// Stable name of an error of the crate or of [`boresight_app`], for programs; `FAILED` if unnamed.
pub fn error_code(err: &anyhow::Error) -> &'static str {
    for cause in err.chain() {
        if cause.is::<batch::ManifestError>() {
            return "MANIFEST";
        }
        if cause.is::<batch::OtherJob>() {
            return "OTHER-BATCH";
        }
        #[cfg(feature = "history")]
        if !matches!(cause.downcast_ref(), None | Some(history::IndexError::File(_))) {
            return "INDEX";
        }
    }
    boresight_app::error_code(err)
}

/// Next action for an error of the crate or of [`boresight_app`], if known.
pub fn explain(err: &anyhow::Error) -> Option<String> {
    #[cfg(feature = "cloud")]
    if let Some(err) = err.chain().find_map(|cause| cause.downcast_ref::<batch::CloudError>()) {
        return Some(err.next_action().into());
    }
    #[cfg(feature = "history")]
    if let Some(history::IndexError::Line { .. }) =
        err.chain().find_map(|cause| cause.downcast_ref())
    {
        return Some("Nothing is lost with an index: delete it, and add the folders of sessions again with boresight history add.".into());
    }
    boresight_app::explain(err)
}
