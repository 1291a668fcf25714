//! `boresight history`.

use std::{
    cell::Cell,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use serde_json::json;

use super::{
    self as fleet, Added, CameraHistory, HistoryFile, Index, Step, days_ago, histories, name, trend,
};
use boresight_app::{Exit, commands::paths::HISTORY};
use boresight_files::{Overwrite, save};
use boresight_present::text::of_source;
use boresight_station::{
    StateLine, Store, curve, exit, replayed, report::WatchedCurve, stores_below,
};
use boresight_terminal::{print, progress::Progress, say};

/// Keep track of every calibration of every camera: what drifts, what is due.
///
/// Without a subcommand, lists all cameras, or the calibrations of one. The index is one file that
/// follows from the session folders: delete it whenever you like, and add the folders again.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
pub struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// The camera: its name in the list of all cameras, or a part of it that no other has.
    camera: Option<String>,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Args)]
struct Common {
    /// The index.
    #[arg(long, value_name = "FILE", default_value = HISTORY)]
    index: PathBuf,
    /// Print JSON on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight history add sessions
  boresight history
  boresight history usb:046d:0825
  boresight history due --older 180d
  boresight history page --out cameras.html
  boresight history page --out gate.html --watch watch/gate";

#[derive(Debug, Subcommand)]
enum Command {
    /// Add the results of sessions to the index.
    ///
    /// Sessions without a result are left out. One that was added before is read again; one that is
    /// gone or damaged by now leaves the index.
    Add {
        /// Sessions, or folders of sessions.
        #[arg(required = true, value_name = "SESSION|ROOT")]
        roots: Vec<PathBuf>,
        #[command(flatten)]
        common: Common,
    },
    /// List the cameras that have changed, as far as they are watched, and those whose newest
    /// usable calibration is too old.
    Due {
        /// Folders of watched cameras (`boresight watch --store`): those whose lens has changed
        /// come first, then those that have moved. Repeat for several.
        #[arg(long, value_name = "DIR")]
        watch: Vec<PathBuf>,
        /// From this age on, in days.
        #[arg(long, value_name = "DAYS", default_value = "180d", value_parser = days)]
        older: f64,
        #[command(flatten)]
        common: Common,
    },
    /// Write one page with every camera's focal length and principal point over time, and where
    /// watched cameras point.
    Page {
        /// Folders of watched cameras (`boresight watch --store`): where each points over time,
        /// with its daily cycle, what happened, and its calibrations. Repeat for several.
        #[arg(long, value_name = "DIR")]
        watch: Vec<PathBuf>,
        /// File to write (HTML).
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Overwrite an existing file.
        #[arg(long)]
        force: bool,
        /// Age from which on a camera is due, in days.
        #[arg(long, value_name = "DAYS", default_value = "180d", value_parser = days)]
        older: f64,
        #[command(flatten)]
        common: Common,
    },
}

/// A number of days, `180d` or `180`.
fn days(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix('d').unwrap_or(text).trim().parse::<f64>();
    match number {
        Ok(days) if (0.0..=36_500.0).contains(&days) => Ok(days),
        _ => Err("expected a number of days, for example 180d".into()),
    }
}

impl Arguments {
    /// Runs the command.
    ///
    /// # Errors
    ///
    /// If the index or a session can't be used.
    pub fn run(self) -> anyhow::Result<Exit> {
        match self.command {
            None => match &self.camera {
                None => list(&self.common),
                Some(camera) => show(camera, &self.common),
            },
            Some(Command::Add { roots, common }) => add(&roots, &common),
            Some(Command::Due { watch, older, common }) => due(&watch, older, &common),
            Some(Command::Page { watch, out, force, older, common }) => {
                page(&watch, (&out, force), older, &common)
            }
        }
    }
}

impl Common {
    /// Opens the index, which must exist.
    fn open(&self) -> anyhow::Result<Index> {
        if !self.index.is_file() {
            bail!(
                "there is no index {:?}; make one: boresight history add SESSIONS",
                self.index.display()
            );
        }
        Ok(Index::open(&self.index)?)
    }
}

fn add(roots: &[PathBuf], common: &Common) -> anyhow::Result<Exit> {
    let progress = Progress::new("reading results", 0);
    let steps = Cell::new(0);
    let total = Cell::new(0);
    let added = fleet::add(
        &common.index,
        roots,
        |count| total.set(count),
        || {
            steps.set(steps.get() + 1);
            progress.at(steps.get(), total.get());
        },
    )?;
    progress.finish();
    let Added { sessions, added, without, gone, damaged } = added;
    damaged.iter().for_each(|why| say(&format!("Left out: {why}")));
    match gone {
        0 => {}
        1 => say("1 session has left the index: it's gone, or its result can't be read"),
        _ => say(&format!(
            "{gone} sessions have left the index: they're gone, or their result can't be read"
        )),
    }
    let none = if without > 0 { format!("; {without} have no result") } else { String::new() };
    say(&format!("{added} of {sessions} sessions are in {}{none}", common.index.display()));
    Ok(if added > 0 || gone > 0 { Exit::Good } else { Exit::Failed })
}

fn list(common: &Common) -> anyhow::Result<Exit> {
    let all = histories(&common.open()?.all());
    if all.is_empty() {
        say(
            "This index holds no calibration yet. To add those of sessions: boresight history add FOLDER",
        );
    }
    for history in all {
        if common.json {
            print(&serde_json::to_string(&HistoryFile::of(&history, false))?)?;
        } else {
            let count = history.entries.len();
            let newest = history.newest().unwrap_or("never usable");
            print(&format!(
                "{}  {count} calibration{}, newest {newest}: {}",
                name(&history),
                if count == 1 { "" } else { "s" },
                trend(&history)
            ))?;
        }
    }
    Ok(Exit::Good)
}

fn show(camera: &str, common: &Common) -> anyhow::Result<Exit> {
    let index = common.open()?;
    let mut entries = index.of_camera(camera);
    if entries.is_empty() {
        let names = index.cameras_with(camera);
        match names.as_slice() {
            [] => bail!("no camera is called {camera:?}; `boresight history` lists all"),
            [name] => entries = index.of_camera(name),
            several => bail!("{} cameras are called so: {}", several.len(), several.join(", ")),
        }
    }
    for history in histories(&entries) {
        if common.json {
            print(&serde_json::to_string(&HistoryFile::of(&history, true))?)?;
            continue;
        }
        print(&format!("{}: {}", name(&history), trend(&history)))?;
        for Step { entry, since_first, .. } in history.steps() {
            let lens = entry.lens.map_or("no lens".to_owned(), |lens| {
                let sd = lens.covariance_px2.diagonal().map(f64::sqrt);
                let [f, x, y]: [f64; 3] = lens.f_pp_px.into();
                format!(
                    "f {f:.2} ± {:.2} px, pp ({x:.2} ± {:.2}, {y:.2} ± {:.2}) px",
                    sd.x, sd.y, sd.z
                )
            });
            let change = since_first.as_ref().map_or(String::new(), |change| {
                format!(", moved {:.2} px at most: {}", change.shift.px, change.verdict.code())
            });
            print(&format!("  {}  {:13} {lens}{change}", entry.created, entry.verdict))?;
        }
    }
    Ok(Exit::Good)
}

fn due(watched: &[PathBuf], older: f64, common: &Common) -> anyhow::Result<Exit> {
    let mut changed = Vec::new();
    for folder in
        watched.iter().map(|root| stores_below(root)).collect::<Result<Vec<_>, _>>()?.concat()
    {
        let (lens, decisions) = replayed(&folder)?;
        let name = Store::read(&folder)?.map_or(String::new(), |file| file.name);
        let Some((at, decision)) = decisions.last() else { continue };
        let deserved = exit(decision.state);
        if matches!(deserved, Exit::Recalibrate | Exit::Moved) {
            changed.push((
                deserved,
                StateLine::of_decision(&name, &lens, decision, Some(*at), [0, 0]),
            ));
        }
    }
    changed.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.camera.cmp(&b.1.camera)));
    for (_, line) in &changed {
        if common.json {
            let value = json!({ "camera": line.camera, "state": line.state, "since": line.since, "sentence": line.sentence });
            print(&value.to_string())?;
        } else {
            print(&format!(
                "{}  {} since {}: {}",
                line.camera, line.state, line.since, line.sentence
            ))?;
        }
    }
    if !watched.is_empty() {
        say(&match changed.len() {
            0 => "No watched camera has changed".to_owned(),
            1 => "1 watched camera has changed".to_owned(),
            count => format!("{count} watched cameras have changed"),
        });
        if !common.index.is_file() {
            return Ok(Exit::Good);
        }
    }
    let due = common.open()?.due(&days_ago(older)?, &days_ago(0.0)?);
    for (camera, newest) in &due {
        if common.json {
            print(&json!({ "camera": camera, "newest": newest }).to_string())?;
        } else {
            let newest = newest.as_deref().unwrap_or("never usable");
            print(&of_source(camera, &format!("{camera}  {newest}")))?;
        }
    }
    let count = match due.len() {
        0 => "No camera lacks".to_owned(),
        1 => "1 camera lacks".to_owned(),
        count => format!("{count} cameras lack"),
    };
    say(&format!("{count} a usable calibration from the last {older} days"));
    Ok(Exit::Good)
}

