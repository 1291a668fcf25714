//! A session in a browser: state of the page's worker.
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
//! | `guide` | [`Guide`], called by the worker |
//! | `judging` | somebody's calibration beside the pictures |
//! | `request` | requests from the page, errors told to it |
//! | `folder` | the session's folder in memory: header, journal, pictures |
//! | `page.js`, `worker.js` | scripts beside [`boresight_present::browser`], and of the worker |
//! | `about.html` | the page's description of itself |
//! | `pack.py` | packs everything into one file |
//!
//! Detector, session, journal and files are those of the program, so the program can replay, report
//! and resume a downloaded session.

#![forbid(unsafe_code)]

mod folder;
mod guide;
mod judging;
mod request;

pub use guide::{Guide, dictionaries, size_of};
pub use judging::judged_alone;

use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_namespace = console, js_name = error)]
    fn log_error(text: &str);
}

/// Initialises the module when loaded: a panic is reported with its location.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|panic| log_error(&panic.to_string())));
}
