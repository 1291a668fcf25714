//! `boresight batch run`.

use std::{
    path::PathBuf,
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

use anyhow::Context;
use clap::{Args, ValueEnum};
use serde_json::json;

use crate::batch::{Action, Batch, Event, Job, Shard, Tally, run, write_metrics};
use boresight_app::{Exit, cores, session::export::Format};
use boresight_files::{Overwrite, may_save};
use boresight_run::config::Config;
use boresight_terminal::{
    board_args::setting,
    format_name, log,
    operation::{LogForm, OnFinish},
    progress::Progress,
    say,
    stdin::Given,
    stop_flag,
};

/// Work on the sessions of a manifest, or on one shard of them.
///
/// Results go to a folder, one file each. Those that are there are left alone: run it again to continue. The folder
/// takes results of one action with the same settings by the same build of boresight; others are refused.
///
/// Actions:
///   replay     make every decision again, with --set if another setting is asked for, and compare with the recorded ones
///   redetect   the same, with the board found again in the stored pictures
///   calibrate  calibrate the recorded views again
///   check      compare the recorded views with an older calibration: --against, or the one that the session names
///   report     write each session's report
///   export     write each session's result for another program
///
/// A recorded bag becomes a session first, with the board and all else from --set. A topic is chosen by
/// --set camera.topic=/TOPIC.
///
/// Nothing is written into a session.
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Arguments {
    /// The list that `batch plan` printed; may be in an object store, too; - for stdin.
    manifest: PathBuf,
    /// What to do with each session.
    #[arg(long, value_enum)]
    action: ActionName,
    /// Folder for the results, or s3://BUCKET/PREFIX.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Work on part I of N, from 1/N to N/N [default: from the variables of Slurm, Kubernetes or
    /// AWS Batch, else all].
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Change one setting of every session, for example guidance.hold_secs=0.5. Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = setting)]
    settings: Vec<String>,
    /// The older calibration, for --action check [default: the one that each session names].
    #[arg(long, value_name = "OLD")]
    against: Option<PathBuf>,
    /// Format to write, for --action export [default: opencv-yaml].
    #[arg(long, value_parser = format_name())]
    format: Option<Format>,
    /// The longest that one session may take, for example 90s, 10m or 1h; after that it's a row
    /// with the code TIME-BUDGET.
    #[arg(long, value_name = "TIME", default_value = "10m", value_parser = time)]
    budget: Duration,
    /// Sessions to work on at a time [default: one per core that this process may use].
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Try sessions again whose row says that they couldn't be worked on.
    #[arg(long)]
    again: bool,
    /// How events are written on stderr: for people, or a JSON object a line.
    #[arg(long, value_enum, default_value_t, value_name = "FORM", hide_default_value = true)]
    log: LogForm,
    /// Run this command with the shell when the run has ended. BORESIGHT_OUT is the folder of
    /// results, BORESIGHT_VERDICT is done, failed (some sessions couldn't be worked on) or stopped.
    /// If it fails, it's reported; the exit code stays.
    #[arg(long, value_name = "COMMAND")]
    on_finish: Option<String>,
    /// Write how it goes to this file for Prometheus' node exporter, every few seconds.
    #[arg(long, value_name = "FILE.prom")]
    metrics: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ActionName {
    Replay,
    Redetect,
    Calibrate,
    Check,
    Report,
    Export,
}

impl From<ActionName> for Action {
    fn from(name: ActionName) -> Self {
        match name {
            ActionName::Replay => Self::Replay,
            ActionName::Redetect => Self::Redetect,
            ActionName::Calibrate => Self::Calibrate,
            ActionName::Check => Self::Check,
            ActionName::Report => Self::Report,
            ActionName::Export => Self::Export,
        }
    }
}

/// Time between two writings of the metrics.
const BETWEEN_METRICS: Duration = Duration::from_secs(5);

/// A duration with a unit.
fn time(text: &str) -> Result<Duration, String> {
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let secs = match unit.trim() {
        "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err("expected a time with its unit, for example 90s, 10m or 1h".into()),
    };
    let number: f64 = number.parse().map_err(|_| "expected a number before the unit".to_owned())?;
    let time = Duration::try_from_secs_f64(number * secs).map_err(|err| err.to_string())?;
    if time.is_zero() { Err("it must be longer than nothing".into()) } else { Ok(time) }
}

