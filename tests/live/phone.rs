//! Phone's page: admission, answers, and independence of the session.

use std::{
    collections::BTreeSet,
    fmt::Write as _,
    io::{Read, Write},
    net::{SocketAddr, TcpStream},
    sync::Arc,
    thread::{Builder, sleep},
    time::{Duration, Instant},
};

use boresight::{
    app::{Announcer, Host, Opening},
    config::Config,
    frame::{CaptureTime, Frame, FrameId, FrameKind},
    pipeline::Onlooker,
    serve::{EndedPage, Hub, PageFile, Secret, Server, Setup, Stage, session_page::ended_page},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

const PATIENCE: Duration = Duration::from_secs(20);

/// A page served to the machine only.
pub(crate) struct Site {
    pub(crate) hub: Arc<Hub>,
    pub(crate) at: SocketAddr,
    pub(crate) owner: String,
    pub(crate) watcher: String,
    server: Option<Server>,
}

impl Site {
    pub(crate) fn new() -> Self {
        Self::with(None)
    }

    /// A page with a secret that outlives the server.
    fn with(kept: Option<Secret>) -> Self {
        let hub = Arc::new(Hub::new());
        let address = "127.0.0.1:0".parse().expect("an address");
        let setup = Setup { address, names: Vec::new(), certificate: None, kept };
        let server = Server::start(&setup, Arc::clone(&hub)).expect("a free port");
        let links = server.links()[0].clone();
        Self { hub, server: Some(server), ..Self::of_links(&links.owner, &links.watcher) }
    }

    /// A page served by another program.
    pub(crate) fn of_links(owner: &str, watcher: &str) -> Self {
        let (url, owner) = owner.split_once("/#").expect("a token in the fragment");
        let at = url.strip_prefix("http://").expect("plain HTTP").parse().expect("an address");
        let (_, watcher) = watcher.split_once('#').expect("a token in the fragment");
        let (owner, watcher) = (owner.to_owned(), watcher.to_owned());
        Self { hub: Arc::new(Hub::new()), at, owner, watcher, server: None }
    }

    /// Key for `token`, once the page takes a new key.
    pub(crate) fn key(&self, token: &str) -> String {
        const TOO_MANY: u16 = 429;
        // Each is another phone.
        let claim = Secret::random().expect("randomness").text();
        let body = format!("{{\"token\":\"{token}\",\"claim\":\"{claim}\"}}");
        let enter = || Ask::post("/api/enter", &body).of(self);
        // Surplus requests are told to come again.
        let answer = std::iter::repeat_with(enter).find(|answer| answer.status != TOO_MANY);
        let answer = answer.expect("an answer without end");
        assert_eq!(answer.status, 200, "{}", answer.text());
        let entered: Value = serde_json::from_str(&answer.text()).expect("JSON");
        entered["key"].as_str().expect("a key").to_owned()
    }
}

/// A request.
#[derive(Clone, Default)]
pub(crate) struct Ask {
    method: String,
    path: String,
    host: Option<String>,
    headers: Vec<(String, String)>,
    body: String,
}

pub(crate) struct Answer {
    pub(crate) status: u16,
    head: String,
    body: Vec<u8>,
}

impl Answer {
    fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}

impl Ask {
    pub(crate) fn get(path: &str) -> Self {
        Self { method: "GET".into(), path: path.into(), ..Self::default() }
    }

    pub(crate) fn post(path: &str, body: &str) -> Self {
        let json = ("content-type".to_owned(), "application/json".to_owned());
        Self {
            method: "POST".into(),
            path: path.into(),
            headers: vec![json],
            body: body.into(),
            ..Self::default()
        }
    }

    fn with(mut self, name: &str, value: &str) -> Self {
        self.headers.push((name.into(), value.into()));
        self
    }

    pub(crate) fn key(self, key: &str) -> Self {
        self.with("authorization", &format!("Bearer {key}"))
    }

    pub(crate) fn bytes(&self, site: &Site) -> Vec<u8> {
        let Self { method, path, host, headers, body } = self;
        let host = host.clone().unwrap_or_else(|| site.at.to_string());
        let mut text = format!("{method} {path} HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n");
        for (name, value) in headers {
            write!(text, "{name}: {value}\r\n").expect("a string takes all");
        }
        if method == "POST" {
            write!(text, "content-length: {}\r\n", body.len()).expect("a string takes all");
        }
        text.push_str("\r\n");
        text.push_str(body);
        text.into_bytes()
    }

    pub(crate) fn of(&self, site: &Site) -> Answer {
        let mut stream = TcpStream::connect(site.at).expect("the page is served");
        stream.set_read_timeout(Some(PATIENCE)).expect("a time-out");
        // An answer to a too large request may come before all of it is sent.
        stream.write_all(&self.bytes(site)).ok();
        let mut bytes = Vec::new();
        let mut part = [0; 16 << 10];
        loop {
            match stream.read(&mut part) {
                Ok(0) | Err(_) => break,
                Ok(count) => bytes.extend_from_slice(&part[..count]),
            }
            // A stream of events doesn't end.
            if bytes.starts_with(b"HTTP/1.1 200") && contains(&bytes, b"event: live") {
                break;
            }
        }
        answer(&bytes)
    }
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

fn answer(bytes: &[u8]) -> Answer {
    let end = bytes.windows(4).position(|w| w == b"\r\n\r\n").unwrap_or(bytes.len());
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
    let body = bytes.get(end + 4..).unwrap_or_default().to_vec();
    Answer { status, head, body }
}

fn ended() -> EndedPage {
    let file = PageFile {
        name: "opencv.yaml".into(),
        label: "OpenCV".into(),
        media_type: "application/octet-stream",
        bytes: b"%YAML".to_vec().into(),
    };
    EndedPage { verdict: "good", files: vec![file], ..EndedPage::default() }
}

/// Every route by everybody, in every wrong way.
#[test]
fn only_who_has_a_link_is_let_in_and_only_the_owner_commands() {
    let site = Site::new();
    site.hub.show(Stage::Ended(Arc::new(ended())));
    let (owner, watcher) = (site.key(&site.owner), site.key(&site.watcher));
    let wrong = "A".repeat(43);
    let pause = "{\"command\":\"pause\"}";
    let start = "{\"source\":\"sim\",\"board\":[9,6],\"square_m\":0.02,\"plan\":\"quick\"}";
    let claim = Secret::random().expect("randomness").text();
    let enter = format!("{{\"token\":\"{}\",\"claim\":\"{claim}\"}}", site.watcher);
    let routes = [
        Ask::get("/"),
        Ask::post("/api/enter", &enter),
        Ask::get("/api/events"),
        Ask::get("/api/picture"),
        Ask::post("/api/command", pause),
        Ask::post("/api/start", start),
        Ask::get("/api/file/0"),
        Ask::get("/api/file/1"),
        Ask::get("/api/nothing"),
    ];
    // Pausing and starting conflict with an ended session; nothing was captured: there is no
    // picture.
    #[rustfmt::skip]
    let wanted: [[u16; 11]; 9] = [
        // none wrong watch owner host origin method large type  key-in-path  two-hosts
        [200, 200, 200, 200, 421, 403, 405, 200, 200, 401, 421],
        [200, 200, 200, 200, 421, 403, 405, 413, 415, 401, 421],
        [401, 401, 200, 200, 421, 403, 405, 200, 200, 401, 421],
        [401, 401, 204, 204, 421, 403, 405, 204, 204, 401, 421],
        [401, 401, 403, 409, 421, 403, 405, 413, 415, 401, 421],
        [401, 401, 403, 409, 421, 403, 405, 413, 415, 401, 421],
        [401, 401, 200, 200, 421, 403, 405, 200, 200, 401, 421],
        [401, 401, 404, 404, 421, 403, 405, 404, 404, 401, 421],
        [401, 401, 404, 404, 421, 403, 404, 404, 404, 401, 421],
    ];
    println!(
        "route | no key | wrong | watcher | owner | other Host | other Origin | other method | too large | other type | key in the path | two Hosts"
    );
    for (route, wanted) in routes.iter().zip(wanted) {
        let mine = || route.clone().key(&owner);
        let large = Ask { body: "x".repeat(5000), ..mine() };
        let other_method = if route.method == "GET" { "POST" } else { "GET" };
        let two_hosts = mine().with("host", &site.at.to_string());
        let untyped =
            Ask { headers: vec![("authorization".into(), format!("Bearer {owner}"))], ..mine() };
        let asked = [
            route.clone(),
            route.clone().key(&wrong),
            route.clone().key(&watcher),
            mine(),
            Ask { host: Some("evil.example:8417".into()), ..mine() },
            mine().with("origin", "http://evil.example"),
            Ask { method: other_method.into(), ..mine() },
            if route.method == "POST" { large } else { mine() },
            untyped,
            Ask { path: format!("{}x?key={owner}", route.path), ..route.clone() },
            two_hosts,
        ];
        let answers = asked.map(|ask| ask.of(&site));
        let got: Vec<u16> = answers.iter().map(|answer| answer.status).collect();
        println!("{} {} | {got:?}", route.method, route.path);
        assert_eq!(got, wanted, "{} {}", route.method, route.path);
        for Answer { head, .. } in &answers {
            let head = head.to_lowercase();
            assert!(head.contains("content-security-policy: default-src 'none'"), "{head}");
            assert!(head.contains("nosniff") && !head.contains("access-control"), "{head}");
        }
    }
}

#[test]
fn no_path_leads_out() {
    let site = Site::new();
    site.hub.show(Stage::Ended(Arc::new(ended())));
    let owner = site.key(&site.owner);
    for path in [
        "/../etc/passwd",
        "/api/file/../../etc/passwd",
        "/api/file/..%2f..%2fetc%2fpasswd",
        "/api/file//etc/passwd",
        "/api/file/0/../../../etc/passwd",
        "/api/file/%00",
        "/api/file/-1",
        "/api/file/99999999999999999999999",
        "/api/file/calibration.json",
        "//",
        "/api/file/opencv.yaml",
        "/%2e%2e/",
    ] {
        let answer = Ask::get(path).key(&owner).of(&site);
        assert!([400, 404].contains(&answer.status), "{path}: {}", answer.status);
        assert!(!answer.text().contains("root:"), "{path}");
    }
    let foreign = Ask::get("http://evil.example/api/events").key(&owner).of(&site);
    assert_eq!(foreign.status, 421);
    let file = Ask::get("/api/file/0").key(&owner).of(&site);
    assert_eq!(file.body, b"%YAML");
    assert!(file.head.contains("attachment; filename=\"opencv.yaml\""), "{}", file.head);
}

/// A request of random parts, sensible and not.
fn random_request(rng: &mut ChaCha8Rng, site: &Site, key: &str) -> Vec<u8> {
    const METHODS: [&str; 8] = ["GET", "POST", "PUT", "OPTIONS", "get", "", "CONNECT", "HEAD"];
    const PATHS: [&str; 14] = [
        "/",
        "/api/enter",
        "/api/events",
        "/api/picture",
        "/api/picture?after=-1",
        "/api/command",
        "/api/start",
        "/api/file/0",
        "/api/file/%ff",
        "*",
        "",
        "/\u{7f}",
        "http://[::1",
        "/api/events?heard=18446744073709551615",
    ];
    const BODIES: [&str; 9] = [
        "{\"command\":\"pause\"}",
        "{\"command\":\"remove\",\"view\":4294967295}",
        "{",
        "[[[[[[[[",
        "{\"token\":\"\"}",
        "{\"token\":1,\"claim\":\"\"}",
        "null",
        "{\"command\":\"end\"}",
        "{\"source\":\"sim\",\"board\":[65535,0],\"square_m\":-1e308,\"plan\":\"\"}",
    ];
    let pick = |rng: &mut ChaCha8Rng, all: &[&str]| all[rng.random_range(0..all.len())].to_owned();
    let body = pick(rng, &BODIES);
    let mut ask = Ask { method: pick(rng, &METHODS), path: pick(rng, &PATHS), ..Ask::default() };
    if rng.random_bool(0.8) {
        ask = ask.key(key);
    }
    if rng.random_bool(0.7) {
        ask = ask.with("content-type", "application/json");
    }
    if rng.random_bool(0.1) {
        ask = ask.with("transfer-encoding", "chunked");
    }
    if rng.random_bool(0.1) {
        ask = ask.with("origin", "null");
    }
    if rng.random_bool(0.05) {
        ask.headers.extend((0..90).map(|i| (format!("x-{i}"), "y".repeat(90))));
    }
    if rng.random_bool(0.05) {
        ask.path.push_str(&"a".repeat(rng.random_range(0..40_000)));
    }
    ask.body = body;
    let mut bytes = ask.bytes(site);
    if rng.random_bool(0.3) {
        for _ in 0..rng.random_range(1..8) {
            let at = rng.random_range(0..bytes.len());
            bytes[at] = rng.random();
        }
    }
    if rng.random_bool(0.1) {
        bytes.truncate(rng.random_range(0..bytes.len()));
    }
    bytes
}

#[test]
fn ten_thousand_random_requests_break_nothing() {
    let site = Site::new();
    site.hub.show(Stage::Ended(Arc::new(ended())));
    let mut keys = vec![site.key(&site.owner)];
    keys.extend((1..16).map(|_| site.key(&site.watcher)));
    let mut statuses = std::collections::BTreeMap::<u16, u32>::new();
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..8_u64)
            .map(|worker| {
                let (site, keys) = (&site, &keys);
                let work = move || {
                    let mut rng = ChaCha8Rng::seed_from_u64(worker);
                    let mut statuses = Vec::new();
                    for i in 0..1250 {
                        let bytes = random_request(&mut rng, site, &keys[i % keys.len()]);
                        let Ok(mut stream) = TcpStream::connect(site.at) else { continue };
                        let brief = Some(Duration::from_millis(60));
                        stream.set_read_timeout(brief).expect("a time-out");
                        stream.write_all(&bytes).ok();
                        let mut head = [0; 64];
                        let count = stream.read(&mut head).unwrap_or(0);
                        statuses.push(answer(&head[..count]).status);
                    }
                    statuses
                };
                Builder::new().spawn_scoped(scope, work).expect("a thread")
            })
            .collect();
        for worker in workers {
            for status in worker.join().expect("no client fails") {
                *statuses.entry(status).or_default() += 1;
            }
        }
    });
    println!("answers to 10000 random requests (0: closed without one): {statuses:?}");
    assert_eq!(statuses.values().sum::<u32>(), 10_000);
    assert!(statuses.keys().all(|status| *status < 500), "{statuses:?}");
    assert!(statuses.len() > 5, "{statuses:?}");
    let page = Ask::get("/").key(&keys[0]).of(&site);
    assert!([200, 429].contains(&page.status), "the page is served as before: {}", page.status);
}

