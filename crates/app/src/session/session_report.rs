//! The report of a session folder.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use anyhow::Context;
use serde_json::Value;

use crate::{
    Announcer, REPORT_FILE, RESULT_FILE, SavedSession,
    session::{
        certificate::{Circumstances, certificate},
        report::versions,
        result::calibration_file,
    },
};
use boresight_detect::Miss;
use boresight_files::{self as files, Links, Overwrite, save};
use boresight_formats::{CalibrationFile, CheckFile};
use boresight_geometry::{
    device::{Control, Lock},
    frame::FrameKind,
};
use boresight_guide::{
    guidance::RULES,
    session::{Ending, Input, Session},
};
use boresight_present::{
    cause_picture::CausePicture,
    report::{
        CameraChange, CameraSection, Certificate, Provenance, Refused, Report, Thumbnail, page,
    },
    result_card::ResultCard,
    text::{self, report as words},
};
use boresight_run::{
    config::{CertificateConfig, Config, PlanName},
    recording::{Header, JournalContents, Line, SessionFolder, Stored, stored_frame},
};

/// Path of a session's report.
pub fn page_path(session: &Path) -> PathBuf {
    session.join(REPORT_FILE)
}

/// Writes the report of a just-ended session, and announces the path. All contents are already on
/// disk: an unwritable report is announced but isn't a failure.
pub fn write_and_announce(path: &Path, session: &Session, announcer: &Announcer) {
    match write(path, session) {
        Ok(page) => announcer.say(&format!("Report: {}", page.display())),
        Err(err) => announcer.say(&format!("{} ({err:#})", words::not_written(path))),
    }
}

/// Writes the report. It follows from the journal and may be replaced.
fn write(path: &Path, session: &Session) -> anyhow::Result<PathBuf> {
    let (header, contents) = SessionFolder::read(path)?;
    let stated = &header.config.certificate;
    let report = compose(path, &header, &contents, session, stated)?;
    let file = page_path(path);
    save(&file, page(&report).as_bytes(), Overwrite::Allowed)?;
    Ok(file)
}

/// Report of the session at `path`, calibrated again from the views in the journal. The session's
/// settings fill the gaps of `stated` in the certificate.
///
/// # Errors
///
/// If the folder or its `check.json` can't be read.
pub fn of_folder(path: &Path, stated: &CertificateConfig) -> anyhow::Result<Report> {
    let saved = SavedSession::open(path)?;
    let SavedSession { header, session, contents, .. } = &saved;
    let mut recorded = header.config.certificate.clone();
    let foreign = recorded.take_foreign_logo();
    let mut report = compose(path, header, contents, session, &stated.clone().over(recorded))?;
    if let Some(logo) = foreign.filter(|_| stated.logo.is_empty()) {
        report.notes.push(text::certificate::logo_of_session(&logo));
    }
    if contents.cut {
        report.notes.push(words::CUT.into());
    }
    if saved.restored {
        let (count, by_these) = (session.accepted().len(), header.guidance_rules == RULES);
        report.notes.push(text::replay::restored(count, by_these));
    }
    if holds_another_result(path, &report.calibration) {
        report.notes.push(words::OTHER_RESULT.into());
    }
    Ok(report)
}

/// True if the folder has a result other than `ours`.
fn holds_another_result(path: &Path, ours: &CalibrationFile) -> bool {
    let Ok(text) = files::read_text(&path.join(RESULT_FILE), files::TEXT_LIMIT, Links::Refused)
    else {
        return false;
    };
    let tree: Value = serde_json::from_str(&text).unwrap_or_default();
    let Ok(theirs) = CalibrationFile::read(&tree) else {
        return true;
    };
    let of = |file: &CalibrationFile| {
        let lens = file.result.as_ref().map(|lens| (lens.f_px, lens.pp_px, lens.distortion));
        (file.verdict.clone(), lens)
    };
    of(&theirs) != of(ours)
}

