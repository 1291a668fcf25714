//! Cuts the bytes of a pipe into pictures.
//!
//! | stream | a picture ends | sign of a torn picture |
//! |---|---|---|
//! | YUV4MPEG2 | after its bytes by the header | a mark within it, or no mark after it |
//! | JPEG | at its end marker | a start marker within it; [`crate::integrity`] of the data |
//! | PNG | after its last chunk | the checksum of each chunk |
//! | raw | after its bytes by the form | only an end within it: there are no marks |

use super::{
    still::{Still, StillEnd},
    what_it_is::what_it_is,
};
use crate::{Decompressor, PICTURE_LIMIT_PX, Pixels, RawForm, integrity::Flaw};
use boresight_geometry::frame::ImageSize;
use image::GrayImage;
use memchr::memmem::find;

/// Most bytes skipped before the first picture, such as words of a login.
const PREFACE_BYTES: usize = 4096;
/// Longest line of a header.
const LINE_BYTES: usize = 1024;
/// Most bytes of a picture.
const PICTURE_BYTES: usize = 1 << 28;
const STREAM_MARK: &[u8] = b"YUV4MPEG2 ";
const PICTURE_MARK: &[u8] = b"FRAME";
const MARK_LINE: &[u8] = b"FRAME\n";

/// Next item in the bytes so far.
#[derive(Debug)]
pub(super) enum Cut {
    /// A picture.
    Picture(Packed),
    /// A whole picture, unless followed by bytes other than the next picture's. Ask again after a
    /// moment.
    Ripe,
    /// An incomplete picture was left out.
    Torn,
    /// More bytes are needed.
    Nothing,
    /// No stream of readable pictures; a guess of its kind.
    Foreign(String),
}

/// A picture as received.
#[derive(Debug)]
pub(super) struct Packed {
    bytes: Vec<u8>,
    planes: Option<Planes>,
}

impl Packed {
    pub(super) fn unpack(&self, decompressor: &mut Decompressor) -> Result<GrayImage, Flaw> {
        match self.planes {
            Some(planes) => planes.pixels.unpack(&self.bytes, planes.size, 0),
            None => decompressor.picture(&self.bytes),
        }
    }

    /// Form of an uncompressed picture.
    pub(super) fn pixels(&self) -> Option<Pixels> {
        self.planes.map(|planes| planes.pixels)
    }
}

#[derive(Clone, Copy, Debug)]
struct Planes {
    size: ImageSize,
    pixels: Pixels,
    picture_bytes: usize,
    has_marks: bool,
}

#[derive(Debug)]
enum Kind {
    NotYet,
    Planes(Planes),
    Stills(Still),
}

/// Bytes of a stream without a whole picture yet.
#[derive(Debug)]
pub(super) struct Cutter {
    bytes: Vec<u8>,
    kind: Kind,
    interval_secs: Option<(u32, u32)>,
    /// True while skipping the rest of a torn picture.
    lost: bool,
}

impl Cutter {
    /// Cutter of a stream with a header, or of `raw` pictures.
    pub(super) fn new(raw: Option<&RawForm>) -> Self {
        let form = raw.and_then(|raw| Planes::of(raw.size, raw.pixels, false));
        // The rate may be any number; thousandths are exact enough to notice losses.
        let interval = |rate_hz: f64| (1000, (1000.0 * rate_hz).round() as u32);
        Self {
            bytes: Vec::new(),
            kind: form.map_or(Kind::NotYet, Kind::Planes),
            interval_secs: raw.and_then(|raw| raw.rate_hz).map(interval),
            lost: false,
        }
    }

    /// The bytes, to append new ones.
    pub(super) fn bytes(&mut self) -> &mut Vec<u8> {
        &mut self.bytes
    }

    /// Time from picture to picture as a fraction of a second, if stated by the stream.
    pub(super) fn interval_secs(&self) -> Option<(u32, u32)> {
        self.interval_secs
    }

