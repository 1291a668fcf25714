//! Page with every camera's curves.

use std::collections::BTreeMap;

use anyhow::Context;

use super::report::{CameraCurve, CurvePoint, HistoryPage, ModelLine, history_page};
use super::{
    told::{name, trend},
    trend::CameraHistory,
};
use boresight_station::report::WatchedCurve;

/// Time `days` ago, in the format of sessions.
///
/// # Errors
///
/// If there was no such time.
pub fn days_ago(days: f64) -> anyhow::Result<String> {
    let ago = jiff::SignedDuration::try_from_secs_f64(days * 86_400.0)?;
    let then = jiff::Timestamp::now().checked_sub(ago)?;
    Ok(then.strftime("%Y-%m-%dT%H:%M:%SZ").to_string())
}

/// Page of HTML with the curves of `all` cameras and of the `watched` cameras. A camera is due
/// after `older_days`.
///
/// # Errors
///
/// If a session has no time.
pub fn page(
    all: &[CameraHistory],
    watched: Vec<WatchedCurve>,
    older_days: f64,
) -> anyhow::Result<String> {
    let limit = days_ago(older_days)?;
    let mut models: BTreeMap<&str, ModelLine> = BTreeMap::new();
    let mut cameras = Vec::with_capacity(all.len());
    for history in all {
        let is_due = history.newest().is_none_or(|newest| newest < limit.as_str());
        let line = models.entry(&history.model).or_default();
        line.model.clone_from(&history.model);
        line.cameras += 1;
        line.calibrations += history.entries.len();
        line.drifting += usize::from(history.drifts());
        line.due += usize::from(is_due);
        let newest = history.newest().unwrap_or("never");
        cameras.push(CameraCurve {
            name: name(history),
            trend: trend(history),
            drifts: history.drifts(),
            due: if is_due { format!("Due: last calibrated {newest}") } else { String::new() },
            points: points(history).context("a session has no time")?,
        });
    }
    cameras.sort_by_key(|camera| !camera.drifts);
    let made = jiff::Timestamp::now().strftime("%Y-%m-%d %H:%M UTC").to_string();
    let due_after = format!("{older_days} days");
    let models = models.into_values().collect();
    Ok(history_page(&HistoryPage { made, due_after, models, cameras, watched }))
}

/// Usable calibrations; `None` if a time can't be read.
fn points(history: &CameraHistory) -> Option<Vec<CurvePoint>> {
    let mut first = None;
    let usable = history.entries.iter().filter(|entry| entry.is_usable());
    usable
        .map(|entry| {
            let at: jiff::Timestamp = entry.created.parse().ok()?;
            let since = at.as_second() - *first.get_or_insert(at.as_second());
            let lens = entry.lens?;
            let sd = lens.covariance_px2.diagonal().map(f64::sqrt);
            let (f_pp_px, sd_px) = (lens.f_pp_px.into(), sd.into());
            Some(CurvePoint { day: since as f64 / 86_400.0, f_pp_px, sd_px })
        })
        .collect()
}
