//! Host of sessions, the same for window, terminal, phone and unattended machines.

use std::{
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use crate::{
    Announcer, Opening,
    session::{
        camera_announcer::CameraAnnouncer,
        rig_result::RigEnded,
        rig_run::{RigHand, RigNews, RigRun},
        run::{Concluded, FinishedRun, Run, RunContext, announcing},
    },
};
use boresight_geometry::device::Adjustable;
use boresight_guide::{
    guidance::Progress,
    session::{Session, Snapshot},
};
use boresight_run::pipeline::{LiveFeed, Onlooker, Onlookers, Pipeline, SOURCE_PATIENCE};

/// Companion of a host's sessions, such as a phone's page, a voice, or a machine's log.
///
/// Methods for sessions of several cameras begin with `rig_`.
pub trait Companion: Send + Sync {
    /// Onlookers for each session of one camera.
    fn onlookers(&self) -> Onlookers {
        Onlookers::new()
    }

    /// A session is being opened.
    fn opening(&self) {}

    /// A session is open, and not started yet.
    fn opens(&self, run: &Run) {
        let _ = run;
    }

    /// A session has ended; its result is being computed.
    fn ending(&self) {}

    /// The result of `session` is stored. `goes_on` unless the whole program ends.
    fn ended(&self, session: &Session, concluded: &Concluded, goes_on: bool) {
        let _ = (session, concluded, goes_on);
    }

    /// A rig's session is open, and not started yet.
    fn rig_opens(&self, run: &RigRun) {
        let _ = run;
    }

    /// State of the rig's session with the cameras `names`, which `hand` commands.
    fn rig_news(&self, news: &RigNews<'_>, names: &[String], hand: &RigHand) {
        let _ = (news, names, hand);
    }

    /// New request to the person with the board before a rig.
    fn rig_asks(&self, sentence: &str) {
        let _ = sentence;
    }

    /// The result of the rig's session is stored in `folder`.
    fn rig_ended(&self, ended: &RigEnded, folder: &Path) {
        let _ = (ended, folder);
    }
}

/// Opens, runs and concludes sessions before companions.
#[derive(Clone)]
pub struct Host {
    announcer: Announcer,
    stop: Arc<AtomicBool>,
    companions: Vec<Arc<dyn Companion>>,
    is_paced: bool,
}

/// Session whose threads run.
pub struct Started {
    /// Threads of the session.
    pub pipeline: Pipeline,
    /// Feed of the session's snapshots and pictures.
    pub feed: LiveFeed,
    /// Adjustable controls of the camera.
    pub adjustables: Vec<Adjustable>,
    /// State needed once the threads have ended.
    pub context: RunContext,
}

impl Host {
    /// Host without companions. `stop` ends each session, and the whole program.
    pub fn new(announcer: Announcer, stop: Arc<AtomicBool>) -> Self {
        Self { announcer, stop, companions: Vec::new(), is_paced: false }
    }

    /// Host without companions or sentences.
    pub fn silent() -> Self {
        Self::new(Announcer::silent(), Arc::default())
    }

    /// Adds a companion.
    #[must_use]
    pub fn beside(mut self, companion: Arc<dyn Companion>) -> Self {
        self.companions.push(companion);
        self
    }

    /// Adds an onlooker.
    #[must_use]
    pub fn watched_by(self, onlooker: Arc<dyn Onlooker>) -> Self {
        self.beside(Arc::new(Watching(onlooker)))
    }

    /// With `is_paced`, simulated and recorded sources run in real time, as a person needs;
    /// without, as fast as the machine can.
    #[must_use]
    pub fn paced(self, is_paced: bool) -> Self {
        Self { is_paced, ..self }
    }

    /// Copy with `announcer`.
    #[must_use]
    pub fn announced_by(&self, announcer: Announcer) -> Self {
        Self { announcer, ..self.clone() }
    }

    /// Receiver of the sentences.
    pub fn announcer(&self) -> &Announcer {
        &self.announcer
    }

    /// Set once the whole program ends.
    pub fn stop(&self) -> &AtomicBool {
        &self.stop
    }

    /// True if the whole program ends.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Opens, runs and concludes a session.
    ///
    /// # Errors
    ///
    /// As [`Self::open`], [`Self::finish`] and [`FinishedRun::conclude`].
    pub fn session(&self, opening: &Opening) -> anyhow::Result<Concluded> {
        let run = self.open(opening)?;
        self.conclude(self.finish(run))
    }

    /// Opens a session.
    ///
    /// # Errors
    ///
    /// As [`Opening::open`].
    pub fn open(&self, opening: &Opening) -> anyhow::Result<Run> {
        self.companions.iter().for_each(|companion| companion.opening());
        let run = opening.open(&self.announcer)?;
        self.companions.iter().for_each(|companion| companion.opens(&run));
        Ok(run)
    }

    /// Runs until the plan is complete, the source ends, or a companion or the program's stop ends
    /// the session.
    ///
    /// # Errors
    ///
    /// [`boresight_run::pipeline::PipelineError`]; every announced view is on disk.
    pub fn finish(&self, run: Run) -> anyhow::Result<FinishedRun> {
        let onlookers = self.onlookers();
        let Started { pipeline, feed, context, .. } = self.started(run, &onlookers, || ())?;
        let snapshots = feed.into_snapshots();
        let mut camera = CameraAnnouncer::new(&self.announcer);
        // The link also closes when the session thread ends, for example because the disk is full.
        // A lost camera sends no snapshots, but the stop must be noticed nevertheless.
        while let Ok(snapshot) = snapshots.recv_within(SOURCE_PATIENCE) {
            let has_ended = snapshot.as_ref().is_some_and(has_ended);
            if let Some(snapshot) = snapshot {
                camera.announce(&snapshot.camera);
            }
            let is_asked = onlookers.iter().any(|onlooker| onlooker.wants_end());
            if self.is_stopped() || has_ended || is_asked {
                break;
            }
        }
        context.finished(pipeline.stop())
    }

    /// Starts the threads of a session; [`RunContext::finished`] and [`Self::conclude`] end it.
    /// `wake` is called after all news.
    ///
    /// # Errors
    ///
    /// If a resumed session's journal can't be written, or the system refuses a thread.
    pub fn start(
        &self,
        run: Run,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> anyhow::Result<Started> {
        self.started(run, &self.onlookers(), wake)
    }

    fn started(
        &self,
        run: Run,
        onlookers: &Onlookers,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> anyhow::Result<Started> {
        let run = if self.is_paced { run.paced() } else { run };
        let (mut setup, context) = run.setup(&self.announcer)?;
        let adjustables = setup.source.adjustables();
        setup.onlookers.clone_from(onlookers);
        let (pipeline, feed) = Pipeline::start(setup, wake)?;
        Ok(Started { pipeline, feed, adjustables, context })
    }

    /// Stores the result of a finished session, and tells everybody.
    ///
    /// # Errors
    ///
    /// The session's own, or as [`FinishedRun::conclude`].
    pub fn conclude(&self, finished: anyhow::Result<FinishedRun>) -> anyhow::Result<Concluded> {
        self.companions.iter().for_each(|companion| companion.ending());
        let finished = finished?;
        let session = finished.session.clone();
        let concluded = finished.conclude(&self.announcer)?;
        let goes_on = !self.is_stopped();
        self.companions.iter().for_each(|it| it.ended(&session, &concluded, goes_on));
        Ok(concluded)
    }

    /// Companions of each session.
    pub(super) fn companions(&self) -> &[Arc<dyn Companion>] {
        &self.companions
    }

    fn onlookers(&self) -> Onlookers {
        let all = self.companions.iter().flat_map(|companion| companion.onlookers());
        all.chain([announcing(&self.announcer)]).collect()
    }
}

/// Companion that only looks on.
struct Watching(Arc<dyn Onlooker>);

impl Companion for Watching {
    fn onlookers(&self) -> Onlookers {
        vec![Arc::clone(&self.0)]
    }
}

fn has_ended(snapshot: &Snapshot) -> bool {
    snapshot.decision.progress != Progress::Collecting
        || snapshot.source_ended
        || !snapshot.failures.is_empty()
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use boresight_run::config::Config;

    #[derive(Default)]
    struct Diary(Mutex<Vec<&'static str>>);

    impl Diary {
        fn note(&self, event: &'static str) {
            self.0.lock().expect("not poisoned").push(event);
        }
    }

    impl Companion for Diary {
        fn opening(&self) {
            self.note("opening");
        }

        fn opens(&self, _run: &Run) {
            self.note("open");
        }

        fn ending(&self) {
            self.note("ending");
        }

        fn ended(&self, _session: &Session, concluded: &Concluded, goes_on: bool) {
            assert!(concluded.path.join(crate::RESULT_FILE).is_file(), "it's stored");
            self.note(if goes_on { "ended" } else { "the last ended" });
        }
    }

    struct Impatient;

    impl Onlooker for Impatient {
        fn wants_end(&self) -> bool {
            true
        }
    }

    #[test]
    fn a_companion_learns_of_each_step_of_a_session_once() {
        let place = tempfile::tempdir().expect("a folder");
        let config = Config::load(None, &[]).expect("settings");
        let opening = |name: &str| Opening {
            out: Some(place.path().join(name)),
            max_frames: Some(3),
            ..Opening::new("sim", config.clone())
        };
        let (diary, stop) = (Arc::new(Diary::default()), Arc::new(AtomicBool::new(false)));
        let host = Host::new(Announcer::silent(), Arc::clone(&stop)).beside(diary.clone());
        host.session(&opening("one")).expect("it runs");
        stop.store(true, Ordering::Relaxed);
        host.session(&opening("two")).expect("it ends");
        let nowhere = Opening { source: "no-such-source".into(), ..opening("three") };
        assert!(host.session(&nowhere).is_err());
        let told = diary.0.lock().expect("not poisoned").clone();
        let begins = ["opening", "open", "ending"];
        let all = [&begins[..], &["ended"], &begins, &["the last ended"], &["opening"]].concat();
        assert_eq!(told, all);
    }

    #[test]
    fn an_onlooker_ends_a_session_long_before_its_source() {
        let place = tempfile::tempdir().expect("a folder");
        let config = Config::load(None, &[]).expect("settings");
        let out = Some(place.path().join("session"));
        let opening = Opening { out, ..Opening::new("sim", config) };
        let host = Host::silent().watched_by(Arc::new(Impatient));
        let finished = host.finish(host.open(&opening).expect("opens")).expect("it ends");
        assert!(finished.session.accepted().len() < 2, "a plan takes more");
    }
}
