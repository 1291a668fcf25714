//! Reads the board from the printed code.

use std::{
    collections::VecDeque,
    path::PathBuf,
    time::{Duration, Instant},
};

use image::GrayImage;

use crate::{Announcer, session::source::OpenSource};
use boresight_capture::{Arrival, preceded, read_picture};
use boresight_detect::{Detection, Detector, DetectorParams, Miss, OtherBoard, read_code};
use boresight_geometry::{board_code::BoardCode, boards::Board};
use boresight_present::text;
use boresight_run::config::Config;

/// Number of pictures searched for a code. From a live camera, only those within the waiting time.
const PICTURES: usize = 10;
const LIVE: Duration = Duration::from_millis(1500);
/// Smaller boards to try when the usual board is seen only in part: a smaller board looks alike.
const SMALLER: [(u16, u16); 8] = [(8, 6), (8, 5), (7, 6), (7, 5), (6, 5), (6, 4), (5, 4), (4, 3)];
/// Most searches for boards in all pictures together.
const SEARCHES: usize = 80;
/// Most waits for a frame, some of which may bring none.
const WAITS: usize = 20;
const PATIENCE: Duration = Duration::from_millis(250);

/// Reader of codes beside any board in the picture.
struct CodeReader {
    detector: Detector,
    /// Board to try first.
    usual: Board,
    searches_left: usize,
}

impl CodeReader {
    fn new(usual: Board) -> Self {
        let detector = Detector::new(DetectorParams::default());
        Self { detector, usual, searches_left: SEARCHES }
    }

    fn read(&mut self, image: &GrayImage) -> Option<BoardCode> {
        match self.search(image, self.usual)? {
            Ok(detection) => read_code(image, &self.usual, &detection.corners),
            Err(Miss::OtherBoard(OtherBoard::Plain { columns, rows })) => {
                let count = |count: usize| u16::try_from(count).ok();
                self.read_as(image, (count(columns)?, count(rows)?))
            }
            Err(Miss::PartialBoard { .. } | Miss::Glare { .. }) => {
                SMALLER.into_iter().find_map(|size| self.read_as(image, size))
            }
            Err(_) => None,
        }
    }

    fn read_as(&mut self, image: &GrayImage, (columns, rows): (u16, u16)) -> Option<BoardCode> {
        let board = Board::new(columns, rows, self.usual.square_m()).ok()?;
        let seen = self.search(image, board)?.ok()?;
        read_code(image, &board, &seen.corners)
    }

    /// `None` once there were enough searches.
    fn search(&mut self, image: &GrayImage, board: Board) -> Option<Result<Detection, Miss>> {
        self.searches_left = self.searches_left.checked_sub(1)?;
        Some(self.detector.detect(image, &board))
    }
}

/// Takes the fields in `decides` from the first code in `pictures`, and announces the result.
/// Without a code nothing changes. Unreadable pictures are skipped.
///
/// # Errors
///
/// If `config` names no usable board.
pub fn board_from_pictures(
    pictures: &[PathBuf],
    config: &mut Config,
    decides: BoardFromCode,
    announcer: &Announcer,
) -> anyhow::Result<()> {
    let mut reader = CodeReader::new(config.board()?);
    let mut images = pictures.iter().take(PICTURES).filter_map(|path| read_picture(path).ok());
    if let Some(code) = images.find_map(|image| reader.read(&image)) {
        take(&code, config, decides, announcer);
    }
    Ok(())
}

/// Takes the board from the code in the first frames of a source, as [`board_from_pictures`] does.
/// Frames of a folder or recording are delivered again; those of a live camera are lost. The
/// simulated camera waits until its first picture is judged. Errors of a broken source reappear at
/// their place in the source.
///
/// # Errors
///
/// If `config` names no usable board.
pub fn board_from_source(
    open: OpenSource,
    config: &mut Config,
    decides: BoardFromCode,
    announcer: &Announcer,
) -> anyhow::Result<OpenSource> {
    let mut reader = CodeReader::new(config.board()?);
    let OpenSource { mut source, on_frame, truth } = open;
    let keeps_frames = source.waits();
    let mut first = VecDeque::new();
    let (mut frames, mut waits, mut until) = (PICTURES, WAITS, None);
    while frames > 0 && waits > 0 && until.is_none_or(|until| Instant::now() < until) {
        // A waiting source has its next picture at once, or not before the first picture is judged.
        let has_begun = keeps_frames && !first.is_empty();
        let arrival = source.next_frame(if has_begun { Duration::ZERO } else { PATIENCE });
        let code = match &arrival {
            Ok(Arrival::Frame(frame)) => {
                if keeps_frames {
                    frames -= 1;
                } else {
                    until.get_or_insert_with(|| Instant::now() + LIVE);
                }
                reader.read(&frame.image)
            }
            Ok(Arrival::NothingYet) if has_begun => break,
            Ok(Arrival::NothingYet) => {
                waits -= 1;
                continue;
            }
            Ok(Arrival::Event(_)) => None,
            Ok(Arrival::End) | Err(_) => {
                first.push_back(arrival);
                break;
            }
        };
        if keeps_frames || matches!(arrival, Ok(Arrival::Event(_))) {
            first.push_back(arrival);
        }
        if let Some(code) = code {
            take(&code, config, decides, announcer);
            break;
        }
    }
    Ok(OpenSource { source: Box::new(preceded(first, source)), on_frame, truth })
}

