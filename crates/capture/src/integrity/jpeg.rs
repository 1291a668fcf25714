//! Frames of a motion-JPEG camera: headers, and the expected contents of the scan.

use std::borrow::Cow;

use super::{
    Flaw,
    huffman::{MeanTable, StepTable, TableSpec, standard, standard_segments},
    scan::{Expected, LARGEST_MEAN, Part, Scratch, walk},
};
use boresight_geometry::frame::ImageSize;

/// Most padding bytes between the scan and the end, as in every frame of some cameras.
const TRAILING_PADDING_BYTES: usize = 16;
/// Number of consecutive padded frames to count as a habit.
const PADDED_FRAMES_TO_LEARN: u32 = 5;

/// Checks the frames of a stream. Learns if the camera pads its frames.
#[derive(Clone, Debug, Default)]
pub struct JpegGate {
    padded_in_a_row: u32,
    pads: bool,
    tables: Tables,
    scratch: Scratch,
}

/// A whole frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checked<'a> {
    /// The frame, complete for any decoder: with Huffman tables, from start to end.
    pub bytes: Cow<'a, [u8]>,
    /// True if the tables had to be inserted.
    pub lacked_tables: bool,
}

impl JpegGate {
    /// Size in the headers of a JPEG.
    ///
    /// # Errors
    ///
    /// [`Flaw`] if the headers aren't those of a camera's JPEG.
    pub fn size(bytes: &[u8]) -> Result<ImageSize, Flaw> {
        Headers::read(bytes).map(|headers| headers.size)
    }

    /// JPEG with the standard Huffman tables if a camera's JPEG in `bytes` has none.
    pub fn with_tables(mut bytes: Vec<u8>) -> Vec<u8> {
        if let Ok(headers) = Headers::read(&bytes)
            && headers.tables.is_empty()
        {
            let at = headers.scan_header_at;
            bytes.splice(at..at, standard_segments());
        }
        bytes
    }

    /// Checks that `bytes`, all of one frame, are a whole JPEG of `size`.
    ///
    /// # Errors
    ///
    /// The first [`Flaw`].
    pub fn check<'a>(&mut self, bytes: &'a [u8], size: ImageSize) -> Result<Checked<'a>, Flaw> {
        let headers = Headers::read(bytes)?;
        self.tables.become_those_of(&headers.tables)?;
        if headers.size != size {
            return Err(Flaw::OtherSize);
        }
        let end =
            walk(bytes, headers.scan_at, &headers.expected(&self.tables)?, &mut self.scratch)?;
        self.judge_surplus(end.surplus)?;
        let whole = &bytes[..end.marker_at + 2];
        let lacked_tables = headers.tables.is_empty();
        if !lacked_tables && end.surplus == 0 {
            return Ok(Checked { bytes: Cow::Borrowed(whole), lacked_tables });
        }
        let mut mended = Vec::with_capacity(whole.len() + 420);
        mended.extend_from_slice(&bytes[..headers.scan_header_at]);
        if lacked_tables {
            mended.extend(standard_segments());
        }
        mended.extend_from_slice(&bytes[headers.scan_header_at..end.marker_at - end.surplus]);
        mended.extend([0xFF, 0xD9]);
        Ok(Checked { bytes: Cow::Owned(mended), lacked_tables })
    }

    /// Judges bytes after the last block: a camera's habit, or the sign of a joined frame.
    fn judge_surplus(&mut self, surplus: usize) -> Result<(), Flaw> {
        if surplus == 0 {
            self.padded_in_a_row = 0;
            return Ok(());
        }
        if surplus <= TRAILING_PADDING_BYTES {
            self.padded_in_a_row += 1;
            self.pads |= self.padded_in_a_row >= PADDED_FRAMES_TO_LEARN;
            if self.pads {
                return Ok(());
            }
        }
        Err(Flaw::SurplusScan)
    }
}

#[derive(Debug)]
struct Headers {
    size: ImageSize,
    components: Vec<Component>,
    dc_steps: [Option<u16>; 4],
    /// Bodies of the table segments.
    tables: Vec<u8>,
    restart_every: u32,
    scan_header_at: usize,
    scan_at: usize,
}

#[derive(Clone, Copy, Debug)]
struct Component {
    id: u8,
    across: u32,
    down: u32,
    steps: usize,
    dc: usize,
    ac: usize,
}

