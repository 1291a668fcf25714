//! Store of a watched camera: a folder with `watch.json`, `watch.jsonl`, `references/` and, while
//! learning, `learning/`.
//!
//! Lines are appended and synced before being announced. References are written under new names,
//! then `watch.json` names them, then the old ones are removed: a power cut loses at most the
//! newest line.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use super::{
    reference_files::{self, ReferenceFiles},
    shelf::{LEARNING, PictureShelf},
};
use boresight_files::{
    Appending, LineReader, Links, Overwrite, TEXT_LIMIT, entries, make_folder, read_text, save,
    sync_folder,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensKind, LensMatrix, frame::ImageSize};
use boresight_watch::{Gallery, Input, Lens, Mask, Station};

/// Schema of `watch.json`.
const SCHEMA: &str = "boresight.watch/1";
/// Names in the folder.
pub(super) const WATCH_FILE: &str = "watch.json";
const LINES_FILE: &str = "watch.jsonl";
const ACCEPTED_FILE: &str = "accepted.jsonl";
const REFERENCES: &str = "references";
/// Maximum bytes of a line: `learned` holds every learning picture.
const LINE_LIMIT: u64 = 1 << 20;

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
    /// Boxes of text and logos: left, top, right, bottom, px.
    #[cfg_attr(feature = "schemas", schemars(with = "Vec<[u32; 4]>"))]
    pub text: Vec<[u32; 4]>,
    /// How often references have been learned: the number of `learned` lines that they belong to.
    pub learned: u64,
    /// True once the learning days are over.
    pub is_learned: bool,
    /// Names of the references in `references/`.
    pub references: Vec<String>,
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
    lines: Appending,
    shelf: PictureShelf,
    accepted: usize,
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
            text: Vec::new(),
            learned: 0,
            is_learned: false,
            references: Vec::new(),
        };
        save(&folder.join(WATCH_FILE), to_json(&file)?.as_bytes(), Overwrite::Never)?;
        Ok(())
    }

    /// Opens the store in `folder` for appending.
    ///
    /// # Errors
    ///
    /// If there is none, or if a line is damaged: the message names the line.
    pub fn open(folder: &Path) -> anyhow::Result<(Self, Stored)> {
        let Some(file) = Self::read(folder)? else {
            bail!("there is no {WATCH_FILE} in {folder:?}");
        };
        let lens = file.lens.lens().with_context(|| format!("{:?}", folder.join(WATCH_FILE)))?;
        let path = folder.join(LINES_FILE);
        let (inputs, whole_bytes, was_cut) = read_lines(&path)?;
        let mut lines = Appending::open(&path)?;
        if was_cut {
            lines.cut(whole_bytes)?;
        }
        let references = folder.join(REFERENCES);
        let mut gallery = Gallery::default();
        for name in &file.references {
            gallery.references.push(reference_files::load(&references, name, &lens)?);
        }
        let mut shelf = PictureShelf::at(folder, file.patches_only);
        let kept = shelf.kept();
        let is_learned_line =
            |input: &&Input| matches!(input, Input::Learned { .. } | Input::Accepted { .. });
        // References and line are written in sequence: after a crash between them, they are learned
        // again.
        let since = inputs.iter().filter(is_learned_line).count() as u64;
        let in_step = since == file.learned;
        let gallery = if in_step || !kept.is_empty() { gallery } else { Gallery::default() };
        let is_learned = file.is_learned && in_step;
        let known = (gallery, Mask { boxes: file.text.clone() });
        let station = Station::resumed(lens, known, is_learned, &kept, &mut shelf);
        let accepted = inputs.iter().filter(|i| matches!(i, Input::Accepted { .. })).count();
        let store = Self { folder: folder.to_path_buf(), file, lines, shelf, accepted };
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

    /// Appends inputs durably.
    ///
    /// # Errors
    ///
    /// If the inputs can't be written.
    pub fn record(&mut self, inputs: &[Input]) -> anyhow::Result<()> {
        let mut text = String::new();
        for input in inputs {
            text.push_str(&serde_json::to_string(input)?);
            text.push('\n');
        }
        self.lines.append(text.as_bytes())?;
        self.lines.sync()?;
        self.file.learned += inputs
            .iter()
            .filter(|i| matches!(i, Input::Learned { .. } | Input::Accepted { .. }))
            .count() as u64;
        Ok(())
    }

    /// Stores the references of `station`, and forgets the previous ones.
    ///
    /// # Errors
    ///
    /// If the references can't be written; the older ones are then still in use.
    pub fn save_references(&mut self, station: &Station) -> anyhow::Result<()> {
        let folder = self.folder.join(REFERENCES);
        let mut files = ReferenceFiles::new(&folder, self.file.learned, self.file.patches_only);
        let names = files.save(&station.gallery, &mut self.shelf)?;
        sync_folder(&folder)?;
        self.file.references = names;
        self.file.text.clone_from(&station.mask.boxes);
        self.file.is_learned = station.is_learned;
        save(&self.folder.join(WATCH_FILE), to_json(&self.file)?.as_bytes(), Overwrite::Allowed)?;
        reference_files::forget_others(&folder, &self.file.references)?;
        Ok(())
    }

    /// Acceptances by persons since the last call.
    ///
    /// # Errors
    ///
    /// If the file is damaged.
    pub fn newly_accepted(&mut self) -> anyhow::Result<Vec<Input>> {
        let lines = accepted_lines(&self.folder)?;
        let new = lines.get(self.accepted..).unwrap_or_default();
        let inputs =
            new.iter().map(|l| Input::Accepted { at: l.at, reason: l.reason.clone() }).collect();
        self.accepted = lines.len().max(self.accepted);
        Ok(inputs)
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
        bail!("there is no watched camera in {folder:?}: name its folder with --store");
    }
    let path = folder.join(ACCEPTED_FILE);
    let mut file = if path.is_file() { Appending::open(&path)? } else { Appending::create(&path)? };
    let line = serde_json::to_string(&AcceptedLine { at: at_secs.round(), reason: reason.into() })?;
    file.append(format!("{line}\n").as_bytes())?;
    file.sync()?;
    sync_folder(folder)?;
    Ok(())
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

/// Inputs of a store, size in bytes, and true if the last line was cut.
pub(super) fn read_lines(path: &Path) -> anyhow::Result<(Vec<Input>, u64, bool)> {
    let mut reader = LineReader::open(path, LINE_LIMIT, Links::Refused)?;
    let (mut line, mut inputs, mut bytes) = (Vec::new(), Vec::new(), 0);
    while reader.read(&mut line)? {
        if line.last() != Some(&b'\n') {
            return Ok((inputs, bytes, true));
        }
        let input = serde_json::from_slice(&line);
        inputs.push(
            input.with_context(|| format!("line {} of {path:?} is damaged", inputs.len() + 1))?,
        );
        bytes += line.len() as u64;
    }
    Ok((inputs, bytes, false))
}

/// Inputs of the store in `folder`, oldest first.
///
/// # Errors
///
/// If there is no store, or a line is damaged.
pub(super) fn inputs(folder: &Path) -> anyhow::Result<(Lens, Vec<Input>)> {
    let Some(file) = Store::read(folder)? else {
        bail!("there is no watched camera in {folder:?}: name its folder with --store");
    };
    let (inputs, _, _) = read_lines(&folder.join(LINES_FILE))?;
    Ok((file.lens.lens()?, inputs))
}

fn to_json<T: Serialize>(value: &T) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}
