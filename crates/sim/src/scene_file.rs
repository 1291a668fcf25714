//! Scene files of the simulated camera: TOML in millimetres and degrees.

use std::path::Path;

use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

use crate::{
    Scene,
    scene_mistake::mistake,
    technician::{Person, TechnicianParams},
};
use boresight_files::{FileError, Links, TEXT_LIMIT, read_text};
use boresight_geometry::{
    Distortion, LensKind, board_code::BoardId, boards::Board, frame::ImageSize,
};

/// Maximum height of a bent board's middle, in squares.
const LARGEST_BEND: f64 = 0.5;

/// Error of reading a scene file.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Unreadable file.
    #[error(transparent)]
    File(#[from] FileError),
    /// Invalid scene, or invalid camera in the scene.
    #[error("{message} (in the scene {origin})")]
    Invalid {
        /// Mistake.
        message: String,
        /// Name of the file.
        origin: String,
    },
}

/// Scene as a file. Missing keys take the default scene's values.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    name: Option<String>,
    seed: Option<u64>,
    /// Inner corners of the board in front of the camera, if different from the session's.
    board: Option<[u16; 2]>,
    /// Side of the squares of the board in front of the camera, if different from the session's.
    square_mm: Option<f64>,
    /// Identity in the code in the board's margin, if any.
    board_id: Option<String>,
    /// Height of the board's middle over the ends.
    bend_mm: Option<f64>,
    image_size_px: Option<[u32; 2]>,
    f_px: Option<f64>,
    pp_px: Option<[f64; 2]>,
    /// True for a fisheye lens: `distortion` is then `k1 k2 k3 k4` of OpenCV's model.
    #[serde(default)]
    fisheye: bool,
    /// `k1 k2 p1 p2 k3`, optionally followed by `k4 k5 k6`.
    distortion: Option<Vec<f64>>,
    fps: Option<f64>,
    noise_levels: Option<f64>,
    blur_px: Option<f64>,
    exposure_ms: Option<f64>,
    readout_ms: Option<f64>,
    clutter: Option<f64>,
    technician: Option<TechnicianFile>,
}

/// Person with the board.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TechnicianFile {
    /// Base person, changed by the other keys.
    person: Option<Person>,
    reaction_secs: Option<f64>,
    reading_secs_per_word: Option<f64>,
    look_away_every_secs: Option<f64>,
    rotation_error_deg: Option<f64>,
    lateral_error_px: Option<f64>,
    distance_error: Option<f64>,
    overshoot: Option<f64>,
    max_speed_mm_per_s: Option<f64>,
    max_turn_deg_per_s: Option<f64>,
    sway_mm: Option<f64>,
    sway_deg: Option<f64>,
    tremor_mm: Option<f64>,
    tremor_deg: Option<f64>,
    sink_mm: Option<f64>,
    tiring_per_sec: Option<f64>,
    rest_after_secs: Option<f64>,
    wanders: Option<bool>,
    hears_only: Option<bool>,
    leaves_for_secs: Option<f64>,
    covers_every_secs: Option<f64>,
}

impl TechnicianFile {
    /// Parameters of the person in front of a camera with pictures `scale` times as wide as the
    /// default scene's.
    fn params(self, scale: f64) -> TechnicianParams {
        let person = self.person.unwrap_or_default();
        let mut params = person.params();
        if person != Person::Tripod {
            // A person judges by the screen, not by the camera's pixels.
            params.lateral_error_px *= scale;
        }
        let degree = 1_f64.to_radians();
        for (value, unit, into) in [
            (self.reaction_secs, 1.0, &mut params.reaction_secs),
            (self.reading_secs_per_word, 1.0, &mut params.reading_secs_per_word),
            (self.look_away_every_secs, 1.0, &mut params.look_away_every_secs),
            (self.rotation_error_deg, degree, &mut params.rotation_error_rad),
            (self.lateral_error_px, 1.0, &mut params.lateral_error_px),
            (self.distance_error, 1.0, &mut params.distance_error),
            (self.overshoot, 1.0, &mut params.overshoot),
            (self.max_speed_mm_per_s, 1e-3, &mut params.max_speed_m_per_s),
            (self.max_turn_deg_per_s, degree, &mut params.max_turn_rad_per_s),
            (self.sway_mm, 1e-3, &mut params.sway_m),
            (self.sway_deg, degree, &mut params.sway_rad),
            (self.tremor_mm, 1e-3, &mut params.tremor_m),
            (self.tremor_deg, degree, &mut params.tremor_rad),
            (self.sink_mm, 1e-3, &mut params.sink_m),
            (self.tiring_per_sec, 1.0, &mut params.tiring_per_sec),
            (self.rest_after_secs, 1.0, &mut params.rest_after_secs),
            (self.leaves_for_secs, 1.0, &mut params.leaves_for_secs),
            (self.covers_every_secs, 1.0, &mut params.covers_every_secs),
        ] {
            if let Some(value) = value {
                *into = value * unit;
            }
        }
        params.wanders = self.wanders.unwrap_or(params.wanders);
        params.hears_only = self.hears_only.unwrap_or(params.hears_only);
        params
    }
}

