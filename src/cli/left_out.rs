//! Commands of features missing from the build, with an error message.

/// Defines the arguments of a command missing from the build.
#[allow(unused_macros, reason = "a build with every command leaves none out")]
macro_rules! left_out {
    ($missing:expr, $about:literal) => {
        #[doc = $about]
        #[derive(Debug, clap::Args)]
        #[command(disable_help_flag = true)]
        pub(in crate::cli) struct Arguments {
            /// Ignored arguments.
            #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
            _any: Vec<std::ffi::OsString>,
        }

        impl Arguments {
            pub(in crate::cli) fn run(self) -> anyhow::Result<boresight_app::Exit> {
                let missing: boresight_app::MissingFeature = $missing;
                Err(missing.into())
            }
        }
    };
}

#[cfg(not(feature = "report"))]
pub(super) mod report {
    left_out!(
        boresight_app::MissingFeature::REPORT,
        "Write the report of a calibration (not in this build)."
    );
}

#[cfg(not(feature = "history"))]
pub(super) mod history {
    left_out!(
        boresight_app::MissingFeature::HISTORY,
        "Keep track of every calibration of every camera (not in this build)."
    );
}

#[cfg(not(feature = "batch"))]
pub(super) mod batch {
    left_out!(
        boresight_app::MissingFeature::BATCH,
        "Work on many sessions, on one computer or on a cluster (not in this build)."
    );
}

#[cfg(not(feature = "watch"))]
pub(super) mod watch {
    left_out!(
        boresight_app::MissingFeature::WATCH,
        "Watch an installed camera without a board (not in this build)."
    );
}

#[cfg(not(feature = "serve"))]
pub(super) mod serve {
    left_out!(
        boresight_app::MissingFeature::SERVE,
        "Wait for a phone: choose and calibrate on its page (not in this build)."
    );
}

#[cfg(not(feature = "serve"))]
pub(super) mod web {
    left_out!(
        boresight_app::MissingFeature::SERVE,
        "Serve the page that calibrates in a browser (not in this build)."
    );
}

#[cfg(not(feature = "manual"))]
pub(super) mod completions {
    left_out!(
        boresight_app::MissingFeature::MANUAL,
        "Print shell completions (not in this build)."
    );
}

#[cfg(not(feature = "manual"))]
pub(super) mod man {
    left_out!(boresight_app::MissingFeature::MANUAL, "Write the manual pages (not in this build).");
}
