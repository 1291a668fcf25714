//! The next action for an error.

use crate::{
    calibration::files::import::NotImported, capture::CaptureError, config::ConfigError,
    pipeline::PipelineError, recording::RecordingError, text,
};

/// The next action for an error, if one is known. The error itself says what happened.
pub fn explain(err: &anyhow::Error) -> Option<String> {
    err.chain().find_map(|cause| {
        if let Some(err) = cause.downcast_ref::<RecordingError>() {
            return recording(err);
        }
        if let Some(PipelineError::Recording(err)) = cause.downcast_ref::<PipelineError>() {
            return recording(err);
        }
        if let Some(err) = cause.downcast_ref::<CaptureError>() {
            return Some(capture(err));
        }
        if let Some(err) = cause.downcast_ref::<NotImported>() {
            return imported(err).map(Into::into);
        }
        cause.downcast_ref::<ConfigError>().map(|_| {
            "config/default.toml lists all settings and their values; `boresight guide --help` shows how to set them.".into()
        })
    })
}

fn recording(err: &RecordingError) -> Option<String> {
    match err {
        RecordingError::Write { source, path } => {
            let full = matches!(
                source.kind(),
                std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded
            );
            let session = path.ancestors().find(|folder| folder.join("session.toml").exists());
            let go_on = session.map_or(String::new(), |session| {
                format!(
                    " Your views are safe. To continue: boresight guide --session {}",
                    session.display()
                )
            });
            Some(if full {
                format!("The disk is full: free some space.{go_on}")
            } else {
                format!("Check that the folder exists and is writable.{go_on}")
            })
        }
        RecordingError::Exists { .. } => {
            Some("Choose another name, or add --force to overwrite the file.".into())
        }
        RecordingError::NotNew { path } => Some(if path.join("session.toml").exists() {
            format!(
                "To continue the session in it: boresight guide --session {}. To start another one, choose a new folder.",
                path.display()
            )
        } else {
            "Choose a new folder. Nothing in this one was changed.".into()
        }),
        RecordingError::Damaged { .. } => Some(
            "To copy the undamaged part into a new session: boresight doctor SESSION --recover NEW"
                .into(),
        ),
        RecordingError::Locked { .. } => Some("Close the other program first.".into()),
        RecordingError::NoLock { .. } => {
            Some("Use a file system with locks: choose a folder on a local disk with --out.".into())
        }
        RecordingError::Read { .. } => {
            Some("Check the name. A session is a folder that contains session.toml.".into())
        }
        RecordingError::Header { .. } | RecordingError::Frame { .. } => None,
    }
}

fn capture(err: &CaptureError) -> String {
    match err {
        CaptureError::Camera { fault, .. } => {
            let (cause, action) = text::camera::fault(*fault);
            return format!("{cause}. {action}");
        }
        CaptureError::Read { .. } => "Check the name, and that the file is readable.",
        CaptureError::Decode { .. } => {
            "Remove the file, or replace it with an undamaged PNG or JPEG."
        }
        CaptureError::NoPictures { .. } => {
            "Choose a folder with PNG or JPEG pictures of the board."
        }
    }
    .into()
}

fn imported(err: &NotImported) -> Option<&'static str> {
    match err {
        NotImported::Model { .. } | NotImported::Coefficient { .. } => Some(
            "Fit a supported lens model with the program that wrote the file, or recalibrate: boresight guide",
        ),
        NotImported::NoResult => Some("Its findings say why. Recalibrate: boresight guide"),
        NotImported::Schema { .. } => Some("Use the newer version that wrote it."),
        NotImported::Missing { .. } | NotImported::Nonsense { .. } => {
            Some("Fix the file, or write it again with the program that made it.")
        }
        NotImported::TooLong { .. }
        | NotImported::UnknownFormat
        | NotImported::Malformed { .. } => None,
    }
}
