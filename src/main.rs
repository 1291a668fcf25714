//! Arguments to command.

use std::process::ExitCode;

fn main() -> ExitCode {
    boresight::cli::main()
}
