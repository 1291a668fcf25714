//! Whole sessions by what the page says and shows, in a browser. They take real time and need chromium, chromedriver and
//! espeak-ng, so they run only if `BORESIGHT_BROWSER` names a folder for what they record:
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

/// Where to record, if these tests are asked for.
fn asked_for() -> Option<PathBuf> {
    let folder = PathBuf::from(std::env::var_os("BORESIGHT_BROWSER")?);
    std::fs::create_dir_all(&folder).expect("a folder");
    Some(folder)
}
