//! `boresight serve`: a program without a screen, a camera on the network, and a person with only
//! the phone.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::{TcpListener, TcpStream},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{
        Arc, Condvar, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::{Builder, sleep},
    time::{Duration, Instant},
};

use boresight::{
    boards::{Board, MarkerSide, Pattern},
    capture::{Arrival, FrameSource},
    frame::{CaptureTime, ImageSize},
    geometry::Camera,
    markers::Dictionary,
    simulation::{Scene, SyntheticSource, technician::CueKind},
};
use image::codecs::jpeg::JpegEncoder;
use nalgebra::Point2;
use serde_json::Value;

use super::{
    asked_for,
    browser::Browser,
    person::{PageCues, read_page},
};

const RATE_HZ: u64 = 12;
const PASSWORD: &str = "s3cret";

/// The newest picture of a camera on the network.
#[derive(Default)]
struct Newest {
    jpeg: Mutex<(u64, Arc<[u8]>)>,
    changed: Condvar,
}

/// Serves `newest` as motion JPEG to everyone; returns its address.
fn network_camera(newest: &Arc<Newest>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let at = listener.local_addr().expect("bound");
    let newest = Arc::clone(newest);
    let send = move |mut client: TcpStream| -> std::io::Result<()> {
        let mut request = [0; 2048];
        if client.read(&mut request)? == 0 {
            return Ok(());
        }
        let head =
            "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n";
        client.write_all(head.as_bytes())?;
        let mut sent = 0;
        loop {
            let jpeg = newest.jpeg.lock().expect("no panic");
            let jpeg = newest.changed.wait_while(jpeg, |jpeg| jpeg.0 == sent).expect("no panic");
            let (number, bytes) = jpeg.clone();
            drop(jpeg);
            sent = number;
            let length = bytes.len();
            let head =
                format!("--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {length}\r\n\r\n");
            client.write_all(head.as_bytes())?;
            client.write_all(&bytes)?;
            client.write_all(b"\r\n")?;
        }
    };
    let serve = move || {
        for client in listener.incoming() {
            let send = send.clone();
            let client = client.expect("a client");
            Builder::new().spawn(move || send(client).ok()).expect("a thread");
        }
    };
    Builder::new().name("network camera".into()).spawn(serve).expect("a thread");
    format!("http://admin:{PASSWORD}@{at}/video.mjpg")
}

/// Paints `scene` with the person following `read`, until `over`.
fn paint(scene: &Scene, newest: &Newest, read: Arc<Mutex<Vec<CueKind>>>, over: &AtomicBool) {
    let cues = PageCues {
        // Paced by the clock, not by viewers.
        judged: Arc::new(AtomicU64::new(u64::MAX)),
        read,
        now: CaptureTime { nanos: 0 },
        interval_nanos: scene.frame_interval_nanos,
    };
    let mut source = SyntheticSource::new(scene.clone(), Box::new(cues), None, 4);
    let interval = Duration::from_nanos(scene.frame_interval_nanos);
    let began = Instant::now();
    for count in 0_u32.. {
        if over.load(Ordering::Relaxed) {
            break;
        }
        let Ok(Arrival::Frame(frame)) = source.next_frame(Duration::from_secs(1)) else { continue };
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, 95).encode_image(&frame.image).expect("encodes");
        sleep((interval * count).saturating_sub(began.elapsed()));
        let mut slot = newest.jpeg.lock().expect("no panic");
        *slot = (slot.0 + 1, jpeg.into());
        newest.changed.notify_all();
    }
}

/// `boresight serve`, until dropped.
struct Program {
    child: Child,
    link: String,
}

impl Program {
    fn start(place: &Path, address: &str, camera: &str) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_boresight"))
            .current_dir(place)
            .args(["serve", address, "--source", camera, "--serve-key", "key"])
            .stdin(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("started");
        let mut lines = BufReader::new(child.stderr.take().expect("piped")).lines();
        let link = lines
            .by_ref()
            .map_while(Result::ok)
            .inspect(|line| assert!(!line.contains(PASSWORD), "{line}"))
            .find_map(|line| Some(line.trim().strip_prefix("or open ")?.to_owned()))
            .expect("it names its link");
        // No other reader of its messages.
        let log = move || lines.map_while(Result::ok).for_each(|line| println!("  serve: {line}"));
        Builder::new().spawn(log).expect("a thread");
        Self { child, link }
    }

