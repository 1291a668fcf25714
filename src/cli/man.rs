//! `boresight man`.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_mangen::Man;

use boresight_app::Exit;
use boresight_files::{Overwrite, make_folder, may_save, save};
use boresight_terminal::say;

/// Write the manual pages: one for boresight, and one for each command and subcommand.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Folder for the pages.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Overwrite existing pages.
    #[arg(long)]
    force: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight man ~/.local/share/man/man1
  man boresight-guide";

/// Heading of the final section of help.
const EXTRA: &str = ".SH EXTRA\n";

impl Arguments {
    /// Writes the pages of `program`.
    pub(super) fn run(self, program: Command) -> anyhow::Result<Exit> {
        // The build and its libraries are no part of a page.
        let mut program = program.long_version(None::<&str>).disable_help_subcommand(true);
        program.build();
        let mut pages = Vec::new();
        for command in with_subcommands(&program) {
            let page = Man::new(command);
            let mut text = Vec::new();
            page.render(&mut text)?;
            let mut text = String::from_utf8(text)?;
            if let Some(examples) = text.find(EXTRA) {
                // The final section of help is broken into lines already; commands are no prose.
                text.insert_str(examples + EXTRA.len(), ".nf\n");
            }
            pages.push((self.folder.join(page.get_filename()), text));
        }
        let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
        if !self.folder.is_dir() {
            make_folder(&self.folder)?;
        }
        for (path, _) in &pages {
            may_save(path, overwrite)?;
        }
        for (path, text) in &pages {
            save(path, text.as_bytes(), overwrite)?;
        }
        say(&format!("Written: {} pages in {}", pages.len(), self.folder.display()));
        Ok(Exit::Good)
    }
}

/// `command`, and all visible subcommands.
fn with_subcommands(command: &Command) -> Vec<Command> {
    let below = command.get_subcommands().filter(|below| !below.is_hide_set());
    let below = below.flat_map(with_subcommands);
    std::iter::once(command.clone()).chain(below).collect()
}
