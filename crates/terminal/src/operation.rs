//! Support for machines running sessions or batches unattended: logs for programs, metrics, and a
//! command at the end.

use std::{
    ffi::OsString,
    io::Write,
    path::{Path, PathBuf},
    process::{Command, ExitStatus, Stdio},
    slice,
    sync::{Arc, Mutex, PoisonError},
    thread::{Builder, JoinHandle},
};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use crate::{announcer, is_json, log, log_as_json, log_to, say};
use boresight_app::{
    Companion, RESULT_FILE, RIG_RESULT, SessionMetrics,
    session::{rig_result::RigEnded, run::Concluded},
    state_topic, verdict_name,
};
use boresight_files::{Links, Overwrite, Scratch, TEXT_LIMIT, may_save, read};
use boresight_guide::session::{Outcome, Session, Snapshot};
use boresight_present::grade::Grade;
use boresight_run::pipeline::{Onlooker, Onlookers};

/// How events are written on stderr.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LogForm {
    /// Sentences for people.
    #[default]
    Text,
    /// A JSON object a line.
    Json,
}

impl LogForm {
    /// Switches stderr to the form.
    pub fn begin(self) {
        if self == Self::Json {
            log_as_json();
        }
    }
}

/// Unattended sessions.
#[derive(Debug, Args)]
#[command(next_help_heading = "Unattended")]
pub struct OperationArguments {
    /// How sentences and events are written on stderr: for people, or a JSON object a line.
    #[arg(long, value_enum, default_value_t, value_name = "FORM", hide_default_value = true)]
    log: LogForm,
    /// Run this command with the shell when a session has its result. BORESIGHT_RESULT is the file,
    /// BORESIGHT_SESSION its folder, BORESIGHT_VERDICT is good, care, unfinished, untrustworthy, or
    /// none without a calibration. If it fails, it's reported; the session's verdict and exit code
    /// stay.
    #[arg(long, value_name = "COMMAND")]
    on_finish: Option<String>,
    /// Write how the session goes to this file for Prometheus' node exporter, every few seconds.
    #[arg(long, value_name = "FILE.prom")]
    metrics: Option<PathBuf>,
    /// Publish the lines of `--log json` on the topic /boresight/state of ROS 2
    /// (std_msgs/msg/String), for other nodes to watch.
    #[arg(long)]
    ros2_state: bool,
}

impl OperationArguments {
    /// Requested output that only a session of one camera has.
    pub fn of_one_camera(&self) -> Option<&'static str> {
        if self.metrics.is_some() {
            Some("--metrics")
        } else {
            self.ros2_state.then_some("--ros2-state")
        }
    }

    /// Starts the requested outputs.
    pub fn start(&self) -> anyhow::Result<Operation> {
        self.log.begin();
        let metrics = match &self.metrics {
            None => None,
            Some(path) => {
                may_save(path, Overwrite::Allowed)?;
                Some(SessionMetrics::start(path, announcer())?)
            }
        };
        if self.ros2_state {
            log_to(Some(state_topic()?));
        }
        let on_finish = self.on_finish.clone().map(OnFinish::new);
        let has_events = self.ros2_state || self.log == LogForm::Json;
        Ok(Operation { has_events, metrics, on_finish })
    }
}

/// Companion for the machine running the sessions. Dropping waits for the commands of
/// `--on-finish`.
#[derive(Default)]
pub struct Operation {
    /// True if a program reads events.
    has_events: bool,
    metrics: Option<SessionMetrics>,
    on_finish: Option<OnFinish>,
}

impl Companion for Operation {
    fn onlookers(&self) -> Onlookers {
        let events = self.has_events.then(|| Arc::new(Events) as Arc<dyn Onlooker>);
        self.metrics.iter().map(SessionMetrics::onlooker).chain(events).collect()
    }

    fn ended(&self, _session: &Session, concluded: &Concluded, _goes_on: bool) {
        if let Some(metrics) = &self.metrics {
            metrics.concluded(&concluded.result);
        }
        self.finish(&concluded.path, RESULT_FILE, verdict_name(&concluded.result));
    }

    /// No grade without a rig.
    fn rig_ended(&self, ended: &RigEnded, folder: &Path) {
        self.finish(folder, RIG_RESULT, ended.grade.map_or("none", Grade::code));
    }
}

impl Operation {
    /// Logs the end, and starts the command of `--on-finish`.
    fn finish(&self, folder: &Path, result: &str, verdict: &'static str) {
        let file = folder.join(result);
        log("end", || json!({ "verdict": verdict, "session": folder, "result": file }));
        if let Some(on_finish) = &self.on_finish {
            on_finish.start(
                vec![
                    ("BORESIGHT_RESULT", file.into()),
                    ("BORESIGHT_SESSION", folder.into()),
                    ("BORESIGHT_VERDICT", verdict.into()),
                ],
                None,
            );
        }
    }
}

impl Drop for Operation {
    /// Delivers the last lines before the program ends.
    fn drop(&mut self) {
        log_to(None);
    }
}

/// Logs changes of the views.
struct Events;

impl Onlooker for Events {
    fn decided(&self, snapshot: &Snapshot) {
        for (event, fields) in events_of(snapshot) {
            log(event, || fields);
        }
    }
}

