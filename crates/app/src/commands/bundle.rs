//! Contents of a bug report, in a single file without private details.

use std::{
    io::Write,
    path::Path,
    process::{Command, Stdio},
};

use anyhow::Context;
use serde_json::Value;

use crate::{
    RESULT_FILE,
    commands::doctor::{DoctorFile, verify},
    session::{
        camera,
        devices_file::{DEVICES_SCHEMA, DevicesFile},
    },
};
use boresight_capture::{is_address, is_command};
use boresight_files::{
    FileStream, Links, Overwrite, Scratch, TEXT_LIMIT, read, read_text, save_streamed,
};
use boresight_present::text::is_simulated;
use boresight_run::recording::{SessionFolder, copy_for_others, hide_in_json};

/// Folder in the file.
const FOLDER: &str = "boresight-bundle";
/// Replacement of hidden text.
const HIDDEN: &str = "hidden";
/// Texts of a result that go in; any other is hidden.
const TEXTS: [&str; 15] = [
    "schema",
    "source",
    "model",
    "order",
    "verdict",
    "code",
    "severity",
    "message",
    "action",
    "reason",
    "format",
    "unit",
    "kind",
    "dictionary",
    "circles",
];
/// Largest journal, in bytes.
const LARGEST: u64 = 1 << 30;

/// Writes the bundle to the new file `out`: `version`, this system, its cameras, and of the session
/// at `session`, if given, the findings of `doctor`, settings, journal and result. Leaves out
/// pictures, names of files, serial numbers, addresses, commands and home folders. Returns the
/// names of the bundled files.
///
/// # Errors
///
/// If `out` exists or can't be written. An unreadable session isn't an error: the bundle says so.
pub fn write(out: &Path, version: &str, session: Option<&Path>) -> anyhow::Result<Vec<String>> {
    let mut hidden = Hidden::of_this_computer();
    let devices = devices(&mut hidden)?;
    let mut files = vec![
        ("about.txt".to_owned(), about(version).into_bytes()),
        ("devices.json".to_owned(), devices),
    ];
    if let Some(path) = session {
        match of_session(path, &mut hidden) {
            Ok(found) => files.extend(found),
            Err(err) => {
                files.push(("session-error.txt".into(), format!("{err:#}\n").into_bytes()));
            }
        }
    }
    for (name, bytes) in files.iter_mut().filter(|(name, _)| !name.starts_with("session/")) {
        *bytes = if name.ends_with(".json") {
            hidden.in_json(serde_json::from_slice(bytes)?)?
        } else {
            let text = hidden.hide(&String::from_utf8_lossy(bytes));
            text.into_bytes()
        };
    }
    save_streamed(out, Overwrite::Never, |stream| packed(&files, stream))?;
    Ok(files.into_iter().map(|(name, _)| name).collect())
}

fn packed(files: &[(String, Vec<u8>)], stream: &mut FileStream<'_>) -> anyhow::Result<()> {
    let mut archive = tar::Builder::new(stream);
    for (name, bytes) in files {
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        archive.append_data(&mut header, format!("{FOLDER}/{name}"), bytes.as_slice())?;
    }
    archive.into_inner()?.flush()?;
    Ok(())
}

/// Texts to hide, with their replacements.
#[derive(Default)]
struct Hidden(Vec<(String, String)>);

impl Hidden {
    fn of_this_computer() -> Self {
        let mut hidden = Self::default();
        for name in ["HOME", "USERPROFILE"] {
            if let Some(home) = std::env::var_os(name) {
                hidden.add(&home.to_string_lossy(), "~");
            }
        }
        hidden
    }

    /// Hides `text` from now on. Texts of at most three letters are ignored: they would occur
    /// anywhere.
    fn add(&mut self, text: &str, instead: &str) {
        if text.chars().count() > 3 {
            self.0.push((text.to_owned(), instead.to_owned()));
            // The whole before its parts.
            self.0.sort_by_key(|(text, _)| std::cmp::Reverse(text.len()));
        }
    }

    /// `tree` as JSON text, with hidden texts replaced in all strings.
    fn in_json(&self, mut tree: Value) -> anyhow::Result<Vec<u8>> {
        hide_in_json(&mut tree, &|text: &str| self.hide(text));
        Ok(serde_json::to_vec_pretty(&tree)?)
    }

    fn hide(&self, text: &str) -> String {
        self.0.iter().fold(text.to_owned(), |text, (hidden, instead)| text.replace(hidden, instead))
    }
}

