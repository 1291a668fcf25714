//! The calibration report in words.

pub use super::boards::board_in_file as board;
use boresight_calibrate::Verdict;
use boresight_formats::CalibrationFile;

/// Sections of the page, in order, with headings and link anchors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// First sheet.
    Certificate,
    /// Verdict on the result, and the next action.
    Verdict,
    /// Identity, mode, controls, board.
    Camera,
    /// Estimates with standard deviations.
    Numbers,
    /// Findings of the honesty checks.
    Findings,
    /// Principal lines in the picture.
    Fan,
    /// Principal point by every method.
    Estimates,
    /// Principal point by the methods with a lens model, enlarged.
    EstimatesNear,
    /// Estimates with views left out.
    Skip,
    /// Uncertainty of projection over the picture.
    Projection,
    /// Distortion against the distance from the principal point.
    Lens,
    /// Places of the boards in the picture.
    Coverage,
    /// Residuals of the corners.
    Residuals,
    /// Table or pictures of every view.
    Views,
    /// Comparison with an older calibration.
    Drift,
    /// Displacement by a judged calibration over the picture.
    Difference,
    /// Cameras of a rig and places of the board.
    Places,
    /// Lenses of a rig's cameras.
    Cameras,
    /// Each two cameras of a rig.
    Pairs,
    /// Pictures of two cameras, as taken and rectified.
    Rows,
    /// Uncertainty of a distance that two cameras measure.
    Distances,
    /// Refused pictures, with reasons.
    Refused,
    /// Versions, and the command to repeat the result.
    Provenance,
}

impl Section {
    /// Stable name, used as the anchor in the page.
    pub fn id(self) -> &'static str {
        match self {
            Self::Certificate => "certificate",
            Self::Verdict => "verdict",
            Self::Camera => "camera",
            Self::Numbers => "numbers",
            Self::Findings => "findings",
            Self::Fan => "principal-lines",
            Self::Estimates => "estimates",
            Self::EstimatesNear => "estimates-near",
            Self::Skip => "skip",
            Self::Projection => "projection",
            Self::Lens => "lens",
            Self::Coverage => "coverage",
            Self::Residuals => "residuals",
            Self::Views => "views",
            Self::Drift => "drift",
            Self::Difference => "difference",
            Self::Places => "places",
            Self::Cameras => "cameras",
            Self::Pairs => "pairs",
            Self::Rows => "rows",
            Self::Distances => "distances",
            Self::Refused => "refused",
            Self::Provenance => "provenance",
        }
    }

    /// Heading of the section.
    pub fn heading(self) -> &'static str {
        match self {
            Self::Certificate => "Certificate",
            Self::Verdict => "Verdict",
            Self::Camera => "Camera and board",
            Self::Numbers => "Numbers",
            Self::Findings => "Findings",
            Self::Fan => "Principal lines",
            Self::Estimates => "Principal point by method",
            Self::EstimatesNear => "Methods that model the lens",
            Self::Skip => "Estimates with n views left out",
            Self::Projection => "Typical error over the picture",
            Self::Lens => "Distortion",
            Self::Coverage => "Coverage",
            Self::Residuals => "Residuals",
            Self::Views => "Views",
            Self::Drift => "Drift",
            Self::Difference => "Difference over the picture",
            Self::Places => "Cameras, and places of the board",
            Self::Cameras => "Cameras",
            Self::Pairs => "Pairs of cameras",
            Self::Rows => "Rows of two pictures",
            Self::Distances => "Distances by two cameras",
            Self::Refused => "Pictures not used, and why",
            Self::Provenance => "Versions and how to repeat",
        }
    }
}

/// Title of the page.
pub fn title(name: &str) -> String {
    format!("Calibration report: {name}")
}

/// Title of the page about several cameras.
pub fn title_of_rig(name: &str) -> String {
    format!("Rig: {name}")
}

/// Title of the page about a judged file.
pub fn title_of_judgement(file: &str) -> String {
    format!("Judged: {file}")
}

/// Note below the map of differences.
pub fn difference_note(times: &str, goal_px: &str) -> String {
    format!(
        "Root mean square per coordinate, in pixels, after the best turn of the camera; green: within {goal_px} px. Arrows, {times} times as long: from where the pictures' lens puts a point to where this calibration puts it. Grey: no board was there. Hatched: one of the lenses has no ray."
    )
}

