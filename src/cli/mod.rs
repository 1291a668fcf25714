//! The command line: one subcommand a file. Machines read stdout, people read stderr.

mod accept_args;
mod backend;
mod batch;
mod beside;
mod board_args;
mod calibrate;
mod check;
#[cfg(feature = "manual")]
mod completions;
mod convert;
mod detect;
mod devices;
mod doctor;
mod export;
mod guide;
#[cfg(feature = "history")]
mod history;
#[cfg(not(all(feature = "report", feature = "manual", feature = "serve", feature = "history")))]
mod left_out;
mod lens_args;
#[cfg(feature = "manual")]
mod man;
mod moved;
mod operation;
pub mod progress;
mod replay;
#[cfg(feature = "report")]
mod report;
#[cfg(feature = "serve")]
mod serve;
mod simulate;
mod status;
mod stream_args;
mod target;
pub mod terminal;
#[cfg(unix)]
mod typing;
mod usage;
mod watch;
#[cfg(feature = "window")]
mod window;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

#[cfg(not(feature = "history"))]
use left_out::history;
#[cfg(not(feature = "report"))]
use left_out::report;
#[cfg(not(feature = "serve"))]
use left_out::serve;
#[cfg(not(feature = "manual"))]
use left_out::{completions, man};

#[cfg(feature = "window")]
use boresight_app::AppHost;
use boresight_app::{Exit, error_code};
use boresight_fleet::explain;
use serde_json::json;

/// Live pose guidance for camera calibration with principal lines.
#[derive(Debug, Parser)]
#[command(
    name = "boresight",
    version,
    propagate_version = true,
    args_conflicts_with_subcommands = true,
    about = "Live pose guidance for camera calibration with principal lines",
    long_about = None,
    after_help = AFTER_HELP
)]
struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    guide: guide::Arguments,
}

/// Exit code of arguments that this build doesn't take; clap uses it for wrong ones.
const WRONG_USAGE: u8 = 2;

const AFTER_HELP: &str = "\
Examples:
  boresight                                   start a session
  boresight target --paper a4                 print a board
  boresight guide --board 9x6 --square 25mm   calibrate with that board
  boresight check --against calibration.json  check an installed camera
  boresight watch cam7 --reference calibration.json --once
                                              watch it without a board

Without a command, boresight starts a guided session, like `boresight guide`, with the same options.
A board is given by its inner corners, columns x rows: 10 by 7 squares is --board 9x6.

Exit codes:
  0  done, and the result is usable
  1  failed
  2  wrong usage
  3  ended, but the result isn't trustworthy or falls short: the output says why
  4  check, watch: the camera needs a new calibration
  5  watch: the camera points elsewhere; its calibration stays valid";

#[derive(Debug, Subcommand)]
enum Command {
    Guide(guide::Arguments),
    Serve(serve::Arguments),
    Check(check::Arguments),
    Watch(watch::Arguments),
    Calibrate(calibrate::Arguments),
    Target(target::Arguments),
    Detect(detect::Arguments),
    Devices(devices::Arguments),
    Report(report::Arguments),
    Export(export::Arguments),
    Convert(convert::Arguments),
    Replay(replay::Arguments),
    Batch(batch::Arguments),
    History(history::Arguments),
    Doctor(doctor::Arguments),
    Simulate(simulate::Arguments),
    #[command(hide = true)]
    Study(moved::Study),
    Completions(completions::Arguments),
    Man(man::Arguments),
}

/// Parses the arguments, runs the command, and turns what comes out into an exit code.
pub fn main() -> ExitCode {
    let read = CommandLine::from_arg_matches(&command_line().get_matches());
    let arguments = read.unwrap_or_else(|err| err.format(&mut command_line()).exit());
    let result = match arguments.command {
        None => arguments.guide.run(),
        Some(Command::Guide(arguments)) => arguments.run(),
        Some(Command::Serve(arguments)) => arguments.run(),
        Some(Command::Replay(arguments)) => arguments.run(),
        Some(Command::Batch(arguments)) => arguments.run(),
        Some(Command::History(arguments)) => arguments.run(),
        Some(Command::Calibrate(arguments)) => arguments.run(),
        Some(Command::Check(arguments)) => arguments.run(),
        Some(Command::Watch(arguments)) => arguments.run(),
        Some(Command::Detect(arguments)) => arguments.run(),
        Some(Command::Devices(arguments)) => arguments.run(),
        Some(Command::Simulate(arguments)) => arguments.run(),
        Some(Command::Export(arguments)) => arguments.run(),
        Some(Command::Convert(arguments)) => arguments.run(),
        Some(Command::Report(arguments)) => arguments.run(),
        Some(Command::Doctor(arguments)) => arguments.run(),
        Some(Command::Study(arguments)) => arguments.run(),
        Some(Command::Target(arguments)) => arguments.run(),
        #[cfg(feature = "manual")]
        Some(Command::Completions(arguments)) => arguments.run(command_line()),
        #[cfg(feature = "manual")]
        Some(Command::Man(arguments)) => arguments.run(command_line()),
        #[cfg(not(feature = "manual"))]
        Some(Command::Completions(arguments)) => arguments.run(),
        #[cfg(not(feature = "manual"))]
        Some(Command::Man(arguments)) => arguments.run(),
    };
    match result {
        Ok(exit) => exit.into(),
        Err(err) => {
            let hint = explain(&err);
            if std::env::args_os().any(|argument| argument == "--json") {
                let error = json!({
                    "schema": "boresight.error/1", "code": error_code(&err), "message": format!("{err:#}"), "next": hint,
                });
                // The error itself decides the exit code.
                let _ = terminal::print(&error.to_string());
            }
            let hint = hint.map_or(String::new(), |hint| format!("\n{hint}"));
            terminal::say(&format!("boresight: {err:#}{hint}"));
            if err.chain().any(usage::is_of_usage) {
                return ExitCode::from(WRONG_USAGE);
            }
            Exit::Failed.into()
        }
    }
}

/// The command line with its help.
fn command_line() -> clap::Command {
    board_args::with_true_defaults(CommandLine::command())
}

/// The program behind a window of guided sessions, for tests that show the window without a display:
/// `arguments` are those of `boresight guide`. With `paced`, a simulated source keeps to its own time, as a
/// person needs; without, it's as fast as the machine.
///
/// # Errors
///
/// If the arguments are wrong.
#[cfg(feature = "window")]
pub fn app_host(arguments: &[&str], paced: bool) -> anyhow::Result<Box<dyn AppHost>> {
    let arguments = ["boresight"].iter().chain(arguments);
    CommandLine::try_parse_from(arguments)?.guide.app_host(paced)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_names_the_board_that_each_command_takes() {
        let mut program = command_line();
        program.build();
        let mut help = |name: &str| {
            let command = program.find_subcommand_mut(name).expect("a command");
            command.render_long_help().to_string()
        };
        let target = help("target");
        assert!(target.contains("[default: as large as fits") && !target.contains("from the code"));
        for (name, reads_code) in [("calibrate", true), ("detect", true), ("check", false)] {
            let help = help(name);
            assert_eq!(help.contains("from the code"), reads_code, "{name}: {help}");
            assert!(help.contains("9x6]"), "{name}: {help}");
        }
    }
}
