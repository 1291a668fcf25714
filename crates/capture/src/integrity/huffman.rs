//! Huffman tables of baseline JPEG, for skipping codes.

use super::bits::Bits;

/// Number of bits looked up at once, of coefficients and of means.
const FAST_BITS: u32 = 12;
const FAST_MEAN_BITS: u32 = 10;
/// Longest values in 8-bit pictures.
const LONGEST_MEAN: u32 = 11;
const LONGEST_VALUE: u32 = 10;

/// Lengths and values of a table's codes, as in a DHT segment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct TableSpec {
    pub(super) counts: [u8; 16],
    pub(super) values: Vec<u8>,
}

/// A prefix code.
#[derive(Clone, Debug)]
struct Code {
    /// Limits by code length: the last code plus 1, aligned to 16 bits; and the number to add to a
    /// code for its index.
    limits: [u32; 17],
    offsets: [i32; 17],
    values: Vec<u8>,
}

impl Code {
    /// Builds the code; `None` if the counts do not make a prefix code or do not fit the values.
    fn new(spec: &TableSpec) -> Option<Self> {
        let total: usize = spec.counts.iter().map(|count| usize::from(*count)).sum();
        if total > 256 || total != spec.values.len() {
            return None;
        }
        let (mut limits, mut offsets) = ([0; 17], [0; 17]);
        let (mut code, mut index) = (0_u32, 0_i32);
        for length in 1..=16_usize {
            let count = u32::from(spec.counts[length - 1]);
            if code + count > 1 << length {
                return None;
            }
            offsets[length] = index - code as i32;
            code += count;
            index += count as i32;
            limits[length] = code << (16 - length);
            code <<= 1;
        }
        Some(Self { limits, offsets, values: spec.values.clone() })
    }

    /// Length and value of the code at the start of the 16 bits `next`; `None` if there is no such
    /// code.
    fn look_up(&self, next: u32) -> Option<(u32, u8)> {
        let length = (1..=16_u32).find(|length| next < self.limits[*length as usize])?;
        let code = (next >> (16 - length)) as i32;
        let index = usize::try_from(code + self.offsets[length as usize]).ok()?;
        Some((length, *self.values.get(index)?))
    }

    /// Length and value of the code at the start of each pattern of `N`, if the pattern is long
    /// enough.
    fn patterns<const N: usize>(&self) -> impl Iterator<Item = (usize, Option<(u32, u8)>)> {
        let bits = N.ilog2();
        let code = move |pattern| self.look_up((pattern as u32) << (16 - bits));
        (0..N).map(move |pattern| (pattern, code(pattern).filter(|(length, _)| *length <= bits)))
    }
}

/// Decoder of the differences of blocks' means.
#[derive(Clone, Debug)]
pub(super) struct MeanTable {
    code: Code,
    /// Table by the next bits: 16 times the difference, plus the number of bits; 0 if more bits are
    /// needed.
    fast: Box<[i16; 1 << FAST_MEAN_BITS]>,
}

impl MeanTable {
    /// Builds the table; `None` if `spec` is no prefix code.
    pub(super) fn new(spec: &TableSpec) -> Option<Self> {
        let code = Code::new(spec)?;
        let mut fast = Box::new([0; 1 << FAST_MEAN_BITS]);
        for (pattern, found) in code.patterns::<{ 1 << FAST_MEAN_BITS }>() {
            let Some((length, size)) = found else { continue };
            let bits = length + u32::from(size);
            if bits <= FAST_MEAN_BITS {
                let value = pattern as u32 >> (FAST_MEAN_BITS - bits) & ((1 << size) - 1);
                fast[pattern] = (signed(value, size.into()) * 16 + bits as i32) as i16;
            }
        }
        Some(Self { code, fast })
    }

    /// Takes a difference of at most 27 bits; `None` if no picture has it.
    #[inline(always)]
    pub(super) fn take(&self, bits: &mut Bits<'_>) -> Option<i32> {
        let found = self.fast[bits.peek(FAST_MEAN_BITS) as usize];
        if found != 0 {
            bits.skip((found & 15) as u32);
            return Some(i32::from(found >> 4));
        }
        self.take_long(bits)
    }

    #[cold]
    fn take_long(&self, bits: &mut Bits<'_>) -> Option<i32> {
        let (length, size) = self.code.look_up(bits.peek(16) as u32)?;
        let size = u32::from(size);
        if size > LONGEST_MEAN {
            return None;
        }
        bits.skip(length);
        let value = if size == 0 { 0 } else { bits.peek(size) as u32 };
        bits.skip(size);
        Some(signed(value, size))
    }
}

