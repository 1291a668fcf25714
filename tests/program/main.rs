//! The program as a process: what it says, how it ends, and what it leaves on the disk.

#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod person;
#[path = "../common/pictures.rs"]
mod pictures;
#[path = "../common/world.rs"]
mod world;

#[cfg(unix)]
mod automation;
#[cfg(target_os = "linux")]
mod batch;
#[cfg(unix)]
mod book;
#[cfg(unix)]
mod bundle;
mod check;
mod command_line;
mod crash;
mod damage;
mod demo;
#[cfg(unix)]
mod files;
mod history;
#[cfg(target_os = "linux")]
mod long_runs;
mod manual;
#[cfg(unix)]
mod operation;
#[cfg(unix)]
mod platform;
mod power_cut;
#[cfg(unix)]
mod release;
mod report;
mod saved_session;
mod schemas;
mod target;
#[cfg(unix)]
mod trouble;
mod watch;
