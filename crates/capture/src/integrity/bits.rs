//! The bits of a scan.

/// Bits of the data, most significant first; zeros after the end.
pub(super) struct Bits<'a> {
    data: &'a [u8],
    /// Index of the first byte of the next refill.
    at: usize,
    /// The next bits, left-aligned; those after the first `held` are true, too, or zero.
    word: u64,
    held: u32,
}

impl<'a> Bits<'a> {
    /// Reader with nothing held before the first refill.
    pub(super) fn new(data: &'a [u8]) -> Self {
        Self { data, at: 0, word: 0, held: 0 }
    }

    /// Makes at least 56 bits available.
    #[inline(always)]
    pub(super) fn refill(&mut self) {
        let eight = self.data.get(self.at..).and_then(<[u8]>::first_chunk);
        let next = eight.map_or_else(|| self.last_bytes(), |eight| u64::from_be_bytes(*eight));
        self.word |= next >> self.held;
        self.at += (63 - self.held as usize) / 8;
        self.held |= 56;
    }

    #[cold]
    fn last_bytes(&self) -> u64 {
        let mut eight = [0; 8];
        let rest = self.data.get(self.at..).unwrap_or(&[]);
        eight[..rest.len()].copy_from_slice(rest);
        u64::from_be_bytes(eight)
    }

    /// The next `count` bits, 1 to 63.
    #[inline(always)]
    pub(super) fn peek(&self, count: u32) -> u64 {
        self.word >> (64 - count)
    }

    #[inline(always)]
    pub(super) fn skip(&mut self, count: u32) {
        self.word <<= count;
        self.held -= count;
    }

    /// Number of bits taken.
    fn taken(&self) -> usize {
        8 * self.at - self.held as usize
    }

    /// True if more bits were taken than in the data.
    #[inline(always)]
    pub(super) fn overrun(&self) -> bool {
        self.taken() > 8 * self.data.len()
    }

    /// Number of whole bytes not taken. `None` if too many were, or if the padding of the last byte
    /// is not all ones.
    pub(super) fn left(&self) -> Option<usize> {
        if self.overrun() {
            return None;
        }
        let fill = 8 * self.data.len() - self.taken();
        let (bytes, fill) = (fill / 8, fill as u32 % 8);
        (fill == 0 || self.peek(fill) == (1 << fill) - 1).then_some(bytes)
    }
}
