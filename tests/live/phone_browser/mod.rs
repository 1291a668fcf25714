//! Whole sessions by what the page says and shows, in a browser. They take real time and need chromium, chromedriver and
//! espeak-ng, so they run only if `BORESIGHT_BROWSER` names a folder for what they record:
//!
//! ```sh
//! BORESIGHT_BROWSER=/tmp/phone cargo test --test live phone_browser -- --nocapture --test-threads=1
//! ```

use std::{
    collections::BTreeMap,
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::{Builder, sleep},
    time::{Duration, Instant},
};

use base64::{Engine, prelude::BASE64_STANDARD};
use boresight::{
    app::{Announcer, Opening, phone::ended_page, source::OpenSource},
    calibration::Calibration,
    config::Config,
    detection::Side,
    frame::{CaptureTime, FrameId},
    geometry::{Corner, Homography},
    pipeline::{FrameReport, Onlookers},
    serve::{Hub, Server, Setup, Stage},
    session::{Across, Edge, Prompt, Upright},
    simulation::{
        Cues, Scene, SyntheticSource,
        technician::{Cue, CueKind, Instruction},
    },
    text,
};
use nalgebra::Point2;
use serde_json::{Value, json};

/// Where to record, if these tests are asked for.
fn asked_for() -> Option<PathBuf> {
    let folder = PathBuf::from(std::env::var_os("BORESIGHT_BROWSER")?);
    std::fs::create_dir_all(&folder).expect("a folder");
    Some(folder)
}

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// A browser that chromedriver drives.
struct Browser {
    driver: Child,
    port: u16,
    session: String,
}

impl Browser {
    fn open(width: u32, height: u32) -> Self {
        let mut driver = Command::new("chromedriver")
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromedriver is installed");
        let lines = BufReader::new(driver.stdout.take().expect("a pipe")).lines();
        let port = lines
            .map_while(Result::ok)
            .find_map(|line| {
                let (_, port) = line.split_once("successfully on port ")?;
                port.trim_end_matches('.').parse().ok()
            })
            .expect("it says its port");
        let mut browser = Self { driver, port, session: String::new() };
        let options = json!({"args": ["--headless=new", "--no-sandbox", "--disable-gpu",
            "--mute-audio", "--hide-scrollbars", "--autoplay-policy=no-user-gesture-required"]});
        let wanted = json!({"capabilities": {"alwaysMatch": {"goog:chromeOptions": options}}});
        let opened = browser.call("POST", "/session", &wanted);
        browser.session = opened["sessionId"].as_str().expect("a session").to_owned();
        browser.size(width, height);
        browser
    }

    fn call(&self, method: &str, path: &str, body: &Value) -> Value {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time-out");
        let body = if method == "GET" { String::new() } else { body.to_string() };
        let head = format!(
            "{method} {path} HTTP/1.1\r\nhost: 127.0.0.1:{}\r\nconnection: close\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
            self.port,
            body.len()
        );
        stream.write_all(format!("{head}{body}").as_bytes()).expect("it reads");
        let mut answer = Vec::new();
        let mut part = [0; 64 << 10];
        let value = |answer: &[u8]| -> Option<Value> {
            let at = answer.windows(4).position(|w| w == b"\r\n\r\n")? + 4;
            serde_json::from_slice(&answer[at..]).ok()
        };
        loop {
            let count = stream.read(&mut part).expect("it answers");
            answer.extend_from_slice(&part[..count]);
            if let Some(value) = value(&answer) {
                let value = value["value"].clone();
                assert!(value.get("error").is_none(), "{path}: {value}");
                return value;
            }
            assert!(count > 0, "{}", String::from_utf8_lossy(&answer));
        }
    }

    fn cdp(&self, cmd: &str, params: &Value) {
        let path = format!("/session/{}/goog/cdp/execute", self.session);
        self.call("POST", &path, &json!({"cmd": cmd, "params": params}));
    }

    fn size(&self, width: u32, height: u32) {
        let metrics =
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": true});
        self.cdp("Emulation.setDeviceMetricsOverride", &metrics);
    }

    /// Runs `script` in every page before its own.
    fn before(&self, script: &str) {
        self.cdp("Page.addScriptToEvaluateOnNewDocument", &json!({"source": script}));
    }

    fn go(&self, url: &str) {
        self.call("POST", &format!("/session/{}/url", self.session), &json!({"url": url}));
    }

    fn run(&self, script: &str) -> Value {
        let path = format!("/session/{}/execute/sync", self.session);
        self.call("POST", &path, &json!({"script": script, "args": []}))
    }

