//! Progress of a guided session, as a text file for Prometheus' node exporter.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread::{Builder, JoinHandle},
    time::Duration,
};

use crossbeam_channel::{RecvTimeoutError, Sender, bounded};

use crate::{Announcer, prometheus::Page};
use boresight_formats::CalibrationFile;
use boresight_geometry::{LensParameter, LensParts};
use boresight_guide::{
    guidance::Progress,
    session::{Snapshot, Stream},
};
use boresight_present::grade::Grade;
use boresight_run::pipeline::{CommandLink, Onlooker};

/// Time between two writings of the file.
const BETWEEN: Duration = Duration::from_secs(5);

/// Writes a file of metrics while sessions run, every few seconds and at the end.
pub struct SessionMetrics {
    watched: Arc<Watched>,
    over: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// Observations of the session so far.
#[derive(Default)]
struct Watched(Mutex<State>);

#[derive(Clone, Debug, Default, PartialEq)]
struct State {
    sessions: u64,
    pictures: u64,
    with_board: u64,
    views: usize,
    views_to_go: Option<usize>,
    complete: bool,
    camera_lost: bool,
    camera_losses: u32,
    dropped: u64,
    damaged: u64,
    lens: Option<Lens>,
    verdict: Option<&'static str>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Lens {
    f_px: f64,
    f_sd_px: f64,
    projection_sd_px: f64,
    rms_px: f64,
}

impl SessionMetrics {
    /// Starts to write the file at `path`; announces the first failure to `announcer`.
    ///
    /// # Errors
    ///
    /// If the system refuses a thread.
    pub fn start(path: &Path, announcer: Announcer) -> std::io::Result<Self> {
        let watched = Arc::new(Watched::default());
        let (over, wait) = bounded::<()>(0);
        let (own, path) = (Arc::clone(&watched), path.to_path_buf());
        let thread = Builder::new().name("metrics".into()).spawn(move || {
            let mut writer = Writer { path, announcer, has_failed: false };
            writer.write(&own);
            while wait.recv_timeout(BETWEEN) == Err(RecvTimeoutError::Timeout) {
                writer.write(&own);
            }
            writer.write(&own);
        })?;
        Ok(Self { watched, over: Some(over), thread: Some(thread) })
    }

    /// Onlooker for a session.
    pub fn onlooker(&self) -> Arc<dyn Onlooker> {
        Arc::clone(&self.watched) as Arc<dyn Onlooker>
    }

    /// Notes the result at the end of the session.
    pub fn concluded(&self, result: &CalibrationFile) {
        self.watched.state().verdict = Some(verdict_name(result));
    }
}

impl Drop for SessionMetrics {
    fn drop(&mut self) {
        self.over = None;
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

/// The verdict on a session's result, for programs: `good`, `care`, `unfinished`, `untrustworthy`,
/// or `none` without a calibration.
pub fn verdict_name(result: &CalibrationFile) -> &'static str {
    let has_verdict = result.result.is_some() && result.known_verdict().is_some();
    if has_verdict { Grade::of_file(result).code() } else { "none" }
}

impl Watched {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Onlooker for Watched {
    fn began(&self, _: CommandLink) {
        let mut state = self.state();
        *state = State { sessions: state.sessions + 1, ..State::default() };
    }

    fn decided(&self, snapshot: &Snapshot) {
        self.state().see(snapshot);
    }
}

impl State {
    fn see(&mut self, snapshot: &Snapshot) {
        if snapshot.decision.frame.is_some() {
            self.pictures += 1;
            let found = snapshot.live.as_ref().is_some_and(|live| live.corners_px.is_ok());
            self.with_board += u64::from(found);
        }
        self.views = snapshot.views.len();
        self.views_to_go = snapshot.views_to_go;
        self.complete = snapshot.decision.progress == Progress::Complete;
        let camera = &snapshot.camera;
        self.camera_lost = matches!(camera.stream, Stream::Lost { .. });
        self.camera_losses = camera.losses;
        self.dropped = camera.dropped;
        self.damaged = camera.rejected;
        self.lens = snapshot.calibration.as_ref().map(|calibration| Lens {
            f_px: calibration.camera.f_px.x,
            f_sd_px: calibration.covariance.variance_of(LensParameter::Fx).max(0.0).sqrt(),
            projection_sd_px: calibration.projection_sd.mean_px,
            rms_px: calibration.rms_px,
        });
    }

