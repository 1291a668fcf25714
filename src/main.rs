//! Arguments to command.

#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    boresight::cli::main()
}