    /// Takes the next picture. `rests` is true if the bytes have ended, or no more came for a
    /// moment.
    pub(super) fn cut(&mut self, rests: bool) -> Cut {
        loop {
            match &mut self.kind {
                Kind::NotYet => {
                    if let Some(cut) = self.begin(rests) {
                        return cut;
                    }
                }
                Kind::Planes(planes) => {
                    let planes = *planes;
                    if let Some(cut) = self.cut_planes(planes, rests) {
                        return cut;
                    }
                }
                Kind::Stills(still) => {
                    let end = still.end(&self.bytes);
                    return match end {
                        StillEnd::NotYet if self.bytes.len() > PICTURE_BYTES => {
                            self.bytes.clear();
                            *still = Still::default();
                            Cut::Torn
                        }
                        StillEnd::NotYet => Cut::Nothing,
                        StillEnd::Between { to } => {
                            self.skip(to);
                            Cut::Nothing
                        }
                        StillEnd::Whole { from, to } => {
                            let bytes = self.bytes[from..to].to_vec();
                            self.skip(to);
                            Cut::Picture(Packed { bytes, planes: None })
                        }
                        StillEnd::Torn { resume } => {
                            self.skip(resume);
                            Cut::Torn
                        }
                    };
                }
            }
        }
    }

    /// Drops an incomplete picture, because no more bytes come; false if there is none.
    pub(super) fn give_up(&mut self) -> bool {
        let count = match &mut self.kind {
            Kind::Stills(still) => still.give_up(&self.bytes),
            Kind::NotYet | Kind::Planes(_) => Some(self.bytes.len()).filter(|count| *count > 0),
        };
        self.skip(count.unwrap_or(0));
        count.is_some()
    }

    fn skip(&mut self, count: usize) {
        self.bytes.drain(..count.min(self.bytes.len()));
    }

    /// Finds the beginning of a stream. `None` if found.
    fn begin(&mut self, ended: bool) -> Option<Cut> {
        let start = (0..self.bytes.len().min(PREFACE_BYTES)).find(|at| {
            let rest = &self.bytes[*at..];
            rest.starts_with(STREAM_MARK) || Still::begins(rest)
        });
        let Some(start) = start else {
            let is_foreign = self.bytes.len() >= PREFACE_BYTES || (ended && !self.bytes.is_empty());
            return Some(if is_foreign {
                Cut::Foreign(what_it_is(&self.bytes))
            } else {
                Cut::Nothing
            });
        };
        if Still::begins(&self.bytes[start..]) {
            self.skip(start);
            self.kind = Kind::Stills(Still::default());
            return None;
        }
        let line = &self.bytes[start..];
        let line = &line[..line.len().min(LINE_BYTES)];
        let Some(end) = line.iter().position(|byte| *byte == b'\n') else {
            return Some(if line.len() == LINE_BYTES {
                Cut::Foreign("the header of its YUV4MPEG2 has no end".into())
            } else {
                Cut::Nothing
            });
        };
        let header = String::from_utf8_lossy(&line[..end]).into_owned();
        match stream_header(&header) {
            Ok((planes, interval)) => {
                self.kind = Kind::Planes(planes);
                self.interval_secs = interval.or(self.interval_secs);
                self.skip(start + end + 1);
                None
            }
            Err(what) => Some(Cut::Foreign(what)),
        }
    }

