//! The book: pages of findings and the planner's table are made from the code, commands run, links lead somewhere.
//!
//! Fences of a page say what becomes of a block: `sh` runs in a folder with a session, its pictures and its calibration;
//! `sh camera` needs a camera, a person or a network, so its commands are only read (`--help` behind them); `sh other` is for
//! other programs.

use std::{
    collections::BTreeSet,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use boresight::{
    calibration::{FindingCode, FocusMotion, LensModel, NotHeld},
    text::{FindingMeaning, finding_meaning},
};
use serde_json::Value;
use tempfile::TempDir;

use crate::person::boresight;

/// Set to rewrite the pages that are made.
const WRITE: &str = "BORESIGHT_WRITE_BOOK";

fn book() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("book/src")
}

/// A page by its path below the book, with its text.
type Page = (PathBuf, String);

/// The pages, with every file that belongs to them.
fn pages() -> Vec<Page> {
    let mut found = Vec::new();
    for folder in ["", "findings", "integrations"] {
        for entry in fs::read_dir(book().join(folder)).expect("a folder") {
            let path = entry.expect("listable").path();
            if path.extension().is_some_and(|ending| ending == "md") {
                let text = fs::read_to_string(&path).expect("readable");
                found.push((path.strip_prefix(book()).expect("below").to_path_buf(), text));
            }
        }
    }
    found.sort();
    found
}

/// Compares the file at `path` with what it should hold, or writes it.
fn holds(path: &Path, wanted: &str) {
    if std::env::var_os(WRITE).is_some() {
        fs::write(path, wanted).expect("written");
    }
    let held = fs::read_to_string(path).unwrap_or_default();
    assert!(
        held == wanted,
        "{} isn't what the code says. To write it: {WRITE}=1 cargo test --test program book",
        path.display()
    );
}

/// `page` with `text` between the line that begins with `begin` and the next `<!-- end -->`.
fn filled(page: &str, begin: &str, text: &str) -> String {
    let (before, rest) = page.split_once(begin).expect("the place for it");
    let (_, after) = rest.split_once("<!-- end -->").expect("its end");
    format!("{before}{begin}\n{text}<!-- end -->{after}")
}

/// Each finding once.
fn every_code() -> Vec<FindingCode> {
    use FindingCode as Code;
    let codes = vec![
        Code::FewViews { distinct: 1, wanted: 1 },
        Code::ViewsAlike { views: 1, distinct: 1 },
        Code::TiltLow { tilted_views: 1, wanted_views: 1, max_tilt_rad: 1.0, wanted_tilt_rad: 1.0 },
        Code::DirectionsFew { spread: 1.0, wanted: 1.0 },
        Code::PriorUsed { focal_length: true },
        Code::LensSimple { model: LensModel::K1, statistic: 1.0, limit: 1.0 },
        Code::LensFolds { unmapped: 1, of: 1 },
        Code::CheckDisagrees { distance_px: 1.0, sigmas: 1.0, limit: 1.0 },
        Code::LensContradicts { statistic: 1.0, limit: 1.0 },
        Code::LensNotHeld { reason: NotHeld::NoCovariance },
        Code::CheckMissing,
        Code::ViewsDisagree { ratio: 1.0, limit: 1.0 },
        Code::ViewOdd { view: 1, rms_px: 1.0, typical_px: 1.0 },
        Code::PlOutlier { view: 1, distance_px: 1.0, sigmas: 1.0 },
        Code::FocusMoved { gain: 1.0, relative_sd: 1.0, motion: FocusMotion::Scattered },
        Code::FocalVaries { f_px: 1.0, scatter_px: 1.0 },
        Code::ViewsMixed { odd_views: 1, view: 1, f_ratio: 1.0, shift_px: 1.0, gain: 1.0 },
        Code::PixelsNotSquare { aspect: 1.0, gain: 1.0 },
        Code::BoardStretched { aspect: 1.0, gain: 1.0 },
        Code::BoardBent { depth_m: 1.0, gain: 1.0 },
        Code::RollingShutter { shear_px: 1.0, gain: 1.0 },
        Code::ViewTorn { view: 1, row_px: 1.0, shift_px: 1.0, views: 1, gain: 1.0 },
        Code::BoardFlexes { depth_m: 1.0, gain: 1.0 },
        Code::PictureShifted { shift_px: 1.0, gain: 1.0 },
        Code::PixelsSkewed { skew_rad: 1.0, gain: 1.0 },
        Code::PictureWarped { shift_px: 1.0, gain: 1.0 },
        Code::CauseUnclear { candidates: [None; 3], gain: 1.0 },
        Code::LensOther { gain: 1.0 },
        Code::CornersOutside { view: 1, views: 1 },
        Code::CornerOdd { view: 1, corner: 1, off_px: 1.0, times: 1.0, count: 1 },
        Code::PrincipalPointFar { distance_px: 1.0, share: 1.0 },
        Code::HeldOut { view: 1, rms_px: 1.0, expected_px: 1.0 },
        Code::Mirrored { view: 1 },
        Code::NoiseHigh { noise_px: 1.0, limit_px: 1.0 },
        Code::NoiseCorrelated { share: 1.0, length_px: 1.0, noise_px: 1.0, residual_px: 1.0 },
        Code::NoiseUnderstated { noise_px: 1.0, measured_px: 1.0 },
        Code::NoiseExceeded { noise_px: 1.0, measured_px: 1.0 },
        Code::ProjectionUncertain { bound_px: 1.0, goal_px: 1.0, share: 1.0, wanted_share: 1.0 },
        Code::NotConverged,
    ];
    // `code` names each variant, so a new one can't be left out here.
    let source =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/calibrate/src/check/finding.rs");
    let source = fs::read_to_string(source).expect("readable");
    let (_, named) = source.split_once("pub fn code(&self)").expect("a function");
    let (named, _) = named.split_once("\n    }\n").expect("its end");
    assert_eq!(codes.len(), named.matches("=> \"").count(), "a finding has no page");
    codes
}

