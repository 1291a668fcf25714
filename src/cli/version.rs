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
