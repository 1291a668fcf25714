//! The program as a process: its words, its ends, and its files on the disk.

#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod person;

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
mod guided_rig;
mod history;
mod judge;
#[cfg(target_os = "linux")]
mod long_runs;
mod manual;
#[cfg(unix)]
mod operation;
#[cfg(unix)]
mod platform;
mod power_cut;
mod power_cut_watch;
#[cfg(unix)]
mod release;
mod report;
mod rig;
mod saved_session;
mod scene;
mod schemas;
mod target;
#[cfg(unix)]
mod trouble;
mod watch;

use boresight_testkit::{pictures, world};