    fn page(&self, path: &Path, now_secs: i64) -> Page {
        let mut page = Page::at(path);
        let mut one = |name: &str, help: &str, value: f64| {
            page.add_one(&format!("boresight_session_{name}"), help, value);
        };
        let flag = |is: bool| f64::from(u8::from(is));
        one("number", "Number of the session since the program started.", self.sessions as f64);
        one("pictures_total", "Pictures judged.", self.pictures as f64);
        one("pictures_with_board_total", "Pictures with the board.", self.with_board as f64);
        one("views", "Views taken.", self.views as f64);
        if let Some(views) = self.views_to_go {
            one("views_to_go", "Forecast of the views still to take.", views as f64);
        }
        one("complete", "Whether the plan is complete.", flag(self.complete));
        one("camera_lost", "Whether the camera is gone at the moment.", flag(self.camera_lost));
        one("camera_losses_total", "How often the camera was lost.", f64::from(self.camera_losses));
        one(
            "pictures_dropped_total",
            "Pictures skipped by driver or program.",
            self.dropped as f64,
        );
        one("pictures_damaged_total", "Damaged pictures, left out.", self.damaged as f64);
        if let Some(lens) = self.lens {
            one("focal_length_pixels", "Focal length so far.", lens.f_px);
            one("focal_length_sd_pixels", "Its standard deviation.", lens.f_sd_px);
            one(
                "projection_sd_pixels",
                "Uncertainty of a point, on average.",
                lens.projection_sd_px,
            );
            one("rms_pixels", "Root mean square of the residuals.", lens.rms_px);
        }
        one("updated_timestamp_seconds", "When this file was written.", now_secs as f64);
        if let Some(verdict) = self.verdict {
            page.add(
                "boresight_session_verdict",
                "1 for the verdict on the ended session.",
                [(&[("verdict", verdict)][..], 1.0)],
            );
        }
        page
    }
}

struct Writer {
    path: PathBuf,
    announcer: Announcer,
    has_failed: bool,
}

impl Writer {
    /// Writes the metrics. A failure doesn't stop the session.
    fn write(&mut self, watched: &Watched) {
        let state = watched.state().clone();
        let written = state.page(&self.path, jiff::Timestamp::now().as_second()).save(&self.path);
        if let Err(err) = &written
            && !self.has_failed
        {
            self.announcer.say(&format!("{err}"));
        }
        self.has_failed = written.is_err();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prometheus::assert_whole;

    #[test]
    fn what_is_unknown_is_left_out() {
        let mut state = State { sessions: 1, pictures: 12, with_board: 7, ..State::default() };
        let text = state.page(Path::new("cell-7.prom"), 1_700_000_000).text().to_owned();
        assert_whole(&text);
        let own = "{file=\"cell-7\"}";
        assert!(text.contains(&format!("boresight_session_pictures_total{own} 12\n")), "{text}");
        assert!(
            !text.contains("views_to_go") && !text.contains("focal") && !text.contains("verdict")
        );
        state.views_to_go = Some(3);
        state.verdict = Some("good");
        state.lens = Some(Lens { f_px: 980.5, f_sd_px: 0.1, projection_sd_px: 0.2, rms_px: 0.05 });
        let text = state.page(Path::new("cell-7.prom"), 1_700_000_000).text().to_owned();
        assert_whole(&text);
        assert!(text.contains("boresight_session_verdict{file=\"cell-7\",verdict=\"good\"} 1\n"));
        assert!(text.contains(&format!("boresight_session_focal_length_pixels{own} 980.5\n")));
    }
}
