//! A shard, from the first item to the last.

use std::{
    collections::{BTreeMap, VecDeque},
    path::Path,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use serde::Deserialize;

use super::{
    address::is_cloud,
    buckets::Sessions,
    desk::{Desk, Outcome, Tools},
    item::Item,
    job::Job,
    manifest::{Manifest, ManifestError, ManifestFile},
    row::{OK, Row},
    shard::Shard,
    store::Store,
};

/// A batch, as seen by a worker of a scheduler.
#[derive(Debug)]
pub struct Batch<'a> {
    /// Work on each item.
    pub job: Job,
    /// The items: a file, or an address in an object store.
    pub manifest: &'a Path,
    /// Part of the items for the run.
    pub shard: Shard,
    /// Place for the results: a folder, or a prefix in an object store.
    pub out: &'a Path,
    /// Longest time for an item.
    pub budget: Duration,
    /// Items worked on at a time, at least 1.
    pub jobs: usize,
    /// True to try items with a failed row again.
    pub again: bool,
    /// Program with the subcommand `batch worker`.
    pub program: &'a Path,
}

/// Counts of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Items of the shard.
    pub items: u64,
    /// Items done before.
    pub there: u64,
    /// Rows by code.
    pub rows: BTreeMap<String, u64>,
    /// Time spent by workers on items.
    pub busy: Duration,
    /// True if the batch was asked to stop before the end.
    pub stopped: bool,
}

impl Tally {
    /// Items with a row.
    pub fn done(&self) -> u64 {
        self.there + self.rows.values().sum::<u64>()
    }

    /// Failed rows.
    pub fn failed(&self) -> u64 {
        self.rows.iter().filter(|(code, _)| *code != OK).map(|(_, count)| count).sum()
    }
}

/// Event of a run.
#[derive(Debug)]
pub enum Event<'a> {
    /// Progress so far.
    Progress(&'a Tally),
    /// A new row.
    Row {
        /// The finished item.
        item: &'a Item,
        /// Code of the row.
        code: &'a str,
        /// Time from start to row.
        took: Duration,
    },
}

/// State shared by the threads of a run.
struct Shared<'a> {
    batch: &'a Batch<'a>,
    store: Store,
    sessions: Sessions,
    /// True if some sessions must be fetched.
    fetches: bool,
    items: Mutex<(Manifest, u64)>,
    /// Items of another program. They are looked at again at the end, in case of its failure.
    elsewhere: Mutex<VecDeque<Item>>,
    tally: Mutex<Tally>,
    stop: &'a AtomicBool,
    /// Set when a thread fails, to stop the others early.
    failed: AtomicBool,
    report: &'a (dyn Fn(&Event<'_>) + Sync),
}