/// Number coded by `size` bits of value `value`.
fn signed(value: u32, size: u32) -> i32 {
    let value = value as i32;
    if size > 0 && value < 1 << (size - 1) { value - (1 << size) + 1 } else { value }
}

/// Decoder to skip the other coefficients of blocks.
#[derive(Clone, Debug)]
pub(super) struct StepTable {
    code: Code,
    fast: Box<[Step; 1 << FAST_BITS]>,
}

/// The next coefficients of a block: as many as fit in the bits looked up.
#[derive(Clone, Copy, Debug)]
struct Step(u16);

impl Step {
    /// More bits are needed; coded as more coefficients than in a block.
    const LONG: Self = Self(64 << 5);

    fn new(bits: u32, coefficients: u32, ends: bool) -> Self {
        Self((bits | coefficients << 5 | u32::from(ends) << 15) as u16)
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0 & 31)
    }

    /// Number of coefficients, zeros included.
    #[inline(always)]
    fn coefficients(self) -> u32 {
        u32::from(self.0 >> 5 & 127)
    }

    /// True if the block ends after the step.
    #[inline(always)]
    fn ends(self) -> bool {
        self.0 >> 15 == 1
    }

    /// The step and `next` combined, if both fit in the bits looked up.
    fn then(self, next: Self) -> Option<Self> {
        let (bits, coefficients) =
            (self.bits() + next.bits(), self.coefficients() + next.coefficients());
        let fits = !self.ends() && bits <= FAST_BITS && coefficients < 64;
        fits.then(|| Self::new(bits, coefficients, next.ends()))
    }
}

impl StepTable {
    /// Builds the table; `None` if `spec` is no prefix code.
    pub(super) fn new(spec: &TableSpec) -> Option<Self> {
        let code = Code::new(spec)?;
        let mut single = [Step::LONG; 1 << FAST_BITS];
        for (pattern, found) in code.patterns::<{ 1 << FAST_BITS }>() {
            let Some((length, value)) = found else { continue };
            let (run, size) = (u32::from(value >> 4), u32::from(value & 15));
            match (run, size) {
                (0, 0) => single[pattern] = Step::new(length, 0, true),
                (_, 1..=LONGEST_VALUE) => {
                    single[pattern] = Step::new(length + size, run + 1, false);
                }
                _ => {}
            }
        }
        let mut fast = Box::new(single);
        for (pattern, step) in fast.iter_mut().enumerate() {
            let behind = |step: Step| single[(pattern << step.bits()) % (1 << FAST_BITS)];
            while let Some(more) = step.then(behind(*step)) {
                *step = more;
            }
        }
        Some(Self { code, fast })
    }

    /// Takes at most 26 bits of a block with `coefficients` so far, and returns true if complete.
    /// `None` for bits no encoder writes.
    #[inline(always)]
    pub(super) fn take(&self, bits: &mut Bits<'_>, coefficients: &mut u32) -> Option<bool> {
        let step = self.fast[bits.peek(FAST_BITS) as usize];
        let sum = *coefficients + step.coefficients();
        if sum < 64 {
            bits.skip(step.bits());
            *coefficients = sum;
            return Some(step.ends());
        }
        self.take_one(bits, coefficients)
    }

    #[inline(never)]
    fn take_one(&self, bits: &mut Bits<'_>, coefficients: &mut u32) -> Option<bool> {
        let (length, value) = self.code.look_up(bits.peek(16) as u32)?;
        let (run, size) = (u32::from(value >> 4), u32::from(value & 15));
        bits.skip(length + size);
        *coefficients += run + 1;
        match (run, size) {
            (0, 0) => Some(true),
            // Sixteen zeros, and a value must follow.
            (15, 0) if *coefficients < 64 => Some(false),
            (_, 1..=LONGEST_VALUE) if *coefficients <= 64 => Some(*coefficients == 64),
            _ => None,
        }
    }
}

/// Standard tables, for cameras without tables (ITU-T T.81, annex K.3), as DHT segments.
pub(super) fn standard_segments() -> Vec<u8> {
    let mut bytes = Vec::with_capacity(420);
    for (class_and_number, spec) in standard() {
        let length = 2 + 1 + 16 + spec.values.len() as u16;
        bytes.extend([0xFF, 0xC4]);
        bytes.extend(length.to_be_bytes());
        bytes.push(class_and_number);
        bytes.extend(spec.counts);
        bytes.extend(&spec.values);
    }
    bytes
}

