//! The report as met by a reader: whole, self-contained, and with the numbers of the result.

use std::{collections::BTreeSet, fs, path::Path};

use boresight::{
    calibration::files::{CalibrationFile, CheckFile},
    report::{CameraSection, Provenance, Report, page},
};
use image::GrayImage;
use roxmltree::{Document, Node, ParsingOptions};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::person::{Ended, boresight, contents, says};
use crate::pictures::{PAIRS, picture};

/// Every part of a page, in order; a drift section only where there is one.
const PARTS: [&str; 15] = [
    "verdict",
    "camera",
    "numbers",
    "findings",
    "principal-lines",
    "estimates",
    "estimates-near",
    "projection",
    "lens",
    "coverage",
    "residuals",
    "skip",
    "views",
    "refused",
    "provenance",
];

/// A folder `pictures` with `views` views, and the paths.
fn place(views: usize) -> (TempDir, Vec<String>) {
    let folder = TempDir::new().expect("folder");
    fs::create_dir(folder.path().join("pictures")).expect("made");
    let paths = PAIRS.iter().take(views).enumerate().map(|(i, (tilt_deg, slot_deg))| {
        let path = format!("pictures/{i}.png");
        picture(*tilt_deg, *slot_deg).save(folder.path().join(&path)).expect("saved");
        path
    });
    let paths = paths.collect();
    (folder, paths)
}

fn calibrate(folder: &Path, files: &[String], more: &[&str]) -> Ended {
    let mut arguments = vec!["calibrate", "--board", "9x6"];
    arguments.extend(files.iter().map(String::as_str));
    arguments.extend(more);
    boresight(folder, &arguments)
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).expect("readable")
}

/// Parses a page, and checks for well-formedness and external references.
fn checked<'a>(html: &'a str, parts: &[&str]) -> Document<'a> {
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document = Document::parse_with_options(html, options).expect("well-formed");
    let mut ids = BTreeSet::new();
    for node in document.descendants().filter(Node::is_element) {
        let name = node.tag_name().name();
        assert!(!["script", "link", "iframe", "object", "img"].contains(&name), "<{name}>");
        for attribute in node.attributes() {
            let (name, value) = (attribute.name(), attribute.value());
            assert!(!name.starts_with("on"), "{name}={value}");
            if ["href", "src"].contains(&name) {
                let picture = ["data:image/jpeg;base64,", "data:image/png;base64,"];
                assert!(picture.iter().any(|kind| value.starts_with(kind)), "{name}={value}");
            }
            if name == "id" {
                assert!(ids.insert(value), "{value} stands twice");
            }
        }
    }
    let style = document.descendants().find(|node| node.has_tag_name("style")).expect("a style");
    let style = style.text().unwrap_or_default();
    assert!(!style.contains("url(") && !style.contains("@import"));
    let order: Vec<&str> = document
        .descendants()
        .filter_map(|node| node.attribute("id"))
        .filter(|id| parts.contains(id))
        .collect();
    assert_eq!(order, parts);
    document
}

fn part<'a>(document: &'a Document<'a>, id: &str) -> Node<'a, 'a> {
    document.descendants().find(|node| node.attribute("id") == Some(id)).expect(id)
}

fn text(node: Node<'_, '_>) -> String {
    let words = node.descendants().filter(Node::is_text).filter_map(|node| node.text());
    words.collect::<Vec<_>>().join(" ")
}

/// All numbers of a part with all digits.
fn numbers(node: Node<'_, '_>) -> Vec<f64> {
    node.descendants()
        .filter(|node| node.has_tag_name("data"))
        .map(|node| node.attribute("value").and_then(|v| v.parse().ok()).expect("a number"))
        .collect()
}

