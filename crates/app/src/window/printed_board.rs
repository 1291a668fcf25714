//! Board on paper, written from the window: the largest squares that fit.

use std::path::{Path, PathBuf};

use crate::{
    commands::board_sheet::{BoardSheet, SheetKind},
    window::services::PrintedBoard,
};
use boresight_files::{Links, Overwrite, read, save};
use boresight_geometry::{board_code::BoardId, boards::BoardChoice};
use boresight_present::{sheet::Paper, text};

/// Largest readable file, in bytes; a sheet with a board is far smaller.
const LIMIT: u64 = 16 << 20;
/// Names tried while a different sheet has the same name.
const NAMES: u32 = 100;

/// ID for the next printed board.
pub fn new_id() -> BoardId {
    let nanos = jiff::Timestamp::now().as_nanosecond();
    // The last bits change with every print.
    BoardId::from_number((nanos >> 10) as u32)
}

/// Names of the papers.
pub fn papers() -> Vec<&'static str> {
    Paper::ALL.map(Paper::name).into()
}

/// Writes a sheet with `board` into `folder`, if plain with the code for `id`. Keeps an existing
/// file of the same sheet, and never overwrites another.
///
/// # Errors
///
/// If the board doesn't fit on paper number `paper` or can't have these markers, or the file can't
/// be written.
pub fn print(
    folder: &Path,
    board: BoardChoice,
    paper: usize,
    id: BoardId,
) -> anyhow::Result<PrintedBoard> {
    let paper = Paper::ALL.get(paper).copied().unwrap_or(Paper::A4);
    let sheet = BoardSheet::new(board, None, &paper.pages())?.with_code(id);
    let (bytes, has_code) = (sheet.bytes(SheetKind::Pdf, None)?, sheet.id().is_some());
    let plan = sheet.plan;
    let name = format!("{}-{}", plan.file_stem(), paper.name());
    let file = free_or_same(folder, &name, &bytes)?;
    Ok(PrintedBoard {
        file,
        square_m: 1e-3 * plan.square_mm,
        steps: text::target_steps(&plan, has_code).into_iter().take(3).collect(),
    })
}

fn free_or_same(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<PathBuf> {
    let mut path = folder.join(format!("{name}.pdf"));
    for number in 2..NAMES {
        if !path.exists() {
            break;
        }
        if read(&path, LIMIT, Links::Refused).is_ok_and(|before| before == bytes) {
            return Ok(path);
        }
        path = folder.join(format!("{name}-{number}.pdf"));
    }
    save(&path, bytes, Overwrite::Never)?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::boards::{MarkerSide, Pattern};

    #[test]
    fn a_sheet_is_written_once_and_nothing_is_overwritten() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        let id = new_id();
        let print = |size| print(folder.path(), BoardChoice::of(size, Pattern::Plain), 0, id);
        let first = print([9, 6])?;
        assert!((first.square_m - 0.02).abs() < 0.01, "{first:?}");
        assert_eq!(print([9, 6])?.file, first.file);
        save(&first.file, b"mine", Overwrite::Allowed)?;
        let second = print([9, 6])?;
        assert_ne!(second.file, first.file);
        assert_eq!(read(&first.file, LIMIT, Links::Refused)?, b"mine");
        assert!(print([300, 300]).is_err(), "squares too small to print");
        Ok(())
    }

    #[test]
    fn a_sheet_has_the_markers_that_were_chosen() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        let (dictionary, side) = ("4x4_50".parse()?, MarkerSide::Squares(0.6));
        let markers = Pattern::Charuco { dictionary, side };
        let print = |size| print(folder.path(), BoardChoice::of(size, markers), 0, new_id());
        let printed = print([7, 10])?;
        let name = printed.file.file_name().map(|name| name.to_string_lossy().into_owned());
        assert_eq!(name.as_deref(), Some("charuco-8x11-21mm-DICT_4X4_50-A4.pdf"));
        assert!(printed.steps.len() == 3 && print([7, 10])?.file == printed.file);
        let plain =
            super::print(folder.path(), BoardChoice::of([7, 10], Pattern::Plain), 0, new_id())?;
        let size = |file: &Path| anyhow::Ok(read(file, LIMIT, Links::Refused)?.len());
        assert_ne!(size(&plain.file)?, size(&printed.file)?);
        assert!(print([12, 9]).is_err(), "65 markers of 50");
        Ok(())
    }
}
