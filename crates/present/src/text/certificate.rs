//! The certificate in words.

/// Title of a usable calibration.
pub const TITLE: &str = "Calibration certificate";
/// Names of the customer's three questions.
pub const HOW_EXACT: &str = "How exact";
/// See [`HOW_EXACT`].
pub const WHERE: &str = "Where";
/// See [`HOW_EXACT`].
pub const UNTIL_WHEN: &str = "Until when";
/// Answer without standard deviations.
pub const NOT_KNOWN: &str = "Not known.";
/// Label of the picture for screen readers.
pub const PICTURE: &str = "The valid part of the picture";
/// Line beside the QR code.
pub const SCAN: &str = "Scan to check that this sheet belongs to the file";

/// Line below the error.
pub fn of_goal(is_bound: bool, goal: &str) -> String {
    let what = if is_bound { "error bound, 95 %" } else { "typical error" };
    format!("{what}; goal {goal}")
}

/// How exact the calibration is.
pub fn how_exact(px: &str, mm: &str, at_m: f64) -> String {
    format!("A point is typically off by {px} pixels: {mm} mm at {at_m} m.")
}

/// Where the calibration holds.
pub fn where_valid(share: f64) -> String {
    if share > 0.995 {
        "In the whole picture.".into()
    } else if share < 0.005 {
        "No part of the picture meets the goal.".into()
    } else {
        "In the bright part of the picture. The rest is extrapolated.".into()
    }
}

/// How long the calibration holds.
pub fn until_when(check_due: Option<&str>) -> String {
    let due = check_due.map_or(String::new(), |due| format!(" Next check due {due}."));
    format!("Until focus, zoom or lens is touched.{due}")
}

/// Title of an unusable calibration.
pub const NO_CERTIFICATE: &str = "Calibration record (not a certificate)";
/// Watermark on the sheet of a simulated camera.
pub const SIMULATED: &str = "SIMULATED";
/// Camera of a simulated session.
pub const SIMULATED_CAMERA: &str = "simulated camera";

/// Certificate number.
pub fn number(number: &str) -> String {
    format!("No. {number}")
}

/// Mark of a limit that's met, where there is no tick.
pub const IS_MET: &str = "met";
/// Mark of a limit that's missed.
pub const IS_MISSED: &str = "missed";

/// Names of rows, columns and lines.
#[expect(missing_docs, reason = "the words say it")]
pub mod name {
    pub const COMPANY: &str = "Calibrated by";
    pub const CUSTOMER: &str = "Customer";
    pub const SITE: &str = "Site";
    pub const OPERATOR: &str = "Operator";
    pub const DATE: &str = "Date";
    pub const DUE: &str = "Next check due";
    pub const MAKE: &str = "Camera make";
    pub const MODEL: &str = "Camera model";
    pub const SERIAL: &str = "Serial number";
    pub const LENS: &str = "Lens";
    pub const MODE: &str = "Mode";
    pub const BOARD: &str = "Board";
    pub const BOARD_ID: &str = "Board ID";
    pub const MEASURED: &str = "Square measured with";
    pub const RESULT: &str = "Result";
    pub const UNCERTAINTY: &str = "U (k = 2)";
    pub const LIMIT: &str = "Limit";
    pub const MET: &str = "Met";
    pub const FAILED: &str = "Failed check";
    pub const PP_X: &str = "Principal point x";
    pub const PP_Y: &str = "Principal point y";
    pub const F: &str = "Focal length";
    pub const FX: &str = "Focal length x";
    pub const FY: &str = "Focal length y";
    pub const TYPICAL: &str = "Typical error";
    pub const MEETS: &str = "Part of the picture that meets the goal";
    pub const NOISE: &str = "Corner error";
    pub const VIEWS: &str = "Views";
    pub const CHECK: &str = "Distance from the independent check";
    pub const GOAL: &str = "Goal";
    pub const FIELD: &str = "Field of view";
    pub const PASTE: &str = "To paste (OpenCV)";
    pub const FILE: &str = "Calibration file";
    pub const SIGNED: &str = "Calibrated by";
    pub const APPROVED: &str = "Approved by";
    pub const SIGNATURE: &str = "name, date, signature";
}

/// Lower limit.
pub fn at_least(value: &str) -> String {
    format!("≥ {value}")
}

/// Upper limit.
pub fn at_most(value: &str) -> String {
    format!("≤ {value}")
}

/// Limit of the independent check, which isn't a length: both points must agree.
pub const CHECK_LIMIT: &str = "agreement within 3.7 sd";

/// Field of view.
pub fn field_of_view([across, down, diagonal]: [f64; 3]) -> String {
    format!("{across:.1}° × {down:.1}°, diagonal {diagonal:.1}°")
}

/// Note below the table.
pub const UNCERTAINTY_NOTE: &str = "U is the expanded uncertainty: the standard deviation times the coverage factor k = 2, for a confidence of about 95 %. Limits of views, corner error and independent check are those of the grade Good; the goal is that of the card. The independent check compares with the principal point from each view alone, without a common lens.";

/// Validity conditions of the numbers.
pub const VALIDITY: &str = "Valid for this camera, lens, focus, zoom and picture size, until one of them changes. Pixel (0, 0) is the centre of the top-left pixel; y points down.";
/// Note about the engineer's sheets.
pub const FOLLOWING: &str = "The sheets that follow show how the result was obtained.";

/// Heading of the checks' further warnings.
pub const WARNINGS: &str = "Further warnings:";

/// Checksum of the calibration file.
pub fn checksum(file: &str, sha256: &str) -> String {
    format!("{file}, SHA-256 {sha256}")
}

/// Error for a missing logo.
pub fn no_logo(path: &str, why: &str) -> String {
    format!("The logo {path} can't be shown: {why}")
}

/// Error for a session whose logo only the session's owner may name.
pub fn logo_of_session(path: &str) -> String {
    format!(
        "The session's logo {path} is outside of this folder. To show it: --set certificate.logo={path}"
    )
}
