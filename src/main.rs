//! Arguments to command.

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    boresight::geometry::panic_message::caught_in_silence();
    boresight::cli::main()
}
