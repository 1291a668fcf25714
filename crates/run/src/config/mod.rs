//! Configuration: TOML in, typed parameters out. The only place with millimetres and degrees.

mod camera;
mod certificate;

pub use camera::{Backend, CameraConfig};
pub use certificate::CertificateConfig;

use std::{collections::BTreeMap, path::Path};

use serde::{Deserialize, Serialize, de::IgnoredAny};

use boresight_calibrate::{
    AcceptanceGoal, BOARD_SCALE_SD, CalibrationParams, KnownLens, LensFamily, LensModel,
};
use boresight_files::{FileError, Links, TEXT_LIMIT, plain_words, read_text};
use boresight_geometry::{
    boards::{Board, BoardChoice, InvalidBoard, MarkerSide, Pattern, millimetres},
    frame::ImageSize,
    markers::{CircleRows, Dictionary, InvalidMarkers, Tags},
};
use boresight_guide::{
    guidance::{BoardRoll, GuidanceParams, PAIRS_BEYOND_EDGE, Plan},
    session::SessionSetup,
};

/// The defaults, with explanations.
pub const DEFAULT_TOML: &str = include_str!("../../../../config/default.toml");

/// All settings, in the units of people.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Board in front of the camera.
    pub board: BoardConfig,
    /// The live camera.
    #[serde(default)]
    pub camera: CameraConfig,
    /// Limits and goals of the guidance.
    pub guidance: GuidanceConfig,
    /// Settings of the solver.
    pub calibration: CalibrationConfig,
    /// The report's first sheet.
    #[serde(default)]
    pub certificate: CertificateConfig,
    /// Printed boards, by the ID of the code.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub boards: BTreeMap<String, MeasuredBoard>,
}

/// A printed board with measured squares.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredBoard {
    /// Side of a square.
    pub square_mm: f64,
    /// Measuring tool.
    #[serde(default)]
    pub measured_with: String,
}

/// Board in front of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "explained in default.toml")]
pub struct BoardConfig {
    pub columns: u16,
    pub rows: u16,
    pub square_mm: f64,
    #[serde(default = "scale_error_percent")]
    pub scale_error_percent: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dictionary: Option<Dictionary>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker_mm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag_spacing: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_tag: Option<u16>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub circles: Option<CircleRows>,
}

impl BoardConfig {
    /// These settings with the chosen board.
    #[must_use]
    pub fn chosen(self, BoardChoice { columns, rows, pattern }: BoardChoice) -> Self {
        Self {
            columns,
            rows,
            dictionary: pattern.dictionary(),
            marker_mm: pattern.side_m().map(millimetres),
            tag_spacing: pattern.tags().map(|tags| tags.spacing),
            first_tag: pattern.tags().map(|tags| tags.first).filter(|first| *first != 0),
            circles: pattern.circles(),
            ..self
        }
    }

    /// The chosen board.
    pub fn choice(&self) -> BoardChoice {
        let Self { columns, rows, .. } = *self;
        let side = self.marker_mm.map_or(MarkerSide::Usual, |mm| MarkerSide::Metres(mm * 1e-3));
        let tags = |spacing| Tags { spacing, first: self.first_tag.unwrap_or(0) };
        let pattern = match (self.circles, self.tag_spacing, self.dictionary) {
            (Some(rows), _, _) => Pattern::Circles(rows),
            (_, Some(spacing), _) => Pattern::AprilGrid(tags(spacing)),
            (_, _, Some(dictionary)) => Pattern::Charuco { dictionary, side },
            (None, None, None) => Pattern::Plain,
        };
        BoardChoice { columns, rows, pattern }
    }
}

/// Default for recordings made before the setting.
fn scale_error_percent() -> f64 {
    100.0 * BOARD_SCALE_SD
}

