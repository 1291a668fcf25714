//! Sessions by the words of the page end as sessions of the terminal do; the announcements are
//! recorded.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::Command,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::{Builder, sleep},
    time::{Duration, Instant},
};

use boresight::{
    app::{Announcer, Host, Opening, session::source::OpenSource},
    calibration::Calibration,
    config::Config,
    frame::CaptureTime,
    pipeline::FrameReport,
    serve::{Hub, Server, Setup, Stage, session_page::ended_page},
    session::Prompt,
    simulation::{Scene, SyntheticSource, technician::CueKind},
    text,
};
use serde_json::json;

use super::{
    asked_for,
    browser::Browser,
    person::{PageCues, prompts, read_page},
};

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// A browser's voice with the durations of espeak-ng and a record of spoken words.
fn voice(durations: &BTreeMap<String, u64>) -> String {
    let table = json!(durations).to_string();
    format!(
        "(() => {{ const ms = {table}; let now = null; window.heard_ = [];
        const synthesis = {{ speak(u) {{ const at = performance.now(), length = ms[u.text] || 300 + 60 * u.text.length;
            const item = {{ at: at / 1000, text: u.text, ms: length, cut: false }}; heard_.push(item);
            now = {{ u, item, timer: setTimeout(() => {{ now = null; u.onend && u.onend(); }}, length) }};
            u.onstart && u.onstart(); }},
          cancel() {{ if (now) {{ clearTimeout(now.timer); now.item.cut = true; now.item.ms = performance.now() - 1000 * now.item.at; now = null; }} }},
          getVoices() {{ return [{{}}]; }} }};
        Object.defineProperty(window, 'speechSynthesis', {{ value: synthesis }});
        window.SpeechSynthesisUtterance = function (text) {{ this.text = text; }}; }})();"
    )
}

/// Duration of every word of a session by espeak-ng.
fn durations(folder: &Path) -> BTreeMap<String, u64> {
    let file = folder.join("word.wav");
    let news = [Prompt::Taken, Prompt::Complete, Prompt::CameraLost];
    let prompts: Vec<Prompt> = prompts().into_values().chain(news).collect();
    prompts
        .into_iter()
        .map(text::spoken)
        .map(|word| {
            let status =
                Command::new("espeak-ng").arg("-w").arg(&file).arg("--").arg(&word).status();
            assert!(status.is_ok_and(|status| status.success()), "espeak-ng is installed");
            let bytes = std::fs::metadata(&file).expect("it wrote").len();
            // 16 bits, 22050 per second, after a header.
            (word, bytes.saturating_sub(44) * 1000 / (2 * 22_050))
        })
        .collect()
}

pub(super) struct Site {
    pub(super) hub: Arc<Hub>,
    pub(super) server: Server,
}

impl Site {
    pub(super) fn new() -> Self {
        let hub = Arc::new(Hub::new());
        let address = "127.0.0.1:0".parse().expect("an address");
        let setup = Setup { address, names: Vec::new(), certificate: None, kept: None };
        let server = Server::start(&setup, Arc::clone(&hub)).expect("a free port");
        Self { hub, server }
    }

    pub(super) fn link(&self) -> String {
        self.server.links()[0].owner.clone()
    }
}

/// A session of `scene` on `site`, with a person reading `cues` if given, else the window.
pub(super) fn session(
    site: &Site,
    scene: &Scene,
    plan: &str,
    out: PathBuf,
    read: Option<Arc<Mutex<Vec<CueKind>>>>,
) -> Option<Arc<Calibration>> {
    let silent = Announcer::silent();
    let config = Config::load(None, &[format!("guidance.plan=\"{plan}\"")]).expect("settings");
    let opening = Opening { out: Some(out), ..Opening::new("sim", config.clone()) };
    let judged = Arc::new(AtomicU64::new(0));
    let cues = PageCues {
        judged: Arc::clone(&judged),
        read: read.unwrap_or_default(),
        now: CaptureTime { nanos: 0 },
        interval_nanos: scene.frame_interval_nanos,
    };
    let source = SyntheticSource::new(scene.clone(), Box::new(cues), Some(9000), 24);
    let truth = source.truth();
    let on_frame = Box::new(move |report: FrameReport<'_>| {
        judged.store(report.observation.frame_id.0 + 1, Ordering::Relaxed);
    });
    let open = OpenSource { source: Box::new(source), on_frame, truth: Some(truth) };
    let run = opening.begin_with("sim", open, config).expect("a session").paced();
    site.hub.opens(run.open.truth.is_some(), run.board_in_words());
    let host = Host::silent().watched_by(Arc::clone(&site.hub) as _);
    let finished = host.finish(run).expect("it runs");
    site.hub.show(Stage::Ending);
    let (session, path) = (finished.session.clone(), finished.path.clone());
    let concluded = finished.conclude(&silent).expect("it's stored");
    site.hub.show(Stage::Ended(Arc::new(ended_page(&session, &concluded, &path, false))));
    session.calibration().cloned()
}

