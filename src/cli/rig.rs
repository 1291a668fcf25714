//! Several cameras: `boresight calibrate --rig`, `boresight check --rig`.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::views::views_of;
use boresight_app::{
    Exit,
    commands::{
        calibration_views::is_table,
        rig::{CameraInput, by_number, cameras_in},
    },
    cores,
};
use boresight_calibrate::{
    CalibrationParams, DriftVerdict, PairChange, RigViews, calibrate_rig, moved_camera, pair_change,
};
use boresight_capture::Upright;
use boresight_files::{Links, TEXT_LIMIT, read_text};
use boresight_formats::RigFile;
use boresight_geometry::boards::Board;
use boresight_present::text::rig as words;
use boresight_run::config::Config;
use boresight_terminal::{board_args::Size, say};

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
    let params = CalibrationParams { threads: cores(), ..config.calibration() };
    let found = match calibrate_rig(&cameras, &board, &params) {
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