impl Headers {
    fn read(bytes: &[u8]) -> Result<Self, Flaw> {
        if bytes.is_empty() {
            return Err(Flaw::Empty);
        }
        if !bytes.starts_with(&[0xFF, 0xD8]) {
            return Err(Flaw::NoStart);
        }
        let mut headers = Self {
            size: ImageSize { width_px: 0, height_px: 0 },
            components: Vec::new(),
            dc_steps: [None; 4],
            tables: Vec::new(),
            restart_every: 0,
            scan_header_at: 0,
            scan_at: 0,
        };
        let mut at = 2;
        loop {
            let (marker, body, next) = segment(bytes, at)?;
            match marker {
                0xC0 | 0xC1 => headers.read_frame(body)?,
                0xC4 => headers.tables.extend_from_slice(body),
                0xDB => headers.read_steps(body)?,
                0xDD => {
                    let &[high, low] = body else { return Err(Flaw::BadHeader) };
                    headers.restart_every = u16::from_be_bytes([high, low]).into();
                }
                0xDA => {
                    headers.read_scan(body)?;
                    (headers.scan_header_at, headers.scan_at) = (at, next);
                    break;
                }
                // Application data and comments.
                0xE0..=0xEF | 0xFE => {}
                // Other kinds of JPEG, or no header at all.
                _ => return Err(Flaw::BadHeader),
            }
            at = next;
        }
        Ok(headers)
    }

    fn read_frame(&mut self, body: &[u8]) -> Result<(), Flaw> {
        let (&[8, h1, h0, w1, w0, count], components) =
            body.split_first_chunk::<6>().ok_or(Flaw::BadHeader)?
        else {
            return Err(Flaw::BadHeader);
        };
        let known = !self.components.is_empty();
        if known || !(1..=4).contains(&count) || components.len() != 3 * usize::from(count) {
            return Err(Flaw::BadHeader);
        }
        self.size = ImageSize {
            width_px: u16::from_be_bytes([w1, w0]).into(),
            height_px: u16::from_be_bytes([h1, h0]).into(),
        };
        for part in components.chunks_exact(3) {
            let (across, down) = (u32::from(part[1] >> 4), u32::from(part[1] & 15));
            let steps = usize::from(part[2]);
            if !(1..=4).contains(&across) || !(1..=4).contains(&down) || steps > 3 {
                return Err(Flaw::BadHeader);
            }
            self.components.push(Component { id: part[0], across, down, steps, dc: 0, ac: 0 });
        }
        Ok(())
    }

    /// Reads the quantization step of the first coefficient; no other matters here.
    fn read_steps(&mut self, mut body: &[u8]) -> Result<(), Flaw> {
        while let Some((&place, rest)) = body.split_first() {
            let wide = place >> 4 == 1;
            let length = if wide { 128 } else { 64 };
            let values = rest.get(..length).ok_or(Flaw::BadHeader)?;
            let step =
                if wide { u16::from_be_bytes([values[0], values[1]]) } else { values[0].into() };
            *self.dc_steps.get_mut(usize::from(place & 15)).ok_or(Flaw::BadHeader)? = Some(step);
            body = &rest[length..];
        }
        Ok(())
    }

    /// Reads the scan header. A camera sends all components in a single scan.
    fn read_scan(&mut self, body: &[u8]) -> Result<(), Flaw> {
        let (&count, rest) = body.split_first().ok_or(Flaw::BadHeader)?;
        let count = usize::from(count);
        if count != self.components.len() || rest.len() != 2 * count + 3 {
            return Err(Flaw::BadHeader);
        }
        for (component, part) in self.components.iter_mut().zip(rest.chunks_exact(2)) {
            if component.id != part[0] {
                return Err(Flaw::BadHeader);
            }
            (component.dc, component.ac) = (usize::from(part[1] >> 4), usize::from(part[1] & 15));
        }
        if rest[2 * count..] != [0, 63, 0] { Err(Flaw::BadHeader) } else { Ok(()) }
    }

