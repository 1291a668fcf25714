//! Words and tables of the page: verdict, camera, numbers, findings, refusals, provenance.

use super::{
    Refused, Report,
    number::{brief_data, measured, plain, row},
    section::{section, section_with},
    unknown_sd::knows_sd,
};
use crate::{
    chart::{escaped, push},
    text::{
        SD_UNKNOWN,
        report::{self as words, Section, name},
        result,
    },
};
use boresight_formats::{CalibrationFile, LensEntry, SigmaEntry};
use boresight_geometry::{self as geometry, BoardOutline, frame::ImageSize};

/// Verdict, next action, and notes to read first. On the page of a check, the check's verdict.
pub(super) fn verdict(report: &Report) -> String {
    let calibration = &report.calibration;
    let (sign, lead, next) = match &report.check {
        Some(check) => {
            let code = check.verdict.as_deref().unwrap_or("none");
            (words::verdict_sign(code), check.message.as_str(), check.action.clone())
        }
        None => {
            (words::sign_of(calibration), words::verdict_of(calibration), next_action(calibration))
        }
    };
    let simulated = if report.camera.simulated {
        format!("<p class=\"simulated\">{}</p>\n", words::SIMULATED)
    } else {
        String::new()
    };
    let mut body = format!(
        "{simulated}<p class=\"lead\"><span class=\"sign\">{sign}</span> <strong>{}</strong></p>\n<p class=\"next\"><b>{}</b> {}</p>\n",
        escaped(lead),
        words::NEXT,
        escaped(&next)
    );
    if let Some(judged) = &calibration.acceptance {
        push(
            &mut body,
            format_args!(
                "<p><b>{}</b> {}. {}</p>\n",
                words::GOAL,
                escaped(&judged.message),
                escaped(&judged.action)
            ),
        );
    }
    if report.check.is_some() {
        push(&mut body, format_args!("<p>{}</p>\n", words::by_themselves(calibration)));
    }
    if calibration.verdict != "untrustworthy"
        && let Some(open) = open_corners(calibration)
    {
        push(&mut body, format_args!("<p>{}</p>\n", escaped(&open)));
    }
    for note in &report.notes {
        push(&mut body, format_args!("<p>{}</p>\n", escaped(note)));
    }
    section_with(Section::Verdict, "box", &body)
}

/// Corners of the picture hardly covered by boards, in words.
fn open_corners(calibration: &CalibrationFile) -> Option<String> {
    let outlines: Vec<BoardOutline> =
        calibration.used().filter_map(|(_, view)| BoardOutline::around(view.outline()?)).collect();
    let [width_px, height_px] = calibration.image_size;
    let open = geometry::open_corners(&outlines, ImageSize { width_px, height_px });
    if outlines.is_empty() { None } else { result::open_corners(open) }
}

/// Action of the worst finding, or of a missed goal.
fn next_action(calibration: &CalibrationFile) -> String {
    let of =
        |severity: &str| calibration.findings.iter().find(|finding| finding.severity == severity);
    match of("bad").or_else(|| of("care")) {
        Some(finding) if calibration.verdict != "good" => finding.action.clone(),
        _ => match &calibration.acceptance {
            Some(judged) if !judged.met => judged.action.clone(),
            _ => words::USE_IT.into(),
        },
    }
}

/// Facts about the camera, and changes.
pub(super) fn camera(report: &Report) -> String {
    let calibration = &report.calibration;
    let mut rows = String::new();
    let mut say = |name: &str, what: &str| rows += &said(name, what);
    for (name, what) in &report.camera.rows {
        say(name, what);
    }
    say(name::PICTURE, &words::picture(calibration.image_size));
    if let Some(board) = &calibration.board {
        say(name::BOARD, &words::board(board));
    }
    let changes = &report.camera.changes;
    if changes.is_empty() && !report.camera.rows.is_empty() {
        say(name::CHANGES, words::NO_CHANGES);
    }
    for change in changes {
        say(&change.when, &change.what);
    }
    section(Section::Camera, &format!("<table><tbody>\n{rows}</tbody></table>\n"))
}

