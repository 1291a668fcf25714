//! Work on an item of a batch, from session to row.

use std::{
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

use anyhow::Context;
use serde::Deserialize;

use super::{
    item::Item,
    job::{Action, Job},
    not_worked::NotWorked,
    recorded::{RESULT_LIMIT, describe, recorded},
    row::{DecisionsEntry, Row},
    store::Store,
    taken::TakenSession,
};
use crate::explained::{error_code, explain};
#[cfg(not(feature = "report"))]
use boresight_app::MissingFeature;
use boresight_app::{
    Announcer, JournalReading, RESULT_FILE, SavedSession,
    commands::redetect::{kind, redetect},
    session::{
        comparison,
        export::{Format, export},
        result::calibration_file,
    },
};
use boresight_capture::is_bag;
use boresight_files::{Links, read_text};
use boresight_geometry::panic_message::panic_message;
use boresight_run::recording::{Replayed, SessionFolder};

/// Does the work of `job` on the session of `item`. Files beside the row go into `store`. Every
/// error becomes a row: nothing in a session stops a batch.
pub fn work(job: &Job, store: &Store, item: &Item) -> Row {
    let id = job.id_of(item).to_string();
    let blank = Row::new(id, &item.session, job.action);
    let worked = catch_unwind(AssertUnwindSafe(|| {
        let mut row = blank.clone();
        let worked = fill(&mut row, job, store, item);
        match worked {
            Ok(()) => row,
            Err(err) => row.failed(error_code(&err), format!("{err:#}"), explain(&err)),
        }
    }));
    worked.unwrap_or_else(|payload| {
        let message = panic_message(&*payload).unwrap_or_else(|| "no message".into());
        blank.failed("PROGRAM-ERROR", message, Some("Please report it with the session.".into()))
    })
}

fn fill(row: &mut Row, job: &Job, store: &Store, item: &Item) -> anyhow::Result<()> {
    let path = Path::new(&item.session);
    if has_changed(item, || Item::of(path)) {
        if !is_bag(path) {
            SessionFolder::read(path)?;
        }
        return Err(NotWorked::Changed.into());
    }
    if is_bag(path) {
        let (taken, broken) = TakenSession::from_bag(path, &job.settings)?;
        on_session(row, job, store, taken.path())?;
        row.recorded_verdict = None;
        return broken.map_or(Ok(()), |how| Err(NotWorked::BrokenBag(how).into()));
    }
    on_session(row, job, store, path)
}

/// Does the work on the session in the folder `path`.
fn on_session(row: &mut Row, job: &Job, store: &Store, path: &Path) -> anyhow::Result<()> {
    row.recorded_verdict = recorded_verdict(path);
    let mut journal = JournalReading::of(path)?;
    describe(row, &journal.header);
    let config = match job.action {
        // The settings concern the page.
        Action::Report => journal.header.config.clone(),
        _ => journal.header.config.with(&job.settings)?,
    };
    match job.action {
        Action::Recorded => {
            let own = recorded(path)?.context("the session has no result")?;
            *row = Row { id: row.id.clone(), ..own };
        }
        Action::Replay | Action::Redetect => {
            if job.action == Action::Redetect {
                redetect(&mut journal, &config.board()?, 1, || ())?;
            }
            let (again, crc32) = journal.decide_again_summed(&config, |_, _| ())?;
            let count = journal.contents.lines.len();
            row.decisions =
                Some(DecisionsEntry { crc32: Some(crc32), ..compared(&again.replayed, count) });
            row.calibrated(&calibration_file(&again.session, &journal.header));
        }
        Action::Calibrate | Action::Check | Action::Report => {
            journal.header.config = config;
            let saved = journal.session()?;
            row.decisions = Some(compared(&saved.replayed, saved.contents.lines.len()));
            row.calibrated(&calibration_file(&saved.session, &saved.header));
            match job.action {
                Action::Check => check(row, job, &saved)?,
                Action::Report => row.file = Some(report(job, store, path, &row.id)?),
                _ => {}
            }
        }
        Action::Export => {
            let wanted = job.format.as_deref().unwrap_or_default();
            let format = Format::by_code(wanted).context("there is no such format")?;
            let exported = export(path, format, None, None, &Announcer::silent())?;
            let name = format!("{}-{}", row.id, format.file());
            row.file = Some(store.save_file(&row.id, &name, exported.text.as_bytes())?);
            row.verdict.clone_from(&row.recorded_verdict);
        }
    }
    Ok(())
}

/// True if `look` finds a different `item`. A second look tells a passing read error from a change.
fn has_changed(item: &Item, mut look: impl FnMut() -> Option<Item>) -> bool {
    let mut differs = || look().is_none_or(|now| now.content != item.content);
    differs() && differs()
}

fn compared(replayed: &Replayed, count: usize) -> DecisionsEntry {
    let mut kinds = BTreeMap::new();
    for difference in &replayed.differences {
        *kinds.entry(kind(difference)).or_insert(0) += 1;
    }
    let different = replayed.different_lines.len();
    DecisionsEntry { count, different, rounded: replayed.rounding.count, kinds, crc32: None }
}

/// Verdict in the session's own result; `None` without one.
fn recorded_verdict(session: &Path) -> Option<String> {
    #[derive(Deserialize)]
    struct Judged {
        verdict: String,
    }
    let text = read_text(&session.join(RESULT_FILE), RESULT_LIMIT, Links::Refused).ok()?;
    serde_json::from_str::<Judged>(&text).ok().map(|judged| judged.verdict)
}

fn check(row: &mut Row, job: &Job, saved: &SavedSession) -> anyhow::Result<()> {
    let against = job.against.as_ref().or(saved.header.against.as_ref());
    let against = Path::new(against.ok_or(NotWorked::NoOldCalibration)?);
    let old = comparison::read(against)?;
    let found = comparison::compare(&saved.session, &old, None);
    let (_, action) = comparison::words(&found);
    row.check = Some(comparison::check_file(against, &saved.header.source, &old, &found, &action));
    Ok(())
}

#[cfg(feature = "report")]
fn report(job: &Job, store: &Store, session: &Path, id: &str) -> anyhow::Result<String> {
    let stated = boresight_run::config::Config::load(None, &job.settings)?.certificate;
    let report = boresight_app::session::session_report::of_folder(session, &stated)?;
    store.save_file(id, &format!("{id}.html"), boresight_present::report::page(&report).as_bytes())
}

#[cfg(not(feature = "report"))]
fn report(_: &Job, _: &Store, _: &Path, _: &str) -> anyhow::Result<String> {
    Err(MissingFeature::REPORT.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::item::Content;

    #[test]
    fn a_read_error_that_passes_is_no_change() {
        let looks_like = |header: Result<Vec<u8>, &'static str>| {
            let content = Content { header, journal: Ok((3, [7; 32])), result: Ok(Vec::new()) };
            content.item("session".into())
        };
        let item = looks_like(Ok(vec![1]));
        let looks = |looks: [Result<Vec<u8>, &'static str>; 2]| {
            let mut looks = looks.into_iter();
            has_changed(&item, || looks.next().map(looks_like))
        };
        assert!(!looks([Ok(vec![1]), Err("FILE-UNREADABLE")]));
        assert!(!looks([Err("FILE-UNREADABLE"), Ok(vec![1])]));
        assert!(looks([Err("FILE-UNREADABLE"), Err("FILE-UNREADABLE")]));
        assert!(looks([Ok(vec![2]), Ok(vec![2])]));
    }
}
