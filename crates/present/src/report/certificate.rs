//! The first sheet, for the customer: camera, result with its limits, and signature.

use super::{
    Certificate, Report, front,
    number::{brief, plain},
    section::section_with,
    warnings::warnings,
};
use crate::{
    chart::{escaped, push},
    goal::Goal,
    known::Known,
    text::{
        certificate::{self as words, name},
        percent, report as report_words,
    },
};
use boresight_calibrate::Limits;
use boresight_formats::{CalibrationFile, DistortionEntry, LensEntry};
use boresight_geometry::frame::ImageSize;

/// Coverage factor of expanded uncertainties.
pub(super) const COVERAGE_FACTOR: f64 = 2.0;

/// First sheet. Empty without a certificate in the report, without a result to certify, and for
/// another program's calibration, which nobody judged.
pub(super) fn sheet(report: &Report) -> String {
    let (Some(certificate), Some(lens)) = (&report.certificate, &report.calibration.result) else {
        return String::new();
    };
    let calibration = &report.calibration;
    if calibration.is_imported() {
        return String::new();
    }
    let certifies = calibration.is_usable() && !report.camera.simulated;
    let mut body = masthead(certificate, certifies, report.camera.simulated);
    if calibration.is_usable() {
        body += &front::front(report, certificate, lens);
    } else {
        body += &verdict(calibration);
        body += &front::cause(report);
    }
    body += &checksum(certificate);
    if certifies {
        body += &signatures(certificate);
    }
    body += "<div class=\"numbers\">\n";
    body += &identity_tables(identity(report, certificate));
    body += &results_table(&results(calibration, lens));
    if let Some(code) = to_paste(lens) {
        push(&mut body, format_args!("<p><b>{}</b></p>\n<pre>{code}</pre>\n", name::PASTE));
    }
    push(
        &mut body,
        format_args!(
            "<p class=\"note\">{} {} {}</p></div>\n",
            words::UNCERTAINTY_NOTE,
            words::VALIDITY,
            words::FOLLOWING
        ),
    );
    section_with(report_words::Section::Certificate, "certificate", &body)
}

/// Logo, company, title and number; a watermark across a sheet about simulated cameras.
pub(super) fn masthead(certificate: &Certificate, certifies: bool, simulated: bool) -> String {
    let title = if certifies { words::TITLE } else { words::NO_CERTIFICATE };
    let mut body = String::from("<header class=\"masthead\"><div>");
    if let Some(logo) = &certificate.logo {
        body += &logo.svg();
    }
    if !certificate.company.is_empty() {
        push(&mut body, format_args!("<p class=\"company\">{}</p>", escaped(&certificate.company)));
    }
    push(&mut body, format_args!("</div><div class=\"title\"><h1>{title}</h1>"));
    if !certificate.number.is_empty() {
        let number = escaped(&words::number(&certificate.number));
        push(&mut body, format_args!("<p class=\"lead\">{number}</p>"));
    }
    body += "</div></header>\n";
    if simulated {
        push(
            &mut body,
            format_args!(
                "<div class=\"watermark\" aria-hidden=\"true\">{}</div>\n<p class=\"simulated\">{}</p>\n",
                words::SIMULATED,
                report_words::SIMULATED
            ),
        );
    }
    body
}

/// Name and checksum of the file, also as a QR code; empty without a file.
pub(super) fn checksum(certificate: &Certificate) -> String {
    let Some((file, sha256)) = &certificate.file else { return String::new() };
    let checksum = words::checksum(file, sha256);
    format!(
        "<div class=\"checksum\">{}<p><b>{}</b><br/>{}</p></div>\n",
        front::qr_code(&checksum),
        words::SCAN,
        escaped(&checksum)
    )
}