#[test]
fn the_page_has_the_numbers_of_the_file() {
    let (folder, files) = place(6);
    let ended =
        calibrate(folder.path(), &files, &["--out", "result.json", "--report", "page.html"]);
    says(&ended, ended.code, &["Report: page.html"]);
    let result: Value =
        serde_json::from_str(&read(&folder.path().join("result.json"))).expect("JSON");
    let html = read(&folder.path().join("page.html"));
    let document = checked(&html, &PARTS);
    let number = |pointer: &str| result.pointer(pointer).and_then(Value::as_f64).expect("number");
    let shown = numbers(part(&document, "numbers"));
    for pointer in [
        "/result/pp_px/0",
        "/result/pp_px/1",
        "/result/sigma/pp_px/0",
        "/result/sigma/pp_px/1",
        "/result/f_px/0",
        "/result/sigma/f_px/0",
        "/projection_sd_px/mean",
        "/projection_sd_px/max",
    ] {
        assert!(shown.contains(&number(pointer)), "{pointer} is not in {shown:?}");
    }
    // Reprojection RMS comes last.
    assert_eq!(shown.last(), Some(&number("/result/rms_px")));
    let methods = numbers(part(&document, "methods"));
    for (method, estimate) in result["principal_point"].as_object().expect("methods") {
        for pointer in ["/px/0", "/px/1", "/sigma_px/0", "/sigma_px/1"] {
            let value = estimate.pointer(pointer).and_then(Value::as_f64).expect("number");
            assert!(methods.contains(&value), "{method}{pointer}");
        }
    }
    let table = numbers(part(&document, "view-table"));
    for view in result["views"].as_array().expect("views") {
        for name in ["tilt_deg", "slot_deg", "pl_residual_px", "focal_px", "rms_px"] {
            assert!(table.contains(&view[name].as_f64().expect("number")), "{name}");
        }
    }
    // Drawings of the fit: a bar and a board for each view, each corner as a dot, a cell for each
    // pair of parameters.
    let shapes = |id: &str, shape: &str| {
        let drawn = part(&document, id).descendants();
        drawn.filter(|node| node.has_tag_name(shape)).count()
    };
    assert_eq!(shapes("chart-views", "polygon"), 6);
    assert_eq!(shapes("chart-poses", "polygon"), 6 + 1);
    let seen = text(part(&document, "chart-scatter"));
    let corners: usize = seen
        .split_whitespace()
        .zip(seen.split_whitespace().skip(1))
        .find_map(|(count, word)| (word == "corners,").then(|| count.parse().expect("a number")))
        .expect("corners");
    assert_eq!(shapes("chart-scatter", "circle"), corners);
    assert_eq!(shapes("chart-radius", "circle"), corners);
    assert_eq!(shapes("chart-radius", "polyline"), 3 * 8, "mean and RMS of eight rings");
    assert_eq!(shapes("chart-distance", "polyline"), 2);
    let cells = (shapes("chart-correlations", "polygon") as f64).sqrt();
    assert!(cells >= 3.0 && cells.fract() == 0.0, "{cells}");
    // The verdict comes first, in words and in a sign, with the command to repeat it at the end.
    let verdict = text(part(&document, "verdict"));
    let word = ["Good", "Use with care", "Not trustworthy"][["good", "care", "untrustworthy"]
        .iter()
        .position(|v| result["verdict"] == *v)
        .expect("known")];
    assert!(verdict.contains(word) && verdict.contains("Next:"), "{verdict}");
    assert_eq!(ended.code == 3, word == "Not trustworthy");
    let repeat = text(part(&document, "provenance"));
    assert!(repeat.contains("boresight calibrate --board 9x6 pictures/0.png"), "{repeat}");
    // The full estimates are in the paper's table, with rows n = 0 … 4 for six views.
    let skip = part(&document, "skip-table");
    let rows = skip.descendants().filter(|node| node.attribute("scope") == Some("row")).count();
    assert_eq!(rows, 5);
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    for pointer in ["/principal_point/pl_unweighted/px/0", "/principal_point/bundle/px/1"] {
        let full = number(pointer);
        assert!(numbers(skip).into_iter().any(|shown| near(shown, full)), "{pointer}");
    }
    assert!(html.contains("stability, not accuracy"));
    // Each view, and the first one with the valid part.
    assert_eq!(html.matches("data:image/jpeg").count(), 6 + 1);

    // Nothing is overwritten unasked.
    let again = calibrate(folder.path(), &files, &["--report", "page.html"]);
    says(&again, 1, &["already", "--force"]);
    assert_eq!(read(&folder.path().join("page.html")), html);
}