/// Copies the fields in `decides` from `code` to `config`, with the measured square from the
/// settings, if any.
fn take(code: &BoardCode, config: &mut Config, decides: BoardFromCode, announcer: &Announcer) {
    let Some(board) = code.board() else { return };
    // Both are at most 99.
    let counts = (board.columns() as u16, board.rows() as u16);
    let given = (config.board.columns, config.board.rows);
    if decides == BoardFromCode::Square && counts != given {
        return;
    }
    let id = code.id().to_string();
    let printed_mm = board.square_m() * 1e3;
    let measured = config.boards.iter().find(|(key, _)| key.parse() == Ok(code.id()));
    let measured = measured.map(|(_, board)| board.clone());
    (config.board.columns, config.board.rows) = counts;
    if decides.has_square() {
        // Micrometres, as printed.
        let printed_mm = (printed_mm * 1e3).round() / 1e3;
        config.board.square_mm = measured.as_ref().map_or(printed_mm, |board| board.square_mm);
    }
    announcer.say(&text::board_from_code(&board, &id, config.board.square_mm));
    let certificate = &mut config.certificate;
    certificate.board_id = id;
    if let Some(measured) = measured.filter(|_| certificate.square_measured.is_empty()) {
        certificate.square_measured = measured.measured_with;
    }
}

/// Properties of the board to read from a code in the margin, if seen in the first frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoardFromCode {
    /// Nothing: the board is given.
    #[default]
    Nothing,
    /// Columns and rows: the square is given.
    Counts,
    /// The square: columns and rows are given. A code with other counts is ignored.
    Square,
    /// Columns, rows and square.
    All,
}

impl BoardFromCode {
    /// The properties not given: columns and rows, or the square.
    pub fn unless_given(counts: bool, square: bool) -> Self {
        match (counts, square) {
            (true, true) => Self::Nothing,
            (false, true) => Self::Counts,
            (true, false) => Self::Square,
            (false, false) => Self::All,
        }
    }

    /// True if the square is open.
    pub fn has_square(self) -> bool {
        matches!(self, Self::Square | Self::All)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::source::SourceName;

    #[test]
    fn a_simulated_board_names_itself_and_loses_no_picture() -> anyhow::Result<()> {
        let place = tempfile::tempdir()?;
        let said = |scene: &str| -> anyhow::Result<(Config, u64)> {
            let file = place.path().join("scene.toml");
            std::fs::write(&file, scene)?;
            let mut config = Config::load(None, &[])?;
            let announcer = Announcer::silent();
            let name = format!("sim:{}", file.display());
            let open = SourceName::parse(&name, &config, &announcer)?.open(Some(2))?;
            let decides = BoardFromCode::All;
            let mut open = board_from_source(open, &mut config, decides, &announcer)?;
            let Arrival::Frame(first) = open.source.next_frame(PATIENCE)? else {
                anyhow::bail!("no picture");
            };
            Ok((config, first.id.0))
        };
        let (config, first) = said("board = [7, 5]\nsquare_mm = 20\nboard_id = \"zx5n\"")?;
        let board = &config.board;
        assert_eq!((board.columns, board.rows, board.square_mm, first), (7, 5, 20.0, 0));
        assert_eq!(config.certificate.board_id, "ZX5N");
        let (config, first) = said("board = [7, 5]")?;
        assert_eq!((config.board.columns, config.certificate.board_id.as_str()), (9, ""));
        assert_eq!(first, 0);
        assert!(said("board_id = \"ZX-N\"").is_err());
        Ok(())
    }
}