/// Verdict in words, from the stable name; an unknown name isn't to be trusted. See
/// [`super::verdict`].
fn verdict(code: &str, unfinished: bool) -> &'static str {
    let known = [Verdict::Good, Verdict::Care].into_iter().find(|verdict| verdict.code() == code);
    super::verdict(known.unwrap_or(Verdict::Untrustworthy), unfinished)
}

/// Verdict on a calibration in a file.
pub fn verdict_of(calibration: &CalibrationFile) -> &'static str {
    if calibration.is_imported() {
        return NOT_JUDGED;
    }
    verdict(&calibration.verdict, calibration.is_unfinished())
}

/// Sign of the verdict on a calibration in a file, recognisable by shape.
pub fn sign_of(calibration: &CalibrationFile) -> &'static str {
    verdict_sign(if calibration.is_imported() { "none" } else { &calibration.verdict })
}

/// Another program's calibration.
const NOT_JUDGED: &str = "NOT JUDGED";

/// Sign of a verdict or an answer, recognisable by shape.
pub fn verdict_sign(code: &str) -> &'static str {
    match code {
        "good" | "ok" | "true" => "✓",
        "care" | "watch" => "!",
        "cannot-tell" | "none" => "?",
        _ => "✗",
    }
}

/// Calibration's verdict on the page of a check.
pub fn by_themselves(calibration: &CalibrationFile) -> String {
    format!("Calibration from the check's views: {}", verdict_of(calibration))
}

/// Action after a good calibration.
pub const USE_IT: &str = "Use it. Don't change focus, zoom or picture size. Keep the file to check the camera against it later.";

/// Line above the verdict on a simulated camera.
pub const SIMULATED: &str = "SIMULATED CAMERA: not a calibration of any real camera";

/// Label of the next action.
pub const NEXT: &str = "Next:";

/// Label of the verdict on a goal.
pub const GOAL: &str = "Goal:";

/// Note in place of a missing calibration.
pub const NO_CALIBRATION: &str = "No calibration yet.";

/// Note in place of a drawing, without the corners.
pub const NEEDS_CORNERS: &str =
    "Not shown: this file has no corners. The session report and `calibrate --report` have them.";

/// Note in place of a drawing, without the covariance.
pub const NEEDS_COVARIANCE: &str = "Its uncertainty isn't known.";

/// Note in place of a drawing, with too few lines or views.
pub const TOO_FEW: &str = "Not shown: too few views.";

/// Note in place of an empty list of findings.
pub const NO_FINDINGS: &str = "All checks passed.";

/// Note in place of an empty list of refusals.
pub const NOTHING_REFUSED: &str = "Every picture was used.";

/// Total duration of a video's frames refused for a reason.
pub fn lasted(secs: f64) -> String {
    format!("{secs:.1} s")
}

/// Note below the first reasons.
pub fn more_reasons(count: usize) -> String {
    format!("And {count} more. On screen, open the full list below.")
}

/// Label of the list of all refused pictures.
pub const ALL_REFUSED: &str = "All pictures not used";

/// Note below a command shortened on paper.
pub const CUT_ON_PAPER: &str = "(Shortened on paper; complete in the file.)";

/// Severity in a word.
pub fn severity(code: &str) -> &'static str {
    match code {
        "info" => "note",
        "care" => "care",
        _ => "bad",
    }
}

/// Name of a method.
pub fn method(code: &str) -> &'static str {
    match code {
        "pl_unweighted" => "principal lines",
        "pl_weighted" => "weighted lines",
        "pl_ring" => "lines and ring",
        "free_homography" => "free homographies",
        "bundle" => "bundle adjustment",
        _ => "Zhang, k1 k2",
    }
}

/// Mark of the method behind the resulting principal point.
pub const THE_RESULT: &str = "the result";

/// Columns of the table of methods.
pub const METHOD_COLUMNS: [&str; 4] = ["method", "x px", "y px", "from the result px"];

/// Note below the fan.
pub const FAN_NOTE: &str = "Each view's line as seen in the picture, numbered; opposed views share a dash pattern. They meet in the principal point (cross; ellipse 2 sd), except as far as the lens bends them.";

/// Note below the estimates.
pub const ESTIMATES_NOTE: &str = "Ellipses: 2 sd. Principal lines come from raw corners: distortion pulls them towards the middle of the boards, as expected.";

/// Note below the estimates of the methods with a lens model.
pub const ESTIMATES_NEAR_NOTE: &str = "Free homographies assume no common focal length. They're the independent check of the bundle adjustment.";

/// Note below the cloud.
pub const SKIP_NOTE: &str = "Each group of n neighbouring views left out once. The scatter shows how much the result depends on single views. It measures stability, not accuracy: evenly spread lines have the same centroid for every n, wherever they meet.";