#[test]
fn a_session_ends_with_its_report() {
    let (folder, _) = place(6);
    fs::write(folder.path().join("pictures/!dark.png"), {
        let mut png = std::io::Cursor::new(Vec::new());
        GrayImage::new(640, 480).write_to(&mut png, image::ImageFormat::Png).expect("written");
        png.into_inner()
    })
    .expect("written");
    let guide = ["guide", "--headless", "--source", "pictures", "--out", "session"];
    let guided = boresight(folder.path(), &guide);
    says(&guided, guided.code, &["session/report.html"]);
    let page = folder.path().join("session/report.html");
    let html = read(&page);
    let document = checked(&html, &PARTS);
    let result: Value =
        serde_json::from_str(&read(&folder.path().join("session/calibration.json"))).expect("JSON");
    let shown = numbers(part(&document, "numbers"));
    assert!(shown.contains(&result["result"]["pp_px"][0].as_f64().expect("number")));
    let views = result["views"].as_array().expect("views").len();
    assert_eq!(html.matches("data:image/jpeg").count(), views + 1);
    let provenance = text(part(&document, "provenance"));
    assert!(provenance.contains("boresight replay session"), "{provenance}");
    assert!(text(part(&document, "camera")).contains("pictures"));
    let refused = text(part(&document, "refused"));
    assert!(refused.contains("Too dark: 1"), "{refused}");

    // The same again, from the folder or from the result in it; nothing else is touched.
    let before = contents(&folder.path().join("session"));
    let code = if result["verdict"] == "untrustworthy" { 3 } else { 0 };
    for input in ["session", "session/calibration.json"] {
        fs::remove_file(&page).expect("removed");
        let again = boresight(folder.path(), &["report", input, "--json"]);
        says(&again, code, &["session/report.html"]);
        let told: Value = serde_json::from_str(&again.stdout).expect("JSON");
        assert_eq!(told["schema"], "boresight.report/1");
        assert_eq!(told["verdict"], result["verdict"]);
        assert!(contents(&folder.path().join("session")) == before, "{input}: another page");
    }
    // Elsewhere only under a free name.
    let elsewhere = ["report", "session", "--out", "mine.html"];
    says(&boresight(folder.path(), &elsewhere), code, &["mine.html"]);
    says(&boresight(folder.path(), &elsewhere), 1, &["already", "--force"]);
    says(&boresight(folder.path(), &[&elsewhere[..], &["--force"]].concat()), code, &["mine.html"]);

    // A result other than the journal's is reported as another.
    let mut stale = result.clone();
    stale["result"]["pp_px"][0] = json!(1.0);
    fs::write(folder.path().join("session/calibration.json"), stale.to_string()).expect("written");
    says(&boresight(folder.path(), &["report", "session"]), code, &["differs from the journal"]);
    // Without its pictures, the page shows the boards' outlines.
    fs::remove_dir_all(folder.path().join("session/frames")).expect("removed");
    boresight(folder.path(), &["report", "session"]);
    let html = read(&page);
    checked(&html, &PARTS);
    assert_eq!(html.matches("data:image").count(), 0);
    assert!(html.contains("showing the boards' outlines"));
}