fn page(
    watch: &[PathBuf],
    (out, force): (&Path, bool),
    older: f64,
    common: &Common,
) -> anyhow::Result<Exit> {
    let overwrite = if force { Overwrite::Allowed } else { Overwrite::Never };
    boresight_files::may_save(out, overwrite)?;
    // Watched cameras need no index.
    let is_needed = watch.is_empty() || common.index.is_file();
    let all = if is_needed { histories(&common.open()?.all()) } else { Vec::new() };
    let page = fleet::page(&all, watched(watch, &all)?, older)?;
    save(out, page.as_bytes(), overwrite)?;
    say(&format!("Written: {}", out.display()));
    Ok(Exit::Good)
}

/// Watched cameras in the folders, each with the calibrations of the camera.
fn watched(folders: &[PathBuf], all: &[CameraHistory]) -> anyhow::Result<Vec<WatchedCurve>> {
    let mut watched = Vec::new();
    for folder in
        folders.iter().map(|root| stores_below(root)).collect::<Result<Vec<_>, _>>()?.concat()
    {
        let file = Store::read(&folder)?.context("the store has gone")?;
        let reference = Path::new(&file.calibration.path);
        let is_of = |history: &&CameraHistory| {
            history.entries.iter().any(|entry| {
                reference.parent().is_some_and(|session| session.ends_with(&entry.session))
            })
        };
        let entries = all.iter().filter(is_of).flat_map(|history| &history.entries);
        let calibrated: Vec<(f64, String)> = entries
            .filter_map(|entry| {
                let at: jiff::Timestamp = entry.created.parse().ok()?;
                Some((at.as_second() as f64, format!("Calibrated: {}", entry.verdict)))
            })
            .collect();
        watched.push(curve(&folder, &calibrated)?);
    }
    Ok(watched)
}
