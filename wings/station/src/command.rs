//! `boresight watch`.

use std::{
    collections::BTreeSet,
    io::{BufRead, IsTerminal},
    path::{Path, PathBuf},
    time::Duration,
};

use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use serde::Deserialize;
use serde_json::json;

#[cfg(feature = "serve")]
use crate::phone_page::adjust_page;
use crate::{
    self as watch, Feed, Places, Round, StateLine, Store, WatchedCamera,
    heard::{Metrics, Told, start},
    words,
};
use boresight_app::{Exit, commands::paths::WATCH};
use boresight_files::{Links, Overwrite, TEXT_LIMIT, may_save, read_text};
use boresight_run::config::Config;
use boresight_terminal::{
    announcer,
    beside::BesideArguments,
    log,
    operation::{LogForm, OnFinish},
    print, say, stop_flag,
};
use boresight_watch::{Decision, State};

/// Watch an installed camera without a board: has it moved, has its lens changed?
///
/// Compares ordinary pictures of the scene with those of the days after installation, through the
/// calibrated lens. It learns for 20 hours before it says anything (with --pin a minute), and for
/// three days until it's surest. Everything is stored in --store; the same command goes on where it
/// stopped.
///
/// States: LEARNING, OK, MOVED (it points elsewhere; the lens calibration stays valid), ZOOM and
/// LENS (calibrate again), CANNOT-TELL, each with the smallest change that would be seen.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
pub struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// Pictures: a folder, files, a camera, a stream, or a video. The times of files are read from
    /// their names, such as 2026-03-12T14_05_00.jpg in UTC, or else are those of the files.
    #[arg(value_name = "SOURCE")]
    source: Vec<String>,
    /// The camera's calibration: a session's folder, or a file that `check --against` reads. Needed
    /// the first time.
    #[arg(long, value_name = "SESSION|FILE")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    place: Place,
    /// The camera's name in messages [default: that of the folder of --store].
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Time between two looks: 90s, 15m, 6h.
    #[arg(long, value_name = "TIME", default_value = "15m", value_parser = duration)]
    every: Duration,
    /// Look at what is there, print the state, and end with its exit code: for cron and tests.
    #[arg(long)]
    once: bool,
    /// Compare the camera with its first six pictures, taken within a minute, until it's learned:
    /// the limits are wide at first, and said.
    #[arg(long, conflicts_with = "presets")]
    pin: bool,
    /// Look now, at a few pictures, and end within seconds with the exit code: 0, 5 or 6. Needs a
    /// camera that was pinned or learned. Nothing is recorded, and another boresight may watch it.
    #[arg(long, conflicts_with_all = ["once", "pin", "list", "presets", "reference", "patches_only"])]
    check: bool,
    /// Keep what is whole of a damaged store, and tell what isn't.
    #[arg(long, conflicts_with_all = ["source", "list"])]
    recover: bool,
    /// Watch the cameras of this list (TOML): a [[camera]] each, with name, source, reference, and
    /// if you like every, presets and patches_only. Each has a folder of its name in --store. One
    /// that can't be opened fails the command, but stops none of the others.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["source", "reference", "name", "presets", "patches_only"])]
    list: Option<PathBuf>,
    /// The camera turns between up to N presets. Watch tells them apart by their pictures and
    /// watches each separately, in its own folder below --store.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=64))]
    presets: Option<u8>,
    /// Store patches of the scene only and no picture: for sites with people. Learning starts over
    /// if the program is stopped meanwhile.
    #[arg(long)]
    patches_only: bool,
    /// Write the states to this file for Prometheus' node exporter.
    #[arg(long, value_name = "FILE.prom")]
    metrics: Option<PathBuf>,
    /// Run this command with the shell when a camera's state changes or has a new finding or
    /// reason, and with --once at the end. BORESIGHT_CAMERA is its name, BORESIGHT_STATE the state,
    /// BORESIGHT_SENTENCE what is said, BORESIGHT_STORE its folder. On its stdin is the line of
    /// --json, for `curl --data-binary @- URL` or `mosquitto_pub -l -t TOPIC`.
    #[arg(long, value_name = "COMMAND")]
    on_finish: Option<String>,
    /// Print a JSON object on stdout for each picture, or with --once for each camera.
    #[arg(long)]
    json: bool,
    /// How sentences and events are written on stderr: for people, or a JSON object a line.
    #[arg(long, value_enum, default_value_t, value_name = "FORM", hide_default_value = true)]
    log: LogForm,
}

