//! Store of a watched camera: a folder with `watch.json`, `watch.jsonl`, `references/` and, while
//! learning, `learning/`.
//!
//! The lines of `watch.jsonl` are the truth: everything else follows. References are written under
//! new names, then a line names them, then `watch.json` follows and the old ones are removed: a
//! power cut loses at most the newest lines. Lines are synced before being announced.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use super::{
    reference_files,
    shelf::{LEARNING, PictureShelf},
    store_lines::{InUse, Lines, StoreLine, Unread, WrittenByNewer},
};
use boresight_files::{
    Appending, FileLock, Links, Overwrite, TEXT_LIMIT, copy, entries, make_folder, read_text,
    remove, save, sync_folder,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensKind, LensMatrix, frame::ImageSize};
use boresight_watch::{Gallery, Input, Lens, Mask, Station};

/// Schema of `watch.json`.
const SCHEMA: &str = "boresight.watch/1";
/// Names in the folder.
pub(super) const WATCH_FILE: &str = "watch.json";
const LINES_FILE: &str = "watch.jsonl";
const DAMAGED_FILE: &str = "watch.damaged.jsonl";
const ACCEPTED_FILE: &str = "accepted.jsonl";
const REFERENCES: &str = "references";

/// `watch.json`: the camera, its lens, and which references are in use.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct WatchFile {
    /// `boresight.watch/1`.
    pub schema: String,
    /// Name of the camera for people and programs.
    pub name: String,
    /// The calibration that it's watched by.
    pub calibration: Named,
    /// The lens.
    pub lens: StoredLens,
    /// True if no picture is stored, only patches.
    pub patches_only: bool,
    /// How often references have been learned: the number of `learned` lines that they belong to.
    pub learned: u64,
    /// The references in use.
    #[serde(flatten)]
    pub in_use: InUse,
}

/// A file by path and content.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct Named {
    /// The path that the person gave.
    pub path: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

/// A lens with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct StoredLens {
    /// Width and height of the pictures, px.
    pub image_size: [u32; 2],
    /// True for OpenCV's fisheye model.
    pub fisheye: bool,
    /// fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6.
    pub parameters: [f64; LENS_PARAMETERS],
    /// Their covariance, row by row.
    pub covariance: Vec<f64>,
}

impl StoredLens {
    pub(super) fn of(lens: &Lens) -> Self {
        Self {
            image_size: [lens.image_size.width_px, lens.image_size.height_px],
            fisheye: lens.camera.distortion.kind == LensKind::Fisheye,
            parameters: lens.camera.lens_parameters(),
            covariance: lens.covariance.transpose().iter().copied().collect(),
        }
    }

    fn lens(&self) -> anyhow::Result<Lens> {
        let kind = if self.fisheye { LensKind::Fisheye } else { LensKind::Perspective };
        if self.covariance.len() != LENS_PARAMETERS * LENS_PARAMETERS {
            bail!("its covariance isn't {LENS_PARAMETERS} by {LENS_PARAMETERS} numbers");
        }
        let [width_px, height_px] = self.image_size;
        Ok(Lens {
            camera: Camera::from_lens_parameters(kind, &self.parameters),
            covariance: LensMatrix::from_row_slice(&self.covariance),
            image_size: ImageSize { width_px, height_px },
        })
    }
}

/// A line of `accepted.jsonl`.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct AcceptedLine {
    at: f64,
    reason: String,
}

/// An open store.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    file: WatchFile,
    /// The lines, to append to; `None` if the store is only read.
    lines: Option<(Appending, FileLock)>,
    count: usize,
    shelf: PictureShelf,
    /// Times of the acceptances in the lines.
    accepted: Vec<f64>,
}

/// What a store is opened for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// To append to, by one program at a time.
    Watch,
    /// To read; nothing is changed.
    Look,
}

/// Contents of an opened store.
#[derive(Debug)]
pub struct Stored {
    /// Last state of the camera.
    pub station: Station,
    /// Every input, oldest first.
    pub inputs: Vec<Input>,
    /// True if a crash cut the newest line, now dropped.
    pub was_cut: bool,
}