#[test]
fn each_finding_has_a_page_that_its_code_writes() {
    let (mut list, mut summary) =
        (String::from("| code | in a few words |\n|---|---|\n"), String::new());
    let mut names = BTreeSet::from(["list.md".to_owned()]);
    for finding in every_code() {
        let FindingMeaning { title, shows, cause, remedy, use_it } = finding_meaning(&finding);
        let code = finding.code();
        let name = format!("{}.md", code.to_lowercase());
        let page = format!(
            "# {code}: {title}\n\n**Where you see it.** {shows}\n\n**Where it comes from.** {cause}\n\n\
             **What to do.** {remedy}\n\n**May I use the result?** {use_it}\n\n\
             [All findings](../good.md#findings)\n"
        );
        holds(&book().join("findings").join(&name), &page);
        writeln!(list, "| [`{code}`](findings/{name}) | {title} |").expect("a string");
        writeln!(summary, "  - [{code}](findings/{name})").expect("a string");
        names.insert(name);
    }
    holds(&book().join("findings/list.md"), &list);
    let path = book().join("SUMMARY.md");
    let text = fs::read_to_string(&path).expect("readable");
    holds(&path, &filled(&text, "<!-- made from the code -->", &summary));
    let there = fs::read_dir(book().join("findings")).expect("a folder");
    let there =
        there.map(|entry| entry.expect("listable").file_name().to_string_lossy().into_owned());
    assert_eq!(there.collect::<BTreeSet<_>>(), names, "a page of no finding");
}

/// Width and height of the board that fills the picture, by distance and field of view.
#[test]
#[ignore = "takes minutes: make long-tests"]
fn long_the_table_of_boards_is_the_planners() {
    let place = TempDir::new().expect("folder");
    let fields = ["40deg", "60deg", "90deg", "120deg"];
    let mut table =
        format!("| distance | {} |\n", fields.map(|field| field.replace("deg", "°")).join(" | "));
    writeln!(table, "|---{}|", "|---".repeat(fields.len())).expect("a string");
    for distance in ["30cm", "50cm", "1m", "2m", "4m"] {
        let cells = fields.map(|field| {
            let arguments = ["plan-board", "--distance", distance, "--fov", field, "--json"];
            let planned = boresight(place.path(), &arguments);
            let plan: Value = serde_json::from_str(planned.stdout.trim()).expect("JSON");
            let number =
                |pointer: &str| plan.pointer(pointer).and_then(Value::as_f64).expect("a number");
            let (square, width) = (number("/filling/square_mm"), number("/filling/board_mm/0"));
            format!("{square:.0} mm, {:.2} m wide", width / 1000.0)
        });
        let (number, unit) = distance.split_at(distance.find(char::is_alphabetic).expect("a unit"));
        writeln!(table, "| {number} {unit} | {} |", cells.join(" | ")).expect("a string");
    }
    let path = book().join("board.md");
    let text = fs::read_to_string(&path).expect("readable");
    holds(&path, &filled(&text, "<!-- made by the planner -->", &table));
}