#[derive(Debug, Args)]
struct Place {
    /// Folder in which the camera is kept.
    #[arg(long, value_name = "DIR", default_value = WATCH)]
    store: PathBuf,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Help to push a camera back: says live what to do, roll first, until it's tight and points
    /// where it should.
    ///
    /// The camera is compared with where it stood at this hour of the day. A window, and with
    /// --serve a phone's page, shows the live picture with the edges of the scene where they should
    /// be, an arrow, a number and a sentence, and sounds a tone that rises as the camera comes
    /// nearer. Nothing is recorded.
    Adjust {
        /// The camera or stream.
        #[arg(required = true, value_name = "SOURCE")]
        source: Vec<String>,
        #[command(flatten)]
        place: Place,
        /// Say it in the terminal instead of a window.
        #[arg(long)]
        headless: bool,
        /// Print a JSON object on stdout for each picture; there's no window then.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        beside: BesideArguments,
    },
    /// Say that the camera stays as it is: it's learned again, and the reason is kept.
    Accept {
        #[command(flatten)]
        place: Place,
        /// The reason [default: asked for].
        #[arg(long, value_name = "TEXT")]
        reason: Option<String>,
    },
    /// Print every change of state again, from the recorded inputs alone.
    Replay {
        #[command(flatten)]
        place: Place,
        /// Print every decision as a JSON object, not only changes.
        #[arg(long)]
        json: bool,
    },
    /// Print the newest state of the camera, or of every camera in a folder.
    State {
        #[command(flatten)]
        place: Place,
        /// Print JSON on stdout.
        #[arg(long)]
        json: bool,
    },
}

