//! Workplace of a thread: a worker process, and copies of objects from an object store.

use std::{
    path::Path,
    sync::atomic::AtomicBool,
    time::{Duration, Instant},
};

use super::{
    address::{Address, is_cloud},
    buckets::{Fetched, Sessions},
    child::{Answer, Worker},
    item::Item,
    job::{Action, Job},
    store::Store,
};
use boresight_files::Scratch;

/// Maximum tries of an item with ended workers: a worker may have been killed for no fault of the
/// item.
const TRIES: usize = 3;
/// Folder for files bound for an object store, below the worker's own.
const OUT: &str = "out";

/// Tools for working on items.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tools<'a> {
    /// Program with the subcommand `batch worker`.
    pub(super) program: &'a Path,
    /// Work on each item.
    pub(super) job: &'a Job,
    /// Folder or prefix for the results, as typed by the person.
    pub(super) out: &'a Path,
    /// Results in `out`.
    pub(super) store: &'a Store,
    /// Longest time for an item.
    pub(super) budget: Duration,
}

/// A worker process, and a private folder if files are fetched or handed over.
pub(super) struct Desk<'a> {
    tools: Tools<'a>,
    fetches: bool,
    worker: Option<Worker>,
    scratch: Option<Scratch>,
}

pub(super) enum Outcome {
    /// Row of the item, with the line's end.
    Row(Vec<u8>),
    /// The batch was asked to stop.
    Stopped,
    /// No row, with the reason.
    NotDone {
        /// Stable name of the reason.
        code: &'static str,
        /// Reason in words.
        message: String,
        /// The next action.
        next: &'static str,
    },
}

impl<'a> Desk<'a> {
    /// Desk for `tools`; `fetches` if some sessions are in an object store.
    pub(super) fn new(tools: Tools<'a>, fetches: bool) -> anyhow::Result<Self> {
        let needs_copies = fetches || tools.store.is_remote();
        let scratch = if needs_copies { Some(Scratch::new()?) } else { None };
        Ok(Self { tools, fetches, worker: None, scratch })
    }

    /// Gets the row of `item` from a worker.
    ///
    /// # Errors
    ///
    /// If no worker can be started, or an object store can't be used.
    pub(super) fn work(
        &mut self,
        sessions: &Sessions,
        item: &Item,
        stop: &AtomicBool,
    ) -> anyhow::Result<Outcome> {
        let began = Instant::now();
        let Some(scratch) = self.scratch.as_ref().filter(|_| is_cloud(Path::new(&item.session)))
        else {
            return self.work_here(item, began, stop);
        };
        if let Err(err) = Address::parse(&item.session) {
            let next = "Plan again: boresight batch plan";
            return Ok(Outcome::NotDone { code: "FILE-MISSING", message: err.to_string(), next });
        }
        // The only actions on pictures.
        let pictures = matches!(self.tools.job.action, Action::Redetect | Action::Report);
        let limits = (self.tools.budget, stop);
        let outcome = match sessions.fetch(&item.session, pictures, scratch, limits)? {
            Fetched::Whole => self.work_here(item, began, stop),
            Fetched::TooLong => Ok(self.too_long()),
            Fetched::Stopped => Ok(Outcome::Stopped),
            Fetched::TooLarge(limit) => Ok(Outcome::NotDone {
                code: "FILE-TOO-LARGE",
                message: format!("the session is larger than {limit} bytes"),
                next: "Fetch it, and work on it on this computer.",
            }),
        };
        if let Some(scratch) = &self.scratch {
            scratch.remove(Path::new(&item.session))?;
        }
        outcome
    }

    /// Gets the row of `item` from the worker. The worker reads a fetched session at a path
    /// relative to its own folder.
    fn work_here(
        &mut self,
        item: &Item,
        began: Instant,
        stop: &AtomicBool,
    ) -> anyhow::Result<Outcome> {
        for _ in 0..TRIES {
            let working = match self.worker.take() {
                Some(working) => working,
                None => self.start()?,
            };
            let working = self.worker.insert(working);
            let left = self.tools.budget.saturating_sub(began.elapsed());
            match working.work(item, left, stop) {
                Answer::Row(line) => return Ok(Outcome::Row(line)),
                Answer::Stopped => return Ok(Outcome::Stopped),
                Answer::TooLong => {
                    self.worker = None;
                    return Ok(self.too_long());
                }
                Answer::Crashed => self.worker = None,
            }
        }
        Ok(Outcome::NotDone {
            code: "CRASHED",
            message: format!("the worker ended {TRIES} times, perhaps because memory ran out"),
            next: "Allow more memory, and run it with --again.",
        })
    }

    fn start(&self) -> anyhow::Result<Worker> {
        let Tools { program, job, out, store, .. } = self.tools;
        let Some(scratch) = &self.scratch else { return Worker::start(program, job, out, None) };
        let out =
            if store.is_remote() { scratch.path().join(OUT) } else { std::path::absolute(out)? };
        // Fetched sessions have paths relative to the scratch folder; without them, the worker runs
        // in the person's folder.
        let at = self.fetches.then(|| scratch.path());
        Worker::start(program, job, &out, at)
    }

    fn too_long(&self) -> Outcome {
        Outcome::NotDone {
            code: "TIME-BUDGET",
            message: format!("longer than {} s", self.tools.budget.as_secs_f64()),
            next: "Allow more: --budget, with --again",
        }
    }

    /// Hands the file `below`, written by the work on `id`, over to the results, if in an object
    /// store.
    ///
    /// # Errors
    ///
    /// If the file can't be read or stored.
    pub(super) fn hand_over(&self, id: &str, below: &str) -> anyhow::Result<()> {
        let Some(scratch) = self.scratch.as_ref().filter(|_| self.tools.store.is_remote()) else {
            return Ok(());
        };
        self.tools.store.take_file(id, below, &scratch.path().join(OUT))?;
        Ok(scratch.remove(&Path::new(OUT).join(below))?)
    }
}
