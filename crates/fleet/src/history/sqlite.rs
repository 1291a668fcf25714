//! Reads a database of SQLite: records in b-trees, <https://www.sqlite.org/fileformat2.html>.
//!
//! For any bytes, each page is read at most once and no cell twice, so the work is bounded by their length.

use std::borrow::Cow;

const MAGIC: &[u8] = b"SQLite format 3\0";
/// Values of a record that are read.
pub(super) const COLUMNS: usize = 16;

/// True if `bytes` are a database of SQLite.
pub(super) fn is_sqlite(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// A value of a record.
pub(super) enum Value<'a> {
    Null,
    Whole(i64),
    Number(f64),
    Text(&'a str),
}

impl Value<'_> {
    /// A whole number from 0 on.
    pub(super) fn whole(&self) -> Option<u32> {
        if let Self::Whole(value) = self { u32::try_from(*value).ok() } else { None }
    }

    /// A finite number; one without a fraction may be stored as a whole one.
    pub(super) fn number(&self) -> Option<f64> {
        match *self {
            Self::Whole(value) => Some(value as f64),
            Self::Number(value) => Some(value).filter(|value| value.is_finite()),
            _ => None,
        }
    }
}

/// A database, read from memory.
pub(super) struct Database<'a> {
    bytes: &'a [u8],
    page_bytes: usize,
    /// Bytes of a page that are used.
    usable: usize,
}

impl<'a> Database<'a> {
    /// The database in `bytes`; `None` unless a program of that `version` wrote it.
    pub(super) fn of(bytes: &'a [u8], version: u32) -> Option<Self> {
        let page_bytes = match big_endian(bytes.get(16..18)?) {
            1 => 1 << 16,
            size => usize::try_from(size).ok()?,
        };
        let usable = page_bytes.checked_sub(usize::from(*bytes.get(20)?))?;
        let is_ours = is_sqlite(bytes)
            && big_endian(bytes.get(60..64)?) == u64::from(version)
            // UTF-8, and no log of writes beside the file.
            && big_endian(bytes.get(56..60)?) == 1
            && bytes.get(18..20)? == [1, 1];
        let is_sane = page_bytes.is_power_of_two() && usable >= 480;
        (is_ours && is_sane).then_some(Self { bytes, page_bytes, usable })
    }