#[test]
fn a_file_by_itself_shows_what_it_holds() {
    let (folder, files) = place(4);
    calibrate(folder.path(), &files, &["--out", "pictures/result.json"]);
    let ended = boresight(folder.path(), &["report", "pictures/result.json"]);
    says(&ended, ended.code, &["pictures/result.html"]);
    let html = read(&folder.path().join("pictures/result.html"));
    let document = checked(&html, &PARTS);
    // The pictures lie beside it; the corners are missing.
    assert_eq!(html.matches("data:image/jpeg").count(), 4 + 1);
    assert!(text(part(&document, "residuals")).contains("this file has no corners"));
    // Names that lead elsewhere bring no picture.
    let away = read(&folder.path().join("pictures/result.json"))
        .replace("\"0.png\"", "\"../pictures/0.png\"");
    fs::write(folder.path().join("pictures/away.json"), away).expect("written");
    boresight(folder.path(), &["report", "pictures/away.json"]);
    let html = read(&folder.path().join("pictures/away.html"));
    assert_eq!(html.matches("data:image/jpeg").count(), 3 + 1);
    for (name, content, word) in [
        ("text.json", "no JSON", "not a calibration"),
        ("other.json", "{\"schema\":\"boresight.calibration/2\"}", "boresight.calibration/1"),
        ("half.json", "{\"schema\":\"boresight.calibration/1\"}", "not a whole calibration"),
        (
            "text-for-number.json",
            r#"{"schema":"boresight.calibration/1","image_size":[640,480],"coverage":"all"}"#,
            "coverage: invalid type: string",
        ),
        (
            "no-size.json",
            r#"{"schema":"boresight.calibration/1","image_size":[640,-480]}"#,
            "image_size[1]: invalid value: integer `-480`",
        ),
    ] {
        fs::write(folder.path().join(name), content).expect("written");
        says(&boresight(folder.path(), &["report", name]), 1, &[word, name]);
    }
}

#[test]
fn one_view_and_none_have_a_page_too() {
    let (folder, files) = place(1);
    GrayImage::new(640, 480).save(folder.path().join("empty.png")).expect("saved");
    let both = [files[0].clone(), "empty.png".into()];
    calibrate(folder.path(), &both, &["--report", "one.html"]);
    let html = read(&folder.path().join("one.html"));
    let document = checked(&html, &PARTS);
    assert!(text(part(&document, "refused")).contains("empty.png"));
    assert_eq!(html.matches("data:image/jpeg").count(), 1);

    let none = calibrate(folder.path(), &["empty.png".into()], &["--report", "none.html"]);
    says(&none, 3, &["No calibration", "none.html"]);
    let html = read(&folder.path().join("none.html"));
    let document = checked(&html, &PARTS);
    assert!(text(part(&document, "verdict")).contains("Not trustworthy"));
    assert!(text(part(&document, "numbers")).contains("No calibration"));
}

/// Priors on the lens make the standard deviations of few views too small to be believed.
#[test]
fn no_standard_deviation_is_shown_below_four_views() {
    let shows_sd = |words: &str| {
        let after = words.split('±').skip(1);
        after.into_iter().any(|rest| rest.trim_start().starts_with(|c: char| c.is_ascii_digit()))
    };
    for (views, is_known) in [(3, false), (4, true)] {
        let (folder, files) = place(views);
        let goal = "projection 1px";
        let ended = calibrate(folder.path(), &files, &["--report", "r.html", "--accept", goal]);
        assert!(ended.stderr.contains("principal point"), "{}", ended.stderr);
        assert_eq!(shows_sd(&ended.stderr), is_known, "{views} views: {}", ended.stderr);
        assert_eq!(ended.stderr.contains("can't be judged"), !is_known, "{}", ended.stderr);
        let html = read(&folder.path().join("r.html"));
        let document = checked(&html, &PARTS);
        let page = text(document.root_element());
        assert_eq!(shows_sd(&page), is_known, "{views} views");
        assert_eq!(page.contains("not known yet"), !is_known, "{views} views");
    }
}

