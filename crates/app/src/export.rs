//! A result in the formats of other programs.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde_json::Value;

use super::{Announcer, RESULT_FILE, SavedSession};
use boresight_calibrate::Verdict;
use boresight_files::{Links, Overwrite, TEXT_LIMIT, read_text, save};
use boresight_formats::{
    CalibrationFile, corner_table,
    export::{
        ExportedCamera, colmap_cameras, kalibr_camchain, matlab_script, mrcal_cameramodel,
        opencv_yaml, ros_camera_info, views_csv,
    },
    import,
};
use boresight_geometry::Corner;
use boresight_present::text;

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Everything, in this program's schema.
    Json,
    /// YAML of OpenCV's FileStorage.
    OpencvYaml,
    /// YAML of ROS camera_info.
    RosYaml,
    /// Kalibr camchain; can't hold k3 or a rational lens.
    Kalibr,
    /// Text file cameras.txt of COLMAP.
    Colmap,
    /// mrcal .cameramodel; can't hold a fisheye lens.
    Mrcal,
    /// Script for MATLAB and Octave; can't hold wide lenses.
    Matlab,
    /// Each view with its numbers, as comma-separated values.
    ViewsCsv,
    /// The corners of the accepted views; needs the session folder.
    Vnl,
}

/// Every format, in the order in which a person is offered them.
pub const FORMATS: [Format; 9] = [
    Format::OpencvYaml,
    Format::RosYaml,
    Format::Kalibr,
    Format::Colmap,
    Format::Mrcal,
    Format::Matlab,
    Format::Json,
    Format::ViewsCsv,
    Format::Vnl,
];

impl Format {
    /// The short name on a button.
    pub fn label(self) -> &'static str {
        self.label_and_file().0
    }

    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::OpencvYaml => "opencv-yaml",
            Self::RosYaml => "ros-yaml",
            Self::Kalibr => "kalibr",
            Self::Colmap => "colmap",
            Self::Mrcal => "mrcal",
            Self::Matlab => "matlab",
            Self::Json => "json",
            Self::ViewsCsv => "views-csv",
            Self::Vnl => "vnl",
        }
    }

    /// The usual name of the file.
    pub fn file(self) -> &'static str {
        self.label_and_file().1
    }

    fn label_and_file(self) -> (&'static str, &'static str) {
        match self {
            Self::OpencvYaml => ("OpenCV", "opencv.yaml"),
            Self::RosYaml => ("ROS", "ros.yaml"),
            Self::Kalibr => ("Kalibr", "kalibr.yaml"),
            Self::Colmap => ("COLMAP", "cameras.txt"),
            Self::Mrcal => ("mrcal", "camera.cameramodel"),
            Self::Matlab => ("MATLAB", "camera.m"),
            Self::Json => ("JSON", "camera.json"),
            Self::ViewsCsv => ("Views", "views.csv"),
            Self::Vnl => ("Corners", "corners.vnl"),
        }
    }
}

/// An exported result.
#[derive(Clone, Debug)]
pub struct Exported {
    /// The file's text.
    pub text: String,
    /// True if the calibration must not be used; its findings say why.
    pub untrustworthy: bool,
}

/// Converts the result in `input`, a session folder or a `calibration.json`, into `format`. The file calls the camera
/// `name`, or without it by the name of the folder or file.
///
/// # Errors
///
/// If the result can't be read, or if the format can't hold the lens.
pub fn export(
    input: &Path,
    format: Format,
    name: Option<&str>,
    announcer: &Announcer,
) -> anyhow::Result<Exported> {
    if format == Format::Vnl {
        return Ok(Exported { text: corners(input, announcer)?, untrustworthy: false });
    }
    let path = if input.is_dir() { input.join(RESULT_FILE) } else { input.to_path_buf() };
    let text = read_text(&path, TEXT_LIMIT, Links::Followed)?;
    let not_one = || format!("not a calibration: {path:?}");
    let tree: Value = serde_json::from_str(&text).with_context(not_one)?;
    let file = CalibrationFile::read(&tree).with_context(not_one)?;
    let untrustworthy = file.known_verdict() == Some(Verdict::Untrustworthy);
    let text = match format {
        Format::Json => text,
        Format::ViewsCsv => views_csv(&file.views),
        _ => {
            let stem = input.file_stem().unwrap_or_default().to_string_lossy();
            camera(format, &text, &path, name.unwrap_or(&stem), announcer)?
        }
    };
    Ok(Exported { text, untrustworthy })
}

/// Writes the result of the session in `folder` beside it, in the format of that number in [`FORMATS`], under
/// a free name. Returns the file.
///
/// # Errors
///
/// As [`export`], and if the file can't be written.
pub fn beside(folder: &Path, number: usize, announcer: &Announcer) -> anyhow::Result<PathBuf> {
    let format = *FORMATS.get(number).context("there is no such format")?;
    let (_, file) = format.label_and_file();
    let (stem, ending) = file.split_once('.').unwrap_or((file, ""));
    let out = (2..1000)
        .map(|n| folder.join(format!("{stem}-{n}.{ending}")))
        .fold(folder.join(file), |free, next| if free.exists() { next } else { free });
    let exported = export(folder, format, None, announcer)?;
    save(&out, exported.text.as_bytes(), Overwrite::Never)?;
    announcer.say(&format!("Written: {}", out.display()));
    Ok(out)
}

fn camera(
    format: Format,
    text: &str,
    path: &Path,
    name: &str,
    announcer: &Announcer,
) -> anyhow::Result<String> {
    let old = import::read(text).with_context(|| format!("could not use {path:?}"))?;
    if old.focal_varies {
        announcer.say(text::focal_is_a_mean());
    }
    let exported = ExportedCamera {
        name,
        camera: old.camera,
        image_size: old.image_size,
        rms_px: old.rms_px.unwrap_or(0.0),
    };
    Ok(match format {
        Format::OpencvYaml => opencv_yaml(&exported),
        Format::RosYaml => ros_camera_info(&exported),
        Format::Kalibr => kalibr_camchain(&exported).context("Kalibr can't hold this lens")?,
        Format::Colmap => colmap_cameras(&exported),
        Format::Mrcal => mrcal_cameramodel(&exported).context("mrcal can't hold this lens")?,
        Format::Matlab => matlab_script(&exported).context("MATLAB can't hold this lens")?,
        Format::Json | Format::ViewsCsv | Format::Vnl => bail!("this format holds no camera"),
    })
}

/// The corners of the accepted views, from the session's journal.
fn corners(session: &Path, announcer: &Announcer) -> anyhow::Result<String> {
    let saved =
        SavedSession::open(session).context("a corner table is written from a session folder")?;
    saved.announce(announcer);
    let views: Vec<(String, &[Corner])> = saved
        .session
        .accepted()
        .iter()
        .map(|view| (view.picture_name(), view.view.corners.as_slice()))
        .collect();
    Ok(corner_table::write(views.iter().map(|(name, corners)| (name.as_str(), Some(*corners)))))
}