/// Limits and goals of the guidance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "explained in default.toml")]
pub struct GuidanceConfig {
    pub plan: PlanName,
    pub board_roll: BoardRollName,
    pub target_tilt_deg: f64,
    pub target_fill: f64,
    #[serde(default = "default_target_margin")]
    pub target_margin: f64,
    pub independent_sigmas: f64,
    pub partner_slot_deg: f64,
    pub hold_secs: f64,
    pub stop_pp_sigma_px: f64,
    pub stop_projection_sigma_px: f64,
    /// `None` in recordings from before boards beyond the picture's edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop_corner_sigma_px: Option<f64>,
    /// Ignored: whose a goal was, in recordings under rules whose goals weren't fixed.
    #[serde(default, skip_serializing, rename = "stop_pp_is_set")]
    _stop_pp_is_set: IgnoredAny,
    #[serde(default, skip_serializing, rename = "stop_corner_is_set")]
    _stop_corner_is_set: IgnoredAny,
    pub min_views: usize,
    pub max_views: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accept: Option<AcceptanceGoal>,
}

// A session's settings may be older than a setting.

fn default_target_margin() -> f64 {
    GuidanceParams::default().target_margin_fraction
}

/// Mirror of [`Plan`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[expect(missing_docs, reason = "see Plan")]
pub enum PlanName {
    Quick,
    Full,
    Adaptive,
}

impl From<PlanName> for Plan {
    fn from(name: PlanName) -> Self {
        match name {
            PlanName::Quick => Self::Quick,
            PlanName::Full => Self::Full,
            PlanName::Adaptive => Self::Adaptive,
        }
    }
}

impl From<Plan> for PlanName {
    fn from(plan: Plan) -> Self {
        match plan {
            Plan::Quick => Self::Quick,
            Plan::Full => Self::Full,
            Plan::Adaptive => Self::Adaptive,
        }
    }
}

/// Mirror of [`BoardRoll`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[expect(missing_docs, reason = "see BoardRoll")]
pub enum BoardRollName {
    Upright,
    Turn,
}

/// Settings of the solver.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "explained in default.toml")]
pub struct CalibrationConfig {
    pub square_pixels: bool,
    #[serde(default)]
    pub varying_focal: bool,
    #[serde(default)]
    pub shifted_sensor: bool,
    #[serde(default, skip_serializing_if = "LensName::is_auto")]
    pub lens: LensName,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_lens: Option<KnownLens>,
}

/// The lens models to choose from: those of a family by code, or `auto` for all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub struct LensName(Option<LensFamily>);

impl LensName {
    /// The models of every family.
    pub const AUTO: Self = Self(None);

    /// The models of a family.
    pub fn of(family: LensFamily) -> Self {
        Self(Some(family))
    }

    /// All names.
    pub fn all() -> impl Iterator<Item = Self> {
        std::iter::once(Self::AUTO).chain(LensFamily::ALL.into_iter().map(Self::of))
    }

    /// Name in settings.
    pub fn code(self) -> &'static str {
        self.0.map_or("auto", LensFamily::code)
    }

    /// The family; `None` for all.
    pub fn family(self) -> Option<LensFamily> {
        self.0
    }

    // By reference, for serde.
    fn is_auto(&self) -> bool {
        *self == Self::AUTO
    }

    /// Lens models to try.
    pub fn models(self) -> Vec<LensModel> {
        self.0.map_or_else(|| LensModel::ALL.to_vec(), LensFamily::models)
    }
}

impl From<LensName> for &'static str {
    fn from(name: LensName) -> Self {
        name.code()
    }
}

impl std::str::FromStr for LensName {
    type Err = String;

    fn from_str(code: &str) -> Result<Self, Self::Err> {
        Self::all().find(|name| name.code() == code).ok_or_else(|| {
            let codes: Vec<&str> = Self::all().map(Self::code).collect();
            format!("no lens models are called `{code}`, expected one of {}", codes.join(", "))
        })
    }
}

impl TryFrom<String> for LensName {
    type Error = String;

    fn try_from(code: String) -> Result<Self, Self::Error> {
        code.parse()
    }
}

