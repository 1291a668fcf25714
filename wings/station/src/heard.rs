//! Who hears of a camera without looking: a command at each change, and Prometheus.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::{Mutex, PoisonError},
};

use crate::{CameraMetrics, StateLine, WatchedCamera, metrics};
use boresight_app::{Announcer, prometheus::Page};
use boresight_terminal::{announcer, operation::OnFinish};

/// What was told about each camera: its state, and the findings and reasons told since. A reason is
/// told unless the camera is OK or learning.
#[derive(Debug, Default)]
pub(super) struct Told {
    cameras: Mutex<BTreeMap<String, (&'static str, BTreeSet<String>)>>,
}

impl Told {
    /// Notes `line`; true if its state, a finding or a reason is new. A finding that comes and goes
    /// is told once a state.
    pub(super) fn is_new(&self, line: &StateLine) -> bool {
        let mut cameras = self.cameras.lock().unwrap_or_else(PoisonError::into_inner);
        let findings = line.findings.iter().map(|finding| finding.code.to_owned());
        let is_calm = ["OK", "LEARNING"].contains(&line.state);
        let all: BTreeSet<String> =
            findings.chain(line.reason.clone().filter(|_| !is_calm)).collect();
        let told = cameras.get_mut(&line.camera).filter(|(state, _)| *state == line.state);
        let Some((_, told)) = told else {
            cameras.insert(line.camera.clone(), (line.state, all));
            return true;
        };
        let before = told.len();
        told.extend(all);
        told.len() > before
    }
}

/// Starts the command of a change: the state line is on its stdin.
pub(super) fn start(on_finish: &OnFinish, camera: &WatchedCamera, line: &StateLine) {
    on_finish.start(
        vec![
            ("BORESIGHT_CAMERA", line.camera.clone().into()),
            ("BORESIGHT_STATE", line.state.into()),
            ("BORESIGHT_SENTENCE", format!("{} {}", line.sentence, line.action).trim().into()),
            ("BORESIGHT_STORE", camera.folder().into()),
        ],
        serde_json::to_string(line).ok().map(|line| line + "\n"),
    );
}

/// File of `--metrics`: looking at a camera replaces its part.
pub(super) struct Metrics {
    path: PathBuf,
    parts: Mutex<BTreeMap<String, CameraMetrics>>,
}

impl Metrics {
    pub(super) fn new(path: PathBuf) -> Self {
        Self { path, parts: Mutex::default() }
    }

    pub(super) fn note(&self, camera: &WatchedCamera, line: &StateLine) {
        let mut parts = self.parts.lock().unwrap_or_else(PoisonError::into_inner);
        parts.insert(camera.name().to_owned(), CameraMetrics::of(camera, line.clone()));
        drop(parts);
        self.write(&announcer());
    }

    pub(super) fn write(&self, announcer: &Announcer) {
        let parts = self.parts.lock().unwrap_or_else(PoisonError::into_inner);
        let mut page = Page::at(&self.path);
        metrics(&mut page, &parts.values().collect::<Vec<_>>());
        if let Err(err) = page.save(&self.path) {
            announcer.say(&format!("The metrics couldn't be written: {err}"));
        }
    }
}
