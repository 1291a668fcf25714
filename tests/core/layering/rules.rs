//! The rules of the house: who may use whom, and who may touch the outside world.

use super::scan::Word;

pub(crate) const RULES: Rules = Rules {
    may_use: &[
        ("lib", ""),
        ("markers", ""),
        ("board", "markers"),
        ("board_code", "board"),
        ("frame", ""),
        ("device", "frame"),
        ("panic_message", ""),
        ("parallel", ""),
        ("files", ""),
        ("geometry", "frame"),
        ("detection", "markers board board_code frame geometry"),
        ("calibration", "board frame parallel geometry"),
        ("guidance", "board frame geometry"),
        ("session", "board frame device geometry detection calibration guidance"),
        ("capture", "frame device panic_message files"),
        ("config", "markers board frame device files geometry calibration guidance session"),
        ("simulation", "markers board frame device files geometry capture config"),
        ("recording", "board frame device files geometry detection guidance session config"),
        ("pipeline", "board frame device panic_message detection session capture recording"),
        ("target", "markers board_code"),
        (
            "text",
            "markers board frame device geometry detection calibration guidance session target",
        ),
        ("ghost", "board geometry"),
        ("speech", "session text"),
        ("serve", "markers board frame device ghost guidance session pipeline text speech"),
        ("chart", ""),
        (
            "study",
            "board frame parallel geometry detection calibration guidance session simulation chart",
        ),
        ("report", "board frame geometry calibration text chart"),
        (
            "app",
            "markers board board_code frame device panic_message parallel files geometry detection calibration \
             guidance session capture config simulation recording pipeline target text speech serve report",
        ),
        (
            "ui",
            "markers board frame device panic_message geometry ghost calibration guidance session pipeline text \
             study app",
        ),
        (
            "cli",
            "markers board board_code frame device files geometry detection calibration guidance session capture \
             config simulation recording pipeline target text serve study report app ui",
        ),
        ("main", "cli"),
    ],
    panels: &[
        "ui/guide",
        "ui/result",
        "ui/replay",
        "ui/settings",
        "ui/start",
        "ui/user_error",
        "ui/picture",
        "ui/screen",
        "ui/theme",
    ],
    panels_may_use: &[
        "markers",
        "board",
        "frame",
        "device",
        "geometry",
        "ghost",
        "calibration",
        "guidance",
        "session",
        "text",
        "ui",
        "app/host",
        "app/recordings",
    ],
    only_in: &[
        // Decisions are a pure fold: no threads, channels, files, clocks, chance or printing below.
        // nokhwa's calls may never return: it has a thread that can be left behind.
        (
            Reach::Path("std::thread"),
            &["parallel", "pipeline", "study", "app", "cli", "capture/nokhwa", "serve/server.rs"],
        ),
        (Reach::Path("crossbeam_channel"), &["pipeline", "app", "cli"]),
        // One place opens and writes files; sysfs, and the lock of a session, are other matters.
        (Reach::Path("std::fs"), &["files", "capture/v4l2", "recording/folder.rs"]),
        (Reach::Path("tempfile"), &["files"]),
        (Reach::Method("exists"), FILES),
        (Reach::Method("try_exists"), FILES),
        (Reach::Method("is_file"), FILES_AND_SOUND),
        (Reach::Method("is_dir"), FILES),
        (Reach::Method("is_symlink"), FILES),
        (Reach::Method("metadata"), FILES),
        (Reach::Method("symlink_metadata"), FILES),
        (Reach::Method("canonicalize"), FILES),
        (Reach::Method("read_dir"), FILES),
        (Reach::Method("read_link"), FILES),
        (Reach::Method("sync_all"), FILES),
        (Reach::Path("std::env"), &["app", "cli", "ui/run", "ui/sound"]),
        (Reach::Path("std::process"), &["capture", "app", "cli", "main", "ui/sound"]),
        (Reach::Path("std::net"), &["serve"]),
        (Reach::Path("tokio"), &["serve", "app/batch/cloud"]),
        (Reach::Path("tokio_rustls"), &["serve"]),
        (Reach::Path("axum"), &["serve"]),
        (Reach::Path("hyper"), &["serve"]),
        (Reach::Path("getrandom"), &["serve/keys.rs"]),
        (Reach::Path("std::os"), &["capture", "files"]),
        (Reach::Path("std::io::stdin"), &["cli"]),
        (Reach::Path("std::io::stdout"), &["cli"]),
        (Reach::Path("std::io::stderr"), &["cli"]),
        // A stream read through another program or library has no clock of a driver.
        (
            Reach::Path("std::time::Instant"),
            &["pipeline", "app", "cli", "capture/nokhwa", "capture/ffmpeg", "serve"],
        ),
        (Reach::Path("std::time::SystemTime"), &[]),
        (Reach::Path("std::time::UNIX_EPOCH"), &[]),
        (Reach::Path("jiff"), &["recording", "app", "cli"]),
        (Reach::Path("rand"), &["simulation", "study"]),
        (Reach::Path("rand_chacha"), &["simulation", "study"]),
        (Reach::Path("rand_distr"), &["simulation", "study"]),
        (Reach::Path("libc"), &["capture", "simulation/kernel"]),
        (Reach::Path("rustix"), &["capture", "files", "serve/server.rs"]),
        (Reach::Path("v4l"), &["capture", "simulation/kernel"]),
        (Reach::Path("nokhwa"), &["capture"]),
        (Reach::Macro("print"), &[]),
        (Reach::Macro("println"), &[]),
        (Reach::Macro("eprint"), &[]),
        (Reach::Macro("eprintln"), &[]),
        // Formats are read and written where files are.
        (Reach::Path("toml"), &["config", "recording", "app", "cli", "simulation/scene_file"]),
        (Reach::Path("serde_saphyr"), &["calibration/files/import"]),
        (Reach::Path("rusqlite"), &["app/history"]),
        (Reach::Path("parquet"), &["app/batch/parquet_table.rs"]),
        (Reach::Path("object_store"), &["app/batch/cloud"]),
        (Reach::Path("rustls"), &["app/batch/cloud/client.rs"]),
        (Reach::Path("futures_util"), &["app/batch/cloud"]),
        (Reach::Path("clap"), &["cli"]),
        (Reach::Path("anyhow"), &["app", "cli"]),
        (Reach::Path("egui"), &["ui"]),
        (Reach::Path("eframe"), &["ui"]),
        // People's units stop at the edge: settings, files, sentences.
        (
            Reach::Ending("_mm"),
            &[
                "config",
                "simulation/scene_file",
                "calibration/files",
                "target",
                "text",
                "report",
                "app",
                "cli",
            ],
        ),
        (Reach::Method("to_degrees"), &["calibration/files", "text", "study", "app", "cli"]),
    ],
    only_by: &[("recording::replay::replay", &["app/saved_session.rs"])],
    unsafe_in: "capture/v4l2/linux.rs",
};