/// Reason for a missing configuration.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file could not be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The text is not a valid configuration.
    #[error("{message} (in {origin})")]
    Invalid {
        /// The mistake, in the parser's words.
        message: String,
        /// File name or command line.
        origin: String,
    },
    /// The board is not usable.
    #[error(transparent)]
    Board(#[from] InvalidBoard),
    /// The markers don't fit the board.
    #[error(transparent)]
    Markers(#[from] InvalidMarkers),
}

impl Config {
    /// The defaults, overridden by the settings of `file` and then by each `key=value` of
    /// `settings`.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] if a file cannot be read, or names or values are not known.
    pub fn load(file: Option<&Path>, settings: &[String]) -> Result<Self, ConfigError> {
        let mut table = defaults();
        if let Some(path) = file {
            let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
            let origin = path.display().to_string();
            let over = toml::from_str(&text).map_err(|err| invalid(&err.to_string(), &origin))?;
            merge(&mut table, over);
        }
        let origin = file.map_or("the defaults".into(), |file| file.display().to_string());
        Self::from_table(table, &origin)?.with(settings)
    }

    /// The configuration, overridden by each `key=value` of `settings`.
    ///
    /// # Errors
    ///
    /// [`ConfigError::Invalid`] if a key is not known or its value does not fit.
    pub fn with(&self, settings: &[String]) -> Result<Self, ConfigError> {
        let mut table =
            toml::Table::try_from(self).map_err(|err| invalid(&err.to_string(), "memory"))?;
        for setting in settings {
            let over = toml::from_str(setting)
                .or_else(|_| match setting.split_once('=') {
                    // A bare word is a string: --set guidance.plan=quick needs no quotes.
                    Some((key, value)) => toml::from_str(&format!("{key}={value:?}")),
                    None => toml::from_str(setting),
                })
                .map_err(|err| invalid(err.message(), setting))?;
            merge(&mut table, over);
        }
        Self::from_table(table, &settings.join(" "))
    }

    fn from_table(table: toml::Table, origin: &str) -> Result<Self, ConfigError> {
        let config: Self =
            table.try_into().map_err(|err: toml::de::Error| invalid(&err.to_string(), origin))?;
        config.checked(origin)
    }

    /// Checks the settings of a session, possibly from another person.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] if a value is out of range.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.clone().checked("session.toml").map(drop)
    }

    fn checked(self, origin: &str) -> Result<Self, ConfigError> {
        let g = &self.guidance;
        let tilts = 0.0 < g.target_tilt_deg && g.target_tilt_deg < 90.0;
        let shares = (0.05..=1.0).contains(&g.target_fill);
        let positive = [
            g.independent_sigmas,
            g.partner_slot_deg,
            g.stop_pp_sigma_px,
            g.stop_projection_sigma_px,
        ]
        .iter()
        .chain(&g.stop_corner_sigma_px)
        .all(|value| value.is_finite() && *value > 0.0);
        let rest = (0.0..0.4).contains(&g.target_margin) && (0.0..=60.0).contains(&g.hold_secs);
        let views = (2..=100).contains(&g.min_views) && (g.min_views..=200).contains(&g.max_views);
        let camera = self.camera.wanted().is_some();
        let raw = self.camera.raw_form().is_ok();
        let scale = (0.0..=10.0).contains(&self.board.scale_error_percent);
        let certificate = self.certificate.is_usable();
        let boards = self.boards.values().all(|board| {
            (1e-3..1e4).contains(&board.square_mm) && board.measured_with.len() <= 200
        });
        for (good, message) in [
            (
                camera,
                "camera.mode: auto, or SIZE@RATE:FORMAT such as 1280x720@30:MJPG, with any of them left out",
            ),
            (
                raw,
                "camera.raw: WIDTHxHEIGHT:FORMAT@RATE such as 1280x720:gray@30, @RATE may be left out",
            ),
            (tilts, "guidance: target_tilt_deg must be above 0 and below 90"),
            (shares, "guidance: target_fill must be 0.05 to 1"),
            (scale, "board.scale_error_percent must be 0 to 10"),
            (
                certificate,
                "certificate: check_months must be 0 to 120, and each text at most 200 letters long",
            ),
            (boards, "boards: square_mm must be 0.001 to 10000"),
            (
                self.board.marker_mm.is_none() || self.board.dictionary.is_some(),
                "board.marker_mm needs board.dictionary",
            ),
            (
                self.board.tag_spacing.is_none() || self.board.dictionary.is_none(),
                "board: an AprilGrid (tag_spacing) has no dictionary",
            ),
            (
                self.board.first_tag.is_none() || self.board.tag_spacing.is_some(),
                "board.first_tag needs board.tag_spacing",
            ),
            (
                self.board.circles.is_none()
                    || (self.board.dictionary.is_none() && self.board.tag_spacing.is_none()),
                "board: circles have no dictionary and no tags",
            ),
            (positive, "guidance: limits must be positive numbers"),
            (rest, "guidance: target_margin must be 0 to 0.4, hold_secs 0 to 60"),
            (views, "guidance: views need 2 <= min_views <= max_views <= 200"),
        ] {
            if !good {
                return Err(invalid(message, origin));
            }
        }
        self.board()?;
        Ok(self)
    }

    /// The board.
    ///
    /// # Errors
    ///
    /// [`ConfigError::Board`].
    pub fn board(&self) -> Result<Board, ConfigError> {
        let BoardConfig { columns, rows, square_mm, marker_mm, .. } = self.board;
        let board = Board::new(columns, rows, square_mm * 1e-3)?;
        let pattern = match (self.board.choice().pattern, marker_mm) {
            // Metres would round the share.
            (Pattern::Charuco { dictionary, .. }, Some(mm)) => {
                Pattern::Charuco { dictionary, side: MarkerSide::Squares(mm / square_mm) }
            }
            (pattern, _) => pattern,
        };
        Ok(board.with(pattern)?)
    }

    /// The settings of the planner.
    pub fn guidance(&self) -> GuidanceParams {
        let g = &self.guidance;
        GuidanceParams {
            plan: g.plan.into(),
            board_roll: match g.board_roll {
                BoardRollName::Upright => BoardRoll::Upright,
                BoardRollName::Turn => BoardRoll::Turn,
            },
            target_tilt_rad: g.target_tilt_deg.to_radians(),
            target_span_fraction: g.target_fill,
            target_margin_fraction: g.target_margin,
            independent_sigmas: g.independent_sigmas,
            partner_slot_rad: g.partner_slot_deg.to_radians(),
            hold_secs: g.hold_secs,
            stop_pp_sigma_px: g.stop_pp_sigma_px,
            stop_projection_sigma_px: g.stop_projection_sigma_px,
            stop_corner_sigma_px: g.stop_corner_sigma_px,
            pairs_beyond_edge: PAIRS_BEYOND_EDGE,
            min_views: g.min_views,
            max_views: g.max_views,
        }
    }

    /// The settings of the solver.
    pub fn calibration(&self) -> CalibrationParams {
        CalibrationParams {
            square_pixels: self.calibration.square_pixels,
            varying_focal: self.calibration.varying_focal,
            shifted_sensor: self.calibration.shifted_sensor,
            models: self.calibration.lens.models(),
            known_lens: self.calibration.known_lens,
            accept: self.guidance.accept,
            board_scale_sd: self.board.scale_error_percent / 100.0,
            ..CalibrationParams::default()
        }
    }

    /// Setup of a session on pictures of `image_size`.
    ///
    /// # Errors
    ///
    /// [`ConfigError::Board`].
    pub fn session(&self, image_size: ImageSize) -> Result<SessionSetup, ConfigError> {
        Ok(SessionSetup {
            board: self.board()?,
            image_size,
            guidance: self.guidance(),
            calibration: self.calibration(),
        })
    }
}