/// Class (high half: 0 for DC, 1 for AC) and number of the standard tables, with the codes.
pub(super) fn standard() -> [(u8, TableSpec); 4] {
    let dc: Vec<u8> = (0..12).collect();
    let luma_dc = [0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0];
    let chroma_dc = [0, 3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0];
    let luma_ac = [0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 0x7d];
    let chroma_ac = [0, 2, 1, 2, 4, 4, 3, 4, 7, 5, 4, 4, 0, 1, 2, 0x77];
    [
        (0x00, TableSpec { counts: luma_dc, values: dc.clone() }),
        (0x10, TableSpec { counts: luma_ac, values: LUMA_AC.to_vec() }),
        (0x01, TableSpec { counts: chroma_dc, values: dc }),
        (0x11, TableSpec { counts: chroma_ac, values: CHROMA_AC.to_vec() }),
    ]
}

#[rustfmt::skip]
const LUMA_AC: [u8; 162] = [
    0x01, 0x02, 0x03, 0x00, 0x04, 0x11, 0x05, 0x12, 0x21, 0x31, 0x41, 0x06, 0x13, 0x51, 0x61, 0x07, 0x22, 0x71,
    0x14, 0x32, 0x81, 0x91, 0xa1, 0x08, 0x23, 0x42, 0xb1, 0xc1, 0x15, 0x52, 0xd1, 0xf0, 0x24, 0x33, 0x62, 0x72,
    0x82, 0x09, 0x0a, 0x16, 0x17, 0x18, 0x19, 0x1a, 0x25, 0x26, 0x27, 0x28, 0x29, 0x2a, 0x34, 0x35, 0x36, 0x37,
    0x38, 0x39, 0x3a, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x49, 0x4a, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58, 0x59,
    0x5a, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69, 0x6a, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7a, 0x83,
    0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8a, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 0x99, 0x9a, 0xa2, 0xa3,
    0xa4, 0xa5, 0xa6, 0xa7, 0xa8, 0xa9, 0xaa, 0xb2, 0xb3, 0xb4, 0xb5, 0xb6, 0xb7, 0xb8, 0xb9, 0xba, 0xc2, 0xc3,
    0xc4, 0xc5, 0xc6, 0xc7, 0xc8, 0xc9, 0xca, 0xd2, 0xd3, 0xd4, 0xd5, 0xd6, 0xd7, 0xd8, 0xd9, 0xda, 0xe1, 0xe2,
    0xe3, 0xe4, 0xe5, 0xe6, 0xe7, 0xe8, 0xe9, 0xea, 0xf1, 0xf2, 0xf3, 0xf4, 0xf5, 0xf6, 0xf7, 0xf8, 0xf9, 0xfa,
];

#[rustfmt::skip]
const CHROMA_AC: [u8; 162] = [
    0x00, 0x01, 0x02, 0x03, 0x11, 0x04, 0x05, 0x21, 0x31, 0x06, 0x12, 0x41, 0x51, 0x07, 0x61, 0x71, 0x13, 0x22,
    0x32, 0x81, 0x08, 0x14, 0x42, 0x91, 0xa1, 0xb1, 0xc1, 0x09, 0x23, 0x33, 0x52, 0xf0, 0x15, 0x62, 0x72, 0xd1,
    0x0a, 0x16, 0x24, 0x34, 0xe1, 0x25, 0xf1, 0x17, 0x18, 0x19, 0x1a, 0x26, 0x27, 0x28, 0x29, 0x2a, 0x35, 0x36,
    0x37, 0x38, 0x39, 0x3a, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48, 0x49, 0x4a, 0x53, 0x54, 0x55, 0x56, 0x57, 0x58,
    0x59, 0x5a, 0x63, 0x64, 0x65, 0x66, 0x67, 0x68, 0x69, 0x6a, 0x73, 0x74, 0x75, 0x76, 0x77, 0x78, 0x79, 0x7a,
    0x82, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89, 0x8a, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97, 0x98, 0x99, 0x9a,
    0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7, 0xa8, 0xa9, 0xaa, 0xb2, 0xb3, 0xb4, 0xb5, 0xb6, 0xb7, 0xb8, 0xb9, 0xba,
    0xc2, 0xc3, 0xc4, 0xc5, 0xc6, 0xc7, 0xc8, 0xc9, 0xca, 0xd2, 0xd3, 0xd4, 0xd5, 0xd6, 0xd7, 0xd8, 0xd9, 0xda,
    0xe2, 0xe3, 0xe4, 0xe5, 0xe6, 0xe7, 0xe8, 0xe9, 0xea, 0xf2, 0xf3, 0xf4, 0xf5, 0xf6, 0xf7, 0xf8, 0xf9, 0xfa,
];