/// Version of the program, and the system.
fn about(version: &str) -> String {
    let first_line = |text: Option<String>| {
        text.and_then(|text| text.lines().next().map(str::to_owned)).unwrap_or("unknown".into())
    };
    let file = |path: &str| read_text(Path::new(path), TEXT_LIMIT, Links::Followed).ok();
    let release = file("/etc/os-release").and_then(|text| {
        let name = text.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="))?;
        Some(name.trim_matches('"').to_owned())
    });
    let ffmpeg = Command::new("ffmpeg").arg("-version").stdin(Stdio::null()).output().ok();
    let ffmpeg = ffmpeg.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    let named = |name: &str| std::env::var(name).unwrap_or_default();
    format!(
        "boresight {version}\nsystem:    {} {}, {}\nkernel:    {}\nffmpeg:    {}\nlocale:    {}\nsession:   {} {}\n",
        std::env::consts::OS,
        std::env::consts::ARCH,
        first_line(release),
        first_line(kernel()),
        first_line(ffmpeg),
        named("LANG"),
        named("XDG_SESSION_TYPE"),
        named("XDG_CURRENT_DESKTOP"),
    )
}

fn kernel() -> Option<String> {
    let output = Command::new("uname").args(["-s", "-r"]).stdin(Stdio::null()).output().ok()?;
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Connected cameras; hides their serial numbers.
fn devices(hidden: &mut Hidden) -> anyhow::Result<Vec<u8>> {
    let found = camera::devices();
    let mut file = DevicesFile {
        schema: DEVICES_SCHEMA.into(),
        cameras: found.cameras.into_iter().map(|(entry, _)| entry).collect(),
        others: found.others.into_iter().map(|(other, _)| other).collect(),
        backends: Vec::new(),
    };
    for v4l2 in file.cameras.iter_mut().filter_map(|camera| camera.v4l2.as_mut()) {
        hidden.add(&v4l2.serial, HIDDEN);
        v4l2.links.clear();
    }
    Ok(serde_json::to_vec_pretty(&file)?)
}

fn of_session(path: &Path, hidden: &mut Hidden) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let header = SessionFolder::header(path)?;
    if let Some(camera) = &header.camera {
        hidden.add(camera.serial(), HIDDEN);
    }
    hide_source(&header.source, hidden);
    // A single word may be any word of the files.
    if path.components().count() > 1 {
        hidden.add(&path.display().to_string(), "SESSION");
    }
    let mut files = Vec::new();
    let found = DoctorFile::from(&verify(path)?);
    files.push(("doctor.json".to_owned(), serde_json::to_vec_pretty(&found)?));
    let scratch = Scratch::new()?;
    let copy = scratch.path().join("session");
    copy_for_others(path, &copy, |text| hidden.hide(text))?;
    for name in ["session.toml", "journal.jsonl"] {
        files.push((format!("session/{name}"), read(&copy.join(name), LARGEST, Links::Refused)?));
    }
    if let Ok(text) = read_text(&path.join(RESULT_FILE), TEXT_LIMIT, Links::Refused) {
        let result =
            nameless(&text).with_context(|| format!("not a calibration: {RESULT_FILE}"))?;
        files.push((format!("session/{RESULT_FILE}"), hidden.in_json(result)?));
    }
    Ok(files)
}

/// Hides the origin of the pictures, except the kind.
fn hide_source(source: &str, hidden: &mut Hidden) {
    if is_address(source) {
        let (scheme, rest) = source.split_once("://").unwrap_or(("", source));
        hidden.add(source, &format!("{scheme}://{HIDDEN}"));
        hidden.add(rest.split(['/', ':', '?']).next().unwrap_or_default(), HIDDEN);
    } else if is_command(source) {
        hidden.add(source, &format!("pipe:{HIDDEN}"));
    } else if !is_simulated(source) {
        let ending = Path::new(source).extension();
        let ending = ending.map(|ending| format!(".{}", ending.to_string_lossy()));
        if ending.is_some() || source.contains(['/', '\\']) {
            hidden.add(source, &format!("{HIDDEN}{}", ending.unwrap_or_default()));
        }
    }
}

/// A result with the texts of [`TEXTS`] only; its views have numbers.
fn nameless(text: &str) -> anyhow::Result<Value> {
    fn listed(tree: &mut Value, name: &str) {
        match tree {
            Value::String(text) if !TEXTS.contains(&name) => *text = HIDDEN.into(),
            Value::Array(all) => all.iter_mut().for_each(|each| listed(each, name)),
            Value::Object(all) => all.iter_mut().for_each(|(name, each)| listed(each, name)),
            _ => {}
        }
    }
    let mut tree: Value = serde_json::from_str(text)?;
    listed(&mut tree, "");
    for (number, view) in tree["views"].as_array_mut().into_iter().flatten().enumerate() {
        view["name"] = format!("view {number}").into();
    }
    Ok(tree)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_is_hidden_before_its_parts_and_short_words_stay() {
        let mut hidden = Hidden::default();
        hide_source("rtsp://gate.example:554/front", &mut hidden);
        hidden.add("/home/eve", "~");
        hidden.add("abc", HIDDEN);
        let said = hidden
            .hide("abc: rtsp://gate.example:554/front is lost (gate.example), see /home/eve/log");
        assert_eq!(said, "abc: rtsp://hidden is lost (hidden), see ~/log");
        let mut hidden = Hidden::default();
        hide_source("/media/mill-ltd/hall.mp4", &mut hidden);
        assert_eq!(hidden.hide("\"/media/mill-ltd/hall.mp4\""), "\"hidden.mp4\"");
    }
}
