//! Whole sessions by the words and drawings of the page, in a browser. They take real time and need
//! chromium, chromedriver and espeak-ng, and run only if `BORESIGHT_BROWSER` names a folder for
//! recordings:
//!
//! ```sh
//! BORESIGHT_BROWSER=/tmp/phone cargo test --test live phone_browser -- --nocapture --test-threads=1
//! ```

mod browser;
mod head;
mod link;
mod person;
mod sessions;
mod states;

use std::path::PathBuf;

/// Folder for recordings, if requested.
fn asked_for() -> Option<PathBuf> {
    let folder = PathBuf::from(std::env::var_os("BORESIGHT_BROWSER")?);
    std::fs::create_dir_all(&folder).expect("a folder");
    Some(folder)
}