/// Follows the events with `key` and hands each to `each`, until a return of false.
pub(crate) fn follow(site: &Site, key: &str, mut each: impl FnMut(&str, &Value) -> bool) {
    let mut stream = TcpStream::connect(site.at).expect("the page is served");
    stream.set_read_timeout(Some(PATIENCE)).expect("a time-out");
    stream.write_all(&Ask::get("/api/events").key(key).bytes(site)).expect("it reads");
    let mut text = String::new();
    let mut part = [0; 16 << 10];
    loop {
        let count = stream.read(&mut part).expect("something is said every half second");
        assert!(count > 0, "the stream ended");
        text.push_str(&String::from_utf8_lossy(&part[..count]));
        while let Some(end) = text.find("\n\n") {
            let event: String = text.drain(..end + 2).collect();
            let Some(at) = event.find("event: ") else { continue };
            let Some((name, data)) = event[at + 7..].split_once("\ndata: ") else { continue };
            // The size of a chunk may stand between two events.
            let Ok(data) = serde_json::from_str(data.trim_end()) else { continue };
            if !each(name, &data) {
                return;
            }
        }
    }
}

#[test]
fn a_session_is_shown_and_obeys_the_page() {
    let site = Site::new();
    let place = tempfile::tempdir().expect("a folder");
    let folder = place.path().join("session");
    let settings = ["guidance.plan=\"quick\"".to_owned()];
    let config = Config::load(None, &settings).expect("settings");
    // A quiet camera, which takes little time.
    let scene = place.path().join("scene.toml");
    std::fs::write(&scene, "").expect("written");
    let source = format!("sim:{}", scene.display());
    let opening = Opening { out: Some(folder.clone()), ..Opening::new(&source, config) };
    let key = site.key(&site.owner);
    let hub = Arc::clone(&site.hub);
    let session = Builder::new()
        .spawn(move || {
            let silent = Announcer::silent();
            let host = Host::silent().watched_by(Arc::clone(&hub) as _);
            let finished = host.finish(host.open(&opening).expect("a session")).expect("it runs");
            hub.show(Stage::Ending);
            let (session, path) = (finished.session.clone(), finished.path.clone());
            let concluded = finished.conclude(&silent).expect("it's stored");
            hub.show(Stage::Ended(Arc::new(ended_page(&session, &concluded, &path, false))));
        })
        .expect("a thread");
    let (mut taken, mut undone, mut done) = (0, false, 0);
    let mut result = Value::Null;
    let mut said = BTreeSet::new();
    follow(&site, &key, |name, data| {
        match name {
            "news" if data["rank"] == "taken" && data["text"] == "Taken" => taken += 1,
            "news" if data["rank"] == "taken" => done += 1,
            "ended" if !data.is_null() => result = data.clone(),
            "live" | "plan" => {
                said.extend(data.as_object().into_iter().flat_map(|fields| fields.keys().cloned()));
            }
            _ => {}
        }
        if name == "live" && data["moment"] == "taken" {
            assert!(data["reason"].is_null(), "nothing but that a view is taken: {data}");
        }
        if name == "live" && data["views"] == 2 && !undone {
            undone = true;
            let undo = Ask::post("/api/command", "{\"command\":\"undo\"}").key(&key).of(&site);
            assert_eq!(undo.status, 204);
        }
        result.is_null()
    });
    session.join().expect("no panic");
    // The network played to a browser's tests gives the same answers.
    let played = include_str!("phone_browser/link.js");
    said.retain(|field| !played.contains(&format!("{field}: ")));
    assert_eq!(said, BTreeSet::new(), "missing in link.js");
    assert!(taken >= 5 && done == 1, "four views at least, one of them twice: {taken}, {done}");
    // Two pairs alone may lie slightly less than 41° apart: a remark.
    let usable = ["Good (SIMULATED)", "Use with care (SIMULATED)"];
    let what = result["what"].as_str().unwrap_or_default();
    assert!(usable.iter().any(|usable| what.starts_with(usable)), "{what}");
    let files = result["files"].as_array().expect("files");
    assert_eq!(files[0]["name"], "report.html");
    let report = Ask::get("/api/file/0").key(&key).of(&site);
    assert_eq!(report.status, 200);
    let stored = std::fs::read(folder.join("report.html")).expect("it's there");
    assert!(contains(&report.body, &stored[..1000.min(stored.len())]));
    let picture = Ask::get("/api/picture").key(&key).of(&site);
    assert_eq!(picture.status, 200);
    assert!(image::load_from_memory(&picture.body).is_ok_and(|picture| picture.width() == 640));
    let journal = std::fs::read_to_string(folder.join("journal.jsonl")).expect("it's there");
    assert_eq!(journal.matches("undo_last").count(), 1, "it's recorded as the window's are");
}

