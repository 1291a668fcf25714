//! Names and next actions of the wing's errors.

use boresight_app::explain::{self as program, Explained, Row, code_by, next_by, row};

use crate::batch;
#[cfg(feature = "history")]
use crate::history::IndexError;

/// Errors of the wing.
pub const ERRORS: &[Row] = &[
    row::<batch::ManifestError>,
    row::<batch::OtherJob>,
    row::<batch::NotWorked>,
    #[cfg(feature = "cloud")]
    row::<batch::CloudError>,
    #[cfg(feature = "history")]
    row::<IndexError>,
];

/// Stable name of an error of the wing or of the program; `FAILED` if unnamed.
pub fn error_code(err: &anyhow::Error) -> &'static str {
    code_by(&[ERRORS, &program::ERRORS], err)
}

/// Next action for an error of the wing or of the program, if known.
pub fn explain(err: &anyhow::Error) -> Option<String> {
    next_by(&[ERRORS, &program::ERRORS], err)
}

impl Explained for batch::ManifestError {
    fn code(&self) -> Option<&'static str> {
        Some("MANIFEST")
    }
}

impl Explained for batch::OtherJob {
    fn code(&self) -> Option<&'static str> {
        Some("OTHER-BATCH")
    }
}

impl Explained for batch::NotWorked {
    fn code(&self) -> Option<&'static str> {
        Some(match self {
            Self::Changed => "SESSION-CHANGED",
            Self::NoOldCalibration => "NO-OLD-CALIBRATION",
            Self::BrokenBag(_) => "BAG",
        })
    }

    fn next(&self) -> Option<String> {
        let action = match self {
            Self::Changed => "Plan again: boresight batch plan",
            Self::NoOldCalibration => "Name the older calibration: --against FILE",
            Self::BrokenBag(_) => {
                "The row holds what comes of the pictures before; record the bag again for more."
            }
        };
        Some(action.into())
    }
}

#[cfg(feature = "cloud")]
impl Explained for batch::CloudError {
    fn code(&self) -> Option<&'static str> {
        None
    }

    fn next(&self) -> Option<String> {
        Some(self.next_action().into())
    }
}

#[cfg(feature = "history")]
impl Explained for IndexError {
    fn code(&self) -> Option<&'static str> {
        (!matches!(self, Self::File(_))).then_some("INDEX")
    }

    fn next(&self) -> Option<String> {
        matches!(self, Self::Line { .. }).then(|| {
            "Nothing is lost with an index: delete it, and add the folders of sessions again with boresight history add.".into()
        })
    }
}
