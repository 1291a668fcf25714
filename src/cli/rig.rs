//! Several cameras: `boresight calibrate --rig`, `boresight check --rig`.

use std::{
    path::{Path, PathBuf},
    thread::available_parallelism,
};

use anyhow::{Context, bail};

use super::views::views_of;
use boresight_app::{
    Exit,
    commands::{
        calibration_views::is_table,
        rig::{CameraInput, by_number, cameras_in},
    },
};
use boresight_calibrate::{
    CalibrationParams, DriftVerdict, PairChange, RigViews, Verdict, calibrate_rig, moved_camera,
    pair_change,
};
use boresight_capture::Upright;
use boresight_files::{Links, Overwrite, TEXT_LIMIT, read_text, save};
use boresight_formats::{FindingEntry, RigFile};
use boresight_geometry::boards::Board;
#[cfg(feature = "report")]
use boresight_present::report::rig_page;
use boresight_present::{grade::Grade, text::rig as words};
use boresight_run::config::Config;
use boresight_terminal::{board_args::Size, print, say};

/// Pictures among the cameras' files, to read the board's code from.
pub(super) fn pictures(inputs: &[CameraInput]) -> Vec<PathBuf> {
    let files = inputs.iter().flat_map(|camera| &camera.files);
    files.filter(|path| !is_table(path)).cloned().collect()
}

/// Names and views of the cameras.
pub(super) fn views(
    inputs: Vec<CameraInput>,
    upright: Upright,
    image_size: Option<Size>,
    board: &Board,
) -> anyhow::Result<(Vec<String>, Vec<RigViews>)> {
    let of = |CameraInput { name, files }: CameraInput| {
        let views = views_of((&files, upright), image_size, board, false)?;
        let views = by_number(&name, &views)?;
        Ok((name, views))
    };
    let both: Vec<_> = inputs.into_iter().map(of).collect::<anyhow::Result<_>>()?;
    Ok(both.into_iter().unzip())
}

fn on_every_core(params: CalibrationParams) -> CalibrationParams {
    CalibrationParams { threads: available_parallelism().map_or(1, usize::from), ..params }
}

/// Result of a rig, as announced.
#[cfg_attr(not(feature = "window"), expect(dead_code, reason = "a window shows all of it"))]
pub(super) struct Announced {
    pub(super) exit: Exit,
    /// `None` without a rig.
    pub(super) grade: Option<Grade>,
    pub(super) lines: Vec<String>,
}

/// Where to write a rig.
#[derive(Clone, Copy)]
pub(super) struct Written<'a> {
    pub(super) out: Option<&'a Path>,
    /// Page about the rig.
    pub(super) report: Option<&'a Path>,
    pub(super) overwrite: Overwrite,
    /// Print as JSON.
    pub(super) as_json: bool,
}

/// Calibrates the cameras, announces the result, and writes it.
pub(super) fn calibrate(
    names: &[String],
    cameras: &[RigViews],
    config: &Config,
    Written { out, report, overwrite, as_json }: Written<'_>,
) -> anyhow::Result<Announced> {
    let board = config.board()?;
    let params = on_every_core(config.calibration());
    let found = calibrate_rig(cameras, &board, &params);
    let file = RigFile::of(found.as_ref(), names, &board, words::RIG_WORDS);
    let mut lines: Vec<String> = found.iter().map(words::verdict).collect();
    for FindingEntry { code, message, action, .. } in &file.findings {
        lines.push(format!("  {code}: {message}. {action}"));
    }
    if let Ok(rig) = &found {
        for ((name, lens), of) in names.iter().zip(&rig.rig.cameras).zip(&rig.cameras) {
            lines.push(words::camera(name, lens, of));
        }
        // Where the pictures contradict each other, no number between cameras is a fact.
        let is_told = rig.verdict != Verdict::Untrustworthy || rig.is_unfinished();
        for pair in rig.pairs.iter().filter(|_| is_told) {
            lines.push(words::pair(pair, names, params.board_scale_sd));
        }
    }
    for line in &lines {
        say(line);
    }
    let json = serde_json::to_string_pretty(&file)?;
    if let Some(path) = out {
        save(path, json.as_bytes(), overwrite)?;
        let written = format!("Written: {}", path.display());
        say(&written);
        lines.push(written);
    }
    #[cfg(feature = "report")]
    if let Some(path) = report {
        let written = write_page(&names.join(", "), &file, path, overwrite)?;
        say(&written);
        lines.push(written);
    }
    #[cfg(not(feature = "report"))]
    let _ = report;
    if as_json {
        print(&json)?;
    }
    let is_usable = found.as_ref().is_ok_and(|rig| rig.verdict != Verdict::Untrustworthy);
    let exit = if is_usable { Exit::Good } else { Exit::NotTrustworthy };
    let grade = found.ok().map(|rig| Grade::by(rig.verdict, rig.is_unfinished()));
    Ok(Announced { exit, grade, lines })
}

