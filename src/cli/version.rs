//! Output of `--version`.

/// Version, build, commit, features and libraries, for a bug report.
pub(super) const LONG: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\nbuild:     ",
    env!("BORESIGHT_BUILD"),
    "\ncommit:    ",
    env!("BORESIGHT_COMMIT"),
    "\nfeatures:  ",
    env!("BORESIGHT_FEATURES"),
    "\nlibraries: ",
    env!("BORESIGHT_LIBRARIES"),
);

/// The version with the hash of its sources: results of a batch name it.
#[cfg(feature = "batch")]
pub(super) const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("BORESIGHT_BUILD"));
