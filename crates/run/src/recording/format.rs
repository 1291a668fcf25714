//! The journal's lines: mirrors of the session's types, so the file format cannot freeze the core.

use nalgebra::{Matrix2, Point2};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::camera_line::CameraLine;
use boresight_detect::{Detection, Miss, OtherBoard, Quality, Side};
use boresight_geometry::{
    Corner,
    frame::{CaptureTime, FrameId, FrameKind, ImageSize, SceneScale},
    markers::{CircleRows, Dictionary},
};
use boresight_guide::{
    guidance::{Purpose, Target},
    session::{Command, Input, Observation, ViewNumber},
};

/// One line of the journal: the checksum is over the exact bytes of `body`.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct Envelope {
    /// Number of the line, from 0.
    pub(super) seq: u64,
    /// CRC-32 of the bytes of `body`, eight hexadecimal digits.
    pub(super) crc32: String,
    /// As in the body, whose checksum covers it; of recordings before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) session: Option<String>,
    /// As in the body, of recordings before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) synced: Option<u64>,
    #[cfg_attr(feature = "schemas", schemars(with = "Line"))]
    pub(super) body: Box<RawValue>,
}

/// What a line says.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Line {
    /// What happened.
    pub input: InputLine,
    /// What was decided, as the JSON text of the `Decision` of that time.
    #[cfg_attr(feature = "schemas", schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    pub decision: Box<RawValue>,
    /// The picture stored with it, if one was.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub stored: Option<Stored>,
    /// CRC-32 of the bytes of `session.toml`, in the first line; older recordings have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub session: Option<String>,
    /// Lines that were synced when this one was written, in the first line after each time. Damage
    /// before them is no cut.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub synced: Option<u64>,
}

/// A picture in `frames/`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Stored {
    /// Number of the frame.
    pub frame: u64,
    /// CRC-32 of the file, hexadecimal.
    pub crc32: String,
}

/// Mirror of [`Input`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum InputLine {
    /// See [`Input::Observed`].
    Observed(ObservedLine),
    /// See [`Input::Command`].
    Command(CommandLine),
    /// See [`Input::Led`].
    Led {
        /// Pose requested by the rig, if any.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pose: Option<PoseLine>,
    },
    /// See [`Input::Camera`].
    Camera(CameraLine),
    /// See [`Input::WorkerFailed`].
    WorkerFailed {
        /// Name of the worker.
        worker: String,
        /// What it said.
        reason: String,
    },
    /// See [`Input::Resumed`].
    Resumed,
    /// See [`Input::Scene`].
    Scene {
        /// Number of a view, log focal length of its picture, and standard deviation.
        views: Vec<(u32, f64, f64)>,
    },
    /// See [`Input::SourceEnded`].
    SourceEnded,
    /// See [`Input::Stop`].
    Stop,
}

/// Mirror of a [`Target`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PoseLine {
    /// Direction in which the board recedes, clockwise from the right, and tilt, in radians.
    tipped_rad: [f64; 2],
    /// Requested pixels of the inner corners.
    ghost_px: Vec<[f64; 2]>,
}

impl PoseLine {
    fn of(target: &Target) -> Self {
        let Target { tilt_azimuth_rad, tilt_rad, ghost_px, .. } = target;
        let ghost_px = ghost_px.iter().map(|px| [px.x, px.y]).collect();
        Self { tipped_rad: [*tilt_azimuth_rad, *tilt_rad], ghost_px }
    }

    fn target(self) -> Target {
        let [tilt_azimuth_rad, tilt_rad] = self.tipped_rad;
        let ghost_px = self.ghost_px.iter().map(|[x, y]| Point2::new(*x, *y)).collect();
        let (purpose, leaves_picture) = (Purpose::MostInformative, false);
        Target { purpose, tilt_azimuth_rad, tilt_rad, ghost_px, leaves_picture }
    }
}

