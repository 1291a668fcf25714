//! Rules of the architecture: access to the outside world.

use super::scan::Word;

pub(crate) const RULES: Rules = Rules {
    of_rooms: &["boresight", "guide", "run", "present", "fleet"],
    panels: &[
        "boresight/ui/guide",
        "boresight/ui/result",
        "boresight/ui/replay",
        "boresight/ui/settings",
        "boresight/ui/start",
        "boresight/ui/user_error",
        "boresight/ui/picture",
        "boresight/ui/screen",
        "boresight/ui/theme",
    ],
    panels_may_use: &[
        "geometry",
        "calibrate",
        "guide",
        "present/ghost",
        "present/instruction",
        "present/reading",
        "present/text",
        "boresight/ui",
        "app/host",
        "app/recordings",
    ],
    // Dependencies on libraries are in `Cargo.toml`; here are the other rules.
    only_in: &[
        // Decisions are a pure fold: no threads, channels, files, clocks, chance or printing below.
        // nokhwa's calls may never return: it has a disposable thread. DDS has threads to wake
        // ours.
        (
            Reach::Path("std::thread"),
            &[
                "geometry/parallel",
                "capture/nokhwa",
                "capture/ros2",
                "run/pipeline",
                "app",
                "phone/server.rs",
                "phone/session_page",
                "fleet/batch",
                "boresight/cli",
                "boresight/window_host",
                "study",
            ],
        ),
        // A single place opens and writes files; exceptions are sysfs, the lock of a session, and
        // bags written by their own library.
        (
            Reach::Path("std::fs"),
            &["files", "capture/bag/copy.rs", "capture/v4l2", "run/recording/folder.rs"],
        ),
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
        (
            Reach::Path("std::env"),
            &["app", "fleet/batch/cloud", "boresight/cli", "boresight/ui/sound"],
        ),
        (
            Reach::Path("std::process"),
            &[
                "capture",
                "app",
                "fleet/batch",
                "boresight/cli",
                "boresight/main",
                "boresight/ui/sound",
                "boresight/window_host",
                "study/main",
            ],
        ),
        (Reach::Path("std::net"), &["phone", "capture/gige", "capture/ros2"]),
        (Reach::Path("std::os"), &["capture", "files"]),
        (Reach::Path("std::io::stdin"), &["boresight/cli", "capture/pipe"]),
        (Reach::Path("std::io::stdout"), &["boresight/cli"]),
        (Reach::Path("std::io::stderr"), &["boresight/cli"]),
        // A stream read through another program or library has no clock of a driver.
        (
            Reach::Path("std::time::Instant"),
            &[
                "capture/nokhwa",
                "capture/ffmpeg",
                "capture/pipe",
                "capture/ros2",
                "capture/stream_report.rs",
                "run/pipeline",
                "app",
                "phone",
                "fleet/batch",
                "boresight/cli",
            ],
        ),
        (Reach::Path("std::time::SystemTime"), &[]),
        (Reach::Path("std::time::UNIX_EPOCH"), &[]),
        (Reach::Macro("print"), &[]),
        (Reach::Macro("println"), &[]),
        (Reach::Macro("eprint"), &[]),
        (Reach::Macro("eprintln"), &[]),
        // Randomness of the system is for keys alone; the simulation's comes from a seed.
        (Reach::Path("getrandom"), &["phone/keys.rs"]),
        (Reach::Path("object_store"), &["fleet/batch/cloud"]),
        (Reach::Path("clap"), &["boresight/cli", "study/main"]),
        (Reach::Path("egui"), &["boresight/ui", "study/window", "study/main"]),
        // Deciding numbers are the same on every processor: the system's functions round
        // differently between machines, those of the crate `libm` don't. Drawings, sounds and
        // studies may use them.
        (Reach::SystemMathematics, &["boresight", "study"]),
        // People's units stop at the edge: settings, files, sentences.
        (
            Reach::Ending("_mm"),
            &[
                "run/config",
                "sim/scene_file",
                "formats",
                "present/target",
                "present/text",
                "present/report",
                "app",
                "phone/session_page",
                "web/request.rs",
                "boresight/cli",
                "boresight/window_host",
            ],
        ),
        (
            Reach::Method("to_degrees"),
            &["formats", "present/text", "study", "app", "boresight/cli"],
        ),
    ],
    only_by: &[("run::recording::replay::replay", &["app/saved_session.rs"])],
    unsafe_in: "capture/v4l2/linux.rs",
};

const FILES: &[&str] = &[
    "files",
    "capture",
    "run/recording",
    "app",
    "fleet",
    "boresight/cli",
    "boresight/window_host",
    "study/study_folder",
];
const FILES_AND_SOUND: &[&str] = &[
    "files",
    "capture",
    "run/recording",
    "app",
    "fleet",
    "boresight/cli",
    "boresight/window_host",
    "boresight/ui/sound",
];

/// Tables of permissions.
pub(crate) struct Rules {
    /// Crates with rooms as modules at the root.
    pub(crate) of_rooms: &'static [&'static str],
    /// Files and folders of panels, and the crates, rooms and files allowed.
    pub(crate) panels: &'static [&'static str],
    pub(crate) panels_may_use: &'static [&'static str],
    /// Ways to the outside, and the only crates, folders and files allowed.
    pub(crate) only_in: &'static [(Reach, &'static [&'static str])],
    /// An item and the only permitted users.
    pub(crate) only_by: &'static [(&'static str, &'static [&'static str])],
    /// The only file with unsafe code.
    pub(crate) unsafe_in: &'static str,
}

/// A way to the outside world, or another privilege of few places.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Reach {
    /// A path of another crate, and all below.
    Path(&'static str),
    /// A method of any type.
    Method(&'static str),
    Macro(&'static str),
    /// A name suffix.
    Ending(&'static str),
    /// A sine, a power, a logarithm, as computed by the system.
    SystemMathematics,
}

const MATHEMATICS: &[&str] = &[
    "sin", "cos", "tan", "sin_cos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp",
    "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "powf", "cbrt", "hypot",
];

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
            Self::SystemMathematics => {
                matches!(path, [float, name] if ["f32", "f64"].contains(&float.as_str())
                    && MATHEMATICS.contains(&name.as_str()))
            }
            Self::Macro(_) | Self::Ending(_) => false,
        }
    }

    pub(crate) fn is_word(self, word: &Word) -> bool {
        match (self, word) {
            (Self::Method(method), Word::Method(name)) => method == name,
            (Self::Macro(called), Word::Macro(name)) => called == name,
            (Self::Ending(end), Word::Name(name)) => name.ends_with(end),
            (Self::SystemMathematics, Word::Method(name)) => MATHEMATICS.contains(&name.as_str()),
            _ => false,
        }
    }

    pub(crate) fn words(self) -> String {
        match self {
            Self::Path(path) => format!("`{path}`"),
            Self::Method(name) => format!("`.{name}()`"),
            Self::Macro(name) => format!("`{name}!`"),
            Self::Ending(end) => format!("name in `{end}`"),
            Self::SystemMathematics => "mathematics of the system".to_owned(),
        }
    }
}
