//! `boresight web`.

use std::{
    path::{Path, PathBuf},
    sync::atomic::Ordering,
    time::Duration,
};

use anyhow::Context;
use clap::Args;

use boresight_app::Exit;
use boresight_files::{Links, read};
use boresight_phone::{ServeAddress, WebPage};
use boresight_present::text::phone as words;
use boresight_terminal::{announcer, stop_flag};

/// Locations of the page relative to the program's folder: installed, and as left by `make web`.
const PLACES: [&str; 2] = ["../share/boresight/boresight.html", "../web/boresight.html"];
/// Largest page, in bytes.
const LIMIT: u64 = 64 << 20;
const LOOK: Duration = Duration::from_millis(100);

/// Serve the page that calibrates in a browser, to this computer.
///
/// The page needs nothing else: webcam, pictures or a video are looked at in the browser, and
/// nothing leaves it. It's one file, which also works when it's opened from a disk. Ctrl-C ends.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// An address of this computer with a port. Only to localhost do browsers give their camera
    /// without HTTPS.
    #[arg(value_name = "ADDRESS", default_value = "127.0.0.1:8418")]
    address: ServeAddress,
    /// The page [default: as installed, or as `make web` made it].
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  boresight web
  boresight web 127.0.0.1:9000 --page boresight.html";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let page = self.page.or_else(found).context(words::NO_WEB_PAGE)?;
        let stop = stop_flag()?;
        let served = WebPage::serve(self.address, read(&page, LIMIT, Links::Followed)?)?;
        announcer().say(&words::web_page(&served.link(), served.is_on_every_interface()));
        while !stop.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
        }
        Ok(Exit::Good)
    }
}

/// Page of the program.
fn found() -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?;
    let folder = program.parent().unwrap_or(Path::new("."));
    PLACES.iter().map(|place| folder.join(place)).find(|page| page.is_file())
}
