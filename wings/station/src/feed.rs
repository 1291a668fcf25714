//! Pictures of a watched camera: from files, growing folders, recordings, cameras and streams.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use image::GrayImage;

use super::times::{PictureTime, changed_secs, now_secs, picture_time};
use crate::street::Street;
use boresight_app::{Announcer, session::source::SourceName};
use boresight_capture::{Arrival, CaptureError, FrameSource, is_picture, read_picture};
use boresight_files::{entries, is_same_file};
use boresight_geometry::device::{CameraEvent, Fault};
use boresight_present::text::is_simulated;
use boresight_run::config::Config;
use boresight_watch::Lens;

/// Pictures in a burst from a live source, and burst duration.
const BURST: usize = 8;
const BURST_TIME: Duration = Duration::from_secs(2);
/// Longest wait for the first picture of a live source, and the settling time of the exposure.
const FIRST_PICTURE: Duration = Duration::from_secs(20);
const SETTLES: Duration = Duration::from_secs(2);
/// Time by which a picture may be ahead of this computer: clocks of other zones are.
const AHEAD_SECS: f64 = 86_400.0;

/// Name of the simulated fixed camera; planted changes follow after a colon.
const STREET: &str = "sim:street";

/// Origin of a camera's pictures.
#[derive(Clone, Debug)]
pub enum Feed {
    /// Files, in the order of time.
    Files(Vec<PathBuf>),
    /// A folder filled by a camera.
    Folder(PathBuf),
    /// A source with own pictures: a video file, a recorded session, a simulation.
    Recorded(SourceName),
    /// A camera or stream.
    Live(SourceName),
    /// The simulated fixed camera, as fast as the machine.
    Street(Box<Street>),
    /// An absent source, such as a folder on an unmounted disk: its name, and its settings.
    Away(String, Box<Config>),
}

/// A picture in a file.
#[derive(Clone, Debug)]
pub(super) struct PictureFile {
    /// Time of the picture, seconds since 1970.
    pub(super) at_secs: f64,
    pub(super) path: PathBuf,
    /// Previous picture.
    before: Option<PathBuf>,
}

/// New pictures in files.
#[derive(Clone, Debug)]
pub(super) struct NewFiles {
    /// Pictures, oldest first.
    pub(super) files: Vec<PictureFile>,
    /// Arrival of the newest picture whose time is still to come, seconds since 1970.
    pub(super) ahead_came_secs: Option<f64>,
}

/// Time of a picture, or of a missing one.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Seconds since 1970.
    pub at_secs: f64,
    /// True if a later picture has already been looked at.
    pub is_late: bool,
}

impl Taken {
    /// On-time picture at `at_secs`.
    pub fn at(at_secs: f64) -> Self {
        Self { at_secs, is_late: false }
    }
}

/// Pictures of a moment.
#[derive(Debug)]
pub struct Moment {
    /// Time of the pictures.
    pub taken: Taken,
    /// A single picture, or a burst.
    pub burst: Vec<GrayImage>,
}

impl Feed {
    /// Parses the names of a source: files, or a single folder, video, session, camera or stream.
    ///
    /// # Errors
    ///
    /// As [`SourceName::parse`].
    pub fn parse(names: &[String], config: &Config, announcer: &Announcer) -> anyhow::Result<Self> {
        let [name] = names else {
            if names.is_empty() {
                bail!("name a source: a folder of pictures, a camera or a stream");
            }
            return Ok(Self::Files(names.iter().map(PathBuf::from).collect()));
        };
        let path = PathBuf::from(name);
        if is_picture(&path) {
            return Ok(Self::Files(vec![path]));
        }
        if let Some(rest) = name.strip_prefix(STREET) {
            let street = Street::parse(rest.strip_prefix(':').unwrap_or(rest))?;
            return Ok(Self::Street(Box::new(street)));
        }
        match SourceName::parse(name, config, announcer)? {
            SourceName::Folder(folder, _) => Ok(Self::Folder(folder)),
            source @ SourceName::Camera(_) => Ok(Self::Live(source)),
            source @ SourceName::Video(_) if !path.is_file() => Ok(Self::Live(source)),
            source => Ok(Self::Recorded(source)),
        }
    }