#[test]
fn names_are_text_whatever_is_in_them() {
    let (folder, files) = place(2);
    let hostile = [
        "<img src=x onerror=alert(1)>.png",
        "\"><script>alert(1)</script>.png",
        "a&amp;b'c\u{1b}]0;x\u{7}.png",
    ];
    let mut all = files.clone();
    for (i, name) in hostile.iter().enumerate() {
        // A slash cannot be in a name, but the other characters still do harm.
        let name = name.replace('/', "∕");
        fs::copy(folder.path().join(&files[i % 2]), folder.path().join(&name)).expect("copied");
        all.push(name);
    }
    GrayImage::new(640, 480).save(folder.path().join("<b>empty.png")).expect("saved");
    all.push("<b>empty.png".into());
    calibrate(folder.path(), &all, &["--report", "page.html"]);
    let html = read(&folder.path().join("page.html"));
    let document = checked(&html, &PARTS);
    assert!(text(part(&document, "view-table")).contains(hostile[0]));
    assert!(text(part(&document, "refused")).contains("<b>empty.png"));
    assert!(
        document.descendants().all(|node| !node.has_tag_name("b") || node.text() != Some("empty"))
    );

    // A session's folder, too.
    let session = "<i>se&ssion</i>".replace('/', "∕");
    boresight(folder.path(), &["guide", "--headless", "--source", "pictures", "--out", &session]);
    let html = read(&folder.path().join(&session).join("report.html"));
    let document = checked(&html, &PARTS);
    assert!(document.descendants().all(|node| !node.has_tag_name("i")));
    assert!(text(document.root()).contains(&session));
}

#[test]
fn drift_is_shown_where_it_is_known() {
    let calibration = json!({
        "schema": "boresight.calibration/1", "image_size": [640, 480], "verdict": "care",
        "findings": [{ "code": "X", "severity": "care", "message": "<m>", "action": "Do & see" }],
        "result": { "model": "k1", "f_px": [600.0, 600.0], "pp_px": [320.0, 240.0],
            "distortion": { "k1": -0.1, "k2": 0, "p1": 0, "p2": 0, "k3": 0 },
            "sigma": { "f_px": [1.0, 1.0], "pp_px": [0.5, 0.5], "k1": 0.01 } },
        "views": [],
    });
    let check = json!({
        "schema": "boresight.check/1", "against": "old <1>.json", "verdict": "recalibrate",
        "message": "RECALIBRATE: it has changed", "action": "Recalibrate.",
        "change": { "f_px": 3.25, "pp_px": [-2.5, 0.25], "sigma": { "f_px": 0.7, "pp_px": [0.6, 0.5] } },
        "visible": { "pp_px": 2.2, "f_px": 2.1 }, "uncertainty_of_old": "assumed",
    });
    let mut report = Report {
        name: "site".into(),
        calibration: CalibrationFile::read(&calibration).expect("whole"),
        notes: Vec::new(),
        certificate: None,
        camera: CameraSection::default(),
        corners: Vec::new(),
        pictures: Vec::new(),
        cause: None,
        check: None,
        refused: Vec::new(),
        provenance: Provenance::default(),
    };
    let without = page(&report);
    checked(&without, &PARTS);
    assert!(!without.contains("RECALIBRATE"));
    report.check = Some(CheckFile::read(&check).expect("whole"));
    let html = page(&report);
    let document = checked(&html, &PARTS);
    let section = part(&document, "drift");
    for words in ["RECALIBRATE", "old <1>.json", "Recalibrate.", "states no uncertainty"] {
        assert!(text(section).contains(words), "{words}");
    }
    let shown = numbers(section);
    for number in [3.25, 0.7, -2.5, 0.25, 0.6, 0.5, 2.1, 2.2] {
        assert!(shown.contains(&number), "{number}");
    }
    // On the page of a check its verdict comes first.
    let verdict = text(part(&document, "verdict"));
    let (first, then) = (verdict.find("RECALIBRATE"), verdict.find("Use with care"));
    assert!(first.is_some() && first < then, "{verdict}");
    // Without a verdict, the page gives the reason.
    let none = json!({ "schema": "boresight.check/1", "against": "old.json", "verdict": null, "message": "NO VERDICT: other size",
        "action": "Set the mode." });
    let check = Some(CheckFile::read(&none).expect("whole"));
    let html = page(&Report { check, ..report.clone() });
    assert!(text(part(&checked(&html, &PARTS), "drift")).contains("NO VERDICT"));
    assert!(text(part(&document, "findings")).contains("<m>. Do & see"));
}