/// Session of the scene by the words of the terminal, as fast as the machine can.
fn by_terminal(seed: u64, plan: &str, out: PathBuf) -> Option<Arc<Calibration>> {
    let config = Config::load(None, &[format!("guidance.plan=\"{plan}\"")]).expect("settings");
    let name = format!("sim:random:{seed}");
    let opening = Opening { out: Some(out), ..Opening::new(&name, config) };
    let host = Host::silent();
    let finished = host.finish(host.open(&opening).expect("a session")).expect("it runs");
    finished.session.calibration().cloned()
}

#[test]
fn sessions_by_the_words_of_the_page_end_as_those_of_the_window_do() {
    let Some(folder) = asked_for() else { return };
    let plan = std::env::var("BORESIGHT_BROWSER_PLAN").unwrap_or_else(|_| "quick".into());
    let durations = durations(&folder);
    std::fs::write(folder.join("durations.json"), json!(durations).to_string()).expect("written");
    let first = number("BORESIGHT_BROWSER_FIRST", 1);
    let sessions = number("BORESIGHT_BROWSER_SESSIONS", 20);
    let mut equal = 0;
    for seed in first..first + sessions {
        let place = tempfile::tempdir().expect("a folder");
        let site = Site::new();
        let scene = Scene::random(seed);
        let browser = Browser::open(360, 740);
        browser.before(&voice(&durations));
        browser.go(&site.link());
        browser.until("shown === 'ask'");
        browser.run("el('behind').click()");
        let read = Arc::new(Mutex::new(Vec::new()));
        let over = AtomicBool::new(false);
        let board = (scene.board.columns(), scene.board.rows());
        let began = Instant::now();
        let (calibration, words) = std::thread::scope(|scope| {
            let runs = Builder::new()
                .spawn_scoped(scope, || {
                    let out = place.path().join("page");
                    let calibration = session(&site, &scene, &plan, out, Some(Arc::clone(&read)));
                    // The last words are heard.
                    sleep(Duration::from_secs(3));
                    over.store(true, Ordering::Relaxed);
                    calibration
                })
                .expect("a thread");
            let words = read_page(&browser, board, &read, &over);
            (runs.join().expect("no panic"), words)
        });
        let heard = browser.run("return {heard: heard_, spoken, ages, page: shown}");
        let log = json!({"seed": seed, "words": words, "heard": heard["heard"],
            "spoken": heard["spoken"], "ages": heard["ages"]});
        std::fs::write(folder.join(format!("session-{seed}.json")), log.to_string())
            .expect("written");
        let other = by_terminal(seed, &plan, place.path().join("terminal"));
        let off = calibration.as_ref().zip(other.as_ref()).map(|(ours, theirs)| {
            let lens = |c: &Calibration| (c.camera.lens_parameters(), c.sd());
            let ((a, sd_a), (b, sd_b)) = (lens(ours), lens(theirs));
            (0..4)
                .map(|i| (a[i] - b[i]).abs() / sd_a[i].hypot(sd_b[i]).max(1e-9))
                .fold(0.0, f64::max)
        });
        let is_equal = off.is_some_and(|off| off < 4.0) && heard["page"] == "result";
        equal += u64::from(is_equal);
        println!(
            "seed {seed}: {:.0} s, verdict {:?} / {:?}, views {:?}, largest difference {off:.2?} sd, page {}",
            began.elapsed().as_secs_f64(),
            calibration.as_ref().map(|c| c.verdict),
            other.as_ref().map(|c| c.verdict),
            calibration.as_ref().map(|c| c.views.len()),
            heard["page"],
        );
    }
    println!("{equal} of {sessions} sessions end with an equal calibration");
    assert_eq!(equal, sessions);
}
