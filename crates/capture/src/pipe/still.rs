//! End of a JPEG or PNG in a stream of them.

use memchr::memmem::find;

const PNG_START: &[u8] = b"\x89PNG\r\n\x1a\n";
const JPEG_START: &[u8] = &[0xFF, 0xD8, 0xFF];
/// Longest chunk of a PNG.
const CHUNK_BYTES: usize = 1 << 28;

/// The end of the first picture in some bytes.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum StillEnd {
    /// The end hasn't come yet.
    NotYet,
    /// The picture's first byte, and the byte after the last.
    Whole { from: usize, to: usize },
    /// The picture is torn; look again from `resume`.
    Torn { resume: usize },
    /// No picture begins before `to`.
    Between { to: usize },
}

/// Progress through a picture, to look at every byte once.
#[derive(Debug, Default)]
pub(super) struct Still {
    at: usize,
    in_scan: bool,
}

impl Still {
    /// True if `bytes` begin with a picture.
    pub(super) fn begins(bytes: &[u8]) -> bool {
        bytes.starts_with(JPEG_START) || bytes.starts_with(PNG_START)
    }

    /// Finds the end of the first picture, skipping bytes between pictures (padding, words of a
    /// protocol). After an end or a tear, the caller removes the bytes before it.
    pub(super) fn end(&mut self, bytes: &[u8]) -> StillEnd {
        let Some(from) = start_of(bytes, 0) else {
            // A start may be cut at the end of the bytes.
            return StillEnd::Between { to: bytes.len().saturating_sub(PNG_START.len() - 1) };
        };
        if self.at <= from {
            (self.at, self.in_scan) = (from, false);
        }
        let end = if bytes[from..].starts_with(PNG_START) {
            self.end_of_png(bytes, from)
        } else {
            self.end_of_jpeg(bytes, from)
        };
        match end {
            StillEnd::NotYet | StillEnd::Between { .. } => {}
            StillEnd::Whole { .. } | StillEnd::Torn { .. } => *self = Self::default(),
        }
        end
    }

    /// Number of bytes to remove if no more come: the incomplete picture, up to the next. `None`
    /// without a picture.
    pub(super) fn give_up(&mut self, bytes: &[u8]) -> Option<usize> {
        *self = Self::default();
        let from = start_of(bytes, 0)?;
        Some(start_of(bytes, from + 1).unwrap_or(bytes.len()))
    }

    fn end_of_png(&mut self, bytes: &[u8], from: usize) -> StillEnd {
        if self.at == from {
            self.at += PNG_START.len();
        }
        // Each chunk: length, name, contents, checksum of name and contents.
        while let Some(&[a, b, c, d, ref name @ ..]) = bytes.get(self.at..self.at + 8) {
            let length = u32::from_be_bytes([a, b, c, d]) as usize;
            if length > CHUNK_BYTES || !name.iter().all(u8::is_ascii_alphabetic) {
                return torn(bytes, from);
            }
            let sum_at = self.at + 8 + length;
            let Some(sum) = bytes.get(sum_at..sum_at + 4) else {
                // A damaged length mustn't swallow the pictures after it.
                let rest = &bytes[self.at + 8..];
                return find(rest, PNG_START)
                    .map_or(StillEnd::NotYet, |at| StillEnd::Torn { resume: self.at + 8 + at });
            };
            if crc32fast::hash(&bytes[self.at + 4..sum_at]).to_be_bytes() != sum {
                return torn(bytes, from);
            }
            self.at = sum_at + 4;
            if name == b"IEND" {
                return StillEnd::Whole { from, to: self.at };
            }
        }
        StillEnd::NotYet
    }

    fn end_of_jpeg(&mut self, bytes: &[u8], from: usize) -> StillEnd {
        if self.at == from {
            self.at += 2;
        }
        while let Some(&[byte, marker]) = bytes.get(self.at..self.at + 2) {
            match (byte, marker) {
                (0xFF, 0xD9) => return StillEnd::Whole { from, to: self.at + 2 },
                // The next picture begins.
                (0xFF, 0xD8) => return StillEnd::Torn { resume: self.at },
                (0xFF, 0xFF) => self.at += 1,
                // A stuffed byte, a restart: the scan continues.
                (0xFF, 0x00 | 0xD0..=0xD7) => self.at += 2,
                (0xFF, _) => {
                    let Some(&[high, low]) = bytes.get(self.at + 2..self.at + 4) else {
                        return StillEnd::NotYet;
                    };
                    let next = self.at + 2 + usize::from(u16::from_be_bytes([high, low]));
                    if next > bytes.len() {
                        return StillEnd::NotYet;
                    }
                    (self.at, self.in_scan) = (next, marker == 0xDA);
                }
                _ if self.in_scan => {
                    let rest = &bytes[self.at..];
                    self.at += rest.iter().position(|byte| *byte == 0xFF).unwrap_or(rest.len());
                }
                _ => return torn(bytes, from),
            }
        }
        StillEnd::NotYet
    }
}

/// The first picture in `bytes` at or after `from`.
fn start_of(bytes: &[u8], from: usize) -> Option<usize> {
    (from..bytes.len()).find(|at| matches!(bytes[*at], 0xFF | 0x89) && Still::begins(&bytes[*at..]))
}

/// The picture at `from` is torn: the next may begin anywhere after the start.
fn torn(bytes: &[u8], from: usize) -> StillEnd {
    let resume =
        start_of(bytes, from + 1).unwrap_or(bytes.len().saturating_sub(PNG_START.len() - 1));
    StillEnd::Torn { resume: resume.max(from + 1) }
}
