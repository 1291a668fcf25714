//! Through what cameras are read, and what that cannot promise.

/// Linux's interface was asked for on another system.
pub const V4L_ELSEWHERE: &str = "the backend v4l is Linux's own; on this system it is nokhwa";

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
        is: "the kernel's own interface, with frames checked, timed and counted by the driver's word, and controls locked and watched",
        is_default: true,
        cannot: &[
            "JPEG has no checksum: a changed bit that leaves every code its length is not noticed.",
        ],
    };
    let nokhwa = BackendWords {
        name: "nokhwa",
        is: "the library of that name",
        is_default: !HAS_V4L,
        cannot: NOKHWA_CANNOT,
    };
    let built = [(v4l, HAS_V4L), (nokhwa, cfg!(feature = "nokhwa"))];
    built.into_iter().filter_map(|(backend, is_built)| is_built.then_some(backend)).collect()
}

/// What nokhwa cannot promise.
const NOKHWA_CANNOT: &[&str] = &[
    "Focus, zoom, exposure, gain and white balance are neither locked nor watched.",
    "Frames carry no number: what the driver lost is not counted. They are timed as they arrive, not as they were taken.",
    if cfg!(target_os = "linux") {
        "Error marks and lengths are not passed on: of a frame that was cut, older bytes are the rest. In MJPG most such frames are noticed and refused, in other formats none."
    } else {
        "Error marks are not passed on: damage is noticed in MJPG frames and in frames that are too short."
    },
    "Rows with gaps between them cannot be read, for their distance is not passed on; nor can GREY on Linux.",
    "A camera that goes silent is said to be lost after 2 s and waited for, never started again: plug it out and in.",
    if cfg!(target_os = "linux") {
        "A camera that another program left at a rate such as 7.5 per second or in an unknown format is refused until it is plugged in again."
    } else {
        "Modes and controls are not listed here, and a camera without an address of its own is known by its name only."
    },
];