/// Changes of the views by the newest decision: one event for each, with its fields.
fn events_of(snapshot: &Snapshot) -> Vec<(&'static str, Value)> {
    let (event, views) = match &snapshot.decision.outcome {
        Outcome::Accepted { view, .. } => ("view-taken", slice::from_ref(view)),
        Outcome::Removed { .. } => ("view-removed", snapshot.just_removed.as_slice()),
        Outcome::Restored { view } => ("view-restored", slice::from_ref(view)),
        Outcome::Refused { .. } | Outcome::Noted => return Vec::new(),
    };
    let left = snapshot.views.len();
    views.iter().map(|view| (event, json!({ "view": view.0, "views": left }))).collect()
}

/// The person's own command for the end. Dropping waits for it.
pub struct OnFinish {
    command: String,
    running: Mutex<Vec<JoinHandle<()>>>,
}

impl OnFinish {
    /// Runs `command` with the shell at each start.
    pub fn new(command: String) -> Self {
        Self { command, running: Mutex::default() }
    }

    /// Starts the command with `variables`, and `input` to read from stdin. A failure is reported
    /// and changes nothing else. Its output goes to stderr: at once for people, and as messages at
    /// the end for a reader of JSON lines.
    pub fn start(&self, variables: Vec<(&'static str, OsString)>, input: Option<String>) {
        let mut shell = if cfg!(windows) {
            let mut shell = Command::new("cmd");
            shell.arg("/C");
            shell
        } else {
            let mut shell = Command::new("sh");
            shell.arg("-c");
            shell
        };
        // stdout is for results.
        shell.arg(&self.command).envs(variables).stdin(Stdio::null()).stdout(std::io::stderr());
        let written = match is_json().then(|| Written::by(&mut shell)).transpose() {
            Ok(written) => written,
            Err(err) => {
                say(&format!("The command of --on-finish could not be started ({err})"));
                return;
            }
        };
        let command = self.command.clone();
        let waiting = Builder::new().name("on finish".into()).spawn(move || {
            let ended = match input {
                None => shell.status(),
                Some(text) => run_with(&mut shell, &text),
            };
            if let Some(written) = written {
                written.say();
            }
            let said = match ended {
                Ok(status) if status.success() => return,
                Ok(status) => status.to_string(),
                Err(err) => err.to_string(),
            };
            say(&format!("The command of --on-finish failed ({said}): {command}"));
        });
        match waiting {
            Ok(waiting) => {
                self.running.lock().unwrap_or_else(PoisonError::into_inner).push(waiting);
            }
            Err(err) => say(&format!("The command of --on-finish could not be started ({err})")),
        }
    }
}

/// Runs a command that may read `text` from stdin.
fn run_with(command: &mut Command, text: &str) -> std::io::Result<ExitStatus> {
    let mut running = command.stdin(Stdio::piped()).spawn()?;
    if let Some(mut stdin) = running.stdin.take() {
        // A command that doesn't read it ends as it likes.
        let _ = stdin.write_all(text.as_bytes());
    }
    running.wait()
}

/// Output of a command, in a file: unlike a pipe, it isn't held open by processes left running.
struct Written {
    scratch: Scratch,
}

impl Written {
    const FILE: &str = "written";

    /// Redirects the output of `command`.
    fn by(command: &mut Command) -> anyhow::Result<Self> {
        let scratch = Scratch::new()?;
        let file = scratch.create(Path::new(Self::FILE))?;
        command.stdout(file.try_clone()?).stderr(file);
        Ok(Self { scratch })
    }

    /// Announces each line.
    fn say(&self) {
        match read(&self.scratch.path().join(Self::FILE), TEXT_LIMIT, Links::Refused) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).lines().for_each(say),
            Err(err) => say(&format!("What the command of --on-finish wrote is lost ({err})")),
        }
    }
}

impl Drop for OnFinish {
    fn drop(&mut self) {
        let running = self.running.get_mut().unwrap_or_else(PoisonError::into_inner);
        for waiting in running.drain(..) {
            let _ = waiting.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::frame::ImageSize;
    use boresight_guide::session::{Command, Input, Session, ViewNumber};
    use boresight_run::config::Config;

    #[test]
    fn each_view_that_a_moved_lens_takes_along_has_its_line() {
        let size = ImageSize { width_px: 1280, height_px: 720 };
        let setup = Config::load(None, &[]).expect("settings").session(size).expect("a board");
        let mut session = Session::new(setup);
        let decision = session.handle(&Input::Command(Command::Pause));
        let mut snapshot = session.snapshot(decision);
        assert!(events_of(&snapshot).is_empty());
        snapshot.just_removed = vec![ViewNumber(5), ViewNumber(6), ViewNumber(7)];
        snapshot.decision.outcome = Outcome::Removed { view: ViewNumber(7) };
        let line = |view: u64| ("view-removed", json!({ "view": view, "views": 0 }));
        assert_eq!(events_of(&snapshot), [line(5), line(6), line(7)]);
        snapshot.decision.outcome = Outcome::Restored { view: ViewNumber(7) };
        assert_eq!(events_of(&snapshot), [("view-restored", json!({ "view": 7, "views": 0 }))]);
    }
}
