//! References as files: `NAME.json` with the learned data, and `NAME.png` with the patches. A name
//! ends with the checksum of both.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use image::{GenericImageView, GrayImage};
use serde::{Deserialize, Serialize};

use super::{shelf::png, store_lines::sum_of};
use boresight_capture::read_picture;
use boresight_files::{Links, Overwrite, TEXT_LIMIT, entries, read_text, remove, save};
use boresight_watch::{
    COARSE_HALF, FINE_HALF, Gallery, Landmark, Lens, Reference, Texture, Thumb, Turn,
};

const FINE: u32 = 2 * FINE_HALF as u32 + 1;
const COARSE: u32 = 2 * COARSE_HALF as u32 + 1;

#[derive(Debug, Serialize, Deserialize)]
struct ReferenceFile {
    taken: f64,
    is_first: bool,
    /// Pan, tilt, roll in rad, log focal ratio.
    turn: [f64; 4],
    thumb: Vec<i8>,
    patches: Vec<PatchLine>,
}

#[derive(Debug, Serialize, Deserialize)]
struct PatchLine {
    px: [i64; 2],
    sigma_px: f64,
    texture: [f64; 2],
    has_coarse: bool,
}

/// Writes missing references of a gallery; returns the names of all.
pub(super) fn save_all(folder: &Path, gallery: &Gallery) -> anyhow::Result<Vec<String>> {
    let mut names = Vec::new();
    for reference in &gallery.references {
        let (file, patches) = written(reference);
        let text = serde_json::to_string(&file)?;
        let sum = sum_of(&[text.as_bytes(), patches.as_raw()]);
        let name = format!("{}-{sum}", reference.taken_secs);
        let path = folder.join(format!("{name}.json"));
        if !path.is_file() {
            let picture = folder.join(format!("{name}.png"));
            save(&picture, &png(&patches)?, Overwrite::Allowed)?;
            save(&path, text.as_bytes(), Overwrite::Allowed)?;
        }
        names.push(name);
    }
    Ok(names)
}

fn written(reference: &Reference) -> (ReferenceFile, GrayImage) {
    let landmarks = &reference.landmarks;
    let mut picture = GrayImage::new(FINE + COARSE, FINE * landmarks.len().max(1) as u32);
    for (n, landmark) in landmarks.iter().enumerate() {
        let top = n as u32 * FINE;
        put(&mut picture, [0, top], FINE, landmark.fine.bytes());
        if let Some(coarse) = &landmark.coarse {
            put(&mut picture, [FINE, top], COARSE, coarse.bytes());
        }
    }
    let patches = landmarks.iter().map(|l| PatchLine {
        px: l.px,
        sigma_px: l.sigma_px,
        texture: [l.texture.sharpness, l.texture.contrast],
        has_coarse: l.coarse.is_some(),
    });
    let file = ReferenceFile {
        taken: reference.taken_secs,
        is_first: reference.is_first,
        turn: reference.turn.vector().into(),
        thumb: reference.thumb.levels(),
        patches: patches.collect(),
    };
    (file, picture)
}

fn put(picture: &mut GrayImage, [left, top]: [u32; 2], side: u32, levels: &[u8]) {
    for (i, level) in levels.iter().enumerate() {
        let at = i as u32;
        picture.put_pixel(left + at % side, top + at / side, image::Luma([*level]));
    }
}

/// Reads the named reference.
pub(super) fn load(folder: &Path, name: &str, lens: &Lens) -> anyhow::Result<Reference> {
    if name.contains(['/', '\\']) || name.starts_with('.') {
        bail!("{name:?} is no name of a reference");
    }
    let path = folder.join(format!("{name}.json"));
    let text = read_text(&path, TEXT_LIMIT, Links::Refused)?;
    let file: ReferenceFile =
        serde_json::from_str(&text).with_context(|| format!("could not read {path:?}"))?;
    let patches = read_picture(&folder.join(format!("{name}.png")))?;
    let is_whole = patches.width() == FINE + COARSE
        && u64::from(patches.height()) >= u64::from(FINE) * file.patches.len() as u64;
    // Names of earlier versions end with the number of patches.
    let sum = name.rsplit_once('-').map(|(_, sum)| sum).filter(|sum| sum.len() == 16);
    let is_same = |sum| sum == sum_of(&[text.as_bytes(), patches.as_raw()]);
    if !is_whole || !sum.is_none_or(is_same) {
        bail!("{path:?} is damaged, or its patches are");
    }
    let damaged = || format!("{path:?} is damaged");
    let cut =
        |left: u32, top: u32, side: u32| patches.view(left, top, side, side).to_image().into_raw();
    let landmark = |(n, line): (usize, &PatchLine)| {
        let top = n as u32 * FINE;
        let (fine, coarse) = (cut(0, top, FINE), line.has_coarse.then(|| cut(FINE, top, COARSE)));
        let texture = Texture { sharpness: line.texture[0], contrast: line.texture[1] };
        Reference::landmark(lens, line.px, (&fine, coarse.as_deref()), texture, line.sigma_px)
    };
    let landmarks: Option<Vec<Landmark>> = file.patches.iter().enumerate().map(landmark).collect();
    Ok(Reference {
        taken_secs: file.taken,
        thumb: Thumb::from_levels(&file.thumb).with_context(damaged)?,
        turn: Turn::from_vector(&file.turn.into()),
        is_first: file.is_first,
        landmarks: landmarks.with_context(damaged)?,
    })
}

/// Removes the files of unused references.
pub(super) fn forget_others(folder: &Path, names: &[String]) -> anyhow::Result<()> {
    let is_used = |path: &PathBuf| {
        let file = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        names.iter().any(|name| {
            file.strip_prefix(name.as_str()).is_some_and(|rest| [".json", ".png"].contains(&rest))
        })
    };
    for path in entries(folder).into_iter().filter(|path| !is_used(path)) {
        remove(&path)?;
    }
    Ok(())
}