    fn until(&self, condition: &str) {
        let began = Instant::now();
        while self.run(&format!("return !!({condition})")) != true {
            assert!(began.elapsed() < Duration::from_secs(60), "never: {condition}");
            sleep(Duration::from_millis(30));
        }
    }

    fn shoot(&self, file: &Path) {
        let picture =
            self.call("GET", &format!("/session/{}/screenshot", self.session), &Value::Null);
        let bytes = BASE64_STANDARD.decode(picture.as_str().expect("base64")).expect("base64");
        std::fs::write(file, bytes).expect("it's written");
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        self.call("DELETE", &format!("/session/{}", self.session), &json!({}));
        self.driver.kill().ok();
        self.driver.wait().ok();
    }
}

/// What the page shows, as far as a person uses it.
const SHOWN: &str = "return {
    words: el('sentence').textContent, page: shown, views: +el('views').textContent,
    frame: live && live.frame, board: live && live.board,
    ghost: plan && plan.ghost && plan.ghost.brackets[0].map(b => b[1]),
    arrow: plan && plan.ghost && plan.ghost.arrow };";

/// Cues of a person who sees nothing but the page.
struct PageCues {
    judged: Arc<AtomicU64>,
    read: Arc<Mutex<Vec<CueKind>>>,
    now: CaptureTime,
    interval_nanos: u64,
}

impl Cues for PageCues {
    fn wait_judged(&mut self, published: Option<FrameId>, patience: Duration) -> bool {
        let Some(published) = published else { return true };
        self.now.nanos = (published.0 + 1) * self.interval_nanos;
        let deadline = Instant::now() + patience;
        while self.judged.load(Ordering::Relaxed) <= published.0 {
            if Instant::now() > deadline {
                return false;
            }
            sleep(Duration::from_millis(1));
        }
        true
    }

    fn next_cue(&mut self) -> Option<Cue> {
        let mut read = self.read.lock().expect("no panic");
        (!read.is_empty()).then(|| Cue { seen_at: self.now, kind: read.remove(0) })
    }
}

/// Every sentence that asks for something, by its words.
fn prompts() -> BTreeMap<String, Prompt> {
    let edges = (0..8).map(|i| Edge::towards(f64::from(i) * std::f64::consts::FRAC_PI_4));
    let tips = edges
        .flat_map(|edge| [Prompt::Tip(edge), Prompt::TipInstead(edge), Prompt::TipFurther(edge)]);
    let across = [None, Some(Across::Left), Some(Across::Right)];
    let upright = [None, Some(Upright::Up), Some(Upright::Down)];
    let shifts = across.into_iter().flat_map(|a| upright.map(|u| Prompt::Shift(a, u)));
    let sides = [Side::Left, Side::Right, Side::Top, Side::Bottom].map(Prompt::CutOff);
    let turns = [true, false].map(|clockwise| Prompt::TurnTilt { clockwise });
    let others = [
        Prompt::ShowBoard,
        Prompt::Closer,
        Prompt::Farther,
        Prompt::HoldStill,
        Prompt::SteadyTheBoard,
        Prompt::Blurred,
        Prompt::TipLess,
        Prompt::TipMore,
        Prompt::ToTheMiddle,
        Prompt::OntoTheOutline,
        Prompt::FollowTheOutline,
        Prompt::Clearer,
        Prompt::Contradicts,
    ];
    tips.chain(shifts)
        .chain(sides)
        .chain(turns)
        .chain(others)
        .map(|prompt| (text::prompt(prompt), prompt))
        .collect()
}

fn points(value: &Value) -> Option<Vec<Point2<f64>>> {
    let point = |p: &Value| Some(Point2::new(p[0].as_f64()?, p[1].as_f64()?));
    value.as_array()?.iter().map(point).collect()
}

fn middle(points: &[Point2<f64>]) -> Point2<f64> {
    let sum = points.iter().fold(nalgebra::Vector2::zeros(), |sum, point| sum + point.coords);
    Point2::from(sum / points.len() as f64)
}

fn span(points: &[Point2<f64>]) -> f64 {
    let middle = middle(points);
    points.iter().map(|point| (point - middle).norm()).sum()
}

