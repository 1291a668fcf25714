//! Camera backends and their limits.

/// Linux's interface was asked for on another system.
pub const V4L_ELSEWHERE: &str = "the v4l backend is available on Linux only; use nokhwa here";

/// A way to a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BackendWords {
    /// What `--backend` calls it.
    pub name: &'static str,
    /// What it is.
    pub is: &'static str,
    /// Whether it is the one that is taken when none is named.
    pub is_default: bool,
    /// What it cannot promise.
    pub cannot: &'static [&'static str],
}

/// Whether this build reads cameras through V4L2.
const HAS_V4L: bool = cfg!(all(target_os = "linux", feature = "live"));

/// The ways to a camera in this build, the usual one first.
pub fn backends() -> Vec<BackendWords> {
    let v4l = BackendWords {
        name: "v4l",
        is: "the Linux kernel interface: frames are checked, time-stamped and counted by the driver; controls are locked and watched",
        is_default: true,
        cannot: &["JPEG has no checksum: a flipped bit can go unnoticed."],
    };
    let nokhwa = BackendWords {
        name: "nokhwa",
        is: "the nokhwa library",
        is_default: !HAS_V4L,
        cannot: NOKHWA_CANNOT,
    };
    let built = [(v4l, HAS_V4L), (nokhwa, cfg!(feature = "nokhwa"))];
    built.into_iter().filter_map(|(backend, is_built)| is_built.then_some(backend)).collect()
}

/// What nokhwa cannot promise.
const NOKHWA_CANNOT: &[&str] = &[
    "Focus, zoom, exposure, gain and white balance aren't locked or watched.",
    "Frames have no numbers, so lost frames aren't counted. Time stamps are those of arrival, not of capture.",
    if cfg!(target_os = "linux") {
        "Driver error flags are lost: the end of a truncated frame holds old data. Most such frames are rejected in MJPG, none in other formats."
    } else {
        "Driver error flags are lost: damage is detected only in MJPG frames and in frames that are too short."
    },
    "Frames with padded rows can't be read, nor can GREY on Linux.",
    "A silent camera is reported lost after 2 s and isn't restarted: unplug it and plug it back in.",
    if cfg!(target_os = "linux") {
        "A camera that another program left at a frame rate such as 7.5 or in an unknown format is refused until you unplug it and plug it back in."
    } else {
        "Modes and controls aren't listed, and a camera without an address is identified by name only."
    },
];