fn compose(
    path: &Path,
    header: &Header,
    contents: &JournalContents,
    session: &Session,
    stated: &CertificateConfig,
) -> anyhow::Result<Report> {
    let stored: BTreeMap<u64, &Stored> =
        contents.stored.iter().map(|stored| (stored.frame, stored)).collect();
    // A missing or damaged picture leaves the board's outline; `doctor` names it.
    let picture = |frame: u64| {
        let stored = stored.get(&frame)?;
        Thumbnail::of(&stored_frame(path, stored).ok()?)
    };
    let check = check(path)?;
    let command = match (&check, &header.against) {
        (Some(_), Some(against)) => check_command(header, against),
        _ => format!("boresight replay {}", text::terminal::quoted(&path.to_string_lossy())),
    };
    let calibration = calibration_file(session, header);
    let result = path.join(RESULT_FILE);
    let bytes = files::read(&result, files::TEXT_LIMIT, Links::Refused)
        .ok()
        .filter(|_| !holds_another_result(path, &calibration));
    let name = std::path::absolute(path)?;
    Ok(of_recorded(Recorded {
        name: name.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        place: path.display().to_string(),
        command,
        header,
        session,
        calibration,
        result: bytes.as_deref(),
        lines: contents.lines.iter(),
        picture,
        check,
        stated,
    })?)
}

/// A session with the contents of the report, from any storage.
pub struct Recorded<'a, L, P> {
    /// Name of the session.
    pub name: String,
    /// Storage location in words.
    pub place: String,
    /// Command to repeat the result.
    pub command: String,
    /// Contents of `session.toml`.
    pub header: &'a Header,
    /// State after the last line.
    pub session: &'a Session,
    /// Calibration file.
    pub calibration: CalibrationFile,
    /// Bytes of the calibration file, if stored.
    pub result: Option<&'a [u8]>,
    /// Lines of the journal.
    pub lines: L,
    /// Thumbnail of a picture by number, if any.
    pub picture: P,
    /// Check against an older calibration.
    pub check: Option<CheckFile>,
    /// Statements of the first sheet.
    pub stated: &'a CertificateConfig,
}

/// Report of a session.
///
/// # Errors
///
/// The error of an unreadable line.
pub fn of_recorded<E>(
    recorded: Recorded<
        '_,
        impl Iterator<Item = Result<Line, E>>,
        impl Fn(u64) -> Option<Thumbnail>,
    >,
) -> Result<Report, E> {
    let Recorded { header, session, calibration, .. } = recorded;
    let accepted = session.accepted();
    let mut notes = Vec::new();
    if session.ending() != Ending::Finished {
        notes.push(text::session_news::ending(session));
    }
    let History { frames, refused, changes } = history(recorded.lines)?;
    let mut rows = versions(&[&header.schema]);
    rows.push((words::name::SESSION.into(), recorded.place));
    rows.push((words::name::FRAMES.into(), words::frames(frames, accepted.len())));
    let certificate = first_sheet(header, session, recorded.result, recorded.stated, &mut notes);
    Ok(Report {
        name: recorded.name,
        calibration,
        notes,
        certificate,
        camera: camera_section(header, session, changes),
        corners: session.corners_at_one_instant().to_vec(),
        pictures: accepted.iter().map(|taken| (recorded.picture)(taken.view.frame_id.0)).collect(),
        cause: cause(session),
        check: recorded.check,
        refused,
        provenance: Provenance { rows, command: recorded.command },
    })
}

fn cause(session: &Session) -> Option<CausePicture> {
    let number = |place: usize| session.accepted().get(place).map(|view| view.number);
    ResultCard::of_result(session.calibration()?, session.limits(), &number).cause
}

/// Camera section of a report on a stored session.
///
/// # Errors
///
/// If a line of its journal can't be read.
pub fn camera_of(saved: &SavedSession) -> anyhow::Result<CameraSection> {
    let History { changes, .. } = history(saved.contents.lines.iter())?;
    Ok(camera_section(&saved.header, &saved.session, changes))
}

fn camera_section(header: &Header, session: &Session, changes: Vec<CameraChange>) -> CameraSection {
    let simulated = text::is_simulated(&header.source);
    CameraSection { rows: camera(header, session), simulated, changes }
}

