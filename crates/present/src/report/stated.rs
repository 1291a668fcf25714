use super::Logo;

/// Statements of a certificate beside the calibration. Empty texts become lines to fill in by pen.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[expect(missing_docs, reason = "explained in config/default.toml")]
pub struct Certificate {
    pub number: String,
    /// Date of the calibration, with its time zone.
    pub date: String,
    /// Due date of the next check.
    pub check_due: Option<String>,
    pub company: String,
    pub logo: Option<Logo>,
    pub customer: String,
    pub site: String,
    pub operator: String,
    pub camera_make: String,
    pub camera_model: String,
    pub camera_serial: String,
    pub lens: String,
    pub mode: String,
    pub board_id: String,
    pub square_measured: String,
    /// Name and SHA-256 of the calibration file.
    pub file: Option<(String, String)>,
}
