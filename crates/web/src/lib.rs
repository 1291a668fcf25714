//! A session in a browser: what one worker of the page holds.
//!
//! ```text
//!  main thread                                   worker
//!  camera ─▶ <video> ─▶ canvas, ghost, words
//!               └─newest frame, if the worker waits─▶ Guide::look ─▶ detector ─▶ session
//!  speech, pages ◀─────────[name, value] as JSON──────────┘   (news, plan, live, ended)
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `guide` | [`Guide`], which the worker calls |
//! | `request` | what the page asks for |
//! | `folder` | the session's folder in memory: header, journal, pictures |
//! | `page.js`, `worker.js`, `about.html` | the page's own script beside [`boresight_present::browser`], the worker's, and what the page says about itself |
//! | `pack.py` | makes one file of all of it |
//!
//! Detector, session, journal and files are those of the program, so a session that's downloaded here is replayed,
//! reported and resumed there.

#![forbid(unsafe_code)]

mod folder;
mod guide;
mod request;

pub use guide::{Guide, dictionaries, size_of};

use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console, js_name = error)]
    fn log_error(text: &str);
}

/// Called once, when the module is loaded: a panic is told with its place.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|panic| log_error(&panic.to_string())));
}
