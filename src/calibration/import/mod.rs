//! Calibrations that this and other programs wrote, read back.
//!
//! | format | told by | brings |
//! |---|---|---|
//! | [`own_json`] | its schema | lens, covariance, where the boards were |
//!
//! Text comes in, numbers go out; nothing here opens a file.

mod own;

use nalgebra::SMatrix;

pub use own::own_json;

use crate::{
    frame::ImageSize,
    geometry::{BoardOutline, Camera, LENS_PARAMETERS},
};

/// A calibration as some program left it.
#[derive(Clone, Debug, PartialEq)]
pub struct OldCalibration {
    /// What the text was.
    pub format: OldFormat,
    /// The lens.
    pub camera: Camera,
    /// The picture that it holds for.
    pub image_size: ImageSize,
    /// Covariance of the lens parameters; zero for those held fixed. Only this program's own files say.
    pub covariance: Option<SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>>,
    /// Where the boards were; empty if the file does not say.
    pub outlines: Vec<BoardOutline>,
    /// Root mean square reprojection residual, if the file says.
    pub rms_px: Option<f64>,
    /// What the camera is called, if the file says.
    pub source: Option<String>,
}

/// Formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OldFormat {
    /// `boresight.calibration/1`.
    Own,
}

/// Why a text is no calibration that can be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotImported {
    /// None of the formats.
    #[error("not a calibration in a format that can be read")]
    UnknownFormat,
    /// The text breaks the rules of its format.
    #[error("not well formed: {reason}")]
    Malformed {
        /// What is wrong.
        reason: String,
    },
    /// A later version of this program's own schema.
    #[error("its schema is {found:?}, this version reads \"boresight.calibration/1\"")]
    Schema {
        /// The schema named.
        found: String,
    },
    /// The session ended without a calibration.
    #[error("it holds no result")]
    NoResult,
    /// A value is missing or no number.
    #[error("{name} is missing or not a number")]
    Missing {
        /// Name in the file.
        name: &'static str,
    },
    /// A lens model other than pinhole with k1, k2, p1, p2, k3.
    #[error("its lens model {found:?} cannot be read: want a pinhole with k1 k2 p1 p2 k3")]
    Model {
        /// The model named.
        found: String,
    },
    /// Numbers that no camera has.
    #[error("{name} is {value}, which no camera has")]
    Nonsense {
        /// Name of the number.
        name: &'static str,
        /// Its value, as text.
        value: String,
    },
}

impl OldCalibration {
    /// Checks what every format holds.
    fn new(
        format: OldFormat,
        lens: &[f64; LENS_PARAMETERS],
        size: [f64; 2],
    ) -> Result<Self, NotImported> {
        let nonsense = |name, value: f64| NotImported::Nonsense { name, value: value.to_string() };
        for (name, value) in
            ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"].into_iter().zip(lens)
        {
            if !value.is_finite() || (name.starts_with('f') && *value <= 1.0) {
                return Err(nonsense(name, *value));
            }
        }
        let [width_px, height_px] = size.map(|side| {
            let whole = side.fract() == 0.0 && (1.0..=1e5).contains(&side);
            // A whole number up to 100 000 fits.
            if whole { Ok(side as u32) } else { Err(nonsense("the picture's size", side)) }
        });
        Ok(Self {
            format,
            camera: Camera::from_lens_parameters(lens),
            image_size: ImageSize { width_px: width_px?, height_px: height_px? },
            covariance: None,
            outlines: Vec::new(),
            rms_px: None,
            source: None,
        })
    }
}