/// Writes the page about `rig` to `path`; the news of it.
#[cfg(feature = "report")]
pub(super) fn write_page(
    name: &str,
    rig: &RigFile,
    path: &Path,
    overwrite: Overwrite,
) -> anyhow::Result<String> {
    save(path, rig_page(name, rig).as_bytes(), overwrite)?;
    Ok(format!("Report: {}", path.display()))
}

/// Rig in the file `path`.
pub(super) fn read(path: &Path) -> anyhow::Result<RigFile> {
    let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
    let tree = serde_json::from_str(&text).with_context(|| format!("not a rig: {path:?}"))?;
    RigFile::read(&tree).with_context(|| format!("not a rig: {path:?}"))
}

/// Checks the cameras `inputs` against the rig in the file `against`: has one moved against the
/// others by more than `limit_px`?
pub(super) fn check(
    against: &Path,
    inputs: &[PathBuf],
    config: &Config,
    image_size: Option<Size>,
    limit_px: f64,
) -> anyhow::Result<Exit> {
    let old = read(against)?;
    let board = old.board.board().with_context(|| format!("{against:?} names no board"))?;
    let inputs = cameras_in(inputs)?;
    let (names, given) = views(inputs, config.camera.upright(), image_size, &board)?;
    if let Some(unknown) = names.iter().find(|name| !old.cameras.iter().any(|it| it.name == **name))
    {
        let has: Vec<&str> = old.cameras.iter().map(|camera| camera.name.as_str()).collect();
        bail!("{unknown:?} isn't a camera of {against:?}: it has {}", has.join(", "));
    }
    let Some(earlier) = old.known() else {
        bail!("{against:?} states no uncertainty: it had too few common places");
    };
    // Cameras of the file, in its order; those without pictures now are left out of both.
    let has_pictures = |camera: &usize| names.contains(&old.cameras[*camera].name);
    let kept: Vec<usize> = (0..old.cameras.len()).filter(has_pictures).collect();
    let earlier = earlier.only(&kept);
    let entries = || kept.iter().map(|camera| &old.cameras[*camera]);
    let mut cameras = Vec::with_capacity(kept.len());
    for entry in entries() {
        let place = names.iter().position(|name| *name == entry.name);
        let views = place.and_then(|place| given.get(place)).cloned();
        let known_lens = entry.known_lens();
        cameras.extend(views.map(|views| RigViews { known_lens, ..views }));
    }
    let names: Vec<String> = entries().map(|entry| entry.name.clone()).collect();
    let found = match calibrate_rig(&cameras, &board, &on_every_core(config.calibration())) {
        Ok(found) => found,
        Err(reason) => {
            let (message, action) = (words::RIG_WORDS.not_a_rig)(&reason, &names);
            say(&format!("CAN'T TELL: {message}. {action}"));
            return Ok(Exit::NotTrustworthy);
        }
    };
    let pairs = found.pairs.iter();
    let changes: Vec<PairChange> =
        pairs.filter_map(|pair| pair_change(&found, &earlier, pair.of, limit_px)).collect();
    for finding in &found.findings {
        let (message, action) = (words::RIG_WORDS.finding)(finding, &names);
        say(&format!("  {}: {message}. {action}", finding.code()));
    }
    for change in &changes {
        say(&words::change(change, &names, limit_px));
    }
    let verdicts = || changes.iter().map(|change| change.verdict);
    say(&words::changed(&changes, moved_camera(&changes), &names));
    Ok(if verdicts().any(|verdict| verdict == DriftVerdict::Recalibrate) {
        Exit::Recalibrate
    } else if !changes.is_empty() && verdicts().all(|verdict| verdict == DriftVerdict::Ok) {
        Exit::Good
    } else {
        Exit::NotTrustworthy
    })
}