impl Arguments {
    pub(super) fn run(self, build: &str) -> anyhow::Result<Exit> {
        self.log.begin();
        let job = self.job(build)?;
        let shard = match self.shard {
            Some(shard) => shard,
            None => Shard::of_scheduler(&|name| std::env::var(name).ok())?,
        };
        if let Some(metrics) = &self.metrics {
            may_save(metrics, Overwrite::Allowed)?;
        }
        let program = std::env::current_exe().context("this program's own file can't be found")?;
        let manifest = Given::one(&self.manifest)?;
        let batch = Batch {
            job,
            manifest: manifest.file(),
            shard,
            out: &self.out,
            budget: self.budget,
            jobs: self.jobs.unwrap_or_else(cores),
            again: self.again,
            program: &program,
        };
        let stop = stop_flag()?;
        let is_json = self.log == LogForm::Json;
        let progress = Progress::new("sessions", 0);
        let Shard { index, count } = shard;
        log("begin", || json!({ "shard": index + 1, "shards": count, "out": self.out }));
        let written = Mutex::new(Instant::now());
        let tally = run(&batch, &stop, &|event| match event {
            Event::Progress(tally) => {
                if !is_json {
                    progress.at(tally.done() as usize, tally.items as usize);
                }
                let mut written = written.lock().unwrap_or_else(PoisonError::into_inner);
                if written.elapsed() >= BETWEEN_METRICS {
                    *written = Instant::now();
                    self.write_metrics(batch.job.action, tally);
                }
            }
            Event::Row { item, code, took } => {
                let secs = took.as_secs_f64();
                log("row", || json!({ "session": item.session, "code": code, "secs": secs }));
                if !is_json && *code != "OK" {
                    progress.say(&format!("{code}: {}", item.session));
                }
            }
        })?;
        progress.finish();
        self.write_metrics(batch.job.action, &tally);
        let verdict = match (&tally, tally.failed()) {
            (Tally { stopped: true, .. }, _) => "stopped",
            (_, 0) => "done",
            _ => "failed",
        };
        if let Some(command) = &self.on_finish {
            OnFinish::new(command.clone()).start(
                vec![
                    ("BORESIGHT_OUT", self.out.clone().into()),
                    ("BORESIGHT_VERDICT", verdict.into()),
                ],
                None,
            );
        }
        if is_json {
            let Tally { items, there, rows, .. } = &tally;
            log(
                "end",
                || json!({ "verdict": verdict, "items": items, "there": there, "rows": rows }),
            );
            return Ok(if tally.stopped { Exit::Failed } else { Exit::Good });
        }
        if batch.shard.count > 1 {
            say(&format!("Shard {} of {}", batch.shard.index + 1, batch.shard.count));
        }
        say(&summary(&tally));
        if tally.stopped {
            say("Stopped. Run the same command again to continue.");
            return Ok(Exit::Failed);
        }
        say(&format!("To put them in one table: boresight batch gather {}", self.out.display()));
        Ok(Exit::Good)
    }

    fn job(&self, build: &str) -> anyhow::Result<Job> {
        let action = Action::from(self.action);
        if self.against.is_some() && action != Action::Check {
            anyhow::bail!("--against is for --action check");
        }
        if self.format.is_some() && action != Action::Export {
            anyhow::bail!("--format is for --action export");
        }
        // Fail now rather than in every row.
        Config::load(None, &self.settings)?;
        let mut job = Job { settings: self.settings.clone(), ..Job::new(action, build) };
        if action == Action::Export {
            job.format = Some(self.format.map_or("opencv-yaml", Format::code).into());
        }
        match &self.against {
            Some(file) => job.against(file),
            None => Ok(job),
        }
    }

    /// Writes the metrics. A failure doesn't stop the work.
    fn write_metrics(&self, action: Action, tally: &Tally) {
        if let Some(path) = &self.metrics
            && let Err(err) = write_metrics(path, action, tally)
        {
            say(&format!("{err}"));
        }
    }
}

fn summary(tally: &Tally) -> String {
    let Tally { items, there, rows, .. } = tally;
    let mut line = format!("{} of {items} sessions have a result", tally.done());
    if *there > 0 {
        line += &format!("; {there} had one before");
    }
    let codes: Vec<String> = rows
        .iter()
        .filter(|(code, _)| *code != "OK")
        .map(|(code, count)| format!("{count} {code}"))
        .collect();
    if !codes.is_empty() {
        line += &format!("; couldn't be worked on: {}", codes.join(", "));
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_need_a_unit() {
        assert_eq!(time("90s"), Ok(Duration::from_secs(90)));
        assert_eq!(time("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(time("2h"), Ok(Duration::from_secs(7200)));
        for wrong in ["90", "s", "1d", "-1s", "0s", "1e400s", ""] {
            assert!(time(wrong).is_err(), "{wrong}");
        }
    }
}
