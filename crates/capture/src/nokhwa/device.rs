//! Requests to nokhwa, and the meaning of the answers.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::mpsc,
    time::Duration,
};

use ::nokhwa::{
    Camera, NokhwaError, nokhwa_check, nokhwa_initialize, query,
    utils::{
        ApiBackend, CameraFormat, CameraIndex, FrameFormat, RequestedFormat, RequestedFormatType,
    },
};

use crate::{CameraMode, choose, not_offered};
use boresight_geometry::{
    device::{Fault, Mode, PixelLayout, Wanted},
    frame::ImageSize,
    panic_message,
};

/// Reason for the loss of a camera, with details.
pub(super) type Loss = (Fault, String);

/// Formats with brightness.
const FORMATS: [FrameFormat; 4] =
    [FrameFormat::MJPEG, FrameFormat::YUYV, FrameFormat::NV12, FrameFormat::GRAY];
/// Time for a person to decide about access to the camera.
const ASKING: Duration = Duration::from_secs(60);
/// Page size: memory of a frame comes in whole pages, so a surplus up to a page is no gap between
/// rows.
const PAGE: usize = 4096;

/// A streaming camera. Every call may take for ever, or panic; so may dropping it.
pub(super) trait Blocking {
    /// The granted mode.
    fn mode(&self) -> Mode;

    /// Waits for the next frame.
    fn frame(&mut self) -> Result<Vec<u8>, Loss>;
}

/// A camera in the library's list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Name for `--source`: `nokhwa:` and the system's name for the camera.
    pub source: String,
    /// Name stated by the camera; may hold anything.
    pub name: String,
    pub(super) index: CameraIndex,
}

/// Lists the cameras found by the library.
///
/// # Errors
///
/// The fault and its details.
pub fn list() -> Result<Vec<Listed>, Loss> {
    let cameras = caught(|| query(ApiBackend::Auto).map_err(|err| loss_of(&err)))?;
    let mut listed: Vec<Listed> = cameras
        .into_iter()
        .map(|camera| {
            let (name, address) = (camera.human_name(), camera.misc());
            let known_by = if address.is_empty() { &name } else { &address };
            Listed { source: format!("nokhwa:{known_by}"), name, index: camera.index().clone() }
        })
        .collect();
    listed.sort_by(|a, b| a.source.cmp(&b.source));
    Ok(listed)
}

/// Camera among `listed` by `source`: a whole name, or a number among all.
///
/// # Errors
///
/// The fault and its details.
pub fn find(listed: &[Listed], source: &str) -> Result<Listed, Loss> {
    let known_by = source.strip_prefix("nokhwa:").unwrap_or(source);
    let fits = |camera: &&Listed| {
        camera.source == source || camera.name == known_by || camera.index.as_string() == known_by
    };
    let fitting: Vec<&Listed> = listed.iter().filter(fits).collect();
    match fitting.as_slice() {
        [one] => Ok((*one).clone()),
        [] => Err((Fault::NotFound, source.into())),
        _ => Err((Fault::Twin, source.into())),
    }
}

/// Calls the library; a panic counts as a fault of the driver.
pub(super) fn caught<T>(call: impl FnOnce() -> Result<T, Loss>) -> Result<T, Loss> {
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|payload| {
        let words = panic_message::panic_message(&*payload).unwrap_or_default();
        Err((Fault::DriverBroken, format!("nokhwa failed: {words}")))
    })
}

/// A streaming camera of the library.
pub(super) struct Streaming {
    camera: Camera,
    mode: Mode,
    /// Bytes of an uncompressed picture.
    picture: Option<usize>,
}