/// Lines to sign on.
pub(super) fn signatures(certificate: &Certificate) -> String {
    let mut body = String::from("<div class=\"signatures\">");
    for (who, by) in [(name::SIGNED, certificate.operator.as_str()), (name::APPROVED, "")] {
        push(
            &mut body,
            format_args!(
                "<div><p><b>{who}</b> {}</p><p class=\"sign-here\">{}</p></div>",
                escaped(by),
                name::SIGNATURE
            ),
        );
    }
    body + "</div>\n"
}

/// Contents of a CSS string for any `text`.
pub(super) fn css_string(text: &str) -> String {
    let mut safe = String::new();
    for c in text.chars().filter(|c| !c.is_control()) {
        if c.is_ascii_alphanumeric() {
            safe.push(c);
        } else {
            push(&mut safe, format_args!("\\{:x} ", u32::from(c)));
        }
    }
    safe
}

/// Verdict in words, with what limits the use, and further warnings.
fn verdict(calibration: &CalibrationFile) -> String {
    format!(
        "<p class=\"lead\"><span class=\"sign\">{}</span> <strong>{}</strong></p>\n{}",
        report_words::sign_of(calibration),
        report_words::verdict_of(calibration),
        warnings(calibration)
    )
}

/// Names with what they name, which is empty where it's to be filled in.
type Named = Vec<(&'static str, String)>;

/// Person, place, date and board; the camera.
pub(super) fn identity(report: &Report, certificate: &Certificate) -> [Named; 2] {
    let calibration = &report.calibration;
    let row = |name, what: &str| (name, what.to_owned());
    let c = certificate;
    let mut who = vec![
        row(name::CUSTOMER, &c.customer),
        row(name::SITE, &c.site),
        row(name::OPERATOR, &c.operator),
        row(name::DATE, &c.date),
    ];
    let due = c.check_due.as_ref().filter(|_| calibration.is_usable());
    who.extend(due.map(|due| row(name::DUE, due)));
    who.extend(calibration.board.iter().map(|board| (name::BOARD, report_words::board(board))));
    who.extend([row(name::BOARD_ID, &c.board_id), row(name::MEASURED, &c.square_measured)]);
    let [width_px, height_px] = calibration.image_size;
    let mode = match c.mode.as_str() {
        "" => report_words::picture([width_px, height_px]),
        mode => mode.to_owned(),
    };
    let camera = vec![
        row(name::MAKE, &c.camera_make),
        row(name::MODEL, &c.camera_model),
        row(name::SERIAL, &c.camera_serial),
        row(name::LENS, &c.lens),
        (name::MODE, mode),
    ];
    [who, camera]
}

fn identity_tables(identity: [Named; 2]) -> String {
    let row = |(name, what): (&str, String)| {
        let blank = "<span class=\"blank\"></span>".to_owned();
        let what = if what.is_empty() { blank } else { escaped(&what) };
        format!("<tr><th scope=\"row\">{name}</th><td>{what}</td></tr>\n")
    };
    let [who, camera] = identity.map(|rows| rows.into_iter().map(row).collect::<String>());
    format!(
        "<div class=\"two\"><table><tbody>\n{who}</tbody></table><table><tbody>\n{camera}</tbody></table></div>\n"
    )
}

/// Row of the table of results. Cells are HTML; `met` is empty without a limit.
pub(super) struct ResultRow {
    pub(super) name: &'static str,
    pub(super) result: String,
    pub(super) uncertainty: String,
    pub(super) limit: String,
    pub(super) met: Option<bool>,
}

impl ResultRow {
    fn html(&self) -> String {
        let met = self.met.map_or("", |met| if met { "✓" } else { "✗" });
        let Self { name, result, uncertainty, limit, .. } = self;
        if *name == name::FAILED {
            return format!(
                "<tr><th scope=\"row\">{name}</th><td colspan=\"3\">{result}</td><td class=\"met\">{met}</td></tr>\n"
            );
        }
        if uncertainty.is_empty() && limit.is_empty() {
            return format!(
                "<tr><th scope=\"row\">{name}</th><td class=\"n\" colspan=\"4\">{result}</td></tr>\n"
            );
        }
        format!(
            "<tr><th scope=\"row\">{name}</th><td class=\"n\">{result}</td><td class=\"n\">{uncertainty}</td><td class=\"n\">{limit}</td><td class=\"met\">{met}</td></tr>\n"
        )
    }

    /// Row of a check that failed, in words.
    fn failed(message: &str) -> Self {
        let [uncertainty, limit] = [String::new(), String::new()];
        let met = Some(false);
        Self { name: name::FAILED, result: escaped(message), uncertainty, limit, met }
    }

    /// Row of an estimate with expanded uncertainty.
    fn estimate(name: &'static str, value_px: f64, sd_px: Option<f64>) -> Self {
        let limit = String::new();
        let Some(expanded_px) = sd_px.map(|sd_px| COVERAGE_FACTOR * sd_px) else {
            let (result, uncertainty) = (format!("{} px", plain(value_px, 2)), String::new());
            return Self { name, result, uncertainty, limit, met: None };
        };
        let decimals = super::number::decimals(expanded_px);
        let reached = brief(expanded_px, 2);
        Self {
            name,
            result: format!("{} px", plain(value_px, decimals)),
            uncertainty: format!("± <data value=\"{expanded_px}\">{reached}</data> px"),
            limit,
            met: None,
        }
    }

    /// Row of a number with a limit.
    fn at_most(name: &'static str, value: f64, limit: f64, unit: &str) -> Self {
        let (reached, limit_text) = beside(value, limit);
        Self {
            name,
            result: format!("<data value=\"{value}\">{reached}</data> {unit}"),
            uncertainty: String::new(),
            limit: words::at_most(&format!("{limit_text} {unit}")),
            met: Some(value <= limit),
        }
    }
}

/// Number and limit, with enough digits to tell them apart.
fn beside(value: f64, limit: f64) -> (String, String) {
    let (mut reached, limit_text) = (brief(value, 2), brief(limit, 2));
    let number = |text: &str| text.parse::<f64>().unwrap_or(f64::NAN);
    for digits in 3..7 {
        let differ = reached != limit_text && number(&reached) != number(&limit_text);
        if differ || value == limit {
            break;
        }
        reached = brief(value, digits);
    }
    (reached, limit_text)
}

/// Failed checks, then results with their limits.
pub(super) fn results(calibration: &CalibrationFile, lens: &LensEntry) -> Vec<ResultRow> {
    let [width_px, height_px] = calibration.image_size;
    let limits = Limits::of(ImageSize { width_px, height_px });
    let few = calibration.findings.iter().any(|finding| finding.code == "VIEWS-FEW");
    let sd = lens.sigma;
    let estimate = ResultRow::estimate;
    let mut rows = vec![
        estimate(name::PP_X, lens.pp_px[0], sd.map(|sd| sd.pp_px[0])),
        estimate(name::PP_Y, lens.pp_px[1], sd.map(|sd| sd.pp_px[1])),
    ];
    let f_sd_px = |axis: usize| sd.map(|sd| sd.f_px[axis]);
    if lens.focal_varies() {
        // Each view has its own focal length.
    } else if lens.square_pixels() {
        rows.push(estimate(name::F, lens.f_px[0], f_sd_px(0)));
    } else {
        rows.push(estimate(name::FX, lens.f_px[0], f_sd_px(0)));
        rows.push(estimate(name::FY, lens.f_px[1], f_sd_px(1)));
    }
    if let Some(angles) = calibration.field_of_view_deg() {
        rows.push(ResultRow {
            name: name::FIELD,
            result: words::field_of_view(angles),
            uncertainty: String::new(),
            limit: String::new(),
            met: None,
        });
    }
    let goal = Goal::of_file(calibration).filter(|goal| !goal.is_bound);
    if let Some((goal, reached)) = goal.and_then(|goal| Some((goal.limit, goal.reached?))) {
        rows.push(ResultRow::at_most(name::TYPICAL, reached, goal, "px"));
    }
    if let Some(known) = Known::of_file(calibration) {
        let share = known.share();
        rows.push(ResultRow {
            name: name::MEETS,
            result: format!("<data value=\"{}\">{}</data>", 100.0 * share, percent(share)),
            uncertainty: String::new(),
            limit: String::new(),
            met: None,
        });
    }
    if let Some((distance_px, agrees)) = independent_check(calibration, lens) {
        rows.push(ResultRow {
            name: name::CHECK,
            result: format!("{} px", plain(distance_px, 2)),
            uncertainty: String::new(),
            limit: words::CHECK_LIMIT.to_owned(),
            met: Some(agrees),
        });
    }
    if let Some(noise_px) = lens.noise_px {
        rows.push(ResultRow::at_most(name::NOISE, noise_px, limits.noise_px, "px"));
    }
    let used = calibration.used().count();
    rows.push(ResultRow {
        name: name::VIEWS,
        result: used.to_string(),
        uncertainty: String::new(),
        limit: words::at_least(&limits.views.to_string()),
        met: Some(used >= limits.views && !few),
    });
    if let Some(judged) = &calibration.acceptance {
        let unit = escaped(&judged.unit);
        let (uncertainty, limit) = match judged.bound {
            Some(bound) => {
                let (bound, limit) = beside(bound, judged.limit);
                (format!("± {bound} {unit}"), limit)
            }
            None => (String::new(), brief(judged.limit, 2)),
        };
        rows.push(ResultRow {
            name: name::GOAL,
            result: escaped(&judged.goal),
            uncertainty,
            limit: words::at_most(&format!("{limit} {unit}")),
            met: Some(judged.met),
        });
    }
    if !calibration.is_usable() {
        // Limits that were kept say nothing for a result that must not be used.
        for row in &mut rows {
            row.met = row.met.filter(|met| !met);
        }
    }
    let bad = calibration.findings.iter().filter(|finding| finding.severity == "bad");
    bad.map(|finding| ResultRow::failed(&finding.message)).chain(rows).collect()
}

/// Columns of the table of results.
pub(super) const COLUMNS: [&str; 5] = ["", name::RESULT, name::UNCERTAINTY, name::LIMIT, name::MET];

fn results_table(rows: &[ResultRow]) -> String {
    let rows: String = rows.iter().map(ResultRow::html).collect();
    let head: String =
        COLUMNS.iter().map(|name| format!("<th scope=\"col\">{name}</th>")).collect();
    format!(
        "<table class=\"results\"><thead><tr>{head}</tr></thead><tbody>\n{rows}</tbody></table>\n"
    )
}

/// Distance of the result from the principal point of the free homographies, and whether they
/// agree.
fn independent_check(calibration: &CalibrationFile, lens: &LensEntry) -> Option<(f64, bool)> {
    let free = calibration.principal_point.as_ref()?.free_homography?;
    if lens.focal_varies() {
        return None;
    }
    let distance_px = libm::hypot(free.px[0] - lens.pp_px[0], free.px[1] - lens.pp_px[1]);
    let disagrees = calibration.findings.iter().any(|finding| finding.code == "CHECK-DISAGREES");
    Some((distance_px, !disagrees))
}

/// Camera matrix and distortion, for OpenCV in Python. `None` if views have a focal length each.
pub(super) fn to_paste(lens: &LensEntry) -> Option<String> {
    if lens.focal_varies() {
        return None;
    }
    let ([fx, fy], [cx, cy]) = (lens.f_px, lens.pp_px);
    let d = lens.distortion;
    let (d, fisheye) = match d {
        DistortionEntry { fisheye: true, k1, k2, k3, k4, .. } => {
            (vec![k1, k2, k3, k4], "   # cv2.fisheye")
        }
        DistortionEntry { k4: 0.0, k5: 0.0, k6: 0.0, .. } => {
            (vec![d.k1, d.k2, d.p1, d.p2, d.k3], "")
        }
        _ => (vec![d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6], ""),
    };
    let d = d.iter().map(|value| format!("{value:.9}")).collect::<Vec<_>>().join(", ");
    Some(format!(
        "K = [[{fx:.5}, 0, {cx:.5}],\n     [0, {fy:.5}, {cy:.5}],\n     [0, 0, 1]]\nD = [{d}]{fisheye}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{CameraSection, Provenance};

    /// First sheet of a recorded calibration with the given verdict and findings.
    fn first_sheet(verdict: &str, findings: &[[&str; 3]]) -> String {
        const GOOD: &str = include_str!("../../../../fixtures/recordings/v1/good/calibration.json");
        let mut tree: serde_json::Value = serde_json::from_str(GOOD).expect("JSON");
        tree["verdict"] = verdict.into();
        let entry = |[code, severity, message]: &[&str; 3]| {
            serde_json::json!({
                "code": code, "severity": severity, "message": message, "action": "",
            })
        };
        tree["findings"] = findings.iter().map(entry).collect();
        let certificate = Certificate {
            date: "1 May 2026".into(),
            check_due: Some("1 May 2027".into()),
            ..Certificate::default()
        };
        sheet(&Report {
            name: "site".into(),
            calibration: CalibrationFile::read(&tree).expect("whole"),
            notes: Vec::new(),
            certificate: Some(certificate),
            camera: CameraSection::default(),
            corners: Vec::new(),
            pictures: Vec::new(),
            cause: None,
            check: None,
            refused: Vec::new(),
            provenance: Provenance::default(),
        })
    }

    #[test]
    fn what_must_not_be_used_has_no_ticks_and_no_next_check() {
        let good = first_sheet("good", &[]);
        assert!(
            good.contains("✓</td>") && good.contains("1 May 2027") && good.contains("sign-here")
        );
        for (code, words) in [("FOCUS-MOVED", "Not trustworthy"), ("VIEWS-FEW", "Unfinished")] {
            let bad = first_sheet("untrustworthy", &[[code, "bad", "The focus moved"]]);
            assert!(bad.contains(words), "{bad}");
            assert!(!bad.contains("✓</td>") && !bad.contains("1 May 2027"), "{bad}");
            assert!(!bad.contains("sign-here"));
            let row = "<th scope=\"row\">Failed check</th><td colspan=\"3\">The focus moved</td><td class=\"met\">✗</td>";
            assert!(bad.contains(row), "{bad}");
        }
    }

    #[test]
    fn use_with_care_names_what_limits_the_use_first() {
        let found = [
            ["PIXELS-SKEWED", "care", "The pixels are skewed"],
            ["PROJECTION-UNCERTAIN", "care", "Projection is known to 3 px only"],
        ];
        let care = first_sheet("care", &found);
        let lead = "<b>Projection is known to 3 px only.</b></p>";
        assert!(care.contains("<strong>Use with care</strong>") && care.contains(lead), "{care}");
        assert!(care.contains("Further warnings:</b> The pixels are skewed."), "{care}");
    }

    #[test]
    fn a_lens_that_nobody_judged_has_no_certificate() {
        assert_eq!(first_sheet("care", &[["IMPORTED", "care", "From an OpenCV file"]]), "");
    }

    #[test]
    fn a_value_beyond_its_limit_never_looks_like_it() {
        assert_eq!(beside(0.3004, 0.3), ("0.3004".into(), "0.30".into()));
        assert_eq!(beside(0.12, 0.3), ("0.12".into(), "0.30".into()));
        assert_eq!(beside(0.3, 0.3), ("0.30".into(), "0.30".into()));
    }

    #[test]
    fn any_number_stays_inside_a_css_string() {
        assert_eq!(css_string("A1-2"), "A1\\2d 2");
        let hostile = css_string("\"}</style><script>");
        assert!(!hostile.contains(['"', '<', '>', '}', '/']), "{hostile}");
    }
}