/// Camera and mode of a session, for the first sheet.
pub fn taken_with(header: &Header, session: &Session) -> Circumstances<'static> {
    let camera = match &header.camera {
        Some(camera) => (camera.name().to_owned(), camera.serial().to_owned()),
        None if text::is_simulated(&header.source) => {
            (text::certificate::SIMULATED_CAMERA.into(), header.source.clone())
        }
        None => Default::default(),
    };
    let mode = session.camera().mode.map_or_else(String::new, |mode| text::camera::mode(&mode));
    Circumstances { camera, mode, ..Circumstances::default() }
}

/// The certificate; `None` for the short session of a check.
fn first_sheet(
    header: &Header,
    session: &Session,
    result: Option<&[u8]>,
    stated: &CertificateConfig,
    notes: &mut Vec<String>,
) -> Option<Certificate> {
    if header.against.is_some() && header.config.guidance.plan == PlanName::Quick {
        return None;
    }
    let known = Circumstances {
        made: header.created.parse().ok(),
        file: result.map(|bytes| (Path::new(RESULT_FILE), bytes)),
        ..taken_with(header, session)
    };
    Some(certificate(stated, known, notes))
}

/// The stored check, if any.
fn check(path: &Path) -> anyhow::Result<Option<CheckFile>> {
    let path = path.join("check.json");
    let text = match files::read_text(&path, files::TEXT_LIMIT, Links::Refused) {
        Err(err) if err.is_missing() => return Ok(None),
        text => text?,
    };
    let damaged = || format!("not what a check writes: {path:?}");
    let found: Value = serde_json::from_str(&text).with_context(damaged)?;
    CheckFile::read(&found).map(Some).with_context(damaged)
}

/// Command to repeat a comparison: the journal alone doesn't hold the old calibration.
fn check_command(header: &Header, against: &str) -> String {
    let board = header.config.board.choice().to_string();
    let square_mm = header.config.board.square_mm;
    let command = match header.config.guidance.plan {
        PlanName::Quick => "check",
        PlanName::Full | PlanName::Adaptive => "guide",
    };
    format!(
        "boresight {command} --against {} --source {} --board {board} --square {square_mm}mm",
        text::terminal::quoted(against),
        text::terminal::quoted(&header.source)
    )
}

/// The camera's entries in the header, with mode and controls at the end of the session.
fn camera(header: &Header, session: &Session) -> Vec<(String, String)> {
    let mut rows = vec![
        (words::name::SOURCE.into(), header.source.clone()),
        (words::name::BEGUN.into(), header.created.clone()),
    ];
    let state = session.camera();
    rows.extend(state.mode.map(|mode| (words::name::MODE.into(), text::camera::mode(&mode))));
    for control in Control::ALL {
        let lock = state.locks.of(control);
        if lock != Lock::Unknown {
            let name = text::camera::capital(text::camera::control(control));
            rows.push((name, text::camera::lock(lock)));
        }
    }
    if let Some(against) = &header.against {
        rows.push((words::name::AGAINST.into(), against.clone()));
    }
    let changed = changed_settings(&header.config);
    if !changed.is_empty() {
        rows.push((words::name::SETTINGS.into(), changed.join(", ")));
    }
    rows
}

/// Settings that are not the default ones, as `--set` takes them; the board and the certificate are
/// shown elsewhere.
fn changed_settings(config: &Config) -> Vec<String> {
    let table = |config: &Config| toml::Table::try_from(config).unwrap_or_default();
    let default = Config::load(None, &[]).map(|config| table(&config)).unwrap_or_default();
    let mut changed = Vec::new();
    for (group, values) in table(config)
        .iter()
        .filter(|(group, _)| !["board", "certificate"].contains(&group.as_str()))
    {
        for (name, value) in values.as_table().into_iter().flatten() {
            if default.get(group).and_then(|values| values.get(name)) != Some(value) {
                changed.push(format!("{group}.{name}={value}"));
            }
        }
    }
    changed
}

