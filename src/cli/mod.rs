//! Command line: one subcommand a file. Machines read stdout, people read stderr.

mod accept_args;
mod backend;
mod calibrate;
mod check;
#[cfg(feature = "manual")]
mod completions;
mod convert;
mod demo;
mod detect;
mod devices;
mod doctor;
mod errors;
mod export;
mod guide;
mod guide_rig;
mod judge;
#[cfg(not(all(
    feature = "report",
    feature = "manual",
    feature = "serve",
    feature = "batch",
    feature = "history",
    feature = "watch"
)))]
mod left_out;
mod lens_args;
#[cfg(feature = "manual")]
mod man;
mod paths;
mod plan_board;
mod replay;
#[cfg(feature = "report")]
mod report;
mod rig;
mod schema;
#[cfg(feature = "serve")]
mod serve;
mod simulate;
mod status;
mod stream_args;
mod target;
mod this_command;
mod version;
mod views;
#[cfg(feature = "serve")]
mod web;

use std::{
    io::{ErrorKind, Write},
    process::ExitCode,
};

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

#[cfg(not(feature = "batch"))]
use left_out::batch;
#[cfg(not(feature = "history"))]
use left_out::history;
#[cfg(not(feature = "report"))]
use left_out::report;
#[cfg(not(feature = "watch"))]
use left_out::watch;
#[cfg(not(feature = "manual"))]
use left_out::{completions, man};
#[cfg(not(feature = "serve"))]
use left_out::{serve, web};

use boresight_app::Exit;
#[cfg(feature = "window")]
use boresight_app::Services;
#[cfg(feature = "batch")]
use boresight_fleet::batch::command as batch;
#[cfg(feature = "history")]
use boresight_fleet::history::command as history;
#[cfg(feature = "watch")]
use boresight_station::command as watch;
use boresight_terminal as terminal;
use serde_json::json;

/// Live pose guidance for camera calibration with principal lines.
#[derive(Debug, Parser)]
#[command(
    name = "boresight",
    version,
    long_version = version::LONG,
    propagate_version = true,
    args_conflicts_with_subcommands = true,
    about = "Live pose guidance for camera calibration with principal lines",
    override_usage = "boresight [COMMAND]",
    long_about = None,
    after_help = EXAMPLES,
    after_long_help = AFTER_HELP
)]
struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    guide: guide::Arguments,
}

/// Exit code for unsupported arguments, as clap uses for wrong usage.
const WRONG_USAGE: u8 = 2;

const EXAMPLES: &str = "\
Examples:
  boresight demo                              see a session without a camera
  boresight                                   start a session
  boresight target --paper a4                 print a board
  boresight guide --help                      list the options of a session";

const AFTER_HELP: &str = "\
Examples:
  boresight demo                              see a session without a camera
  boresight                                   start a session
  boresight target --paper a4                 print a board
  boresight guide --board 9x6 --square 25mm   calibrate with that board
  boresight check --against calibration.json  check an installed camera
  boresight judge ost.yaml pictures           is somebody's calibration true?
  boresight watch cam7 --reference calibration.json --once
                                              watch it without a board

Without a command, boresight starts a guided session, like `boresight guide`, with the same options.
A board is given by its inner corners, columns x rows: 10 by 7 squares is --board 9x6.

Exit codes:
  0  done, and the result is usable
  1  failed
  2  wrong usage
  3  ended, but the result isn't trustworthy or falls short: the output says why
  4  check, watch: the camera needs a new calibration; judge: this calibration is off
  5  watch: the camera points elsewhere; its calibration stays valid
  6  watch: nobody can tell whether the camera has moved; the output says why";

#[derive(Debug, Subcommand)]
enum Command {
    Guide(guide::Arguments),
    Demo(demo::Arguments),
    Serve(serve::Arguments),
    Web(web::Arguments),
    Check(check::Arguments),
    Judge(judge::Arguments),
    Watch(watch::Arguments),
    Calibrate(calibrate::Arguments),
    Target(target::Arguments),
    PlanBoard(plan_board::Arguments),
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
    Schema(schema::Arguments),
    Paths(paths::Arguments),
    Completions(completions::Arguments),
    Man(man::Arguments),
}

