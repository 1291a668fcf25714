//! The book: pages of findings and the planner's table are made from the code, commands run, links
//! lead somewhere.
//!
//! Fences of a page select the treatment of a block: `sh` runs in a folder with a session, its
//! pictures and its calibration; `sh camera` needs a camera, a person or a network, and is only
//! parsed (`--help` behind it); `sh other` is for other programs.

use std::{
    collections::BTreeSet,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use boresight::calibration::FindingCode;
use serde_json::Value;
use tempfile::TempDir;

use crate::person::boresight;

/// Variable to rewrite the generated pages.
const WRITE: &str = "BORESIGHT_WRITE_BOOK";

fn book() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("book/src")
}

/// A page by path below the book, with text.
type Page = (PathBuf, String);

/// The pages, with all files.
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

/// Compares the file at `path` with the expected contents, or writes it.
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

/// `page` with `text` between the line beginning with `begin` and the next `<!-- end -->`.
fn filled(page: &str, begin: &str, text: &str) -> String {
    let (before, rest) = page.split_once(begin).expect("the place for it");
    let (_, after) = rest.split_once("<!-- end -->").expect("its end");
    format!("{before}{begin}\n{text}<!-- end -->{after}")
}

#[test]
fn each_finding_has_a_page_that_answers_four_questions() {
    const QUESTIONS: [&str; 4] = [
        "\n\n**Where you see it.** ",
        "\n\n**Where it comes from.** ",
        "\n\n**What to do.** ",
        "\n\n**May I use the result?** ",
    ];
    let (mut list, mut summary) =
        (String::from("| code | in a few words |\n|---|---|\n"), String::new());
    let mut names = BTreeSet::from(["list.md".to_owned()]);
    for finding in FindingCode::one_of_each() {
        let code = finding.code();
        let name = format!("{}.md", code.to_lowercase());
        let page = fs::read_to_string(book().join("findings").join(&name)).expect("a page");
        let title = page.lines().next().and_then(|line| line.strip_prefix(&format!("# {code}: ")));
        let title = title.unwrap_or_else(|| panic!("{name} begins with its code"));
        let places: Vec<_> = QUESTIONS.iter().map(|question| page.find(question)).collect();
        assert!(places.is_sorted() && !places.contains(&None), "{name}: {places:?}");
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

/// Commands in the blocks of `page` with the fence ```` ```fence ````.
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

/// A folder with a session, pictures, and calibration.
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
    let mut demos = BTreeSet::new();
    for (page, text) in pages() {
        let place = workplace();
        for line in commands(&text, "sh") {
            // A demonstration needs nothing of its page, and leaves nothing to it.
            if line.starts_with("boresight demo ") && !demos.insert(line.clone()) {
                continue;
            }
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
