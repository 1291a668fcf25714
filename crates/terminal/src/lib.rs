//! Terminal of the program: lines on stdout and stderr, progress, and arguments that several
//! commands share.
//!
//! | file | holds |
//! |---|---|
//! | `lines` | results on stdout, sentences and events on stderr, and the flag that Ctrl-C sets |
//! | `progress` | progress of long work |
//! | `board_args` | board, square and settings |
//! | `format_name` | the formats of an export |
//! | `stdin` | files and pictures given by name, or by `-` |
//! | `operation` | logs for programs, metrics, and the command at the end |
//! | `beside` | the phone's page and the voice beside a session |
//! | `usage` | wrong arguments that clap accepts |
//!
//! Each wing of the program brings its own commands, which write through this crate.

#![forbid(unsafe_code)]

pub mod beside;
pub mod board_args;
mod format_name;
mod lines;
pub mod operation;
pub mod progress;
pub mod stdin;
#[cfg(unix)]
pub mod typing;
pub mod usage;

pub use format_name::format_name;
pub use lines::*;
