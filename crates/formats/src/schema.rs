//! Reading files with a named schema.

use serde::de::DeserializeOwned;
use serde_json::Value;

/// Reason for a file of boresight not to be readable.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotRead {
    /// The file is of another schema, or of another version.
    #[error("its schema is {found:?}, this version reads {wanted:?}")]
    Schema {
        /// The schema in the file; empty if missing.
        found: String,
        /// The readable schema.
        wanted: &'static str,
    },
    /// A field is missing or of another type.
    #[error("{reason}")]
    Field {
        /// The field, and the mistake.
        reason: String,
    },
}

/// Reads `tree` with the schema `wanted`.
///
/// # Errors
///
/// [`NotRead`].
pub(super) fn read<T: DeserializeOwned>(tree: &Value, wanted: &'static str) -> Result<T, NotRead> {
    let found = tree["schema"].as_str().unwrap_or_default();
    if found != wanted {
        return Err(NotRead::Schema { found: found.into(), wanted });
    }
    serde_path_to_error::deserialize(tree).map_err(|err| NotRead::Field { reason: err.to_string() })
}