impl Streaming {
    /// Opens and starts the camera in the best `wanted` mode.
    pub(super) fn open(index: CameraIndex, wanted: &Wanted) -> Result<Self, Loss> {
        let failed = |err: NokhwaError| loss_of(&err);
        ask_for_permission()?;
        let any = RequestedFormat::with_formats(RequestedFormatType::None, &FORMATS);
        let mut camera = Camera::new(index, any).map_err(failed)?;
        let formats = camera.compatible_camera_formats().map_err(failed)?;
        let offers: Vec<CameraMode> = formats.iter().filter_map(offer).collect();
        // Some systems list nothing and stream nevertheless.
        let current = offer(&camera.camera_format()).filter(|_| offers.is_empty());
        let chosen = choose(&offers, wanted).or(current);
        let chosen = chosen.and_then(|offer| format(&offer)).ok_or_else(|| {
            (Fault::NoFormat, not_offered(&camera.info().human_name(), &offers, wanted))
        })?;
        if camera.camera_format() != chosen {
            let exact = RequestedFormatType::Exact(chosen);
            let exact = RequestedFormat::with_formats(exact, &FORMATS);
            camera.set_camera_requset(exact).map_err(failed)?;
        }
        camera.open_stream().map_err(failed)?;
        let granted = camera.camera_format();
        let mode = mode(&granted).ok_or_else(|| (Fault::NoFormat, granted.to_string()))?;
        Ok(Self { camera, mode, picture: picture_bytes(&mode) })
    }
}

impl Blocking for Streaming {
    fn mode(&self) -> Mode {
        self.mode
    }

    fn frame(&mut self) -> Result<Vec<u8>, Loss> {
        let bytes = self.camera.frame_raw().map_err(|err| loss_of(&err))?;
        match self.picture {
            Some(needed) if bytes.len() >= needed + PAGE => Err(gaps(bytes.len(), needed)),
            _ => Ok(bytes.into_owned()),
        }
    }
}

/// Loss for rows with gaps between them, whose distance the library doesn't state.
fn gaps(came: usize, needed: usize) -> Loss {
    (Fault::NoFormat, format!("frames of {came} bytes for a picture of {needed}"))
}

fn picture_bytes(mode: &Mode) -> Option<usize> {
    let pixels = mode.size.width_px as usize * mode.size.height_px as usize;
    match mode.layout {
        PixelLayout::Nv12 => Some(pixels + pixels.div_ceil(2)),
        PixelLayout::Mjpeg | PixelLayout::Decoded => None,
        layout => Some(layout.bytes_per_pixel() * pixels),
    }
}

/// Asks for permission. Some systems ask the person first; others answer at once.
fn ask_for_permission() -> Result<(), Loss> {
    if nokhwa_check() {
        return Ok(());
    }
    let (answer, answered) = mpsc::channel();
    nokhwa_initialize(move |may| {
        answer.send(may).ok();
    });
    match answered.recv_timeout(ASKING) {
        Ok(true) => Ok(()),
        _ => Err((Fault::NotPermitted, String::new())),
    }
}

fn offer(format: &CameraFormat) -> Option<CameraMode> {
    let fourcc = match format.format() {
        FrameFormat::MJPEG => *b"MJPG",
        FrameFormat::YUYV => *b"YUYV",
        FrameFormat::NV12 => *b"NV12",
        FrameFormat::GRAY => *b"GREY",
        FrameFormat::RAWRGB | FrameFormat::RAWBGR => return None,
    };
    let size = ImageSize { width_px: format.width(), height_px: format.height() };
    let rate = format.frame_rate();
    Some(CameraMode { fourcc, size, interval: (rate > 0).then_some((1, rate)) })
}

fn format(offer: &CameraMode) -> Option<CameraFormat> {
    let format = match &offer.fourcc {
        b"MJPG" => FrameFormat::MJPEG,
        b"YUYV" => FrameFormat::YUYV,
        b"NV12" => FrameFormat::NV12,
        b"GREY" => FrameFormat::GRAY,
        _ => return None,
    };
    let rate = offer.interval.map_or(0, |(_, rate)| rate);
    Some(CameraFormat::new_from(offer.size.width_px, offer.size.height_px, format, rate))
}

fn mode(format: &CameraFormat) -> Option<Mode> {
    let offer = offer(format)?;
    let layout = crate::layout(offer.fourcc)?;
    Some(Mode { size: offer.size, layout, interval_secs: offer.interval })
}