/// Estimates with standard deviations; reprojection RMS last.
pub(super) fn numbers(calibration: &CalibrationFile) -> String {
    let Some(lens) = &calibration.result else {
        let body = format!("<p>{}</p>\n", words::NO_CALIBRATION);
        return section(Section::Numbers, &body);
    };
    let sigma_px = lens.sigma.map(|sigma| sigma.pp_px);
    let [x, y] = [0, 1].map(|k| measured(lens.pp_px[k], sigma_px.map(|sigma| sigma[k])));
    let mut rows = row(name::PRINCIPAL_POINT, &[format!("{x}, {y} px")]);
    rows += &focal_length(lens);
    rows += &distortion(lens);
    if !knows_sd(calibration) {
        rows += &row(name::SD, &[SD_UNKNOWN.into()]);
    }
    if let Some(projection) = &calibration.projection_sd_px {
        let both =
            format!("{}, {} px", brief_data(projection.mean, 2), brief_data(projection.max, 2));
        rows += &row(name::PROJECTION, &[both]);
    }
    let bound = calibration.bound_px.and_then(|b| result::error_bound(b.picture, b.covered));
    if let Some(bound) = bound {
        rows += &row(name::BOUND, &[bound]);
    }
    if let Some(change) = calibration.visible_drift {
        rows += &row(name::FOCUS, &[result::unseen_drift(change)]);
    }
    if let Some(noise_px) = lens.noise_px {
        rows += &row(name::NOISE, &[format!("{} px", brief_data(noise_px, 2))]);
    }
    if let Some(measured_px) = lens.noise_floor_px {
        rows += &row(name::NOISE_FLOOR, &[format!("{} px", brief_data(measured_px, 2))]);
    }
    if let Some(coverage) = calibration.coverage {
        rows += &row(name::COVERAGE, &[format!("{} %", plain(100.0 * coverage, 0))]);
    }
    let used = calibration.used().count();
    rows += &row(name::VIEWS, &[format!("{used} / {}", calibration.views.len())]);
    if let Some(rms_px) = lens.rms_px {
        rows += &row(name::RMS, &[format!("{} px", brief_data(rms_px, 3))]);
    }
    section(Section::Numbers, &format!("<table><tbody>\n{rows}</tbody></table>\n"))
}

fn focal_length(lens: &LensEntry) -> String {
    if lens.focal_varies() {
        let scatter_px = lens.focal.and_then(|focal| focal.scatter_px).unwrap_or_default();
        return row(name::FOCAL_MEAN, &[format!("{} px", plain(lens.f_px[0], 2))])
            + &row(name::FOCAL_SCATTER, &[format!("{} px", brief_data(scatter_px, 3))]);
    }
    let sigma_px = lens.sigma.map(|sigma| sigma.f_px);
    let [fx, fy] = [0, 1].map(|k| measured(lens.f_px[k], sigma_px.map(|sigma| sigma[k])));
    if lens.square_pixels() {
        row(name::FOCAL_LENGTH, &[format!("{fx} px")])
    } else {
        row(name::FOCAL_LENGTHS, &[format!("{fx}, {fy} px")])
    }
}

/// Lens model and coefficients, without those fixed at zero.
fn distortion(lens: &LensEntry) -> String {
    let value = lens.distortion;
    let sd = |of: fn(&SigmaEntry) -> f64| lens.sigma.as_ref().map(of);
    let all = [
        ("k1", value.k1, sd(|sigma| sigma.k1)),
        ("k2", value.k2, sd(|sigma| sigma.k2)),
        ("p1", value.p1, sd(|sigma| sigma.p1)),
        ("p2", value.p2, sd(|sigma| sigma.p2)),
        ("k3", value.k3, sd(|sigma| sigma.k3)),
        ("k4", value.k4, sd(|sigma| sigma.k4)),
        ("k5", value.k5, sd(|sigma| sigma.k5)),
        ("k6", value.k6, sd(|sigma| sigma.k6)),
    ];
    let free = all.iter().filter(|(_, value, sd)| *value != 0.0 || sd.is_some_and(|sd| sd > 0.0));
    let mut rows = row(name::LENS_MODEL, &[escaped(&lens.model)]);
    for (name, value, sd) in free {
        rows += &row(name, &[measured(*value, *sd)]);
    }
    rows
}