impl Store {
    /// Reads the camera file of a store; `None` without a store in the folder.
    ///
    /// # Errors
    ///
    /// If the file can't be read, or is of a later version.
    pub fn read(folder: &Path) -> anyhow::Result<Option<WatchFile>> {
        let path = folder.join(WATCH_FILE);
        if !path.is_file() {
            return Ok(None);
        }
        let text = read_text(&path, TEXT_LIMIT, Links::Refused)?;
        let file: WatchFile =
            serde_json::from_str(&text).with_context(|| format!("could not read {path:?}"))?;
        if file.schema != SCHEMA {
            bail!("{path:?} has the schema {:?}; this version reads {SCHEMA:?}", file.schema);
        }
        Ok(Some(file))
    }

    /// Creates a store for a camera in `folder`, which may exist.
    ///
    /// # Errors
    ///
    /// If the store can't be written, or exists.
    pub fn create(
        folder: &Path,
        name: &str,
        calibration: Named,
        lens: &Lens,
        patches_only: bool,
    ) -> anyhow::Result<()> {
        make_folder(&folder.join(REFERENCES))?;
        if !patches_only {
            make_folder(&folder.join(LEARNING))?;
        }
        let lines = folder.join(LINES_FILE);
        if !lines.is_file() {
            Appending::create(&lines)?;
        }
        let file = WatchFile {
            schema: SCHEMA.into(),
            name: name.into(),
            calibration,
            lens: StoredLens::of(lens),
            patches_only,
            learned: 0,
            in_use: InUse::default(),
        };
        save(&folder.join(WATCH_FILE), to_json(&file)?.as_bytes(), Overwrite::Never)?;
        Ok(())
    }

    /// Opens the store in `folder`.
    ///
    /// # Errors
    ///
    /// If there is none, if another program watches it, or if it's damaged: the message names the
    /// line and the way out.
    pub fn open(folder: &Path, access: Access) -> anyhow::Result<(Self, Stored)> {
        let lock = match access {
            Access::Watch => Some(lock(folder)?),
            Access::Look => None,
        };
        let (lens, mut file, lines) = whole(folder)?;
        if lines.in_use().is_some() && file.follow(&lines) && lock.is_some() {
            file.save(folder)?;
        }
        let references = folder.join(REFERENCES);
        let mut gallery = Gallery::default();
        for name in &file.in_use.references {
            let reference = reference_files::load(&references, name, &lens);
            gallery.references.push(reference.with_context(|| way_out(folder))?);
        }
        let appending = |lock| {
            let mut file = Appending::open(&folder.join(LINES_FILE))?;
            if lines.was_cut {
                file.cut(lines.bytes)?;
            }
            Ok::<_, anyhow::Error>((file, lock))
        };
        let appending = lock.map(appending).transpose()?;
        let mut shelf = PictureShelf::at(folder, file.patches_only);
        let kept = if file.in_use.is_learned { Vec::new() } else { shelf.kept() };
        let known = (gallery, Mask { boxes: file.in_use.text.clone() });
        let station = Station::resumed(lens, known, file.in_use.is_learned, &kept, &mut shelf);
        let was_cut = lines.was_cut;
        let inputs: Vec<Input> = lines.lines.into_iter().map(|line| line.input).collect();
        let accepted = inputs.iter().filter_map(accepted_at).collect();
        let (folder, count) = (folder.to_path_buf(), inputs.len());
        let store = Self { folder, file, lines: appending, count, shelf, accepted };
        Ok((store, Stored { station, inputs, was_cut }))
    }

    /// Folder of the store.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Camera file of the store.
    pub fn file(&self) -> &WatchFile {
        &self.file
    }

    /// The learning pictures.
    pub fn shelf(&mut self) -> &mut PictureShelf {
        &mut self.shelf
    }