/// True for plausible parameters.
fn is_sensible(person: &TechnicianParams) -> bool {
    let within = |value: f64, largest: f64| (0.0..=largest).contains(&value);
    let time = |secs: f64| within(secs, 3600.0);
    time(person.reaction_secs)
        && time(person.reading_secs_per_word)
        && time(person.look_away_every_secs)
        && time(person.rest_after_secs)
        && time(person.leaves_for_secs)
        && time(person.covers_every_secs)
        && within(person.rotation_error_rad, 1.6)
        && within(person.lateral_error_px, 1e4)
        && within(person.distance_error, 0.9)
        && within(person.overshoot, 0.5)
        && (0.001..=1e3).contains(&person.max_speed_m_per_s)
        && (0.001..=1e3).contains(&person.max_turn_rad_per_s)
        && within(person.sway_m, 1.0)
        && within(person.sway_rad, 1.6)
        && within(person.tremor_m, 1.0)
        && within(person.tremor_rad, 1.6)
        && within(person.sink_m, 1.0)
        && within(person.tiring_per_sec, 1.0)
}

impl SceneFile {
    /// Reads a scene with the usual board, unless the file names a board.
    ///
    /// # Errors
    ///
    /// As [`load_with`](Self::load_with).
    pub fn load(path: &Path) -> Result<Scene, SceneError> {
        Self::load_with(path, Scene::default_720p(1).board)
    }

    /// Reads a scene with `board` in front of the camera, unless the file names a board. Counts
    /// or squares missing in the file are taken from `board`.
    ///
    /// # Errors
    ///
    /// [`SceneError`] if the file cannot be read, has unknown names, or describes no camera.
    pub fn load_with(path: &Path, board: Board) -> Result<Scene, SceneError> {
        let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
        let invalid = |message: &str| SceneError::Invalid {
            message: message.trim_end().to_owned(),
            origin: path.display().to_string(),
        };
        let table: toml::Table = toml::from_str(&text).map_err(|err| invalid(&err.to_string()))?;
        let file: Self = table.try_into().map_err(|err| invalid(&mistake::<Self>(&text, &err)))?;
        let board = match (file.board, file.square_mm) {
            (None, None) => board,
            (size, square_mm) => {
                // Boards have at most 99.
                let side = |corners: usize| u16::try_from(corners).unwrap_or(u16::MAX);
                let [columns, rows] = size.unwrap_or([side(board.columns()), side(board.rows())]);
                let square_m = square_mm.map_or(board.measured_m(), |mm| mm * 1e-3);
                Board::new(columns, rows, square_m).map_err(|err| invalid(&err.to_string()))?
            }
        };
        let board_id: Option<BoardId> = file
            .board_id
            .as_deref()
            .map(str::parse)
            .transpose()
            .map_err(|err| invalid(&format!("board_id: {err}")))?;
        let distortion = file
            .lens_distortion()
            .ok_or_else(|| invalid("distortion needs 5 or 8 numbers; with fisheye = true, 4"))?;
        let scene = file.over(distortion, Scene { board, board_id, ..Scene::default_720p(1) });
        let (width_px, height_px) = (scene.image_size.width_px, scene.image_size.height_px);
        let sized = (160..=8192).contains(&width_px) && (120..=8192).contains(&height_px);
        let lens = scene.camera.lens_parameters();
        let finite = lens.iter().all(|value| value.is_finite()) && scene.camera.f_px.x > 1.0;
        let rest = (0.0..=255.0).contains(&scene.noise_sigma)
            && (0.0..=1.0).contains(&scene.clutter)
            && (0.0..20.0).contains(&scene.psf_sigma_px)
            && (0.0..1.0).contains(&scene.exposure_secs)
            && (0.0..1.0).contains(&scene.readout_secs)
            && scene.bend_m.abs() <= LARGEST_BEND * scene.board.square_m()
            && (1_000_000..=100_000_000_000).contains(&scene.frame_interval_nanos);
        let corners = [(0, 0), (width_px, 0), (0, height_px), (width_px, height_px)];
        let unfolded = corners.iter().all(|&(x, y)| {
            scene.camera.ray_from_px(&Point2::new(f64::from(x), f64::from(y))).is_some()
        });
        for (good, message) in [
            (sized, "image_size_px needs 160x120 to 8192x8192"),
            (finite, "f_px, pp_px and distortion must be numbers, f_px above 1"),
            (
                rest,
                "noise_levels needs 0 to 255, clutter 0 to 1, blur_px below 20, exposure_ms and readout_ms below 1000, fps 0.01 to 1000, bend_mm at most half a square",
            ),
            (
                is_sensible(&scene.technician),
                "[technician]: numbers must be positive and of a person's size, overshoot up to 0.5",
            ),
            (finite && unfolded, "this distortion folds the picture over within its corners"),
        ] {
            if !good {
                return Err(invalid(message));
            }
        }
        Ok(scene)
    }