/// Note for views with a focal length each.
pub const SKIP_NO_BUNDLE: &str =
    "Each view has a separate focal length, so there's no bundle adjustment to repeat.";

/// Note for a file without the corners needed for another adjustment.
pub const SKIP_NEEDS_CORNERS: &str =
    "Bundle adjustment needs the corners, which this file doesn't have.";

/// Note about more views than starts.
pub fn skip_starts(starts: usize, views: usize) -> String {
    format!("Bundle adjustment: starting at {starts} of the {views} views.")
}

/// Caption of the table of estimates with views left out.
pub const SKIP_CAPTION: &str = "Stability with n views left out";

/// Columns of the table of estimates with views left out, after n.
pub const SKIP_COLUMNS: [&str; 3] = ["estimates", "centroid x, y px", "sd x, y px"];

/// Note below the map.
pub fn projection_note(mean_px: &str, max_px: &str, hatched: bool) -> String {
    let places = if hatched { " Hatched: not covered by the lens model." } else { "" };
    format!(
        "Typical error of a point (1 sd), ignoring camera rotation: {mean_px} px on average, {max_px} px at worst. Darker is less certain.{places}"
    )
}

/// Note below the distortion curve.
pub const LENS_NOTE: &str = "Radial distortion vs. distance from the principal point; band: 2 sd. Right of the dotted line is extrapolated.";

/// Reference of a fisheye lens's distortion.
pub const FISHEYE_NOTE: &str =
    "Distortion is measured against an ideal fisheye, which shows angles in proportion.";

/// Tangential distortion at the farthest corner.
pub fn tangential(shift_px: &str) -> String {
    format!("Tangential distortion adds up to {shift_px} px.")
}

/// Note below the map of outlines.
pub const COVERAGE_NOTE: &str =
    "Outlines of the boards' inner corners. Hatched: not covered by any board.";

/// Covered share of the picture.
pub fn covered(percent: &str) -> String {
    format!("Covered: {percent} %.")
}

/// Note below the residuals.
pub fn residuals_note(times: &str, shown: usize, of: usize) -> String {
    let which =
        if shown < of { format!("{shown} of {of} corners") } else { format!("{of} corners") };
    format!("Measured minus predicted, enlarged {times}×; {which}.")
}

/// Note behind the numbers of the view with the largest residual.
pub const FITS_WORST: &str = ", fits worst";

/// Note below the views.
pub fn views_note(shown: usize, of: usize) -> String {
    let more =
        if shown < of { format!(" The first {shown} of {of} are shown.") } else { String::new() };
    format!(
        "Number; tilt and its direction (0° is right, 90° down); focal length from this view alone; residual. Bold line: principal line.{more}"
    )
}

/// Note for views without a picture.
pub const NO_PICTURES: &str = "Pictures not available: showing the boards' outlines.";

/// Columns of the table of views.
pub const VIEW_COLUMNS: [&str; 7] =
    ["view", "picture", "tilt °", "direction °", "line off px", "f px", "RMS px"];

/// Label of the table of views.
pub const VIEW_TABLE: &str = "All views as a table";

/// Note in place of an empty list of camera changes.
pub const NO_CHANGES: &str = "No changes while the views were taken.";

/// Names of rows and axes.
#[expect(missing_docs, reason = "the words say it")]
pub mod name {
    pub const PICTURE: &str = "Picture";
    pub const BOARD: &str = "Board";
    pub const SOURCE: &str = "Source";
    pub const MODE: &str = "Mode";
    pub const BEGUN: &str = "Started";
    pub const SETTINGS: &str = "Settings changed";
    pub const CHANGES: &str = "Changes";
    pub const PRINCIPAL_POINT: &str = "Principal point x, y";
    pub const FOCAL_LENGTH: &str = "Focal length";
    pub const FOCAL_LENGTHS: &str = "Focal lengths x, y";
    pub const FOCAL_MEAN: &str = "Focal length, mean of all views";
    pub const FOCAL_SCATTER: &str = "Focal length, sd between views";
    pub const LENS_MODEL: &str = "Lens model";
    pub const SD: &str = "Standard deviations";
    pub const PROJECTION: &str = "Typical error (1 sd), and at worst";
    pub const BOUND: &str = "Error bound (95 %)";
    pub const FOCUS: &str = "Focus";
    pub const NOISE: &str = "Corner error";
    pub const NOISE_FLOOR: &str = "Corner error, measured while holding still";
    pub const COVERAGE: &str = "Coverage";
    pub const VIEWS: &str = "Views used";
    pub const RMS: &str = "RMS residual (says little about accuracy)";
    pub const SKIPPED: &str = "n";
    pub const RADIUS: &str = "distance from the principal point (px)";
    pub const SHIFT: &str = "outwards (px)";
    pub const X: &str = "x (px)";
    pub const Y: &str = "y (px)";
    pub const LAST_BOARD: &str = "farthest board";
    pub const PROGRAM: &str = "Program";
    pub const SCHEMAS: &str = "Schemas";
    pub const SESSION: &str = "Session";
    pub const FILE: &str = "File";
    pub const FRAMES: &str = "Frames";
    pub const AGAINST: &str = "Old calibration";
    pub const REPEAT: &str = "Repeat with";
}