/// Parses the arguments, runs the command, and turns the outcome into an exit code.
pub fn main() -> ExitCode {
    let read = command_line().try_get_matches().and_then(|matches| {
        CommandLine::from_arg_matches(&matches).map_err(|err| err.format(&mut command_line()))
    });
    let arguments = match read {
        Ok(arguments) => arguments,
        Err(err) => return not_run(&err),
    };
    let result = match arguments.command {
        None => arguments.guide.run(),
        Some(Command::Guide(arguments)) => arguments.run(),
        Some(Command::Demo(arguments)) => arguments.run(),
        Some(Command::Serve(arguments)) => arguments.run(),
        Some(Command::Web(arguments)) => arguments.run(),
        Some(Command::Replay(arguments)) => arguments.run(),
        #[cfg(feature = "batch")]
        Some(Command::Batch(arguments)) => arguments.run(version::BUILD),
        #[cfg(not(feature = "batch"))]
        Some(Command::Batch(arguments)) => arguments.run(),
        Some(Command::History(arguments)) => arguments.run(),
        Some(Command::Calibrate(arguments)) => arguments.run(),
        Some(Command::Check(arguments)) => arguments.run(),
        Some(Command::Judge(arguments)) => arguments.run(),
        Some(Command::Watch(arguments)) => arguments.run(),
        Some(Command::Detect(arguments)) => arguments.run(),
        Some(Command::Devices(arguments)) => arguments.run(),
        Some(Command::Simulate(arguments)) => arguments.run(),
        Some(Command::Export(arguments)) => arguments.run(),
        Some(Command::Convert(arguments)) => arguments.run(),
        Some(Command::Report(arguments)) => arguments.run(),
        Some(Command::Doctor(arguments)) => arguments.run(),
        Some(Command::Schema(arguments)) => arguments.run(),
        Some(Command::Paths(arguments)) => arguments.run(),
        Some(Command::Target(arguments)) => arguments.run(),
        Some(Command::PlanBoard(arguments)) => arguments.run(),
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
            let hint = errors::explain(&err);
            let is_of_usage = err.chain().any(terminal::usage::is_of_usage);
            let code = match errors::error_code(&err) {
                "FAILED" if is_of_usage => "USAGE",
                code => code,
            };
            tell_program(code, &format!("{err:#}"), hint.as_deref());
            let hint = hint.map_or(String::new(), |hint| format!("\n{hint}"));
            terminal::say(&format!("boresight: {err:#}{hint}"));
            if is_of_usage {
                return ExitCode::from(WRONG_USAGE);
            }
            Exit::Failed.into()
        }
    }
}

/// Shows the requested help, or the reason for rejecting the arguments.
fn not_run(err: &clap::Error) -> ExitCode {
    if err.use_stderr() {
        // The first paragraph names the error; usage and hints follow.
        let words = err.to_string();
        let cause = words.split("\n\n").next().unwrap_or_default();
        tell_program("USAGE", cause.trim_start_matches("error: "), Some(HELP));
        // Pasted arguments with commands to a terminal are shown without them, and without colours.
        if *terminal::harmless(&words) != *words {
            terminal::say(words.trim_end());
        } else {
            // If printing fails, the exit code tells.
            let _ = err.print();
        }
        return ExitCode::from(WRONG_USAGE);
    }
    match err.print().and_then(|()| std::io::stdout().flush()) {
        Err(err) if err.kind() != ErrorKind::BrokenPipe => {
            terminal::say(&format!("boresight: could not write to stdout: {err}"));
            Exit::Failed.into()
        }
        _ => Exit::Good.into(),
    }
}

/// Next action for unreadable arguments.
const HELP: &str = "`boresight COMMAND --help` lists the options.";

/// Tells a program reading stdout or stderr as JSON why the command failed.
fn tell_program(code: &str, message: &str, next: Option<&str>) {
    let error =
        || json!({ "schema": "boresight.error/1", "code": code, "message": message, "next": next });
    terminal::log("error", error);
    if std::env::args_os().any(|argument| argument == "--json") {
        // The error itself decides the exit code.
        let _ = terminal::print(&error().to_string());
    }
}

/// Command line with help.
fn command_line() -> clap::Command {
    // `guide --help` lists the options of a session without a command, too.
    let is_general = |arg: &clap::Arg| ["help", "version"].contains(&arg.get_id().as_str());
    let program = CommandLine::command().mut_args(|arg| {
        let hidden = !is_general(&arg);
        arg.hide(hidden)
    });
    terminal::board_args::with_true_defaults(program)
}

/// Program behind a window of guided sessions, for tests of the window without a display:
/// `arguments` are those of `boresight guide`. With `paced`, a simulated source runs in real time,
/// as a person needs; without, as fast as the machine can.
///
/// # Errors
///
/// If the arguments are wrong.
#[cfg(feature = "window")]
pub fn services(arguments: &[&str], paced: bool) -> anyhow::Result<Box<dyn Services>> {
    let arguments = ["boresight"].iter().chain(arguments);
    CommandLine::try_parse_from(arguments)?.guide.services(paced)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Options of a session are in the help of `guide`.
    #[test]
    fn the_short_help_fits_on_a_screen() {
        let help = command_line().render_help().to_string();
        assert!(help.lines().count() <= 40, "{} lines: {help}", help.lines().count());
        assert!(help.contains("Commands:\n  guide") && help.contains("Examples:"), "{help}");
    }

    #[test]
    fn help_names_the_board_that_each_command_takes() {
        let mut program = command_line();
        program.build();
        let mut help = |name: &str| {
            let command = program.find_subcommand_mut(name).expect("a command");
            let help = command.render_long_help().to_string();
            help.split_whitespace().collect::<Vec<_>>().join(" ")
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
