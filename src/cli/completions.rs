//! `boresight completions`.

use clap::{Args, Command};
use clap_complete::{Shell, generate};

use boresight_app::Exit;
use boresight_terminal::print;

/// Print a script that completes commands and options in your shell.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Your shell.
    #[arg(value_enum)]
    shell: Shell,
}

const EXAMPLES: &str = "\
Examples:
  boresight completions bash > ~/.local/share/bash-completion/completions/boresight
  boresight completions zsh > ~/.zfunc/_boresight
  boresight completions fish > ~/.config/fish/completions/boresight.fish";

impl Arguments {
    /// Prints the script to complete `program`.
    pub(super) fn run(self, mut program: Command) -> anyhow::Result<Exit> {
        let mut script = Vec::new();
        generate(self.shell, &mut program, "boresight", &mut script);
        print(String::from_utf8_lossy(&script).trim_end())?;
        Ok(Exit::Good)
    }
}