/// What a person who reads these words and sees board and ghost on the page does.
fn instruction(prompt: Prompt, shown: &Value) -> Instruction {
    let (board, ghost) = (points(&shown["board"]), points(&shown["ghost"]));
    let azimuth = || {
        let arrow = points(&shown["arrow"]).filter(|arrow| arrow.len() > 2)?;
        let along = arrow[arrow.len() - 1] - arrow[0];
        Some(along.y.atan2(along.x))
    };
    match prompt {
        Prompt::HoldStill | Prompt::SteadyTheBoard | Prompt::Blurred => Instruction::HoldStill,
        Prompt::ShowBoard => Instruction::ShowBoard,
        Prompt::Closer | Prompt::Farther => {
            let usual = if prompt == Prompt::Closer { 0.8 } else { 1.2 };
            let ratio = board.zip(ghost).map(|(board, ghost)| span(&board) / span(&ghost));
            let way = |ratio: &f64| (*ratio < 1.0) == (prompt == Prompt::Closer);
            Instruction::Distance { ratio: ratio.filter(way).unwrap_or(usual) }
        }
        Prompt::Shift(..) | Prompt::CutOff(_) => match board.zip(ghost) {
            Some((board, ghost)) => {
                let by = middle(&ghost) - middle(&board);
                Instruction::Shift { right_px: by.x, down_px: by.y }
            }
            None => {
                let [right, down] = prompt.shift().unwrap_or_default();
                let (right_px, down_px) = (120.0 * f64::from(right), 120.0 * f64::from(down));
                Instruction::Shift { right_px, down_px }
            }
        },
        _ => Instruction::MatchGhost,
    }
    .or_tip(prompt, azimuth())
}

trait OrTip {
    fn or_tip(self, prompt: Prompt, azimuth_rad: Option<f64>) -> Self;
}

impl OrTip for Instruction {
    fn or_tip(self, prompt: Prompt, azimuth_rad: Option<f64>) -> Self {
        let is_tip = matches!(
            prompt,
            Prompt::Tip(_)
                | Prompt::TipInstead(_)
                | Prompt::TipFurther(_)
                | Prompt::TurnTilt { .. }
        );
        match azimuth_rad {
            Some(azimuth_rad) if is_tip => Self::Tip { azimuth_rad, tilt_rad: 0.65 },
            _ => self,
        }
    }
}

/// All inner corners of the ghost, from its four outermost.
fn ghost_px(outer: &[Point2<f64>], columns: usize, rows: usize) -> Option<Vec<Point2<f64>>> {
    let (right, down) = ((columns - 1) as f64, (rows - 1) as f64);
    let board = [[0.0, 0.0], [right, 0.0], [right, down], [0.0, down]].map(Point2::from);
    let corners: Vec<Corner> = outer.iter().map(|px| Corner::isotropic(*px, 1.0)).collect();
    let homography = Homography::fit(&board, &corners).ok()?;
    let all = (0..rows).flat_map(|y| (0..columns).map(move |x| Point2::new(x as f64, y as f64)));
    all.map(|at| homography.map(&at)).collect()
}

/// Reads the page until the session is over.
fn read_page(
    browser: &Browser,
    (columns, rows): (usize, usize),
    read: &Mutex<Vec<CueKind>>,
    over: &AtomicBool,
) -> Vec<(f64, String)> {
    let prompts = prompts();
    let began = Instant::now();
    let (mut words, mut views, mut ghost) = (String::new(), 0, Value::Null);
    let mut target = 0;
    let mut log = Vec::new();
    while !over.load(Ordering::Relaxed) {
        let shown = browser.run(SHOWN);
        let mut cues = Vec::new();
        let now_views = shown["views"].as_u64().unwrap_or(0);
        if now_views > views {
            cues.push(CueKind::Taken);
        }
        views = now_views;
        if shown["page"] == "result" {
            cues.push(CueKind::Finished);
        }
        if shown["ghost"] != ghost {
            ghost = shown["ghost"].clone();
            let outer = points(&ghost).filter(|outer| outer.len() == 4);
            if let Some(ghost_px) = outer.and_then(|outer| ghost_px(&outer, columns, rows)) {
                target += 1;
                cues.push(CueKind::Show { ghost_px, target });
            }
        }
        let now_words = shown["words"].as_str().unwrap_or_default();
        if now_words != words {
            words = now_words.to_owned();
            log.push((began.elapsed().as_secs_f64(), words.clone()));
            if let Some(prompt) = prompts.get(&words) {
                let instruction = instruction(*prompt, &shown);
                let words = words.split_whitespace().count();
                cues.push(CueKind::Sentence { instruction, words });
            }
        }
        read.lock().expect("no panic").extend(cues);
        sleep(Duration::from_millis(30));
    }
    log
}

/// A browser's voice that takes as long as espeak-ng does, and notes what it says.
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

/// How long espeak-ng takes for every word of a session.
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

struct Site {
    hub: Arc<Hub>,
    server: Server,
}

impl Site {
    fn new() -> Self {
        let hub = Arc::new(Hub::new());
        let address = "127.0.0.1:0".parse().expect("an address");
        let setup = Setup { address, names: Vec::new(), certificate: None };
        let server = Server::start(&setup, Arc::clone(&hub)).expect("a free port");
        Self { hub, server }
    }