    /// Parses as [`Self::parse`], but allows an absent source: every look searches for it.
    ///
    /// # Errors
    ///
    /// As [`Self::parse`] for a simulation, which is never away.
    pub fn parse_or_away(
        names: &[String],
        config: &Config,
        announcer: &Announcer,
    ) -> anyhow::Result<Self> {
        match (Self::parse(names, config, announcer), names) {
            (Err(_), [name]) if !is_simulated(name) => {
                Ok(Self::Away(name.clone(), Box::new(config.clone())))
            }
            (parsed, _) => parsed,
        }
    }

    /// True for files and recordings, readable all at once.
    pub fn is_recorded(&self) -> bool {
        !matches!(self, Self::Live(_))
    }

    /// Pictures with times, if the source is files.
    pub(super) fn stills(&self) -> Option<Vec<(f64, PathBuf)>> {
        let is_files = matches!(self, Self::Files(_) | Self::Folder(_));
        let all = || self.new_files(|_| false).files.into_iter();
        is_files.then(|| all().map(|file| (file.at_secs, file.path)).collect())
    }

    /// Opens a camera, stream or recording; a simulated street needs no source.
    ///
    /// # Errors
    ///
    /// If the source can't be opened.
    pub(super) fn open(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        match self {
            Self::Live(name) | Self::Recorded(name) => Ok(name.open(Some(u64::MAX))?.source),
            Self::Files(_) | Self::Folder(_) | Self::Street(_) | Self::Away(..) => {
                bail!("name a camera or a stream: a camera is pushed back while it's watched")
            }
        }
    }

    /// Lens known to the source: that of a simulation.
    pub fn own_lens(&self) -> Option<Lens> {
        match self {
            Self::Street(street) => Some(Lens::new(street.camera, None, street.image_size)),
            _ => None,
        }
    }

    /// Files with seconds not `known`, oldest first. A file deleted since the listing gets the
    /// present time, and can't be read. In a folder of files whose names tell the time, others are
    /// passed over: a `latest.jpg` is one of them again.
    pub(super) fn new_files(&self, known: impl Fn(i64) -> bool) -> NewFiles {
        let paths = match self {
            Self::Files(paths) => paths.clone(),
            Self::Folder(folder) => {
                entries(folder).into_iter().filter(|path| is_picture(path)).collect()
            }
            Self::Recorded(_) | Self::Live(_) | Self::Street(_) | Self::Away(..) => Vec::new(),
        };
        let now = now_secs();
        let with_time = |path: PathBuf| {
            let unknown = PictureTime { secs: now, is_named: false };
            (picture_time(&path).unwrap_or(unknown), path)
        };
        let mut files: Vec<(PictureTime, PathBuf)> = paths.into_iter().map(with_time).collect();
        if matches!(self, Self::Folder(_)) && files.iter().any(|(time, _)| time.is_named) {
            files.retain(|(time, _)| time.is_named);
        }
        let (mut files, ahead): (Vec<_>, Vec<_>) =
            files.into_iter().partition(|(time, _)| time.secs <= now + AHEAD_SECS);
        files.sort_by(|a, b| a.0.secs.total_cmp(&b.0.secs));
        let before = |place: usize| Some(files.get(place.checked_sub(1)?)?.1.clone());
        let new =
            files.iter().enumerate().filter(|(_, (time, _))| !known(time.secs.round() as i64));
        let new = new.map(|(place, (time, path))| PictureFile {
            at_secs: time.secs,
            path: path.clone(),
            before: before(place),
        });
        let came = ahead.iter().filter_map(|(_, path)| changed_secs(path).ok());
        NewFiles { files: new.collect(), ahead_came_secs: came.reduce(f64::max) }
    }

