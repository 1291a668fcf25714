//! `boresight batch`.

mod gather;
mod plan;
mod run;
mod worker;

use clap::{Args, Subcommand};

use boresight_app::Exit;

/// Work on many sessions, on one computer or on a cluster.
///
/// `plan` lists the sessions, `run` works on them or on one shard of them, `gather` puts the
/// results in one table. There is no scheduler here: Slurm, Kubernetes, AWS Batch or GNU parallel
/// starts `run`, once for each shard.
///
/// A result that is there is done. So if a run was interrupted, or a machine was lost, run it
/// again: only what is missing is worked on. Several runs on one folder of results share the work.
/// A session that can't be worked on becomes a row with a code, and the others go on.
///
/// Calibrations of other programs, a folder a camera with its pictures, have no session: for their
/// table, `boresight judge CAMERAS`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

// Lines of at most 80 columns, which no terminal breaks.
const EXAMPLES: &str = "\
Examples:
  What would another limit have given, over all recorded sessions?
    boresight batch plan sessions > manifest.jsonl
    boresight batch run manifest.jsonl --action replay --out hold-longer \\
        --set guidance.hold_secs=0.5
    boresight batch gather hold-longer --changes

  Without a file between:
    boresight batch plan sessions | boresight batch run - --action replay --out OUT

  Eight machines, each with its part:
    boresight batch run manifest.jsonl --action redetect --out OUT --shard 1/8
  In a job array of Slurm or AWS Batch, the shard needs no option. In an indexed
  job of Kubernetes, set BORESIGHT_SHARDS to the number of completions.

  Sessions and results in an S3-compatible object store, in a build with the
  feature `cloud`. The environment has the endpoint and the keys:
  AWS_ENDPOINT_URL, AWS_REGION, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY.
    boresight batch plan s3://fleet/sessions > manifest.jsonl
    boresight batch run manifest.jsonl --action replay --out s3://fleet/replayed

Exit codes of run: 0 if every item has a result, 1 if it was stopped or results
can't be written. Of gather: 0 if every item has a result, 1 if one is missing.";

#[derive(Debug, Subcommand)]
enum Command {
    Plan(plan::Arguments),
    Run(run::Arguments),
    Gather(gather::Arguments),
    #[command(hide = true)]
    Worker(worker::Arguments),
}

impl Arguments {
    /// Runs the command for the `build` of the program, which names results.
    ///
    /// # Errors
    ///
    /// If the manifest, the results or the settings can't be used.
    pub fn run(self, build: &str) -> anyhow::Result<Exit> {
        match self.command {
            Command::Plan(arguments) => arguments.run(),
            Command::Run(arguments) => arguments.run(build),
            Command::Gather(arguments) => arguments.run(),
            Command::Worker(arguments) => arguments.run(),
        }
    }
}