/// Mirror of [`Observation`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ObservedLine {
    frame: u64,
    nanos: u64,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    photograph: bool,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    size: [u32; 2],
    seen: SeenLine,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum SeenLine {
    /// `[x, y, var x, cov xy, var y]` of every corner. Of those listed in `unseen`, by their numbers on the board, the
    /// position is where they are expected, and the variances are zero.
    Board {
        corners: Vec<[f64; 5]>,
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        unseen: Vec<u32>,
        blur_px: f64,
        contrast: f64,
        glare: f64,
        motion_px: f64,
    },
    NoBoard,
    PartialBoard {
        found: usize,
        wanted: usize,
        /// Corners along the longer and the shorter side of the grid; absent if it doesn't count.
        #[serde(default, skip_serializing_if = "is_unknown")]
        size: [usize; 2],
        cut_off_by: Option<SideLine>,
    },
    Glare {
        found: usize,
        wanted: usize,
    },
    OtherBoard {
        columns: usize,
        rows: usize,
    },
    /// A plain board with at least this many corners.
    OtherLarger {
        columns: usize,
        rows: usize,
    },
    /// Of the family of this dictionary.
    OtherCharuco {
        #[cfg_attr(feature = "schemas", schemars(with = "String"))]
        dictionary: Dictionary,
        is_usual_side: bool,
    },
    OtherAprilGrid,
    OtherCircles {
        columns: usize,
        rows: usize,
        #[cfg_attr(feature = "schemas", schemars(with = "String"))]
        layout: CircleRows,
    },
    Mirrored,
    OtherMarkers {
        markers: usize,
    },
    OtherSquares {
        markers: usize,
    },
    TooSmall {
        square_px: f64,
        needed_px: f64,
    },
    Blurred {
        blur_px: f64,
        limit_px: f64,
    },
    LowContrast {
        contrast: f64,
        needed: f64,
    },
    OutOfTime,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
enum SideLine {
    Left,
    Right,
    Top,
    Bottom,
}

/// Mirror of [`Command`].
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CommandLine {
    /// See [`Command::ForceNext`].
    ForceNext,
    /// See [`Command::UndoLast`].
    UndoLast,
    /// See [`Command::Remove`].
    Remove {
        /// Number of the view.
        view: u32,
    },
    /// See [`Command::Restore`].
    Restore,
    /// See [`Command::Pause`].
    Pause,
    /// See [`Command::Resume`].
    Resume,
    /// See [`Command::TakeMore`].
    TakeMore,
}

impl InputLine {
    /// The observation, if the input has one.
    pub fn observed_mut(&mut self) -> Option<&mut ObservedLine> {
        match self {
            Self::Observed(observed) => Some(observed),
            _ => None,
        }
    }
}

impl ObservedLine {
    /// Number of the frame.
    pub fn frame(&self) -> u64 {
        self.frame
    }

    /// Clears the name of the picture.
    pub(super) fn forget_name(&mut self) {
        self.name.clear();
    }

    /// Replaces the detection by `seen`.
    pub fn see(&mut self, seen: &Result<Detection, Miss>) {
        self.seen = seen.as_ref().into();
    }
}

impl From<&Input> for InputLine {
    fn from(input: &Input) -> Self {
        match input {
            Input::Observed(observation) => Self::Observed(observation.into()),
            Input::Command(command) => Self::Command(match *command {
                Command::ForceNext => CommandLine::ForceNext,
                Command::UndoLast => CommandLine::UndoLast,
                Command::Remove { view } => CommandLine::Remove { view: view.0 },
                Command::Restore => CommandLine::Restore,
                Command::Pause => CommandLine::Pause,
                Command::Resume => CommandLine::Resume,
                Command::TakeMore => CommandLine::TakeMore,
            }),
            Input::Led(target) => Self::Led { pose: target.as_ref().map(PoseLine::of) },
            Input::Camera(event) => Self::Camera(event.into()),
            Input::WorkerFailed { worker, reason } => {
                Self::WorkerFailed { worker: worker.clone(), reason: reason.clone() }
            }
            Input::Resumed => Self::Resumed,
            Input::Scene(scales) => {
                let of =
                    |(view, scale): &(ViewNumber, SceneScale)| (view.0, scale.log_focal, scale.sd);
                Self::Scene { views: scales.iter().map(of).collect() }
            }
            Input::SourceEnded => Self::SourceEnded,
            Input::Stop => Self::Stop,
        }
    }
}

impl From<InputLine> for Input {
    fn from(line: InputLine) -> Self {
        match line {
            InputLine::Observed(observed) => Self::Observed(observed.into()),
            InputLine::Command(command) => Self::Command(match command {
                CommandLine::ForceNext => Command::ForceNext,
                CommandLine::UndoLast => Command::UndoLast,
                CommandLine::Remove { view } => Command::Remove { view: ViewNumber(view) },
                CommandLine::Restore => Command::Restore,
                CommandLine::Pause => Command::Pause,
                CommandLine::Resume => Command::Resume,
                CommandLine::TakeMore => Command::TakeMore,
            }),
            InputLine::Led { pose } => Self::Led(pose.map(PoseLine::target)),
            InputLine::Camera(line) => Self::Camera(line.into()),
            InputLine::WorkerFailed { worker, reason } => Self::WorkerFailed { worker, reason },
            InputLine::Resumed => Self::Resumed,
            InputLine::Scene { views } => {
                let of = |(view, log_focal, sd)| (ViewNumber(view), SceneScale { log_focal, sd });
                Self::Scene(views.into_iter().map(of).collect())
            }
            InputLine::SourceEnded => Self::SourceEnded,
            InputLine::Stop => Self::Stop,
        }
    }
}

impl From<&Observation> for ObservedLine {
    fn from(observation: &Observation) -> Self {
        Self {
            frame: observation.frame_id.0,
            nanos: observation.captured_at.nanos,
            photograph: observation.kind == FrameKind::Photograph,
            name: observation.name.clone(),
            size: [observation.image_size.width_px, observation.image_size.height_px],
            seen: observation.seen.as_ref().into(),
        }
    }
}

impl From<ObservedLine> for Observation {
    fn from(line: ObservedLine) -> Self {
        let kind = if line.photograph { FrameKind::Photograph } else { FrameKind::Video };
        Self {
            frame_id: FrameId(line.frame),
            captured_at: CaptureTime { nanos: line.nanos },
            kind,
            name: line.name,
            image_size: ImageSize { width_px: line.size[0], height_px: line.size[1] },
            seen: line.seen.into(),
        }
    }
}

impl From<Result<&Detection, &Miss>> for SeenLine {
    fn from(seen: Result<&Detection, &Miss>) -> Self {
        match seen {
            Ok(detection) => Self::Board {
                corners: detection.corners.iter().map(corner_to_line).collect(),
                unseen: (0..)
                    .zip(&detection.corners)
                    .filter_map(|(place, corner)| (!corner.is_seen()).then_some(place))
                    .collect(),
                blur_px: detection.quality.blur_px,
                contrast: detection.quality.contrast,
                glare: detection.quality.glare,
                motion_px: detection.quality.motion_px,
            },
            Err(miss) => miss_to_line(*miss),
        }
    }
}

impl From<SeenLine> for Result<Detection, Miss> {
    fn from(line: SeenLine) -> Self {
        Err(match line {
            SeenLine::Board { corners, unseen, blur_px, contrast, glare, motion_px } => {
                let mut corners: Vec<Corner> = corners.iter().map(corner_from_line).collect();
                for place in unseen {
                    if let Some(corner) = corners.get_mut(place as usize) {
                        *corner = Corner::unseen(corner.px);
                    }
                }
                return Ok(Detection {
                    corners,
                    quality: Quality { blur_px, contrast, glare, motion_px },
                });
            }
            SeenLine::NoBoard => Miss::NoBoard,
            SeenLine::PartialBoard { found, wanted, size, cut_off_by } => {
                let cut_off_by = cut_off_by.map(|side| match side {
                    SideLine::Left => Side::Left,
                    SideLine::Right => Side::Right,
                    SideLine::Top => Side::Top,
                    SideLine::Bottom => Side::Bottom,
                });
                Miss::PartialBoard { found, wanted, size, cut_off_by }
            }
            SeenLine::Glare { found, wanted } => Miss::Glare { found, wanted },
            SeenLine::OtherBoard { columns, rows } => {
                Miss::OtherBoard(OtherBoard::Plain { columns, rows })
            }
            SeenLine::OtherCharuco { dictionary, is_usual_side } => {
                Miss::OtherBoard(OtherBoard::Charuco { dictionary, is_usual_side })
            }
            SeenLine::OtherLarger { columns, rows } => {
                Miss::OtherBoard(OtherBoard::Larger { columns, rows })
            }
            SeenLine::OtherAprilGrid => Miss::OtherBoard(OtherBoard::AprilGrid),
            SeenLine::OtherCircles { columns, rows, layout } => {
                Miss::OtherBoard(OtherBoard::Circles { columns, rows, layout })
            }
            SeenLine::Mirrored => Miss::Mirrored,
            SeenLine::OtherMarkers { markers } => Miss::OtherMarkers { markers },
            SeenLine::OtherSquares { markers } => Miss::OtherSquares { markers },
            SeenLine::TooSmall { square_px, needed_px } => Miss::TooSmall { square_px, needed_px },
            SeenLine::Blurred { blur_px, limit_px } => Miss::Blurred { blur_px, limit_px },
            SeenLine::LowContrast { contrast, needed } => Miss::LowContrast { contrast, needed },
            SeenLine::OutOfTime => Miss::OutOfTime,
        })
    }
}

fn is_unknown(size: &[usize; 2]) -> bool {
    *size == [0; 2]
}

fn miss_to_line(miss: Miss) -> SeenLine {
    match miss {
        Miss::NoBoard => SeenLine::NoBoard,
        Miss::PartialBoard { found, wanted, size, cut_off_by } => {
            let cut_off_by = cut_off_by.map(|side| match side {
                Side::Left => SideLine::Left,
                Side::Right => SideLine::Right,
                Side::Top => SideLine::Top,
                Side::Bottom => SideLine::Bottom,
            });
            SeenLine::PartialBoard { found, wanted, size, cut_off_by }
        }
        Miss::Glare { found, wanted } => SeenLine::Glare { found, wanted },
        Miss::OtherBoard(other) => match other {
            OtherBoard::Plain { columns, rows } => SeenLine::OtherBoard { columns, rows },
            OtherBoard::Charuco { dictionary, is_usual_side } => {
                SeenLine::OtherCharuco { dictionary, is_usual_side }
            }
            OtherBoard::Larger { columns, rows } => SeenLine::OtherLarger { columns, rows },
            OtherBoard::AprilGrid => SeenLine::OtherAprilGrid,
            OtherBoard::Circles { columns, rows, layout } => {
                SeenLine::OtherCircles { columns, rows, layout }
            }
        },
        Miss::Mirrored => SeenLine::Mirrored,
        Miss::OtherMarkers { markers } => SeenLine::OtherMarkers { markers },
        Miss::OtherSquares { markers } => SeenLine::OtherSquares { markers },
        Miss::TooSmall { square_px, needed_px } => SeenLine::TooSmall { square_px, needed_px },
        Miss::Blurred { blur_px, limit_px } => SeenLine::Blurred { blur_px, limit_px },
        Miss::LowContrast { contrast, needed } => SeenLine::LowContrast { contrast, needed },
        Miss::OutOfTime => SeenLine::OutOfTime,
    }
}

fn corner_to_line(corner: &Corner) -> [f64; 5] {
    if !corner.is_seen() {
        return [corner.px.x, corner.px.y, 0.0, 0.0, 0.0];
    }
    let c = &corner.covariance_px2;
    [corner.px.x, corner.px.y, c[(0, 0)], c[(0, 1)], c[(1, 1)]]
}

fn corner_from_line(line: &[f64; 5]) -> Corner {
    let [x, y, xx, xy, yy] = *line;
    Corner::new(Point2::new(x, y), Matrix2::new(xx, xy, xy, yy))
}

/// JSON Schema of a line of `journal.jsonl`.
#[cfg(feature = "schemas")]
pub fn journal_line_schema(generator: schemars::SchemaGenerator) -> schemars::Schema {
    generator.into_root_schema_for::<Envelope>()
}