const EXAMPLES: &str = "\
Examples:
  boresight watch rtsp://192.168.1.20/stream --reference sessions/gate --store watch/gate
  boresight watch /var/ftp/cam7 --reference cam7.yaml --store watch/cam7 --every 10m
  boresight watch pictures/*.jpg --reference calibration.json --once
  boresight watch /dev/video0 --reference arm.json --store watch/arm --pin --once
  boresight watch /dev/video0 --store watch/arm --check
  boresight watch --list cameras.toml --store watch --metrics /var/lib/node_exporter/watch.prom
  boresight watch adjust rtsp://192.168.1.20/stream --store watch/gate --serve
  boresight watch accept --store watch/gate --reason \"moved to the new pole\"";

/// The list of cameras.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    camera: Vec<Listed>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Listed {
    name: String,
    source: String,
    reference: Option<PathBuf>,
    every: Option<String>,
    presets: Option<u8>,
    #[serde(default)]
    patches_only: bool,
}

/// A time such as `90s`, `15m`, `6h`, `1d`.
fn duration(text: &str) -> Result<Duration, String> {
    let (number, unit) =
        text.split_at(text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len()));
    let secs = match unit {
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        "d" => 86_400.0,
        _ => return Err("expected a time, for example 15m".into()),
    };
    match number.trim().parse::<f64>() {
        Ok(value) if (1.0..=2.6e6).contains(&(value * secs)) => {
            Ok(Duration::from_secs_f64(value * secs))
        }
        _ => Err("expected a time from 1s to 30d, for example 15m".into()),
    }
}

impl Arguments {
    /// Runs the command.
    ///
    /// # Errors
    ///
    /// If a store, a list or a source can't be used.
    pub fn run(self) -> anyhow::Result<Exit> {
        match &self.command {
            Some(Command::Adjust { source, place, headless, json, beside }) => {
                adjust(&place.store, source, (*headless, *json), beside)
            }
            Some(Command::Accept { place, reason }) => accept(&place.store, reason.as_deref()),
            Some(Command::Replay { place, json }) => replay(&place.store, *json),
            Some(Command::State { place, json }) => state(&place.store, *json),
            None if self.recover => recover(&self.place.store),
            None => self.watch(),
        }
    }

    fn watch(&self) -> anyhow::Result<Exit> {
        self.log.begin();
        let is_once = self.once || self.check;
        if let Some(path) = &self.metrics {
            may_save(path, Overwrite::Allowed)?;
        }
        let (rounds, listed) = self.rounds()?;
        let stop = stop_flag()?;
        let on_finish = self.on_finish.clone().map(OnFinish::new);
        let metrics = self.metrics.as_ref().map(|path| Metrics::new(path.clone()));
        let told = Told::default();
        for camera in rounds.iter().flat_map(|round| round.places.cameras()) {
            told.is_new(&StateLine::heard(camera));
        }
        let hear = |camera: &WatchedCamera, _: &Decision| {
            let line = StateLine::heard(camera);
            if let Some(metrics) = &metrics {
                metrics.note(camera, &line);
            }
            if self.json && !is_once {
                // A closed reader ends nothing.
                let _ = serde_json::to_string(&line).map(|line| print(&line));
            }
            if !told.is_new(&line) {
                return;
            }
            log("state", || json!(line));
            say(&format!(
                "{}  {}: {}. {} {}",
                line.at, line.camera, line.state, line.sentence, line.action
            ));
            if !is_once && let Some(on_finish) = &on_finish {
                start(on_finish, camera, &line);
            }
        };
        let left = watch::run(rounds, is_once, &stop, &hear, &announcer())?;
        if let Some(metrics) = &metrics {
            metrics.write(&announcer());
        }
        if left.is_empty() {
            return Ok(Exit::Failed);
        }
        let cameras = || left.iter().flat_map(|round| round.places.cameras());
        for camera in cameras() {
            let line = StateLine::asked(camera);
            if is_once && let Some(metrics) = &metrics {
                metrics.note(camera, &line);
            }
            if self.json && is_once {
                print(&serde_json::to_string(&line)?)?;
            } else if is_once {
                for line in watch::lines(camera) {
                    print(&line)?;
                }
            }
            if is_once && let Some(on_finish) = &on_finish {
                start(on_finish, camera, &line);
            }
        }
        if left.len() < listed {
            return Ok(Exit::Failed);
        }
        if cameras().next().is_none() {
            say("No preset has been seen twice yet: its second picture begins its learning.");
            return Ok(Exit::NotTrustworthy);
        }
        Ok(watch::worst(cameras().map(|camera| camera.watch().asked().state)))
    }

    /// Opens the cameras, each with pictures and interval, and returns the intended number: a
    /// failing camera of a list stops none of the others.
    fn rounds(&self) -> anyhow::Result<(Vec<Round>, usize)> {
        let config = Config::load(None, &[])?;
        let Some(list) = &self.list else {
            let folder = &self.place.store;
            let is_known = watch::stores_below(folder).is_ok();
            let parse = if is_known { Feed::parse_or_away } else { Feed::parse };
            let feed = parse(&self.source, &config, &announcer())?;
            let usual =
                folder.file_name().map_or("camera".into(), |n| n.to_string_lossy().into_owned());
            let name = self.name.clone().unwrap_or(usual);
            if self.check {
                let camera = WatchedCamera::ask(folder, watch::times::now_secs())?;
                let places = Places::one(camera);
                return Ok((
                    vec![Round { name, places, feed, every: self.every, is_frozen: false }],
                    1,
                ));
            }
            let known = (self.reference.as_deref(), self.patches_only, self.presets);
            let round = open(folder, &name, known, feed, (self.every, self.pin))?;
            return Ok((vec![round], 1));
        };
        let text = read_text(list, TEXT_LIMIT, Links::Followed)?;
        let cameras: List =
            toml::from_str(&text).with_context(|| format!("could not read {list:?}"))?;
        if cameras.camera.is_empty() {
            bail!("{list:?} lists no [[camera]]");
        }
        let mut planned = Vec::new();
        let mut names = BTreeSet::new();
        for camera in cameras.camera {
            let is_plain = !camera.name.is_empty()
                && !camera.name.contains(['/', '\\'])
                && !camera.name.starts_with('.');
            if !is_plain || !names.insert(camera.name.clone()) {
                bail!(
                    "{list:?}: {:?} can't be the name of a folder, or is there twice",
                    camera.name
                );
            }
            let every = match &camera.every {
                None => self.every,
                Some(text) => duration(text)
                    .map_err(|err| anyhow::anyhow!("{list:?}: {}: {err}", camera.name))?,
            };
            let source = std::slice::from_ref(&camera.source);
            let feed = Feed::parse_or_away(source, &config, &announcer())
                .with_context(|| format!("{list:?}: {}", camera.name))?;
            planned.push((camera, feed, every));
        }
        let listed = planned.len();
        let mut rounds = Vec::new();
        for (camera, feed, every) in planned {
            let folder = self.place.store.join(&camera.name);
            let known = (camera.reference.as_deref(), camera.patches_only, camera.presets);
            match open(&folder, &camera.name, known, feed, (every, self.pin)) {
                Ok(round) => rounds.push(round),
                Err(err) => watch::say_left_out(&camera.name, &err, &announcer()),
            }
        }
        Ok((rounds, listed))
    }
}

fn open(
    folder: &Path,
    name: &str,
    (reference, patches_only, presets): (Option<&Path>, bool, Option<u8>),
    feed: Feed,
    (every, pin): (Duration, bool),
) -> anyhow::Result<Round> {
    let say_cut =
        |name: &str| say(&format!("{name}: the newest line was cut by a crash and is left out."));
    let own = (feed.own_lens(), patches_only);
    let places = if let Some(most) = presets {
        Places::presets((folder, name), reference, own, usize::from(most), say_cut)?
    } else {
        let (mut camera, was_cut) = WatchedCamera::open(folder, name, reference, own)?;
        if pin {
            camera.pin();
        }
        if was_cut {
            say_cut(name);
        }
        Places::one(camera)
    };
    Ok(Round { name: name.into(), places, feed, every, is_frozen: false })
}

fn adjust(
    folder: &Path,
    source: &[String],
    (headless, json): (bool, bool),
    beside: &BesideArguments,
) -> anyhow::Result<Exit> {
    let feed = Feed::parse(source, &Config::load(None, &[])?, &announcer())?;
    let camera = WatchedCamera::look_at(folder)?;
    if !camera.station().is_learned {
        say("The camera is still being learned: the way back is as good as the pictures so far.");
    }
    let (stop, voice) = (stop_flag()?, beside.voice()?);
    #[cfg(feature = "serve")]
    let phone = beside.phone()?;
    let mut said = words::Cue { arrow: "", number: String::new(), sentence: String::new() };
    let mut hear = |step: &watch::Step<'_>| {
        #[cfg(feature = "serve")]
        if let Some(phone) = &phone {
            phone.adjusting(step.frame, adjust_page(step, camera.lens()));
        }
        if let Some(voice) = &voice {
            watch::say_aloud(voice, &step.advice);
        }
        // Programs get the side as seen from behind the camera.
        let faces = !json && beside.faces();
        let advice = if faces { words::facing(&step.advice) } else { step.advice };
        let cue = watch::with_scale(camera.lens(), |scale| words::cue(&advice, scale));
        if json {
            let line = json!({
                "arrow": cue.arrow, "number": cue.number, "sentence": cue.sentence, "closeness": step.closeness,
            });
            // A closed reader ends nothing.
            let _ = print(&line.to_string());
        } else if cue != said {
            say(&format!("{}  {:>8}  {}", cue.arrow, cue.number, cue.sentence));
            said = cue;
        }
    };
    #[cfg(feature = "window")]
    if !headless && !json && boresight_app::window::desktop::has_display() {
        let faces = beside.speaks() && beside.faces();
        let is_right = crate::window_page::adjust((&camera, &feed), faces, &stop, &mut hear)?;
        return Ok(if is_right { Exit::Good } else { Exit::Moved });
    }
    #[cfg(not(feature = "window"))]
    let _ = headless;
    let is_right = watch::adjust(&camera, &feed, &stop, &mut hear)?;
    #[cfg(feature = "serve")]
    if let Some(phone) = &phone {
        phone.linger(&stop, words::LINGERING, &announcer());
    }
    Ok(if is_right { Exit::Good } else { Exit::Moved })
}

fn accept(folder: &Path, reason: Option<&str>) -> anyhow::Result<Exit> {
    let Some(file) = Store::read(folder)? else {
        bail!("there is no watched camera in {folder:?}: name its folder with --store");
    };
    let reason = match reason {
        Some(reason) => reason.to_owned(),
        None if std::io::stdin().is_terminal() => {
            say(words::WHY);
            let mut line = String::new();
            std::io::stdin().lock().read_line(&mut line).context("could not read the reason")?;
            line
        }
        None => bail!("say why with --reason: it's kept beside the camera's states"),
    };
    let reason = reason.trim();
    if reason.is_empty() {
        bail!("without a reason, nothing is accepted");
    }
    watch::accept(folder, watch::times::now_secs(), reason)?;
    say(&words::accepted(&file.name));
    Ok(Exit::Good)
}

fn recover(folder: &Path) -> anyhow::Result<Exit> {
    for folder in watch::stores_below(folder)? {
        let found = watch::recover(&folder, watch::times::now_secs())?;
        say(&words::recovered(&folder, &found));
    }
    Ok(Exit::Good)
}

fn replay(folder: &Path, json: bool) -> anyhow::Result<Exit> {
    let name = Store::read(folder)?.map_or(String::new(), |file| file.name);
    let (lens, decisions) = watch::replayed(folder)?;
    let mut before: Option<State> = None;
    for (at, decision) in &decisions {
        let line = || StateLine::of_decision(&name, &lens, decision, Some(*at), [0, 0]);
        if json {
            print(&serde_json::to_string(&line())?)?;
        } else if before.is_none_or(|before| before.code() != decision.state.code()) {
            let line = line();
            let said = format!("{}  {}. {} {}", line.at, line.state, line.sentence, line.action);
            print(said.trim_end())?;
        }
        before = Some(decision.state);
    }
    Ok(watch::worst(before))
}

fn state(folder: &Path, json: bool) -> anyhow::Result<Exit> {
    let folders = watch::stores_below(folder)?;
    let mut states = Vec::new();
    for folder in &folders {
        let camera = WatchedCamera::look_at(folder)?;
        if json {
            print(&serde_json::to_string(&StateLine::asked(&camera))?)?;
        } else {
            for line in watch::lines(&camera) {
                print(&line)?;
            }
        }
        states.push(camera.watch().asked().state);
    }
    Ok(watch::worst(states))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_have_units() {
        assert_eq!(duration("15m"), Ok(Duration::from_secs(900)));
        assert_eq!(duration("90"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("6h"), Ok(Duration::from_secs(21_600)));
        for wrong in ["", "m", "0s", "-3m", "15 weeks", "40d", "NaNs"] {
            assert!(duration(wrong).is_err(), "{wrong}");
        }
    }
}
