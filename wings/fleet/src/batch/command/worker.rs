//! `boresight batch worker`: works on items in sequence for `batch run`, which may kill it.

use std::{
    io::BufRead,
    path::PathBuf,
    sync::{Arc, atomic::AtomicBool, mpsc::sync_channel},
    thread::Builder,
};

use anyhow::Context;
use clap::Args;

use crate::batch::{Item, Job, Store, work};
use boresight_app::Exit;
use boresight_terminal::print;

/// Work on the items of stdin; `batch run` starts it.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Folder for what items write beside their rows.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        // Ctrl-C reaches the worker, too, but `batch run` decides its fate.
        signal_hook::flag::register(signal_hook::consts::SIGINT, Arc::new(AtomicBool::new(false)))?;
        // A panic becomes a row.
        std::panic::set_hook(Box::new(|_| ()));
        let (send, lines) = sync_channel::<String>(1);
        Builder::new().name("items".into()).spawn(move || {
            for line in std::io::stdin().lock().lines() {
                if line.is_ok_and(|line| send.send(line).is_ok()) {
                    continue;
                }
                break;
            }
            // `batch run` is gone, perhaps killed: no reader is left for the row.
            std::process::exit(0);
        })?;
        let first = lines.recv().context("there is no job on stdin")?;
        let job: Job = serde_json::from_str(&first).context("no job")?;
        let store = Store::at(&self.out)?;
        for line in lines {
            let item: Item = serde_json::from_str(&line).context("no item")?;
            print(&serde_json::to_string(&work(&job, &store, &item))?)?;
        }
        Ok(Exit::Good)
    }
}