fn invalid(message: &str, origin: &str) -> ConfigError {
    ConfigError::Invalid { message: plain_words(message), origin: origin.into() }
}

#[expect(clippy::expect_used, reason = "the text is compiled in, and a test parses it")]
fn defaults() -> toml::Table {
    toml::from_str(DEFAULT_TOML).expect("the default configuration is valid TOML")
}

/// Merges `over` into `table`, table by table.
fn merge(table: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (table.get_mut(&key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(over)) => merge(inner, over),
            // TOML has 25 for a value of 25.0.
            (Some(toml::Value::Float(number)), toml::Value::Integer(whole)) => {
                *number = whole as f64;
            }
            // A serial number or a date needs no quotes.
            (
                Some(toml::Value::String(text)),
                bare @ (toml::Value::Integer(_) | toml::Value::Float(_) | toml::Value::Datetime(_)),
            ) => *text = bare.to_string(),
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_file_and_default_parameters_agree() {
        let config = Config::load(None, &[]).expect("valid");
        assert_eq!(config.guidance(), GuidanceParams::default());
    }

    #[test]
    fn a_goal_may_be_set_and_is_kept() {
        let text = "guidance.accept=length 800mm at 2m <= 0.5mm".to_owned();
        let config = Config::load(None, &[text, "board.scale_error_percent=0.02".into()]);
        let config = config.expect("valid");
        let params = config.with(&[]).expect("reads itself").calibration();
        let goal = AcceptanceGoal::Length { length_m: 0.8, at_m: 2.0, within_m: 0.0005 };
        assert_eq!((params.accept, params.board_scale_sd), (Some(goal), 0.0002));
        let before = Config::load(None, &[]).expect("valid").calibration();
        assert_eq!((before.accept, before.board_scale_sd), (None, BOARD_SCALE_SD));
    }

    #[test]
    fn recordings_that_say_whose_a_goal_was_are_still_read() {
        let plain = Config::load(None, &["guidance.stop_pp_sigma_px=0.5".into()]).expect("valid");
        let text = toml::to_string(&plain).expect("written");
        assert!(!text.contains("is_set"), "{text}");
        let before = text.replace("[guidance]", "[guidance]\nstop_pp_is_set = true");
        assert_ne!(before, text);
        assert_eq!(toml::from_str::<Config>(&before).expect("read"), plain);
    }

    #[test]
    fn what_a_certificate_says_needs_no_quotes() {
        let settings = [
            "certificate.camera_serial=0012",
            "certificate.number=17",
            "certificate.customer=Mill & Sons",
            "certificate.site=2026-11-22",
        ];
        let config = Config::load(None, &settings.map(str::to_owned)).expect("valid").certificate;
        assert_eq!((config.camera_serial.as_str(), config.number.as_str()), ("0012", "17"));
        assert_eq!((config.customer.as_str(), config.site.as_str()), ("Mill & Sons", "2026-11-22"));
        let long = format!("certificate.site={}", "x".repeat(201));
        assert!(Config::load(None, &[long]).is_err());
    }

    #[test]
    fn measured_boards_are_listed_by_their_id() {
        let set = |text: &str| Config::load(None, &[text.to_owned()]);
        let config = set("boards.K7Q2.square_mm=25.03").expect("valid");
        assert_eq!(config.boards["K7Q2"].square_mm, 25.03);
        assert!(set("boards.K7Q2.square_mm=25").is_ok());
        assert!(set("boards.K7Q2.square_mm=-1").is_err());
        assert!(set("boards.K7Q2.size=25").is_err());
    }

    #[test]
    fn the_lens_models_are_named_by_their_family() {
        let set = |code: &str| {
            let config = Config::load(None, &[format!("calibration.lens={code}")])?;
            Ok::<_, ConfigError>(config.with(&[])?.calibration().models)
        };
        for family in LensFamily::ALL {
            assert_eq!(set(family.code()).expect("a family"), family.models());
        }
        assert_eq!(set("auto").expect("all"), LensModel::ALL);
        let err = set("pinhole").expect_err("none").to_string();
        assert!(err.contains("pinhole") && err.contains("auto, brown, rational, fisheye"), "{err}");
    }

    #[test]
    fn one_setting_changes_one_thing() {
        let set = |text: &str| Config::load(None, &[text.to_owned()]);
        assert_eq!(set("guidance.hold_secs=0.5").expect("valid").guidance.hold_secs, 0.5);
        assert_eq!(set("guidance.plan=quick").expect("valid").guidance.plan, PlanName::Quick);
        let no_number = set("guidance.hold_secs=long").expect_err("none").to_string();
        assert!(no_number.contains("expected a number in `guidance.hold_secs`"), "{no_number}");
        for wrong in [
            "guidance.hold=1",
            "guidance.plan=slow",
            "board.columns=2",
            "nonsense",
            "guidance.target_tilt_deg=90",
            "guidance.hold_secs=nan",
            "guidance.target_margin=inf",
            "guidance.accept=soon",
            "board.scale_error_percent=-1",
        ] {
            assert!(set(wrong).is_err(), "{wrong}");
        }
    }
}