    /// Appends inputs durably; with the references of `station`, if they have changed.
    ///
    /// # Errors
    ///
    /// If something can't be written; the older references are then still in use.
    pub fn record(&mut self, inputs: &[Input], station: Option<&Station>) -> anyhow::Result<()> {
        let Some((lines, _)) = &mut self.lines else {
            bail!("{:?} was opened to be read only", self.folder);
        };
        let references = self.folder.join(REFERENCES);
        let in_use = station.map(|station| {
            let names = reference_files::save_all(&references, &station.gallery)?;
            sync_folder(&references)?;
            let (text, is_learned) = (station.mask.boxes.clone(), station.is_learned);
            Ok::<_, anyhow::Error>(InUse { text, is_learned, references: names })
        });
        let in_use = in_use.transpose()?;
        let mut text = String::new();
        for (n, input) in inputs.iter().enumerate() {
            let is_last = n + 1 == inputs.len();
            let in_use = in_use.clone().filter(|_| is_last);
            let line = StoreLine { input: input.clone(), in_use, seq: None, sum: None };
            text.push_str(&line.text(self.count + n)?);
        }
        lines.append(text.as_bytes())?;
        lines.sync()?;
        self.count += inputs.len();
        self.file.learned += inputs
            .iter()
            .filter(|i| matches!(i, Input::Learned { .. } | Input::Accepted { .. }))
            .count() as u64;
        if let Some(in_use) = in_use {
            self.file.in_use = in_use;
            self.file.save(&self.folder)?;
            reference_files::forget_others(&references, &self.file.in_use.references)?;
        }
        Ok(())
    }

    /// Acceptances by persons since the last call.
    ///
    /// # Errors
    ///
    /// If the file is damaged.
    pub fn newly_accepted(&mut self) -> anyhow::Result<Vec<Input>> {
        let lines = accepted_lines(&self.folder)?.into_iter();
        let new = lines.filter(|line| !self.accepted.contains(&line.at));
        let new: Vec<Input> =
            new.map(|line| Input::Accepted { at: line.at, reason: line.reason }).collect();
        self.accepted.extend(new.iter().filter_map(accepted_at));
        Ok(new)
    }
}

/// Folders of watched cameras: `folder` itself, or those in it.
///
/// # Errors
///
/// If there is none.
pub fn stores_below(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let is_store = |folder: &PathBuf| folder.join(WATCH_FILE).is_file();
    let itself = folder.to_path_buf();
    let all: Vec<PathBuf> = if is_store(&itself) {
        vec![itself]
    } else {
        entries(folder).into_iter().filter(is_store).collect()
    };
    if all.is_empty() {
        bail!("there is no watched camera in {folder:?}: name its folder with --store");
    }
    Ok(all)
}

/// Accepts the present pose of a camera; a running watch learns it with the next picture.
///
/// # Errors
///
/// If there is no store in `folder`, or it can't be written.
pub fn accept(folder: &Path, at_secs: f64, reason: &str) -> anyhow::Result<()> {
    if Store::read(folder)?.is_none() {
        bail!(no_store(folder));
    }
    let path = folder.join(ACCEPTED_FILE);
    let mut file = if path.is_file() { Appending::open(&path)? } else { Appending::create(&path)? };
    let line = serde_json::to_string(&AcceptedLine { at: at_secs.round(), reason: reason.into() })?;
    file.append(format!("{line}\n").as_bytes())?;
    file.sync()?;
    sync_folder(folder)?;
    Ok(())
}

fn accepted_at(input: &Input) -> Option<f64> {
    match input {
        Input::Accepted { at, .. } => Some(*at),
        Input::Picture(_) | Input::Learned { .. } => None,
    }
}

fn accepted_lines(folder: &Path) -> anyhow::Result<Vec<AcceptedLine>> {
    let path = folder.join(ACCEPTED_FILE);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = read_text(&path, TEXT_LIMIT, Links::Refused)?;
    // A line without its end is still being written.
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let lines = whole.lines().map(serde_json::from_str).collect::<Result<_, _>>();
    lines.with_context(|| format!("could not read {path:?}"))
}

/// Inputs of the store in `folder`, oldest first.
///
/// # Errors
///
/// If there is no store, or it's damaged.
pub(super) fn inputs(folder: &Path) -> anyhow::Result<(Lens, Vec<Input>)> {
    let (lens, _, lines) = whole(folder)?;
    Ok((lens, lines.lines.into_iter().map(|line| line.input).collect()))
}

/// Outcome of a recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recovered {
    /// Number of lines kept and left out.
    pub lines: [usize; 2],
    /// True if the references were lost, so that the camera is learned again.
    pub is_relearned: bool,
}