    /// Distortion of the lens; `None` for a wrong number of coefficients.
    fn lens_distortion(&self) -> Option<Option<Distortion>> {
        let given = self.distortion.as_deref();
        if self.fisheye {
            let [k1, k2, k3, k4] = given.map_or(Ok([0.0; 4]), TryInto::try_into).ok()?;
            let kind = LensKind::Fisheye;
            return Some(Some(Distortion { kind, k1, k2, k3, k4, ..Distortion::default() }));
        }
        let kind = LensKind::Perspective;
        match given {
            None => Some(None),
            Some(&[k1, k2, p1, p2, k3]) => {
                Some(Some(Distortion { k1, k2, p1, p2, k3, ..Distortion::default() }))
            }
            Some(&[k1, k2, p1, p2, k3, k4, k5, k6]) => {
                Some(Some(Distortion { kind, k1, k2, p1, p2, k3, k4, k5, k6 }))
            }
            Some(_) => None,
        }
    }

    fn over(self, distortion: Option<Distortion>, mut scene: Scene) -> Scene {
        let mut scale = 1.0;
        if let Some([width_px, height_px]) = self.image_size_px {
            scale = f64::from(width_px) / f64::from(scene.image_size.width_px);
            scene.image_size = ImageSize { width_px, height_px };
            scene.camera.pp_px = scene.image_size.centre_px();
            scene.camera.f_px *= scale;
        }
        scene.name = self.name.unwrap_or(scene.name);
        scene.seed = self.seed.unwrap_or(scene.seed);
        if let Some(f_px) = self.f_px {
            scene.camera.f_px = Vector2::new(f_px, f_px);
        }
        if let Some([x, y]) = self.pp_px {
            scene.camera.pp_px = Point2::new(x, y);
        }
        scene.camera.distortion = distortion.unwrap_or(scene.camera.distortion);
        if let Some(fps) = self.fps {
            scene.frame_interval_nanos = (1e9 / fps).max(0.0) as u64;
        }
        scene.noise_sigma = self.noise_levels.unwrap_or(scene.noise_sigma);
        scene.psf_sigma_px = self.blur_px.unwrap_or(scene.psf_sigma_px);
        scene.exposure_secs = self.exposure_ms.map_or(scene.exposure_secs, |ms| ms * 1e-3);
        scene.readout_secs = self.readout_ms.map_or(scene.readout_secs, |ms| ms * 1e-3);
        scene.bend_m = self.bend_mm.map_or(scene.bend_m, |mm| mm * 1e-3);
        scene.clutter = self.clutter.unwrap_or(scene.clutter);
        scene.technician = self.technician.unwrap_or_default().params(scale);
        scene
    }
}

#[cfg(test)]
mod tests {
    use boresight_files::Scratch;

    use super::*;
    use crate::scene_mistake::{EXAMPLE, example};

    fn refused(text: &str) -> String {
        let place = Scratch::new().expect("a folder");
        let path = place.path().join("a.toml");
        std::fs::write(&path, text).expect("written");
        SceneFile::load(&path).expect_err(text).to_string()
    }

    #[test]
    fn a_wrong_value_is_named_with_its_line_and_an_example() {
        for (text, message) in [
            (
                "seed = 3\nf_px = \"a\"",
                "line 2: found string \"a\", expected a number in `f_px`, for example f_px = 980.0",
            ),
            (
                "# mine\n[technician]\n\nsway_mm = \"1,5\"",
                "line 4: found string \"1,5\", expected a number in `technician.sway_mm`, for example sway_mm = 1.5",
            ),
            (
                "image_size_px = 640",
                "line 1: found integer `640`, expected two numbers in [ ] in `image_size_px`, for example image_size_px = [1280, 720]",
            ),
            (
                "seed = 1\nfisheye = 1",
                "expected true or false in `fisheye`, for example fisheye = false",
            ),
            ("\n\nfocal = 1", "line 3: unknown field `focal`"),
        ] {
            let said = refused(text);
            assert!(said.contains(message), "{said}");
            assert!(said.ends_with("a.toml)") && !said.contains("f64"), "{said}");
        }
    }

    #[test]
    fn every_key_has_an_example() {
        let place = Scratch::new().expect("a folder");
        let path = place.path().join("example.toml");
        std::fs::write(&path, EXAMPLE).expect("written");
        SceneFile::load(&path).expect("a scene");
        for (unknown, table) in [("unknown = 1", ""), ("[technician]\nunknown = 1", "technician.")]
        {
            let said = refused(unknown);
            let (_, known) = said.split_once("expected one of ").expect("names");
            let names =
                known.split('`').skip(1).step_by(2).filter(|name| !name.contains("technician"));
            let names: Vec<String> = names.map(|name| format!("{table}{name}")).collect();
            assert!(names.len() >= 17, "{said}");
            assert!(names.iter().all(|name| example(name).is_some()), "{names:?}");
        }
    }
}