/// Maximum number of findings in a single column.
const FEW_FINDINGS: usize = 4;

/// Findings of the checks, each with an action.
pub(super) fn findings(calibration: &CalibrationFile) -> String {
    if calibration.findings.is_empty() {
        return section(Section::Findings, &format!("<p>{}</p>\n", words::NO_FINDINGS));
    }
    let class = if calibration.findings.len() > FEW_FINDINGS { "columns" } else { "" };
    let mut body = format!("<ul class=\"{class}\">\n");
    for finding in &calibration.findings {
        push(
            &mut body,
            format_args!(
                "<li class=\"{}\"><b>{}</b> ({}): {}. {}</li>\n",
                escaped(&finding.severity),
                escaped(&finding.code),
                words::severity(&finding.severity),
                escaped(&finding.message),
                escaped(&finding.action)
            ),
        );
    }
    body += "</ul>\n";
    section(Section::Findings, &body)
}

/// Maximum length of a command on paper, in characters.
const LONG_COMMAND: usize = 700;
/// Maximum number of reasons on paper, and of names per reason.
const REASONS: usize = 12;
const NAMES: usize = 6;

/// Refused frames and pictures: reasons with counts, pictures by reason.
pub(super) fn refused(report: &Report) -> String {
    // Reason, count or duration, and names of pictures.
    let mut items: Vec<(&str, String, Vec<&str>)> = report
        .refused
        .iter()
        .map(|Refused { what, count, secs }| {
            (what.as_str(), secs.map_or_else(|| count.to_string(), words::lasted), Vec::new())
        })
        .collect();
    for view in report.calibration.views.iter().filter(|view| !view.used) {
        let reason = view.reason.as_deref().unwrap_or_default();
        match items.iter_mut().find(|(what, _, names)| *what == reason && !names.is_empty()) {
            Some((_, often, names)) => {
                names.push(&view.name);
                *often = names.len().to_string();
            }
            None => items.push((reason, "1".into(), vec![&view.name])),
        }
    }
    if items.is_empty() {
        return section(Section::Refused, &format!("<p>{}</p>\n", words::NOTHING_REFUSED));
    }
    let list = |items: &[(&str, String, Vec<&str>)], most_names: usize| -> String {
        let item = |(what, often, names): &(&str, String, Vec<&str>)| {
            let (shown, rest) = names.split_at(names.len().min(most_names));
            let mut line = format!("<li>{}: {often}", escaped(what));
            if !shown.is_empty() {
                push(&mut line, format_args!(" ({}", escaped(&shown.join(", "))));
                line += if rest.is_empty() { ")" } else { ", …)" };
            }
            line + "</li>\n"
        };
        items.iter().map(item).collect()
    };
    let (shown, rest) = items.split_at(items.len().min(REASONS));
    let mut body = format!("<ul class=\"columns\">\n{}</ul>\n", list(shown, NAMES));
    if !rest.is_empty() {
        push(
            &mut body,
            format_args!("<p class=\"note\">{}</p>\n", words::more_reasons(rest.len())),
        );
    }
    if !rest.is_empty() || items.iter().any(|(_, _, names)| names.len() > NAMES) {
        push(
            &mut body,
            format_args!(
                "<details class=\"screen\"><summary>{}</summary><ul>\n{}</ul></details>\n",
                words::ALL_REFUSED,
                list(&items, usize::MAX)
            ),
        );
    }
    section(Section::Refused, &body)
}

/// Table row with words for a value.
fn said(name: &str, what: &str) -> String {
    format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escaped(name), escaped(what))
}

/// Versions, and the command to repeat the result.
pub(super) fn provenance(report: &Report) -> String {
    let mut rows = String::new();
    for (name, what) in &report.provenance.rows {
        rows += &said(name, what);
    }
    push(
        &mut rows,
        format_args!(
            "<tr><th scope=\"row\">{}</th><td><div class=\"command\"><code>{}</code></div>{}</td></tr>\n",
            name::REPEAT,
            escaped(&report.provenance.command),
            if report.provenance.command.len() > LONG_COMMAND { words::CUT_ON_PAPER } else { "" }
        ),
    );
    section(Section::Provenance, &format!("<table><tbody>\n{rows}</tbody></table>\n"))
}