/// Recovers the whole part of a damaged store. The lines as they were are kept beside; the camera
/// is learned again if its references don't belong to the lines any more.
///
/// # Errors
///
/// If there is no store in `folder`, if another program watches it, if a line is of a newer
/// version, or if something can't be written.
pub fn recover(folder: &Path, at_secs: f64) -> anyhow::Result<Recovered> {
    let Some(mut file) = Store::read(folder)? else { bail!(no_store(folder)) };
    let _lock = lock(folder)?;
    let (path, lens) = (folder.join(LINES_FILE), file.lens.lens()?);
    let all = if path.is_file() { Lines::each(&path)? } else { Vec::new() };
    let (mut lines, before) = (Lines::default(), all.len());
    for (line, _) in all {
        match line {
            Ok(line) => lines.lines.push(line),
            Err(Unread::Newer(what)) => bail!("{path:?} was written by a newer boresight: {what}"),
            Err(Unread::Damaged(_) | Unread::Hole) => {}
        }
    }
    let kept = lines.lines.len();
    let learned = file.learned;
    file.follow(&lines);
    let references = folder.join(REFERENCES);
    let is_there = |name: &String| reference_files::load(&references, name, &lens).is_ok();
    let named = file.in_use.references.len();
    file.in_use.references.retain(is_there);
    let is_relearned = file.learned < learned || 2 * file.in_use.references.len() < named;
    if is_relearned {
        file.in_use = InUse::default();
        // Nobody knows whether the camera stood as it does.
        entries(&folder.join(LEARNING)).iter().try_for_each(|path| remove(path))?;
        let reason = "the references were lost".into();
        let input = Input::Accepted { at: at_secs.round(), reason };
        lines.lines.push(StoreLine { input, in_use: None, seq: None, sum: None });
    }
    file.learned = lines.learned();
    if let Some(last) = lines.lines.last_mut() {
        last.in_use = Some(file.in_use.clone());
    }
    let mut text = String::new();
    for (seq, line) in lines.lines.into_iter().enumerate() {
        text.push_str(&line.text(seq)?);
    }
    if path.is_file() {
        copy(&path, &folder.join(DAMAGED_FILE), Overwrite::Allowed)?;
    }
    save(&path, text.as_bytes(), Overwrite::Allowed)?;
    file.save(folder)?;
    Ok(Recovered { lines: [kept, before - kept], is_relearned })
}

/// Lens, camera file and lines of a whole store.
fn whole(folder: &Path) -> anyhow::Result<(Lens, WatchFile, Lines)> {
    let Some(file) = Store::read(folder)? else { bail!(no_store(folder)) };
    let path = folder.join(LINES_FILE);
    let lens = file.lens.lens().with_context(|| format!("{:?}", folder.join(WATCH_FILE)))?;
    let lines = Lines::read(&path).map_err(|err| {
        // What a later version wrote isn't damaged, and can't be mended by this one.
        if err.is::<WrittenByNewer>() { err } else { err.context(way_out(folder)) }
    })?;
    let (named, there) = (file.learned, lines.learned());
    // Earlier versions named references in the camera file only.
    if there < named || (there > named && lines.in_use().is_none()) {
        let lacks = format!("{path:?} has {there} lines about learning instead of {named}");
        return Err(anyhow::Error::msg(lacks).context(way_out(folder)));
    }
    Ok((lens, file, lines))
}

fn way_out(folder: &Path) -> String {
    format!(
        "the store is damaged. Keep what is whole: boresight watch --recover --store {folder:?}"
    )
}

fn no_store(folder: &Path) -> String {
    format!("there is no watched camera in {folder:?}: name its folder with --store")
}

fn lock(folder: &Path) -> anyhow::Result<FileLock> {
    let lock = FileLock::try_for(&folder.join(WATCH_FILE))?;
    lock.with_context(|| {
        format!("another boresight is watching {folder:?}: wait, or stop it first")
    })
}

impl WatchFile {
    /// Takes the references from the lines; true if that changes something.
    fn follow(&mut self, lines: &Lines) -> bool {
        let in_use = lines.in_use().unwrap_or(&self.in_use).clone();
        let new = (lines.learned(), in_use);
        let is_new = (self.learned, &self.in_use) != (new.0, &new.1);
        (self.learned, self.in_use) = new;
        is_new
    }

    fn save(&self, folder: &Path) -> anyhow::Result<()> {
        save(&folder.join(WATCH_FILE), to_json(self)?.as_bytes(), Overwrite::Allowed)?;
        Ok(())
    }
}

fn to_json<T: Serialize>(value: &T) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}
