//! Process working on items. May crash or hang without harm to the shard.

use std::{
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Child, ChildStdin, Command, Stdio},
    sync::atomic::{AtomicBool, Ordering},
    thread::{Builder, JoinHandle},
    time::{Duration, Instant},
};

use anyhow::Context;
use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};

use super::{item::Item, job::Job};

/// Time between two checks of the stop flag during a wait.
const LOOK: Duration = Duration::from_millis(100);

/// A process answering items with rows, line by line.
pub(super) struct Worker {
    process: Child,
    items: Option<ChildStdin>,
    rows: Receiver<Vec<u8>>,
    reader: Option<JoinHandle<()>>,
}

/// Answer of a worker to an item.
pub(super) enum Answer {
    /// Row of the item, with the line's end.
    Row(Vec<u8>),
    /// The item took longer than allowed.
    TooLong,
    /// The process ended.
    Crashed,
    /// The worker was asked to stop.
    Stopped,
}

impl Worker {
    /// Starts `program` as a worker on `job`, with files in `out`, in the folder `at` if given,
    /// otherwise in this process's folder.
    pub(super) fn start(
        program: &Path,
        job: &Job,
        out: &Path,
        at: Option<&Path>,
    ) -> anyhow::Result<Self> {
        let mut command = Command::new(program);
        if let Some(at) = at {
            command.current_dir(at);
        }
        let mut process = command
            .args(["batch", "worker", "--out"])
            .arg(out)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("could not start a worker: {program:?}"))?;
        let items = process.stdin.take();
        let output = process.stdout.take().context("a worker has no output")?;
        let (send, rows) = bounded(1);
        let reader = Builder::new().name("rows".into()).spawn(move || {
            let mut output = BufReader::new(output);
            loop {
                let mut line = Vec::new();
                // Text without a line's end is the partial row of an ended process.
                let read = output.read_until(b'\n', &mut line).unwrap_or(0);
                if read == 0 || line.last() != Some(&b'\n') || send.send(line).is_err() {
                    return;
                }
            }
        })?;
        let mut worker = Self { process, items, rows, reader: Some(reader) };
        // If the process has ended already, the first item finds out.
        let _ = worker.write(job);
        Ok(worker)
    }

    fn write(&mut self, line: &impl serde::Serialize) -> std::io::Result<()> {
        let Some(items) = &mut self.items else {
            return Err(std::io::ErrorKind::BrokenPipe.into());
        };
        let mut bytes = serde_json::to_vec(line)?;
        bytes.push(b'\n');
        items.write_all(&bytes)?;
        items.flush()
    }

    /// Hands `item` to the process for at most `budget`. After any answer but a row, the worker is
    /// useless.
    pub(super) fn work(&mut self, item: &Item, budget: Duration, stop: &AtomicBool) -> Answer {
        let began = Instant::now();
        if self.write(item).is_err() {
            return Answer::Crashed;
        }
        loop {
            if stop.load(Ordering::Relaxed) {
                return Answer::Stopped;
            }
            let left = budget.saturating_sub(began.elapsed());
            match self.rows.recv_timeout(left.min(LOOK)) {
                Ok(row) => return Answer::Row(row),
                Err(RecvTimeoutError::Timeout) if began.elapsed() >= budget => {
                    return Answer::TooLong;
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Answer::Crashed,
            }
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.items = None;
        let _ = self.process.kill();
        let _ = self.process.wait();
        // Drain pending rows to let the reader exit.
        while self.rows.try_recv().is_ok() {}
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}