/// Size of the picture.
pub fn picture([width, height]: [u32; 2]) -> String {
    format!("{width}×{height} px")
}

/// Rows of the drift section.
#[expect(missing_docs, reason = "the words say it")]
pub mod drift {
    pub const OLD: &str = "Old calibration";
    pub const CHANGE_F: &str = "Change of focal length";
    pub const CHANGE_PP: &str = "Change of principal point x, y";
    pub const SMALLEST_F: &str = "Smallest detectable change of focal length";
    pub const SMALLEST_PP: &str = "Smallest detectable change of principal point";
    pub const NOTE: &str = "Change of the principal point from the old calibration (0, 0). Ellipse: 2 sd. Dotted circle: smallest detectable change.";
    pub const X: &str = "change of x (px)";
    pub const Y: &str = "change of y (px)";
}

/// Reason for refusing a frame, from its stable name: `why` of a refusal, or the name of a miss.
pub fn refusal_kind(code: &str) -> &str {
    match code {
        "no_board" | "not_found" => "No board found",
        "partial_board" => "Part of the board hidden or out of view",
        "glare" => "Too much glare",
        "other_board" | "other_squares" => "Different board",
        "other_markers" => "Different markers on the board",
        "too_small" => "Squares too small to measure",
        "blurred" => "Blurred",
        "low_contrast" => "Too dark",
        "out_of_time" => "Search took too long",
        "no_line" => "Board faced the camera",
        "outside_lens" => "Board outside the part of the lens measured so far",
        "too_flat" => "Board not tipped enough",
        "too_steep" => "Board tipped too far",
        "unclear" => "Direction of the board uncertain",
        "too_far" => "Board too far away",
        "at_the_edge" => "Board too close to the picture's edge",
        "already_covered" => "Angle already taken",
        "partner_off" => "Opposite tilt, but off the outline",
        "between_slots" => "Between two directions",
        "tells_little" => "Added little compared with the requested pose",
        "inconsistent" => "Didn't fit the other views",
        "moving" => "Board moved",
        "holding" => "A sharper photo of the same pose was used",
        "other_size" => "Different picture size",
        "camera_not_ready" => "Camera lost, frozen, or its focus or zoom moved",
        "not_collecting" => "Capture was paused or over",
        "removed" => "View removed",
        other => other,
    }
}

/// Frame number of an event in a session.
pub fn at_frame(frame: Option<u64>) -> String {
    frame.map_or_else(|| "before the first frame".into(), |frame| format!("after frame {frame}"))
}

/// Event of a session resumed after an interruption.
pub const RESUMED: &str = "The session resumed after an interruption";

/// Event of a failed worker.
pub fn failed(worker: &str, reason: &str) -> String {
    format!("The {worker} failed: {reason}")
}

/// Source of a calibration from files.
pub fn files(folder: &str, count: usize) -> String {
    let files = if count == 1 { "1 file" } else { &format!("{count} files") };
    if folder.is_empty() { files.into() } else { format!("{folder}, {files}") }
}

/// Frames of a session.
pub fn frames(looked_at: usize, taken: usize) -> String {
    format!("{looked_at} examined, {taken} taken")
}

/// Error of writing the page at the end of a session.
pub fn not_written(session: &std::path::Path) -> String {
    format!("The report couldn't be written. Try again: boresight report {}", session.display())
}

/// Note about a result in the folder that differs from the journal's.
pub const OTHER_RESULT: &str = "calibration.json in this folder differs from the journal: it's older than the last view or from another version. This page shows the journal's numbers.";

/// Note about a cut or damaged journal, read up to the damage.
pub const CUT: &str =
    "The journal's last entry was incomplete (never shown as saved) and was dropped.";
