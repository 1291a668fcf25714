//! Parts of the program missing from the build.

/// A part of the program missing from the build.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "this build has no {part}; for one that has, run: cargo build --release --features {feature}"
)]
pub struct MissingFeature {
    /// Name of the missing part, in plural or as "window".
    pub part: &'static str,
    /// Cargo feature of the part.
    pub feature: &'static str,
}

impl MissingFeature {
    /// The window.
    pub const WINDOW: Self = Self { part: "window", feature: "window" };
    /// Cameras of Linux, network streams and video files.
    pub const LIVE: Self =
        Self { part: "live cameras, network streams or video files", feature: "live" };
    /// Machine-vision cameras on the network.
    pub const GIGE: Self = Self { part: "GigE Vision cameras", feature: "gige" };
    /// Image topics of ROS 2.
    pub const ROS2: Self = Self { part: "topics of ROS 2", feature: "ros2" };
    /// Recorded bags.
    pub const BAGS: Self = Self { part: "recorded bags (MCAP, .db3)", feature: "bags" };
    /// Shell completions and manual pages.
    pub const MANUAL: Self = Self { part: "shell completions or manual pages", feature: "manual" };
    /// The HTML report.
    pub const REPORT: Self = Self { part: "HTML reports", feature: "report" };
    /// Installed cameras that are watched.
    pub const WATCH: Self = Self { part: "watch over installed cameras", feature: "watch" };
    /// Many sessions at once.
    pub const BATCH: Self = Self { part: "batches of sessions", feature: "batch" };
    /// Calibrations over time.
    pub const HISTORY: Self = Self { part: "history of cameras", feature: "history" };
    /// Tables in Parquet.
    pub const PARQUET: Self = Self { part: "tables in Parquet", feature: "parquet" };
    /// Sessions and results of a batch in object stores.
    pub const CLOUD: Self = Self { part: "object stores (s3://…)", feature: "cloud" };
    /// The page for a phone.
    pub const SERVE: Self = Self { part: "page for a phone", feature: "serve" };
}