/// Works on the shard of `batch` until the end, or until `stop` is set. Skips items with a row.
/// `report` is called from several threads.
///
/// # Errors
///
/// If the manifest can't be read, results can't be written or are those of another job, or no
/// worker can be started. A failed item is a row, not an error.
pub fn run(
    batch: &Batch<'_>,
    stop: &AtomicBool,
    report: &(dyn Fn(&Event<'_>) + Sync),
) -> anyhow::Result<Tally> {
    let manifest = ManifestFile::at(batch.manifest)?;
    let (mut items, mut fetches) = (0, false);
    for (number, item) in (0..).zip(manifest.items()?) {
        let item = item?;
        if batch.shard.has(number) {
            items += 1;
            fetches |= is_cloud(Path::new(&item.session));
        }
    }
    let mut store = Store::at(batch.out)?;
    store.prepare(&batch.job, &manifest.path)?;
    store.look()?;
    let shared = Shared {
        batch,
        store,
        sessions: Sessions::default(),
        fetches,
        items: Mutex::new((manifest.items()?, 0)),
        elsewhere: Mutex::default(),
        tally: Mutex::new(Tally { items, ..Tally::default() }),
        stop,
        failed: AtomicBool::new(false),
        report,
    };
    thread::scope(|scope| {
        let threads: Result<Vec<_>, _> = (0..batch.jobs.max(1))
            .map(|n| {
                let name = format!("batch {n}");
                thread::Builder::new().name(name).spawn_scoped(scope, || {
                    let ended = shared.work();
                    if ended.is_err() {
                        shared.failed.store(true, Ordering::Relaxed);
                    }
                    ended
                })
            })
            .collect();
        let failed = |_| anyhow::anyhow!("a thread of the batch failed");
        threads?.into_iter().try_for_each(|thread| thread.join().map_err(failed)?)
    })?;
    let mut tally = shared.tally.into_inner().unwrap_or_else(PoisonError::into_inner);
    tally.stopped = tally.done() < tally.items;
    Ok(tally)
}

impl Shared<'_> {
    /// Next item of the shard.
    fn next(&self) -> Option<Result<Item, ManifestError>> {
        let mut items = self.items.lock().unwrap_or_else(PoisonError::into_inner);
        let (manifest, number) = &mut *items;
        loop {
            let item = manifest.next()?;
            let is_own = self.batch.shard.has(*number);
            *number += 1;
            if is_own || item.is_err() {
                return Some(item);
            }
        }
    }

    fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.failed.load(Ordering::Relaxed)
    }

    fn count(&self, change: impl FnOnce(&mut Tally)) {
        let mut tally = self.tally.lock().unwrap_or_else(PoisonError::into_inner);
        change(&mut tally);
        (self.report)(&Event::Progress(&tally));
    }

    /// Works on items until none is left.
    fn work(&self) -> anyhow::Result<()> {
        let batch = self.batch;
        let tools = Tools {
            program: batch.program,
            job: &batch.job,
            out: batch.out,
            store: &self.store,
            budget: batch.budget,
        };
        let mut desk = Desk::new(tools, self.fetches)?;
        while !self.is_over() {
            let Some(item) = self.next() else { break };
            let item = item?;
            if self.settle(&mut desk, &item)? == Settled::Elsewhere {
                self.elsewhere().push_back(item);
            }
        }
        while !self.is_over() {
            let Some(item) = self.elsewhere().pop_front() else { break };
            if self.settle(&mut desk, &item)? == Settled::Elsewhere {
                self.elsewhere().push_back(item);
                thread::sleep(LOOK_AGAIN);
            }
        }
        Ok(())
    }

    fn elsewhere(&self) -> MutexGuard<'_, VecDeque<Item>> {
        self.elsewhere.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Produces the row of `item`, unless another program works on the item.
    fn settle(&self, desk: &mut Desk<'_>, item: &Item) -> anyhow::Result<Settled> {
        let batch = self.batch;
        let id = batch.job.id_of(item).to_string();
        let is_there = || self.store.is_done(&id, batch.again);
        if is_there()? {
            self.count(|tally| tally.there += 1);
            return Ok(Settled::Done);
        }
        let Some(claim) = self.store.claim(&id)? else { return Ok(Settled::Elsewhere) };
        // The other program may have stored it just before releasing its claim.
        if is_there()? {
            claim.finish();
            self.count(|tally| tally.there += 1);
            return Ok(Settled::Done);
        }
        let began = Instant::now();
        let Some((code, line)) = self.row(desk, item, &id)? else { return Ok(Settled::Stopped) };
        let took = began.elapsed();
        if code == NOT_WRITTEN {
            // The disk of the results is at fault, not the item: without a row, it's tried again.
            let row: Head = serde_json::from_slice(&line)?;
            anyhow::bail!("{}", row.message.unwrap_or(code));
        }
        self.store.save_row(&id, &line, batch.again)?;
        claim.finish();
        (self.report)(&Event::Row { item, code: &code, took });
        self.count(|tally| {
            *tally.rows.entry(code).or_insert(0) += 1;
            tally.busy += took;
        });
        Ok(Settled::Done)
    }

    /// Code and row of `item`; `None` if the batch was asked to stop.
    fn row(
        &self,
        desk: &mut Desk<'_>,
        item: &Item,
        id: &str,
    ) -> anyhow::Result<Option<(String, Vec<u8>)>> {
        let (code, message, next) = match desk.work(&self.sessions, item, self.stop)? {
            Outcome::Row(line) => {
                let head: Head = serde_json::from_slice(&line)?;
                anyhow::ensure!(head.id == id, "a worker answered another item");
                if let Some(file) = &head.file {
                    desk.hand_over(id, file)?;
                }
                return Ok(Some((head.code, line)));
            }
            Outcome::Stopped => return Ok(None),
            Outcome::NotDone { code, message, next } => (code, message, next),
        };
        let row = Row::new(id.to_owned(), &item.session, self.batch.job.action);
        let mut line = serde_json::to_vec(&row.failed(code, message, Some(next.into())))?;
        line.push(b'\n');
        Ok(Some((code.to_owned(), line)))
    }
}

/// Time between two looks at another program's item.
const LOOK_AGAIN: Duration = Duration::from_millis(200);
/// Code of a row with an unwritable file.
const NOT_WRITTEN: &str = "NOT-WRITTEN";

/// State of an item after a look.
#[derive(PartialEq, Eq)]
enum Settled {
    /// The item has a row.
    Done,
    /// Another program works on the item.
    Elsewhere,
    /// The batch was asked to stop.
    Stopped,
}

#[derive(Deserialize)]
struct Head {
    id: String,
    code: String,
    file: Option<String>,
    message: Option<String>,
}