/// Fault behind the library's words; error numbers appear in the text only.
pub(super) fn loss_of(err: &NokhwaError) -> Loss {
    let words = err.to_string();
    let lower = words.to_lowercase();
    let says = |any: &[&str]| any.iter().any(|some| lower.contains(some));
    let fault = if says(&["permission denied", "access is denied", "0x80070005"]) {
        Fault::NotPermitted
    } else if says(&["resource busy", "in use", "0xc00d3704"]) {
        Fault::Busy
    } else if says(&["no space left"]) {
        Fault::NoBandwidth
    } else {
        let is_gone = says(&["no such device", "no longer present", "not connected", "0xc00d3ea2"]);
        match err {
            NokhwaError::OpenDeviceError(..)
                if is_gone || says(&["no such file", "not found", "no device", "is null"]) =>
            {
                Fault::NotFound
            }
            _ if is_gone => Fault::Unplugged,
            NokhwaError::GetPropertyError { .. }
                if says(&["fufill", "fulfill", "unsupported", "not whole number"]) =>
            {
                Fault::NoFormat
            }
            NokhwaError::SetPropertyError { .. } if says(&["rejected"]) => Fault::OtherMode,
            NokhwaError::OpenDeviceError(..)
            | NokhwaError::OpenStreamError(_)
            | NokhwaError::ReadFrameError(_)
            | NokhwaError::GetPropertyError { .. }
            | NokhwaError::SetPropertyError { .. } => Fault::Transfer,
            _ => Fault::DriverBroken,
        }
    };
    (fault, format!("nokhwa: {words}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_librarys_words_mean_faults() {
        let text = String::from;
        let get = |property: &str, error: &str| NokhwaError::GetPropertyError {
            property: property.into(),
            error: error.into(),
        };
        let set = |error: &str| NokhwaError::SetPropertyError {
            property: "CameraFormat".into(),
            value: String::new(),
            error: error.into(),
        };
        for (err, fault) in [
            (
                NokhwaError::OpenDeviceError(
                    text("0"),
                    text("V4L2 Error: No such file or directory (os error 2)"),
                ),
                Fault::NotFound,
            ),
            (
                NokhwaError::OpenDeviceError(
                    text("0"),
                    text("V4L2 Error: Permission denied (os error 13)"),
                ),
                Fault::NotPermitted,
            ),
            (set("Device or resource busy (os error 16)"), Fault::Busy),
            (
                NokhwaError::OpenStreamError(text("No space left on device (os error 28)")),
                Fault::NoBandwidth,
            ),
            (NokhwaError::ReadFrameError(text("No such device (os error 19)")), Fault::Unplugged),
            (NokhwaError::ReadFrameError(text("Input/output error (os error 5)")), Fault::Transfer),
            (get("V4L2 FrameRate", "Framerate not whole number: 15 / 2"), Fault::NoFormat),
            (get("FrameFormat", "unsupported"), Fault::NoFormat),
            (get("CameraFormat", "Failed to Fufill"), Fault::NoFormat),
            (set("Not same/Rejected"), Fault::OtherMode),
            (NokhwaError::UnitializedError, Fault::DriverBroken),
        ] {
            let (found, detail) = loss_of(&err);
            assert_eq!(found, fault, "{err}");
            assert_eq!(detail, format!("nokhwa: {err}"));
        }
    }

    #[test]
    fn a_camera_is_found_by_its_whole_name_and_never_guessed() {
        let camera = |index: u32, name: &str, source: &str| Listed {
            source: source.into(),
            name: name.into(),
            index: CameraIndex::Index(index),
        };
        let listed = [
            camera(0, "C920", "nokhwa:usb-1"),
            camera(1, "C920", "nokhwa:usb-2"),
            camera(2, "Other", "nokhwa:Other"),
        ];
        for (source, which) in [("nokhwa:usb-2", 1), ("nokhwa:Other", 2), ("nokhwa:0", 0)] {
            assert_eq!(find(&listed, source).as_ref(), Ok(&listed[which]));
        }
        assert_eq!(find(&listed, "nokhwa:C920"), Err((Fault::Twin, "nokhwa:C920".into())));
        assert_eq!(find(&listed, "nokhwa:usb-9"), Err((Fault::NotFound, "nokhwa:usb-9".into())));
    }

    #[test]
    fn a_panic_is_a_fault_with_its_words() {
        let broken: Result<(), Loss> = caught(|| panic!("cut within a character"));
        let words = "nokhwa failed: cut within a character";
        assert_eq!(broken, Err((Fault::DriverBroken, words.into())));
    }
}