    fn page(&self, number: u32) -> Option<&'a [u8]> {
        let from = (number as usize).checked_sub(1)?.checked_mul(self.page_bytes)?;
        self.bytes.get(from..from.checked_add(self.page_bytes)?)
    }

    /// Hands the values of each record in the b-tree at page `root` to `each`. `None` if the tree is damaged, or if
    /// `each` returns `None`.
    pub(super) fn walk(
        &self,
        root: u32,
        each: &mut dyn FnMut(&[Value<'_>]) -> Option<()>,
    ) -> Option<()> {
        let count = self.bytes.len() / self.page_bytes;
        let mut left = count;
        let mut pages = vec![root];
        while let Some(number) = pages.pop() {
            left = left.checked_sub(1)?;
            let page = self.page(number)?.get(..self.usable)?;
            let at = if number == 1 { 100 } else { 0 };
            let (is_leaf, has_row_ids) = match page.get(at)? {
                0x0d => (true, true),
                0x05 => (false, true),
                0x0a => (true, false),
                0x02 => (false, false),
                _ => return None,
            };
            if !is_leaf {
                pages.push(u32::try_from(big_endian(page.get(at + 8..at + 12)?)).ok()?);
            }
            let pointers = page.get(at + if is_leaf { 8 } else { 12 }..)?;
            let cells = usize::try_from(big_endian(page.get(at + 3..at + 5)?)).ok()?;
            // Cells don't overlap.
            let mut room = self.usable;
            for pointer in pointers.get(..2 * cells)?.chunks_exact(2) {
                let mut cell = page.get(usize::try_from(big_endian(pointer)).ok()?..)?;
                if !is_leaf {
                    let (child, rest) = cell.split_at_checked(4)?;
                    pages.push(u32::try_from(big_endian(child)).ok()?);
                    cell = rest;
                    if pages.len() > count {
                        return None;
                    }
                }
                let length = varint(&mut cell)?;
                if has_row_ids && !is_leaf {
                    continue;
                }
                if has_row_ids {
                    varint(&mut cell)?;
                }
                let payload = self.payload(cell, length, has_row_ids, &mut left)?;
                room = room.checked_sub(self.local_bytes(length, has_row_ids))?;
                each(&values(&payload)?)?;
            }
        }
        Some(())
    }

    /// Bytes of a payload of `length` that lie in its cell; the rest lies in pages of its own.
    fn local_bytes(&self, length: usize, has_row_ids: bool) -> usize {
        let usable = self.usable;
        let most = if has_row_ids { usable - 35 } else { (usable - 12) * 64 / 255 - 23 };
        let least = (usable - 12) * 32 / 255 - 23;
        if length <= most {
            return length;
        }
        let fitting = least + (length - least) % (usable - 4);
        if fitting <= most { fitting } else { least }
    }

    fn payload(
        &self,
        cell: &'a [u8],
        length: usize,
        has_row_ids: bool,
        left: &mut usize,
    ) -> Option<Cow<'a, [u8]>> {
        let local = self.local_bytes(length, has_row_ids);
        let (here, mut rest) = cell.split_at_checked(local)?;
        if local == length {
            return Some(Cow::Borrowed(here));
        }
        let mut all = here.to_vec();
        while all.len() < length {
            *left = left.checked_sub(1)?;
            let next = u32::try_from(big_endian(rest.get(..4)?)).ok()?;
            rest = self.page(next)?.get(..self.usable)?;
            let part = rest.get(4..)?;
            all.extend_from_slice(&part[..part.len().min(length - all.len())]);
        }
        Some(Cow::Owned(all))
    }
}

/// The values of a record, at most [`COLUMNS`].
fn values(record: &[u8]) -> Option<Vec<Value<'_>>> {
    let mut kinds = record;
    let length = varint(&mut kinds)?;
    kinds = record.get(record.len() - kinds.len()..length)?;
    let mut rest = record.get(length..)?;
    let mut values = Vec::with_capacity(COLUMNS);
    while !kinds.is_empty() && values.len() < COLUMNS {
        let kind = varint(&mut kinds)?;
        let length = match kind {
            0 | 8 | 9 => 0,
            1..=4 => kind,
            5 => 6,
            6 | 7 => 8,
            _ => kind.checked_sub(12)? / 2,
        };
        let (value, after) = rest.split_at_checked(length)?;
        rest = after;
        values.push(match kind {
            0 => Value::Null,
            8 | 9 => Value::Whole(i64::from(kind == 9)),
            1..=6 => {
                // The first byte carries the sign.
                let unused = 64 - 8 * u32::try_from(length).ok()?;
                Value::Whole((big_endian(value) << unused).cast_signed() >> unused)
            }
            7 => Value::Number(f64::from_bits(big_endian(value))),
            _ if kind % 2 == 1 => Value::Text(std::str::from_utf8(value).ok()?),
            // Bytes; no column of ours has some.
            _ => return None,
        });
    }
    Some(values)
}

/// The number in at most 8 bytes, the highest first.
fn big_endian(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

/// A number in 1 to 9 bytes of 7 bits, the ninth of 8; takes them off `bytes`.
fn varint(bytes: &mut &[u8]) -> Option<usize> {
    let mut number = 0_u64;
    for at in 0..9 {
        let byte = *bytes.get(at)?;
        let (bits, part) = if at == 8 { (8, byte) } else { (7, byte & 0x7f) };
        number = number << bits | u64::from(part);
        if at == 8 || byte < 0x80 {
            *bytes = &bytes[at + 1..];
            return usize::try_from(number).ok();
        }
    }
    None
}