    /// The next uncompressed picture; `None` if a new stream has begun instead.
    fn cut_planes(&mut self, planes: Planes, rests: bool) -> Option<Cut> {
        if !planes.has_marks {
            if self.bytes.len() < planes.picture_bytes {
                return Some(Cut::Nothing);
            }
            return Some(self.picture(planes, 0));
        }
        if self.bytes.len() < STREAM_MARK.len() {
            return Some(Cut::Nothing);
        }
        if self.bytes.starts_with(STREAM_MARK) {
            self.kind = Kind::NotYet;
            return None;
        }
        if !self.bytes.starts_with(PICTURE_MARK) {
            return Some(self.find_mark(0));
        }
        let line = &self.bytes[..self.bytes.len().min(LINE_BYTES)];
        let Some(mark) = line.iter().position(|byte| *byte == b'\n') else {
            return Some(if line.len() == LINE_BYTES { self.find_mark(1) } else { Cut::Nothing });
        };
        let begin = mark + 1;
        let Some(picture) = self.bytes.get(begin..begin + planes.picture_bytes) else {
            return Some(Cut::Nothing);
        };
        // Bytes are missing if the next picture begins within this one.
        if let Some(inside) = find(picture, MARK_LINE) {
            self.skip(begin + inside);
            self.lost = false;
            return Some(Cut::Torn);
        }
        let after = &self.bytes[begin + planes.picture_bytes..];
        let goes_on = |mark: &[u8]| {
            let known = after.len().min(mark.len());
            after[..known] == mark[..known]
        };
        if !goes_on(PICTURE_MARK) && !goes_on(STREAM_MARK) {
            // Bytes too many, somewhere in it.
            return Some(self.find_mark(begin + planes.picture_bytes));
        }
        if after.is_empty() && !rests {
            return Some(Cut::Ripe);
        }
        self.lost = false;
        Some(self.picture(planes, begin))
    }

    fn picture(&mut self, planes: Planes, begin: usize) -> Cut {
        let bytes = self.bytes[begin..begin + planes.picture_bytes].to_vec();
        self.skip(begin + planes.picture_bytes);
        Cut::Picture(Packed { bytes, planes: Some(planes) })
    }

    /// Advances to the next mark from `from` on; a torn picture is reported once.
    fn find_mark(&mut self, from: usize) -> Cut {
        let is_new = !std::mem::replace(&mut self.lost, true);
        match find(&self.bytes[from..], MARK_LINE) {
            Some(at) => {
                self.skip(from + at);
                // Whole pictures follow.
                self.lost = false;
                if is_new { Cut::Torn } else { self.cut(false) }
            }
            None => {
                // The mark may have begun.
                let kept = MARK_LINE.len() - 1;
                self.skip(self.bytes.len().saturating_sub(kept).max(from.min(self.bytes.len())));
                if is_new { Cut::Torn } else { Cut::Nothing }
            }
        }
    }
}

impl Planes {
    fn of(size: ImageSize, pixels: Pixels, has_marks: bool) -> Option<Self> {
        let picture_bytes =
            pixels.picture_bytes(size).filter(|bytes| (1..=PICTURE_BYTES).contains(bytes))?;
        Some(Self { size, pixels, picture_bytes, has_marks })
    }
}

/// Form of the pictures after a header such as `YUV4MPEG2 W640 H480 F30:1 Ip A1:1 C420jpeg`, and
/// the interval.
fn stream_header(line: &str) -> Result<(Planes, Option<(u32, u32)>), String> {
    let word = |letter: char| {
        let mut words = line.split_ascii_whitespace().skip(1);
        words.find_map(|word| word.strip_prefix(letter))
    };
    let side = |letter| {
        let side = word(letter).and_then(|text| text.parse().ok());
        side.filter(|side| (1..=PICTURE_LIMIT_PX).contains(side))
    };
    let (Some(width_px), Some(height_px)) = (side('W'), side('H')) else {
        return Err("its YUV4MPEG2 states no size".into());
    };
    let tag = word('C').unwrap_or("420");
    let planes = Pixels::of_yuv4mpeg(tag)
        .and_then(|pixels| Planes::of(ImageSize { width_px, height_px }, pixels, true));
    let planes = planes.ok_or_else(|| {
        let tag: String = tag.chars().take(20).collect();
        format!("its YUV4MPEG2 is in {tag:?}, which can't be read")
    })?;
    if word('I').is_some_and(|interlacing| !matches!(interlacing, "p" | "?")) {
        return Err(
            "its YUV4MPEG2 is interlaced: half of each picture is older than the other".into()
        );
    }
    let interval = word('F').and_then(|rate| {
        let (times, secs) = rate.split_once(':')?;
        let (times, secs) = (times.parse().ok()?, secs.parse().ok()?);
        (times > 0 && secs > 0).then_some((secs, times))
    });
    Ok((planes, interval))
}