/// The commands in the blocks of `page` whose fence is ```` ```fence ````.
fn commands(page: &str, fence: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut inside = false;
    for line in page.lines() {
        if let Some(opened) = line.strip_prefix("```") {
            inside = !inside && opened == fence;
        } else if inside && line.starts_with("boresight") {
            found.push(line.to_owned());
        } else if inside {
            assert!(line.is_empty() || line.starts_with('#'), "no command of boresight: {line}");
        }
    }
    found
}

/// A folder with a session, its pictures, and its calibration.
fn workplace() -> TempDir {
    let place = TempDir::new().expect("folder");
    let good = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/recordings/v1/good");
    for (from, to) in
        [("", "session"), ("frames", "pictures"), ("calibration.json", "calibration.json")]
    {
        let copied =
            Command::new("cp").arg("-r").arg(good.join(from)).arg(place.path().join(to)).status();
        assert!(copied.expect("cp runs").success());
    }
    place
}

fn shell(folder: &Path, line: &str) -> std::process::Output {
    let program = Path::new(env!("CARGO_BIN_EXE_boresight")).parent().expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let mut sh = Command::new("sh");
    sh.args(["-c", line]).current_dir(folder).env("PATH", format!("{}:{path}", program.display()));
    sh.stdin(std::process::Stdio::null());
    sh.output().expect("sh runs")
}

#[test]
fn every_command_in_the_book_runs() {
    let (mut run, mut read) = (0, 0);
    for (page, text) in pages() {
        let place = workplace();
        for line in commands(&text, "sh") {
            let ended = shell(place.path(), &line);
            let said = String::from_utf8_lossy(&ended.stderr).into_owned();
            assert!(ended.status.success(), "{}: {line}\n{said}", page.display());
            run += 1;
        }
        for line in commands(&text, "sh camera") {
            let ended = shell(place.path(), &format!("{line} --help"));
            let said = String::from_utf8_lossy(&ended.stderr).into_owned();
            assert!(ended.status.success(), "{}: {line}\n{said}", page.display());
            read += 1;
        }
    }
    println!("{run} commands run, {read} read");
    assert!(run > 30 && read > 8, "{run} run, {read} read");
}

#[test]
fn every_link_in_the_book_leads_somewhere_and_every_page_is_in_its_summary() {
    let all = pages();
    let summary = &all.iter().find(|(page, _)| page == Path::new("SUMMARY.md")).expect("there").1;
    let mut count = 0;
    for (page, text) in &all {
        let is_part = page.ends_with("list.md") || page.ends_with("SUMMARY.md");
        let name = page.display().to_string();
        assert!(is_part || summary.contains(&format!("({name})")), "{name} isn't in the summary");
        // `list.md` is part of a page in the folder above.
        let folder = if page.ends_with("list.md") {
            book()
        } else {
            book().join(page.parent().expect("a folder"))
        };
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if target.contains("://") {
                continue;
            }
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            let path = folder.join(file);
            assert!(path.is_file(), "{name} leads to {target}");
            let headings = fs::read_to_string(&path).unwrap_or_default();
            let is_there = headings.lines().any(|line| {
                line.starts_with('#')
                    && line.trim_start_matches('#').trim().to_lowercase().replace(' ', "-")
                        == heading
            });
            assert!(heading.is_empty() || is_there, "{name} leads to {target}");
            count += 1;
        }
    }
    println!("{count} links");
    assert!(count > 100, "{count} links");
}
