//! Who hears of a camera: a webhook at each change, and the reason why there is no answer.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::{TcpListener, TcpStream},
    process::{Command, Stdio},
    thread,
};

use boresight_station::command::Arguments;
use clap::Parser;
use serde_json::Value;
use tempfile::TempDir;

#[derive(Parser)]
struct Watch {
    #[command(flatten)]
    arguments: Arguments,
}

/// A web server that keeps the body of each POST, until an empty one comes.
struct Hook {
    address: String,
    bodies: thread::JoinHandle<Vec<Value>>,
}

fn body(stream: TcpStream) -> Vec<u8> {
    let mut reader = BufReader::new(stream);
    let (mut line, mut length) = (String::new(), 0);
    while reader.read_line(&mut line).expect("read") > 2 {
        let (name, value) = line.split_once(':').unwrap_or_default();
        if name.eq_ignore_ascii_case("content-length") {
            length = value.trim().parse().expect("a number");
        }
        line.clear();
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body).expect("read");
    let answer = b"HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n";
    reader.into_inner().write_all(answer).expect("answered");
    body
}

impl Hook {
    fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address").to_string();
        let serve = move || {
            let all = listener.incoming().map(|stream| body(stream.expect("accepted")));
            let json = |body: Vec<u8>| serde_json::from_slice(&body).expect("JSON");
            all.take_while(|body| !body.is_empty()).map(json).collect()
        };
        let bodies = thread::Builder::new().name("hook".into()).spawn(serve).expect("a thread");
        Self { address, bodies }
    }

    /// What came so far.
    fn heard(self) -> Vec<Value> {
        let mut last = TcpStream::connect(&self.address).expect("connected");
        last.write_all(b"POST / HTTP/1.1\r\nContent-Length: 0\r\n\r\n").expect("written");
        self.bodies.join().expect("served")
    }
}

fn has_curl() -> bool {
    let curl = Command::new("curl").arg("--version").stdout(Stdio::null()).status();
    let is_there = curl.is_ok_and(|status| status.success());
    assert!(is_there || std::env::var_os("CI").is_none(), "curl is missing");
    is_there
}

#[test]
fn a_webhook_hears_each_change_once_and_no_picture() {
    if !has_curl() {
        println!("skipped: curl is missing");
        return;
    }
    let (place, hook) = (TempDir::new().expect("a folder"), Hook::new());
    let metrics = place.path().join("watch.prom");
    let store = place.path().join("mast");
    let post = format!("curl -sS --noproxy '*' --data-binary @- http://{}/", hook.address);
    let arguments = Watch::try_parse_from([
        "watch",
        "sim:street:3,days=0.12,pan=8px@0.04d,cover=1@0.08d",
        "--every=5m",
        "--pin",
        "--store",
        store.to_str().expect("a path"),
        "--metrics",
        metrics.to_str().expect("a path"),
        "--on-finish",
        &post,
    ]);
    arguments.expect("arguments").arguments.run().expect("watched");
    let heard = hook.heard();
    let mut states: Vec<&str> = heard.iter().filter_map(|line| line["state"].as_str()).collect();
    assert_eq!(heard[0]["schema"], "boresight.watch-state/1");
    assert!(heard.len() <= 8, "{} posts: {heard:?}", heard.len());
    states.dedup();
    // Commands of changes that follow each other at once may overtake.
    for state in ["OK", "MOVED"] {
        assert!(states.contains(&state), "{state} of {states:?}");
    }
    // A camera that has moved stays so while it's covered: the reason is heard.
    let is_covered = |line: &&Value| line["state"] == "MOVED" && line["reason"].is_string();
    assert!(heard.iter().any(|line| is_covered(&line)), "{heard:?}");
    let page = std::fs::read_to_string(metrics).expect("written");
    let reason = "boresight_watch_reason{file=\"watch\",camera=\"mast\",reason=\"";
    assert!(page.contains(reason), "{page}");
}