    fn port(&self) -> &str {
        let host = self.link.split_once("://").and_then(|(_, rest)| rest.split_once('/'));
        host.and_then(|(host, _)| host.rsplit_once(':')).expect("a port").1
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// A camera with the same picture size for any board.
fn scene(columns: u16, rows: u16, seed: u64) -> Scene {
    Scene {
        image_size: ImageSize { width_px: 640, height_px: 360 },
        camera: Camera::pinhole(490.0, Point2::new(326.0, 176.0)),
        board: Board::new(columns, rows, 0.03).expect("a board"),
        frame_interval_nanos: 1_000_000_000 / RATE_HZ,
        ..Scene::default_720p(seed)
    }
}

/// Chooses a ChArUco board, or a plain board.
fn choose_kind(browser: &Browser, dictionary: Option<Dictionary>) {
    let kind = if dictionary.is_some() { "charuco" } else { "" };
    browser.run(&format!(
        "el('kind').value = '{kind}'; el('kind').dispatchEvent(new Event('change'))"
    ));
    if let Some(dictionary) = dictionary {
        browser.run(&format!("el('dictionary').value = '{dictionary}'"));
    }
}

/// Fills in the numbers and taps Start.
fn start(browser: &Browser, camera: &str, [columns, rows]: [usize; 2], square_mm: f64) {
    browser.run(&format!(
        "el('camera').value = '{camera}'; el('columns').value = {columns}; el('rows').value = {rows};
        el('square').value = {square_mm}; el('plan').value = 'quick'; el('start').click()"
    ));
}

/// Runs a session with the camera on the network, by the words of the page only. Returns the result
/// page's words.
fn by_the_page(
    browser: &Browser,
    newest: &Newest,
    camera: &str,
    scene: &Scene,
    words: &Path,
) -> Value {
    let read = Arc::new(Mutex::new(Vec::new()));
    let over = AtomicBool::new(false);
    let board = (scene.board.columns(), scene.board.rows());
    // Checkerboards are named by their inner corners, ChArUco boards by their squares.
    let dictionary = scene.board.pattern().dictionary();
    let counts = if dictionary.is_some() { scene.board.squares() } else { [board.0, board.1] };
    std::thread::scope(|scope| {
        let cues = Arc::clone(&read);
        let paints = || paint(scene, newest, cues, &over);
        Builder::new().spawn_scoped(scope, paints).expect("a thread");
        choose_kind(browser, dictionary);
        browser.shoot(&words.with_extension("form.png"));
        start(browser, camera, counts, 30.0);
        let reads = || read_page(browser, board, &read, &over);
        let reader = Builder::new().spawn_scoped(scope, reads).expect("a thread");
        let began = Instant::now();
        while browser.run("return shown") != "result" && began.elapsed() < Duration::from_secs(180)
        {
            sleep(Duration::from_millis(200));
        }
        over.store(true, Ordering::Relaxed);
        let said = reader.join().expect("no panic");
        let said: Vec<String> = said.iter().map(|(at, text)| format!("{at:6.1} {text}")).collect();
        std::fs::write(words, said.join("\n")).expect("written");
    });
    let shown = browser.run(
        "return {page: shown, what: el('what').textContent, trouble: el('trouble').textContent,
        again: !el('again').hidden, files: [...el('files').children].map(b => b.textContent)}",
    );
    assert_eq!(shown["page"], "result", "{shown}");
    shown
}

/// The sessions in `place`, oldest first.
fn sessions(place: &Path) -> Vec<PathBuf> {
    let folders = std::fs::read_dir(place.join("sessions")).expect("there");
    let mut folders: Vec<_> = folders.map(|entry| entry.expect("there").path()).collect();
    folders.sort();
    folders
}

#[test]
fn sessions_are_started_ended_and_started_again_on_the_page() {
    let Some(folder) = asked_for() else { return };
    let place = tempfile::tempdir().expect("a folder");
    let newest = Arc::new(Newest::default());
    let camera = network_camera(&newest);
    let program = Program::start(place.path(), "127.0.0.1:0", &camera);
    let browser = Browser::open(360, 740);
    let shoot = |name: &str| browser.shoot(&folder.join(format!("serve-{name}.png")));
    browser.go(&program.link);
    browser.until("shown === 'ask'");
    browser.run("el('behind').click()");
    browser.until("shown === 'wait' && el('camera').options.length === 2");
    shoot("1-start");
    // The password of the camera stays in the program.
    assert_eq!(
        browser.run(&format!("return document.body.outerHTML.includes('{PASSWORD}')")),
        false
    );
    assert_eq!(browser.run(&format!("return JSON.stringify(live).includes('{PASSWORD}')")), false);
    let named = browser.run("return el('camera').options[0].value");
    let named = named.as_str().expect("a name").to_owned();
    assert!(named.starts_with("http://127.0.0.1:"), "{named}");

    // Impossible boards are reported, and nothing starts.
    start(&browser, &named, [2, 6], 30.0);
    browser.until("!el('toast').hidden");
    start(&browser, "sim", [9, 6], 0.0);
    assert_eq!(browser.run("return live.stage"), "waiting");

    let first = scene(9, 6, 3);
    let shown = by_the_page(&browser, &newest, &named, &first, &folder.join("serve-1.txt"));
    println!("first session: {shown}");
    shoot("2-result");
    assert!(shown["what"].as_str().is_some_and(|what| what.starts_with("Good")), "{shown}");
    assert_eq!(shown["again"], true);
    assert!(shown["files"].as_array().is_some_and(|files| files.len() > 5), "{shown}");

    // A board with markers in the same camera.
    browser.run("el('again').click()");
    browser.until("shown === 'wait'");
    shoot("3-again");
    let mut second = scene(7, 5, 4);
    let dictionary = "DICT_4X4_50".parse().expect("a dictionary");
    let markers = Pattern::Charuco { dictionary, side: MarkerSide::Usual };
    second.board = second.board.with(markers).expect("enough markers");
    let shown = by_the_page(&browser, &newest, &named, &second, &folder.join("serve-2.txt"));
    println!("second session: {shown}");
    assert!(shown["what"].as_str().is_some_and(|what| what.starts_with("Good")), "{shown}");

    // A third session, ended by the person with two taps.
    browser.run("el('again').click()");
    browser.until("shown === 'wait'");
    assert_eq!(browser.run("return el('kind').value"), "charuco", "as before");
    choose_kind(&browser, None);
    start(&browser, "sim", [9, 6], 25.0);
    browser.until("shown === 'guide' && live.stage === 'guiding' && live.views >= 1");
    browser.run("el('end').click()");
    browser.until("el('end').textContent.includes('again')");
    assert_eq!(browser.run("return live.stage"), "guiding");
    browser.run("el('end').click()");
    browser.until("shown === 'result'");
    shoot("4-ended");
    let done = sessions(place.path());
    assert_eq!(done.len(), 3);
    for (folder, board) in done.iter().zip([[9, 6], [7, 5], [9, 6]]) {
        let result = std::fs::read_to_string(folder.join("calibration.json")).expect("stored");
        let result: Value = serde_json::from_str(&result).expect("JSON");
        println!("{}: board {}", folder.display(), result["board"]);
        assert_eq!(result["board"]["columns"], board[0]);
        assert_eq!(result["board"]["rows"], board[1]);
        let dictionary = &result["board"]["markers"]["dictionary"];
        assert_eq!(dictionary == "DICT_4X4_50", board == [7, 5], "{}", result["board"]);
        assert!(!result.to_string().contains(PASSWORD));
    }

    // The program is restarted: the phone reconnects unaided, and isn't asked where its owner
    // stands.
    let address = format!("127.0.0.1:{}", program.port());
    drop(program);
    browser.until("!linked()");
    shoot("5-gone");
    let began = Instant::now();
    let program = Program::start(place.path(), &address, &camera);
    browser.until("shown === 'wait' && linked()");
    println!("back after {:.1} s", began.elapsed().as_secs_f64());
    browser.go("about:blank");
    browser.go(&program.link);
    browser.until("shown === 'ask'");
    assert_eq!(browser.run("return el('askwhat').textContent"), "Tap to go on");
    shoot("6-known");
    // Without the kept secret, the page names the next action.
    std::fs::remove_file(place.path().join("key")).expect("removed");
    drop(program);
    browser.run("el('behind').click()");
    let _program = Program::start(place.path(), &address, &camera);
    browser.until("shown === 'closed'");
    shoot("7-closed");
}