const FILES: &[&str] = &["files", "capture", "recording", "app", "cli"];
const FILES_AND_SOUND: &[&str] = &["files", "capture", "recording", "app", "cli", "ui/sound"];

/// The tables that say who may do what.
pub(crate) struct Rules {
    /// A room and the rooms it may use, bottom up.
    pub(crate) may_use: &'static [(&'static str, &'static str)],
    /// Files and folders of panels, and the rooms and files that they may use.
    pub(crate) panels: &'static [&'static str],
    pub(crate) panels_may_use: &'static [&'static str],
    /// What reaches outside, and the only rooms, folders and files that may.
    pub(crate) only_in: &'static [(Reach, &'static [&'static str])],
    /// An item of this crate and the only files that may use it.
    pub(crate) only_by: &'static [(&'static str, &'static [&'static str])],
    /// The only file with unsafe code.
    pub(crate) unsafe_in: &'static str,
}

/// A way to the outside world, or to something else that few places may do.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Reach {
    /// A path of another crate, and all below it.
    Path(&'static str),
    /// A method, by whatever type.
    Method(&'static str),
    Macro(&'static str),
    /// A name that ends so.
    Ending(&'static str),
}

impl Reach {
    pub(crate) fn is_path(self, path: &[String]) -> bool {
        match self {
            Self::Path(start) => {
                let start: Vec<&str> = start.split("::").collect();
                path.len() >= start.len() && path.iter().zip(&start).all(|(a, b)| a == b)
            }
            // `Path::exists` is a method, too.
            Self::Method(name) => {
                path.len() > 3 && path[1] == "path" && path.last().is_some_and(|last| last == name)
            }
            Self::Macro(_) | Self::Ending(_) => false,
        }
    }

    pub(crate) fn is_word(self, word: &Word) -> bool {
        match (self, word) {
            (Self::Method(method), Word::Method(name)) => method == name,
            (Self::Macro(called), Word::Macro(name)) => called == name,
            (Self::Ending(end), Word::Name(name)) => name.ends_with(end),
            _ => false,
        }
    }

    pub(crate) fn words(self) -> String {
        match self {
            Self::Path(path) => format!("`{path}`"),
            Self::Method(name) => format!("`.{name}()`"),
            Self::Macro(name) => format!("`{name}!`"),
            Self::Ending(end) => format!("name in `{end}`"),
        }
    }
}