    fn link(&self) -> &str {
        &self.server.links()[0].owner
    }
}

/// A session of `scene` on `site`, whose person reads `cues` if there are any, else what the window shows.
fn session(
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
    let onlookers: Onlookers = vec![Arc::clone(&site.hub) as _];
    let finished =
        run.carry_out_before(&AtomicBool::new(false), &onlookers, &silent).expect("it runs");
    site.hub.show(Stage::Ending);
    let (session, path) = (finished.session.clone(), finished.path.clone());
    let concluded = finished.conclude(&silent).expect("it's stored");
    site.hub.show(Stage::Ended(Arc::new(ended_page(&session, &concluded, &path, false))));
    session.calibration().cloned()
}

/// The same scene by the words of the terminal, as fast as the machine is.
fn by_terminal(seed: u64, plan: &str, out: PathBuf) -> Option<Arc<Calibration>> {
    let silent = Announcer::silent();
    let config = Config::load(None, &[format!("guidance.plan=\"{plan}\"")]).expect("settings");
    let name = format!("sim:random:{seed}");
    let opening = Opening { out: Some(out), ..Opening::new(&name, config) };
    let run = opening.open(&silent).expect("a session");
    let finished = run.carry_out(&AtomicBool::new(false), &silent).expect("it runs");
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
        browser.go(site.link());
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

/// Pictures of every state, at three sizes.
#[test]
fn every_state_is_drawn() {
    let Some(folder) = asked_for() else { return };
    let sizes = [(360, 740), (740, 360), (820, 1180)];
    for (width, height) in sizes {
        let place = tempfile::tempdir().expect("a folder");
        let site = Site::new();
        let browser = Browser::open(width, height);
        let shoot =
            |name: &str| browser.shoot(&folder.join(format!("{name}-{width}x{height}.png")));
        browser.go(site.link().split('#').next().expect("an address"));
        browser.until("shown === 'closed'");
        shoot("0-closed");
        site.hub.show(Stage::Waiting(Arc::new(boresight::serve::Offer {
            cameras: vec![boresight::serve::OfferedCamera {
                source: "sim".into(),
                name: "Simulated camera".into(),
            }],
            last: Some(boresight::serve::Request {
                source: "sim".into(),
                board: [9, 6],
                square_m: 0.025,
                plan: "adaptive".into(),
            }),
            trouble: None,
        })));
        // Another address: only its fragment would change otherwise.
        browser.go("about:blank");
        browser.go(site.link());
        browser.until("shown === 'ask'");
        shoot("1-ask");
        browser.run("el('facing').click()");
        browser.until("shown === 'wait'");
        shoot("2-wait");
        let scene = Scene::default_720p(1);
        let read = Arc::new(Mutex::new(Vec::new()));
        let over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            Builder::new()
                .spawn_scoped(scope, || {
                    let out = place.path().join("page");
                    session(&site, &scene, "quick", out, Some(Arc::clone(&read)));
                    over.store(true, Ordering::Relaxed);
                })
                .expect("a thread");
            let states = [
                ("3-guide", "live && live.stage === 'guiding' && bitmap && live.close > .3"),
                ("4-hold", "live && live.hold > .3"),
                ("5-taken", "live && live.views >= 1"),
            ];
            let reader = Builder::new()
                .spawn_scoped(scope, || read_page(&browser, (9, 6), &read, &over))
                .expect("a thread");
            for (name, condition) in states {
                browser.until(condition);
                shoot(name);
            }
            browser.run("el('pause').click()");
            browser.until("live.paused");
            sleep(Duration::from_millis(300));
            shoot("6-paused");
            browser.run("el('pause').click(); el('list').click()");
            browser.until("shown === 'sheet'");
            sleep(Duration::from_millis(300));
            shoot("7-views");
            browser.run("el('close').click(); el('end').click()");
            shoot("8-end");
            browser.run("el('list').click(); el('bigger').click()");
            sleep(Duration::from_millis(300));
            shoot("9-large");
            browser.run("el('list').click(); el('bigger').click()");
            reader.join().expect("no panic");
        });
        browser.until("shown === 'result'");
        sleep(Duration::from_millis(300));
        shoot("a-result");
        browser.run("el('result').scrollTo(0, 900)");
        sleep(Duration::from_millis(300));
        shoot("b-result");
        let link = site.server.links()[0].watcher.clone();
        drop(site);
        browser.run("el('result').scrollTo(0, 0)");
        sleep(Duration::from_secs(3));
        shoot("c-lost");
        drop(link);
    }
}