#[test]
fn the_first_sheet_is_a_certificate() {
    let (folder, files) = place(6);
    let mut logo = std::io::Cursor::new(Vec::new());
    GrayImage::new(40, 20).write_to(&mut logo, image::ImageFormat::Png).expect("written");
    fs::write(folder.path().join("logo.png"), logo.into_inner()).expect("written");
    fs::write(
        folder.path().join("firm.toml"),
        "[certificate]\ncompany = \"Gauge <House> & Sons\"\nlogo = \"logo.png\"\noperator = \"A. Meter\"\n\
         square_measured = \"caliper\"\ncheck_months = 6\n",
    )
    .expect("written");
    let more = [
        "--out",
        "result.json",
        "--report",
        "page.html",
        "--config",
        "firm.toml",
        "--set",
        "certificate.customer=Mill Ltd",
        "--set",
        "certificate.camera_serial=0012",
    ];
    let ended = calibrate(folder.path(), &files, &more);
    says(&ended, ended.code, &["Report: page.html"]);
    let html = read(&folder.path().join("page.html"));
    let document = checked(&html, &PARTS);
    let sheet = part(&document, "certificate");
    let result: Value =
        serde_json::from_str(&read(&folder.path().join("result.json"))).expect("JSON");
    let is_usable = result["verdict"] != "untrustworthy";
    let title = if is_usable { "Calibration certificate" } else { "not a certificate" };
    assert_eq!(text(sheet).contains("Next check due"), is_usable);
    assert_eq!(text(sheet).contains("✓"), is_usable);
    for words in [
        title,
        "Gauge <House> & Sons",
        "A. Meter",
        "caliper",
        "Mill Ltd",
        "0012",
        "k = 2",
        "No. 2",
        "9 × 6 inner corners",
        "640×480 px",
        "K = [[",
        "Field of view",
        "Part of the picture that meets the goal",
        "≤ 0.30 px",
    ] {
        assert!(text(sheet).contains(words), "{words}: {}", text(sheet));
    }
    assert!(html.contains("data:image/png;base64,"));
    // Expanded by k = 2, and the numbers of the file.
    let shown = numbers(sheet);
    let of = |pointer: &str| result.pointer(pointer).and_then(Value::as_f64).expect("number");
    for value in [
        of("/result/pp_px/0"),
        2.0 * of("/result/sigma/pp_px/0"),
        2.0 * of("/result/sigma/f_px/0"),
        of("/projection_sd_px/mean"),
    ] {
        assert!(shown.contains(&value), "{value} is not in {shown:?}");
    }
    // The checksum is that of the present file, and begins the number.
    let again =
        boresight(folder.path(), &["report", "result.json", "--set", "certificate.site=Hall 2"]);
    says(&again, ended.code, &["result.html"]);
    let other = read(&folder.path().join("result.html"));
    let other = checked(&other, &PARTS);
    let sum = |node: Node<'_, '_>| {
        let all = text(node);
        let at = all.find("SHA-256 ").expect("a checksum") + 8;
        all[at..at + 64].to_owned()
    };
    assert_eq!(sum(sheet), sum(part(&other, "certificate")));
    assert!(text(sheet).contains(&sum(sheet)[..6].to_uppercase()));
    assert!(text(part(&other, "certificate")).contains("Hall 2"));
    // A missing logo doesn't cost the report.
    let away = ["report", "result.json", "--force", "--set", "certificate.logo=away.png"];
    says(&boresight(folder.path(), &away), ended.code, &["away.png", "result.html"]);
}

