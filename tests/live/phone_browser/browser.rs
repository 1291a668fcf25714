//! A browser with the screen of a phone.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::{Value, json};

/// A browser driven by chromedriver.
pub(super) struct Browser {
    driver: Child,
    port: u16,
    session: String,
}

impl Browser {
    pub(super) fn open(width: u32, height: u32) -> Self {
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

    /// Runs `script` in every page before the page's scripts.
    pub(super) fn before(&self, script: &str) {
        self.cdp("Page.addScriptToEvaluateOnNewDocument", &json!({"source": script}));
    }

    pub(super) fn go(&self, url: &str) {
        self.call("POST", &format!("/session/{}/url", self.session), &json!({"url": url}));
    }

    pub(super) fn run(&self, script: &str) -> Value {
        let path = format!("/session/{}/execute/sync", self.session);
        self.call("POST", &path, &json!({"script": script, "args": []}))
    }

    pub(super) fn until(&self, condition: &str) {
        let began = Instant::now();
        while self.run(&format!("return !!({condition})")) != true {
            assert!(began.elapsed() < Duration::from_secs(60), "never: {condition}");
            sleep(Duration::from_millis(30));
        }
    }

    pub(super) fn shoot(&self, file: &Path) {
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
