//! Commands that have become programs of their own.

use std::ffi::OsString;

use anyhow::bail;
use clap::Args;

use boresight_app::Exit;

/// Repeat the paper's experiments (a program of its own: boresight-study).
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
pub(super) struct Study {
    /// Whatever they are, they change nothing.
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _any: Vec<OsString>,
}

impl Study {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        bail!(
            "the experiments are a program of their own. Run: make study ARGS=\"skip table1 --out study\""
        )
    }
}