/// Minimum number of frames of a video with the same reason for a line.
const FEWEST_FRAMES: usize = 5;
/// Longest time attributed to a frame of a video.
const PAUSE_SECS: f64 = 1.0;

/// Facts in a journal besides the views.
struct History {
    frames: usize,
    /// Reasons for refusals, the most frequent first.
    refused: Vec<Refused>,
    changes: Vec<CameraChange>,
}

fn history<E>(lines: impl Iterator<Item = Result<Line, E>>) -> Result<History, E> {
    let mut counts: BTreeMap<String, (usize, f64)> = BTreeMap::new();
    let mut last_at = None;
    let mut frames = 0;
    let mut changes = Vec::new();
    let mut last_frame = None;
    for line in lines {
        let Line { input, decision, .. } = line?;
        let input = Input::from(input);
        let lasted_secs = match &input {
            Input::Observed(seen) if seen.kind == FrameKind::Video => {
                let before = last_at.replace(seen.captured_at);
                before.map_or(0.0, |at| seen.captured_at.secs_since(at).clamp(0.0, PAUSE_SECS))
            }
            _ => 0.0,
        };
        if let Some(reason) = refusal(&input, decision.get()) {
            let (count, secs) = counts.entry(reason).or_default();
            *count += 1;
            *secs += lasted_secs;
        }
        let mut change = |what: String| {
            changes.push(CameraChange { when: words::at_frame(last_frame), what });
        };
        match input {
            Input::Observed(observation) => {
                frames += 1;
                last_frame = Some(observation.frame_id.0);
            }
            Input::WorkerFailed { worker, reason } => change(words::failed(&worker, &reason)),
            Input::Resumed => change(words::RESUMED.into()),
            Input::Camera(event) => {
                if let Some(what) = text::camera::event(&event) {
                    change(what);
                }
            }
            Input::Command(_)
            | Input::Led(_)
            | Input::Scene(_)
            | Input::SourceEnded
            | Input::Stop => {}
        }
    }
    let mut refused: Vec<Refused> = counts
        .into_iter()
        .map(|(code, (count, secs))| Refused {
            what: words::refusal_kind(&code).into(),
            count,
            secs: (secs > 0.0).then_some(secs),
        })
        .filter(|refused| refused.secs.is_none() || refused.count >= FEWEST_FRAMES)
        .collect();
    refused.sort_by(|a, b| b.count.cmp(&a.count).then_with(|| a.what.cmp(&b.what)));
    Ok(History { frames, refused, changes })
}

/// Stable name of the reason for refusing the frame or taking back a view, as reported then.
fn refusal(input: &Input, decision: &str) -> Option<String> {
    let decision: Value = serde_json::from_str(decision).unwrap_or_default();
    let word = |pointer: &str| decision.pointer(pointer).and_then(Value::as_str);
    match (word("/outcome/outcome")?, word("/outcome/refusal/why")) {
        ("removed", _) => Some("removed".into()),
        // The frame belongs to a hold under way.
        ("refused", Some("holding")) => None,
        ("refused", Some("not_found")) => match input {
            Input::Observed(observation) => {
                let miss = observation.seen.as_ref().err();
                Some(miss.map_or("not_found", miss_code).into())
            }
            _ => Some("not_found".into()),
        },
        ("refused", why) => why.map(Into::into),
        _ => None,
    }
}

fn miss_code(miss: &Miss) -> &'static str {
    match miss {
        Miss::NoBoard => "no_board",
        Miss::PartialBoard { .. } => "partial_board",
        Miss::Glare { .. } => "glare",
        Miss::OtherBoard(_) => "other_board",
        Miss::Mirrored => "mirrored",
        Miss::OtherMarkers { .. } => "other_markers",
        Miss::OtherSquares { .. } => "other_squares",
        Miss::TooSmall { .. } => "too_small",
        Miss::Blurred { .. } => "blurred",
        Miss::LowContrast { .. } => "low_contrast",
        Miss::OutOfTime => "out_of_time",
    }
}
