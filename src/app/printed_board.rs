//! The board on paper, written from the window: the largest squares that fit.

use std::path::{Path, PathBuf};

use anyhow::anyhow;

use super::host::PrintedBoard;
use crate::{
    files::{Links, Overwrite, read, save},
    target::{Paper, Square, pdf, plan, sheet},
    text,
};

/// A sheet with a board is far smaller.
const LIMIT: u64 = 16 << 20;
/// Names tried for a sheet that differs from one of the same name.
const NAMES: u32 = 100;

/// Names of the papers.
pub(super) fn papers() -> Vec<&'static str> {
    Paper::ALL.map(Paper::name).into()
}

/// Writes a sheet with a board of `columns` × `rows` inner corners into `folder`. A file that holds the same sheet is
/// kept; any other one is left alone.
///
/// # Errors
///
/// If the board doesn't fit on the paper of that number, or the file can't be written.
pub(super) fn print(
    folder: &Path,
    [columns, rows]: [u16; 2],
    paper: usize,
) -> anyhow::Result<PrintedBoard> {
    let paper = Paper::ALL.get(paper).copied().unwrap_or(Paper::A4);
    let plan = plan(columns, rows, Square::Largest, &paper.pages())
        .map_err(|err| anyhow!("{err}: {}", text::does_not_fit(&err)))?;
    let bytes = pdf(&sheet(&plan, &text::target_lines(&plan)));
    let name = format!("checkerboard-{columns}x{rows}-{}mm-{}", plan.square_mm, paper.name());
    let file = free_or_same(folder, &name, &bytes)?;
    Ok(PrintedBoard {
        file,
        square_m: 1e-3 * plan.square_mm,
        steps: text::target_steps(&plan).into_iter().take(3).collect(),
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

    #[test]
    fn a_sheet_is_written_once_and_nothing_is_overwritten() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        let first = print(folder.path(), [9, 6], 0)?;
        assert!((first.square_m - 0.02).abs() < 0.01, "{first:?}");
        assert_eq!(print(folder.path(), [9, 6], 0)?.file, first.file);
        save(&first.file, b"mine", Overwrite::Allowed)?;
        let second = print(folder.path(), [9, 6], 0)?;
        assert_ne!(second.file, first.file);
        assert_eq!(read(&first.file, LIMIT, Links::Refused)?, b"mine");
        assert!(print(folder.path(), [99, 99], 0).is_err(), "squares too small to print");
        Ok(())
    }
}
