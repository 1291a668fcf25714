//! Detects boards in a list of pictures and prints a line for each: the corners or the miss, and
//! the processor time.
//!
//! ```text
//! cargo run --release -p boresight-detect --example look [LOOKS] < list > table
//! ```
//!
//! A line of the list is a board, the time of the frame in nanoseconds, and a picture (binary PGM),
//! separated by tabs: `9x6<TAB>33000000<TAB>a.pgm`. Consecutive frames are tracked; a picture
//! without a time (`-`) is single and ends the sequence. A line of the table has the same, then
//! milliseconds, the miss or `found`, and `x,y,sd` of each corner. `tests/bench/detector_table.py`
//! makes lists, and judges and compares tables.

use std::{
    fmt::Write,
    io::{BufRead, stdin},
    time::Instant,
};

use boresight_detect::{Detector, DetectorParams, Search, Track};
use boresight_geometry::{
    boards::{Board, BoardChoice},
    frame::{CaptureTime, FrameKind},
};
use image::GrayImage;

type Failed = Box<dyn std::error::Error>;

/// Default number of looks at each picture; the shortest time counts.
const LOOKS: usize = 3;

fn main() -> Result<(), Failed> {
    let looks = std::env::args().nth(1).map_or(Ok(LOOKS), |looks| looks.parse())?;
    let mut detector = Detector::new(DetectorParams::default());
    let mut track = Track::default();
    for line in stdin().lock().lines() {
        let line = line?;
        let [name, at, path] = line.split('\t').collect::<Vec<_>>()[..] else {
            return Err(format!("{line:?}: board, time and picture, parted by tabs").into());
        };
        let board = board(name)?;
        let image = read_pgm(path)?;
        let at = at.parse().ok().map(|nanos| CaptureTime { nanos });
        if at.is_none() {
            track = Track::default();
        }
        let near = at.and_then(|at| track.predict(FrameKind::Video, at));
        let search = Search { near: near.as_ref(), ..Search::FULL };
        let mut least_ms = f64::INFINITY;
        let mut look = || {
            let began = now_ms();
            let seen = detector.search(&image, &board, search);
            least_ms = least_ms.min(now_ms() - began);
            seen
        };
        let mut seen = look();
        for _ in 1..looks {
            seen = look();
        }
        if let Some(at) = at {
            track.add(FrameKind::Video, at, &seen);
        }
        let mut said = String::new();
        match &seen {
            Err(miss) => write!(said, "{miss:?}")?,
            Ok(found) => {
                said += "found\t";
                for corner in &found.corners {
                    match corner.is_seen() {
                        true => {
                            let sd = corner.sigma_px();
                            write!(said, "{:.4},{:.4},{sd:.5} ", corner.px.x, corner.px.y)?;
                        }
                        false => said += "- ",
                    }
                }
            }
        }
        println!("{line}\t{least_ms:.3}\t{}", said.trim_end());
    }
    Ok(())
}

fn board(name: &str) -> Result<Board, Failed> {
    let choice: BoardChoice = name.parse()?;
    Ok(choice.board(0.025)?)
}

/// Processor time of the current thread if reported by the system, else the clock's.
fn now_ms() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanos = told.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    nanos.map_or_else(
        || START.get_or_init(Instant::now).elapsed().as_secs_f64() * 1e3,
        |nanos| nanos * 1e-6,
    )
}

fn read_pgm(path: &str) -> Result<GrayImage, Failed> {
    let bytes = std::fs::read(path)?;
    let mut parts = bytes.splitn(4, u8::is_ascii_whitespace);
    let mut part = || parts.next().ok_or(format!("{path}: no binary PGM"));
    let magic = part()?;
    let mut number = || -> Result<u32, Failed> { Ok(std::str::from_utf8(part()?)?.parse()?) };
    let (width, height) = (number()?, number()?);
    let rest = part()?;
    let pixels = rest.strip_prefix(b"255\n").filter(|_| magic == b"P5").unwrap_or_default();
    GrayImage::from_raw(width, height, pixels.to_vec())
        .ok_or(format!("{path}: no binary PGM of 8 bits").into())
}