#[test]
fn the_certificate_is_a_pdf_with_the_words_of_the_page() {
    let (folder, files) = place(6);
    calibrate(folder.path(), &files, &["--out", "result.json"]);
    let report =
        |more: &[&str]| boresight(folder.path(), &[&["report", "result.json"][..], more].concat());
    let stated = ["--set", "certificate.customer=Mühle", "--set", "certificate.operator=A. Meter"];
    let ended = report(&stated);
    let pdf = report(&[&["--pdf"][..], &stated].concat());
    says(&pdf, ended.code, &["Report: result.pdf"]);
    let html = read(&folder.path().join("result.html"));
    let document = checked(&html, &PARTS);
    let bytes = fs::read(folder.path().join("result.pdf")).expect("written");
    assert!(bytes.starts_with(b"%PDF"));
    let written: String = bytes.iter().map(|byte| char::from(*byte)).collect();
    let sheet = text(part(&document, "certificate"));
    for words in ["A. Meter", "SHA-256", "Focal length", "Corner error", "Camera make", "K = [["] {
        assert!(sheet.contains(words) && written.contains(words), "{words}");
    }
    // Beyond ASCII, letters are numbers of one byte each.
    assert!(sheet.contains("Mühle") && written.to_uppercase().contains("4DFC686C65"));
    let is_usable = sheet.contains("Until when");
    for words in ["How exact", "Where", "Until when", "name, date, signature"] {
        assert_eq!(written.contains(words), is_usable, "{words}");
    }
    assert_eq!(written.contains("not a certificate"), !is_usable);
    let strange = ["--pdf", "--force", "--set", "certificate.customer=Młyn"];
    says(&report(&strange), 1, &["Młyn", "HTML report"]);
}

#[test]
fn a_simulated_session_says_so_on_every_sheet() {
    let folder = TempDir::new().expect("folder");
    // A quiet camera, which takes little time.
    let quick = "image_size_px = [640, 480]\nfps = 12\n[technician]\nperson = \"tripod\"\n";
    fs::write(folder.path().join("scene.toml"), quick).expect("written");
    let scene = ["simulate", "sim:scene.toml", "--out", "session", "--accepted-only"];
    let simulate = [&scene[..], &["--set", "certificate.site=Hall 1"]].concat();
    let ended = boresight(folder.path(), &simulate);
    says(&ended, ended.code, &["report.html"]);
    let html = read(&folder.path().join("session/report.html"));
    let document = checked(&html, &PARTS);
    for words in ["SIMULATED", "simulated camera", "Hall 1", "not a certificate"] {
        assert!(text(part(&document, "certificate")).contains(words), "{words}");
    }
    assert!(html.contains("@top-center{content:\"SIMULATED\""), "on each printed sheet");
    assert!(html.contains("counter(page) \" of \" counter(pages)"));
    // A session from elsewhere shows no picture of this machine.
    let header = folder.path().join("session/session.toml");
    assert!(read(&header).contains("logo = \"\""));
    // Given later, the statement appears; the rest stays.
    let later = ["report", "session", "--set", "certificate.customer=Mill Ltd"];
    says(&boresight(folder.path(), &later), ended.code, &[]);
    let html = read(&folder.path().join("session/report.html"));
    let document = checked(&html, &PARTS);
    for words in ["Mill Ltd", "Hall 1"] {
        assert!(text(part(&document, "certificate")).contains(words), "{words}");
    }
    // Nor does a session with such a picture as its logo, existing or not.
    let logo = folder.path().join("logo.png");
    GrayImage::new(40, 20).save(&logo).expect("written");
    let naming = format!("logo = {:?}", logo.display().to_string());
    fs::write(&header, read(&header).replace("logo = \"\"", &naming)).expect("written");
    let journal = folder.path().join("session/journal.jsonl");
    fs::write(&journal, crate::files::without_checksum(&read(&journal))).expect("written");
    let has_logo = || read(&folder.path().join("page.html")).contains("class=\"logo\"");
    for command in [["report", "session", "--out"], ["calibrate", "session", "--report"]] {
        let command = [&command[..], &["page.html", "--force"]].concat();
        let told = ["logo.png is outside of this folder", "page.html"];
        says(&boresight(folder.path(), &command), ended.code, &told);
        assert!(!has_logo(), "{command:?}");
        let mine = [&command[..], &["--set", "certificate.logo=logo.png"]].concat();
        says(&boresight(folder.path(), &mine), ended.code, &[]);
        assert!(has_logo(), "{command:?}");
        let away = [&command[..], &["--set", "certificate.logo=away.png"]].concat();
        says(&boresight(folder.path(), &away), ended.code, &["away.png can't be shown"]);
    }
}
