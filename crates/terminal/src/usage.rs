//! Implausible arguments.

use boresight_app::MissingFeature;
use boresight_run::config::ConfigError;

/// Error for implausible arguments.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct WrongUsage(pub String);

/// True if the arguments are at fault, not the named files.
pub fn is_of_usage(cause: &(dyn std::error::Error + 'static)) -> bool {
    let is_setting = |err: &ConfigError| !matches!(err, ConfigError::File(_));
    cause.is::<MissingFeature>()
        || cause.is::<WrongUsage>()
        || cause.downcast_ref().is_some_and(is_setting)
}