    fn expected<'a>(&self, tables: &'a Tables) -> Result<Expected<'a>, Flaw> {
        let widest = self.components.iter().map(|c| c.across).max().unwrap_or(1);
        let tallest = self.components.iter().map(|c| c.down).max().unwrap_or(1);
        let single = self.components.len() == 1;
        let (unit_width, unit_height) = if single { (8, 8) } else { (8 * widest, 8 * tallest) };
        let part = |component: &Component| {
            let means = tables.means.get(component.dc).and_then(Option::as_ref);
            let steps = tables.steps.get(component.ac).and_then(Option::as_ref);
            let mean_step = i32::from(self.dc_steps[component.steps].ok_or(Flaw::BadHeader)?);
            if mean_step == 0 {
                return Err(Flaw::BadHeader);
            }
            Ok(Part {
                means: means.ok_or(Flaw::BadHeader)?,
                steps: steps.ok_or(Flaw::BadHeader)?,
                across: if single { 1 } else { component.across },
                down: if single { 1 } else { component.down },
                mean_step,
                largest_mean: LARGEST_MEAN / mean_step + 1,
            })
        };
        Ok(Expected {
            parts: self.components.iter().map(part).collect::<Result<_, _>>()?,
            columns: self.size.width_px.div_ceil(unit_width),
            rows: self.size.height_px.div_ceil(unit_height),
            restart_every: self.restart_every,
            zeros_are_foreign: !tables.unusual,
        })
    }
}

/// Huffman tables, kept until a frame has different ones.
#[derive(Clone, Debug, Default)]
struct Tables {
    /// Bodies of the segments behind the tables; `None` before the first frame.
    from: Option<Vec<u8>>,
    means: [Option<MeanTable>; 4],
    steps: [Option<StepTable>; 4],
    /// True if any table is not a standard one.
    unusual: bool,
}

impl Tables {
    /// Takes over the tables defined by `bodies`, or the standard tables if `bodies` is empty.
    fn become_those_of(&mut self, bodies: &[u8]) -> Result<(), Flaw> {
        if self.from.as_deref() == Some(bodies) {
            return Ok(());
        }
        *self = Self::default();
        let standard = standard();
        if bodies.is_empty() {
            for (place, spec) in &standard {
                self.set(*place, spec)?;
            }
        }
        let mut left = bodies;
        while let Some((&place, rest)) = left.split_first() {
            let (counts, rest) = rest.split_first_chunk::<16>().ok_or(Flaw::BadHeader)?;
            let total: usize = counts.iter().map(|count| usize::from(*count)).sum();
            let values = rest.get(..total).ok_or(Flaw::BadHeader)?.to_vec();
            let spec = (place, TableSpec { counts: *counts, values });
            self.unusual |= !standard.contains(&spec);
            self.set(place, &spec.1)?;
            left = &rest[total..];
        }
        self.from = Some(bodies.to_vec());
        Ok(())
    }

    fn set(&mut self, place: u8, spec: &TableSpec) -> Result<(), Flaw> {
        let number = usize::from(place & 15);
        match place >> 4 {
            0 => {
                let table = self.means.get_mut(number).ok_or(Flaw::BadHeader)?;
                *table = Some(MeanTable::new(spec).ok_or(Flaw::BadHeader)?);
            }
            1 => {
                let table = self.steps.get_mut(number).ok_or(Flaw::BadHeader)?;
                *table = Some(StepTable::new(spec).ok_or(Flaw::BadHeader)?);
            }
            _ => return Err(Flaw::BadHeader),
        }
        Ok(())
    }
}

/// Marker, body and end of the header segment at `at`.
fn segment(bytes: &[u8], mut at: usize) -> Result<(u8, &[u8], usize), Flaw> {
    let two = |at: usize| bytes.get(at..at + 2).map(|two| [two[0], two[1]]);
    let mut marker = two(at).ok_or(Flaw::NoEnd)?;
    while marker == [0xFF, 0xFF] {
        at += 1;
        marker = two(at).ok_or(Flaw::NoEnd)?;
    }
    if marker[0] != 0xFF {
        return Err(Flaw::BadHeader);
    }
    let length = usize::from(u16::from_be_bytes(two(at + 2).ok_or(Flaw::NoEnd)?));
    if length < 2 {
        return Err(Flaw::BadHeader);
    }
    let next = at + 2 + length;
    let body = bytes.get(at + 4..next).ok_or(Flaw::NoEnd)?;
    Ok((marker[1], body, next))
}