    /// Hands the pictures of a recorded source to `take`, every `every_secs` of source time, with
    /// times since `began_secs`. Ends when `take` says so.
    ///
    /// # Errors
    ///
    /// If the source can't be read, or the error of `take`.
    pub fn play(
        &self,
        began_secs: f64,
        every_secs: f64,
        mut take: impl FnMut(Moment) -> anyhow::Result<bool>,
    ) -> anyhow::Result<()> {
        let Self::Recorded(name) = self else { return Ok(()) };
        let mut source = name.open(Some(u64::MAX))?.source;
        let (mut first, mut last) = (None, f64::NEG_INFINITY);
        loop {
            let frame = match source.next_frame(FIRST_PICTURE)? {
                Arrival::Frame(frame) => frame,
                Arrival::End => return Ok(()),
                Arrival::Event(_) | Arrival::NothingYet => continue,
            };
            let first = *first.get_or_insert(frame.captured_at);
            let at = frame.captured_at.secs_since(first);
            if at - last < every_secs {
                continue;
            }
            last = at;
            let moment =
                Moment { taken: Taken::at(began_secs + at), burst: vec![frame.image.clone()] };
            if !take(moment)? {
                return Ok(());
            }
        }
    }

    /// Opens a live source, takes a burst, and closes the source.
    ///
    /// # Errors
    ///
    /// If no picture comes.
    pub fn burst(&self) -> anyhow::Result<Moment> {
        let Self::Live(name) = self else { bail!("this source isn't live") };
        let mut source = name.open(Some(u64::MAX))?.source;
        let began = Instant::now();
        let first = next(&mut *source, began + FIRST_PICTURE)?;
        let settled = Instant::now() + SETTLES;
        let mut burst = vec![first];
        while Instant::now() < settled {
            burst[0] = next(&mut *source, Instant::now() + FIRST_PICTURE)?;
        }
        let at_secs = now_secs();
        for n in 1..BURST {
            let due = settled + BURST_TIME * n as u32 / BURST as u32;
            let mut newest = None;
            while newest.is_none() || Instant::now() < due {
                newest = Some(next(&mut *source, Instant::now() + FIRST_PICTURE)?);
            }
            burst.extend(newest);
        }
        Ok(Moment { taken: Taken::at(at_secs), burst })
    }
}

fn next(source: &mut dyn FrameSource, until: Instant) -> anyhow::Result<GrayImage> {
    loop {
        match source.next_frame(Duration::from_millis(100))? {
            Arrival::Frame(frame) => return Ok(frame.image.clone()),
            Arrival::End => bail!("the source has ended"),
            Arrival::Event(
                CameraEvent::Lost { fault, detail } | CameraEvent::Doubtful { fault, detail },
            ) if [Fault::Frozen, Fault::NotLoggedIn, Fault::Unreachable].contains(&fault) => {
                return Err(CaptureError::Camera { fault, detail }.into());
            }
            Arrival::Event(_) | Arrival::NothingYet if Instant::now() < until => {}
            Arrival::Event(_) | Arrival::NothingYet => bail!("no picture came in time"),
        }
    }
}

/// Reads a picture's file.
///
/// # Errors
///
/// If unreadable, or a copy of the previous picture: no camera repeats a picture exactly.
pub(super) fn read_moment(taken: Taken, file: &PictureFile) -> anyhow::Result<Moment> {
    let PictureFile { path, before, .. } = file;
    if let Some(before) = before.as_ref().filter(|before| is_same_file(path, before)) {
        let again = format!("{path:?} is {before:?} again, byte for byte");
        return Err(CaptureError::Camera { fault: Fault::Frozen, detail: again }.into());
    }
    let grey = read_picture(path).with_context(|| format!("{path:?}"))?;
    Ok(Moment { taken, burst: vec![grey] })
}
