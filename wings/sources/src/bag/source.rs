//! The pictures of a bag as a frame source.

use std::{
    collections::{BTreeMap, VecDeque},
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use image::GrayImage;

use super::{
    files::{Storage, plain_message},
    message::{Kind, Message, Pictures},
};
use boresight_capture::{
    Arrival, BagFlaw, CaptureError, FrameSource, RosFlaw, SourceIdentity, bag_files, guarded,
};
use boresight_geometry::frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize};

/// Opens the bag at `path`, a file or a folder of ROS 2, and reads the first picture. `topic` is
/// the topic of the pictures; by default, the only one with pictures. Pictures have the times in
/// their headers, or else those of the recording.
///
/// # Errors
///
/// [`CaptureError::Bag`] if it can't be read, has no such topic, or several and none was named.
/// [`CaptureError::GaveUp`] if a library gives up.
pub fn open_bag(path: &Path, topic: Option<&str>) -> Result<Box<dyn FrameSource>, CaptureError> {
    guarded(&path.display().to_string(), || Ok(Box::new(Bag::open(path, topic)?)))
}

/// A recorded bag.
struct Bag {
    path: PathBuf,
    topic: String,
    files: VecDeque<PathBuf>,
    storage: Option<Storage>,
    images: Pictures,
    size: ImageSize,
    /// The first picture, until delivered.
    in_hand: Option<Stamped>,
    first_nanos: Option<u64>,
    last_nanos: u64,
    /// Number of messages so far, and of those without a whole picture.
    count: u64,
    torn: u64,
    ended: bool,
}

/// A picture with number and time.
struct Stamped {
    id: u64,
    nanos: u64,
    image: GrayImage,
}

impl Bag {
    fn open(path: &Path, topic: Option<&str>) -> Result<Self, CaptureError> {
        let failed = |flaw| CaptureError::Bag { flaw, path: path.into() };
        let files =
            bag_files(path).map_err(|source| CaptureError::Read { source, path: path.into() })?;
        let (topic, kind) = chosen(&files, topic).map_err(failed)?;
        let mut bag = Self {
            path: path.into(),
            topic,
            files: files.into(),
            storage: None,
            images: Pictures::new(kind),
            size: ImageSize { width_px: 0, height_px: 0 },
            in_hand: None,
            first_nanos: None,
            last_nanos: 0,
            count: 0,
            torn: 0,
            ended: false,
        };
        let mut flaw = None;
        let Some(first) = bag.next(&mut flaw).map_err(|flaw| failed(flaw.at_the_start()))? else {
            let topic = bag.topic;
            return Err(failed(match flaw {
                Some(flaw) => BagFlaw::NoPicture { topic, flaw },
                None => BagFlaw::Silent(topic),
            }));
        };
        bag.size = ImageSize::of(&first.image);
        bag.in_hand = Some(first);
        Ok(bag)
    }

    /// The next whole picture; `None` at the end. Notes the first flaw of a message.
    fn next(&mut self, first_flaw: &mut Option<RosFlaw>) -> Result<Option<Stamped>, BagFlaw> {
        while let Some(message) = self.message()? {
            let id = self.count;
            self.count += 1;
            let data = plain_message(message.data);
            match self.images.read(&data) {
                Ok((stamp_nanos, image)) => {
                    let nanos = stamp_nanos.unwrap_or(message.log_nanos);
                    return Ok(Some(Stamped { id, nanos, image }));
                }
                Err(flaw) => {
                    self.torn += 1;
                    first_flaw.get_or_insert(flaw);
                }
            }
        }
        Ok(None)
    }

    fn message(&mut self) -> Result<Option<Message>, BagFlaw> {
        loop {
            let damaged = |how| BagFlaw::Damaged { count: self.count - self.torn, how };
            if let Some(storage) = &mut self.storage {
                if let Some(message) = storage.next().map_err(damaged)? {
                    return Ok(Some(message));
                }
                self.storage = None;
            }
            let Some(file) = self.files.pop_front() else { return Ok(None) };
            let mut storage = Storage::open(&file).map_err(damaged)?;
            storage.choose(&self.topic).map_err(damaged)?;
            self.storage = Some(storage);
        }
    }
}

/// The topic `asked`, or the only topic with pictures, in `files`.
pub(super) fn chosen(files: &[PathBuf], asked: Option<&str>) -> Result<(String, Kind), BagFlaw> {
    let (mut pictures, mut others) = (BTreeMap::new(), BTreeMap::new());
    let mut broken = None;
    for file in files {
        match Storage::open(file).and_then(|storage| storage.topics()) {
            Ok(topics) => {
                for topic in topics {
                    if let Some(kind) = topic.kind {
                        pictures.insert(topic.name, kind);
                    } else {
                        others.insert(topic.name, topic.type_name);
                    }
                }
            }
            Err(how) => broken = Some(how),
        }
    }
    let names = || pictures.keys().cloned().collect();
    let named = |(name, kind): (&String, &Kind)| (name.clone(), *kind);
    match (asked, pictures.len()) {
        (_, 0) => Err(match broken {
            Some(how) => BagFlaw::Unreadable(how),
            None => {
                let line = |(name, kind): (&String, &String)| format!("{name} ({kind})");
                BagFlaw::NoPictures(others.iter().map(line).collect())
            }
        }),
        (None, 1) => pictures.iter().next().map(named).ok_or(BagFlaw::NoPictures(Vec::new())),
        (None, _) => Err(BagFlaw::Several(names())),
        (Some(asked), _) => pictures
            .get_key_value(asked)
            .map(named)
            .ok_or_else(|| BagFlaw::NoSuchTopic { asked: asked.into(), have: names() }),
    }
}

impl FrameSource for Bag {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: self.path.display().to_string(), image_size: Some(self.size) }
    }

    fn next_frame(&mut self, _patience: Duration) -> Result<Arrival, CaptureError> {
        if self.ended {
            return Ok(Arrival::End);
        }
        let next = match self.in_hand.take() {
            Some(first) => Ok(Some(first)),
            None => self.next(&mut None),
        };
        let flaw = match next {
            Ok(Some(Stamped { id, nanos, image })) => {
                let since_first = nanos.saturating_sub(*self.first_nanos.get_or_insert(nanos));
                self.last_nanos = (since_first + 1).max(self.last_nanos + 1);
                let captured_at = CaptureTime { nanos: self.last_nanos };
                let (id, kind, name) = (FrameId(id), FrameKind::Video, String::new());
                let frame = Frame { id, captured_at, kind, name, image };
                return Ok(Arrival::Frame(Arc::new(frame)));
            }
            Ok(None) if self.torn == 0 => return Ok(Arrival::End),
            Ok(None) => BagFlaw::Torn { torn: self.torn, count: self.count },
            Err(flaw) => flaw,
        };
        self.ended = true;
        Err(CaptureError::Bag { flaw, path: self.path.clone() })
    }
}
