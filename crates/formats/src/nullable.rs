//! Fields of a file that may be absent, null, or hold a value.

use serde::{Deserialize, Deserializer};

/// Reads `None` for an absent field, `Some(None)` for null. Needs `#[serde(default)]`.
pub(super) fn nullable<'de, D, T>(deserializer: D) -> Result<Option<Option<T>>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Option::deserialize(deserializer).map(Some)
}