/// A watcher may have any number of keys and connections.
#[test]
fn hundreds_of_streams_of_watchers_leave_an_owner_and_pictures_alone() {
    let site = Site::new();
    let owner = site.key(&site.owner);
    let watchers: Vec<String> = (0..9).map(|_| site.key(&site.watcher)).collect();
    let follow = |key: &str| {
        let mut stream = TcpStream::connect(site.at).expect("the page is served");
        stream.set_read_timeout(Some(PATIENCE)).expect("a time-out");
        stream.write_all(&Ask::get("/api/events").key(key).bytes(&site)).expect("it reads");
        assert!(stream.read(&mut [0; 64]).expect("an answer") > 0);
        stream
    };
    let streams: Vec<TcpStream> = (0..256).map(|n| follow(&watchers[n % 8])).collect();
    for route in ["/", "/api/events"] {
        assert_eq!(Ask::get(route).key(&owner).of(&site).status, 200, "{route}");
    }
    for id in 0..2 {
        let frame = Frame {
            id: FrameId(id),
            captured_at: CaptureTime { nanos: 0 },
            kind: FrameKind::Video,
            name: String::new(),
            image: image::GrayImage::new(64, 48),
        };
        site.hub.captured(&Arc::new(frame));
    }
    assert_eq!(Ask::get("/api/picture").key(&watchers[8]).of(&site).status, 200);
    drop(streams);
}

