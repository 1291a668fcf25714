//! Arguments that can't be meant.

use boresight_app::MissingFeature;
use boresight_run::config::ConfigError;

/// Arguments that can't be meant.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct WrongUsage(pub(super) String);

/// Whether the arguments are at fault, not what they name.
pub(super) fn is_of_usage(cause: &(dyn std::error::Error + 'static)) -> bool {
    let is_setting = |err: &ConfigError| !matches!(err, ConfigError::File(_));
    cause.is::<MissingFeature>()
        || cause.is::<WrongUsage>()
        || cause.downcast_ref().is_some_and(is_setting)
}
