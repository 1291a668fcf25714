//! Modes of the simulated USB camera.

/// Offered sizes.
pub(crate) const SIZES: [(u16, u16); 5] =
    [(640, 480), (640, 360), (1280, 720), (1920, 1080), (320, 240)];
/// Frame intervals in 100 ns: 60, 30, 15, 7.5 and 2.5 frames per second. They must rise, or the
/// kernel picks wrongly.
pub(crate) const INTERVALS: [u32; 5] = [166_666, 333_333, 666_666, 1_333_333, 4_000_000];
/// 30 frames per second.
const USUAL_INTERVAL: u32 = INTERVALS[1];
/// Rate of the camera's own clock.
pub(crate) const CLOCK_HZ: u32 = 48_000_000;
/// Bytes of an isochronous packet: 3 transactions of 1024.
pub(crate) const PACKET: u32 = 3072;

/// Pixel formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Format {
    Mjpeg,
    Yuyv,
}

/// Mode chosen by the driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mode {
    pub(crate) format: Format,
    pub(crate) size: (u16, u16),
    pub(crate) interval: u32,
}

impl Mode {
    /// Initial mode.
    pub(crate) const START: Self =
        Self { format: Format::Mjpeg, size: SIZES[0], interval: USUAL_INTERVAL };

    /// Reads a UVC probe or commit block.
    pub(crate) fn from_block(block: &[u8]) -> Self {
        let interval = u32::from_le_bytes([block[4], block[5], block[6], block[7]]);
        let nearest = INTERVALS.into_iter().min_by_key(|known| known.abs_diff(interval));
        Self {
            format: if block[2] == 2 { Format::Yuyv } else { Format::Mjpeg },
            size: SIZES[usize::from(block[3].clamp(1, SIZES.len() as u8)) - 1],
            interval: nearest.unwrap_or(USUAL_INTERVAL),
        }
    }

    /// Writes a UVC 1.1 probe or commit block.
    pub(crate) fn to_block(self) -> Vec<u8> {
        let index = SIZES.iter().position(|size| *size == self.size).unwrap_or(0);
        let mut block = vec![0; 34];
        block[0] = 1;
        block[2] = if self.format == Format::Yuyv { 2 } else { 1 };
        block[3] = index as u8 + 1;
        block[4..8].copy_from_slice(&self.interval.to_le_bytes());
        block[18..22].copy_from_slice(&largest_frame(self.size).to_le_bytes());
        block[22..26].copy_from_slice(&PACKET.to_le_bytes());
        block[26..30].copy_from_slice(&CLOCK_HZ.to_le_bytes());
        (block[30], block[31]) = (3, 1);
        block
    }
}

/// Bytes of the largest frame of `size`.
pub(crate) fn largest_frame((width, height): (u16, u16)) -> u32 {
    u32::from(width) * u32::from(height) * 2
}

/// The configuration descriptor: one camera terminal with controls, one processing unit, one
/// isochronous stream.
pub(crate) fn configuration() -> Vec<u8> {
    let mut formats = vec![11, 0x24, 0x06, 1, SIZES.len() as u8, 1, 1, 0, 0, 0, 0];
    frames(0x07, &mut formats);
    formats.extend([6, 0x24, 0x0d, 1, 1, 4]);
    formats.extend([27, 0x24, 0x04, 2, SIZES.len() as u8]);
    // The GUID of YUY2, 16 bits a pixel.
    formats.extend([0x59, 0x55, 0x59, 0x32, 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71]);
    formats.extend([16, 1, 0, 0, 0, 0]);
    frames(0x05, &mut formats);
    formats.extend([6, 0x24, 0x0d, 1, 1, 4]);

    let mut streaming = vec![15, 0x24, 0x01, 2];
    streaming.extend((15 + formats.len() as u16).to_le_bytes());
    streaming.extend([0x81, 0, 3, 0, 0, 0, 1, 0, 0]);
    streaming.extend(formats);

    let mut units = Vec::new();
    // Camera terminal with exposure mode and time, focus, zoom, and autofocus.
    units.extend([18, 0x24, 0x02, 1, 0x01, 0x02, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0x2a, 0x02, 0x02]);
    // Processing unit with brightness.
    units.extend([11, 0x24, 0x05, 2, 1, 0, 0, 2, 0x01, 0x00, 0]);
    units.extend([9, 0x24, 0x03, 3, 0x01, 0x01, 0, 2, 0]);
    let mut control = vec![13, 0x24, 0x01, 0x00, 0x01];
    control.extend((13 + units.len() as u16).to_le_bytes());
    control.extend(CLOCK_HZ.to_le_bytes());
    control.extend([1, 1]);
    control.extend(units);

    let mut body = vec![8, 0x0b, 0, 2, 0x0e, 3, 0, 2];
    body.extend([9, 4, 0, 0, 0, 0x0e, 1, 0, 2]);
    body.extend(control);
    body.extend([9, 4, 1, 0, 0, 0x0e, 2, 0, 0]);
    body.extend(streaming);
    body.extend([9, 4, 1, 1, 1, 0x0e, 2, 0, 0]);
    body.extend([7, 5, 0x81, 5, 0x00, 0x14, 1]);

    let mut whole = vec![9, 2];
    whole.extend((9 + body.len() as u16).to_le_bytes());
    whole.extend([2, 1, 0, 0x80, 250]);
    whole.extend(body);
    whole
}

fn frames(subtype: u8, to: &mut Vec<u8>) {
    for (index, size) in SIZES.into_iter().enumerate() {
        let bytes = largest_frame(size);
        to.extend([26 + 4 * INTERVALS.len() as u8, 0x24, subtype, index as u8 + 1, 0]);
        to.extend(size.0.to_le_bytes());
        to.extend(size.1.to_le_bytes());
        for number in [bytes * 8 * 5, bytes.saturating_mul(8 * 60), bytes, USUAL_INTERVAL] {
            to.extend(number.to_le_bytes());
        }
        to.push(INTERVALS.len() as u8);
        for interval in INTERVALS {
            to.extend(interval.to_le_bytes());
        }
    }
}