#[test]
fn a_page_that_reads_nothing_is_let_go() {
    let site = Site::new();
    let key = site.key(&site.owner);
    let mut stream = TcpStream::connect(site.at).expect("the page is served");
    stream.write_all(&Ask::get("/api/events").key(&key).bytes(&site)).expect("it reads");
    let began = Instant::now();
    while site.hub.pages() == 0 && began.elapsed() < PATIENCE {
        sleep(Duration::from_millis(5));
    }
    assert_eq!(site.hub.pages(), 1);
    drop(stream);
    while site.hub.pages() > 0 && began.elapsed() < PATIENCE {
        sleep(Duration::from_millis(5));
    }
    assert!(site.hub.alone_secs().is_some());
}

#[test]
fn an_owners_link_lets_one_phone_in_and_the_next_link_is_told() {
    let site = Site::new();
    let told = Arc::new(std::sync::Mutex::new(Vec::new()));
    let server = site.server.as_ref().expect("it's served here");
    server.when_used({
        let told = Arc::clone(&told);
        move |links| told.lock().expect("no panic").push(links[0].owner.clone())
    });
    let key = site.key(&site.owner);
    let claim = Secret::random().expect("randomness").text();
    let again = format!("{{\"token\":\"{}\",\"claim\":\"{claim}\"}}", site.owner);
    let again = Ask::post("/api/enter", &again).of(&site);
    assert_eq!((again.status, again.text().contains("Another phone")), (410, true));
    assert_eq!(Ask::get("/api/events").key(&key).of(&site).status, 200, "the first goes on");
    let next = server.links()[0].owner.clone();
    assert_eq!(*told.lock().expect("no panic"), std::slice::from_ref(&next));
    let (_, next) = next.split_once('#').expect("a token");
    assert!(!site.key(next).is_empty());
    // Watchers share their keys.
    assert!(!site.key(&site.watcher).is_empty() && !site.key(&site.watcher).is_empty());
}

#[test]
fn a_phone_outlives_the_program_only_if_its_secret_is_kept() {
    let kept = Secret::random().expect("randomness");
    let before = Site::with(Some(kept));
    let (owner, key) = (before.owner.clone(), before.key(&before.owner));
    drop(before);
    let status = |site: &Site, key: &str| Ask::get("/api/events").key(key).of(site).status;
    let after = Site::with(Some(kept));
    assert_eq!((status(&after, &key), &after.owner), (200, &owner));
    assert_eq!(status(&after, &owner), 401, "a link is no key");
    let fresh = Site::new();
    assert_eq!(status(&fresh, &key), 401);
    assert_ne!(fresh.owner, owner);
}
