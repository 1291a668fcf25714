//! Memory of the window between starts: a small file in the person's configuration folder.

use std::path::{Path, PathBuf};

use crate::window::services::Memory;
use boresight_files::{FileError, Links, Overwrite, make_folder, read_text, save};

const FILE: &str = "window.toml";
/// Largest readable file, in bytes; a file of choices is far smaller.
const LIMIT: u64 = 1 << 20;

/// Path of the file; `None` if the system names no folder for it.
pub fn usual_path() -> Option<PathBuf> {
    let folder =
        |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let configuration = folder("XDG_CONFIG_HOME")
        .or_else(|| folder("APPDATA"))
        .or_else(|| Some(folder("HOME")?.join(".config")))?;
    Some(configuration.join("boresight").join(FILE))
}

/// Reads the file. A missing or unreadable file gives no choices: they are quickly made again.
pub fn read(path: &Path) -> Memory {
    let text = read_text(path, LIMIT, Links::Followed).unwrap_or_default();
    toml::from_str::<Memory>(&text).unwrap_or_default().sensible()
}

/// Writes the file.
///
/// # Errors
///
/// [`FileError`]; the choices then last until the window is closed.
pub fn write(path: &Path, memory: &Memory) -> Result<(), FileError> {
    if let Some(folder) = path.parent() {
        make_folder(folder)?;
    }
    let text = toml::to_string(memory).unwrap_or_default();
    save(path, text.as_bytes(), Overwrite::Allowed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::boards::{MarkerSide, Pattern};
    use boresight_guide::guidance::Plan;

    #[test]
    fn what_is_written_is_read_back() -> Result<(), Box<dyn std::error::Error>> {
        let home = tempfile::tempdir()?;
        let path = home.path().join("of/nobody").join(FILE);
        assert_eq!(read(&path), Memory::default(), "an empty home");
        let (dictionary, side) = ("5x5_100".parse()?, MarkerSide::Metres(0.021));
        let mut memory = Memory {
            source: Some("usb:046d:0825:1F3A".into()),
            board: Some([7, 5]),
            pattern: Pattern::Charuco { dictionary, side },
            square_m: Some(0.0305),
            plan: Some(Plan::Quick),
            mirrored: Some(true),
            ..Memory::default()
        };
        memory.note_stream("rtsp://10.0.0.7/front");
        write(&path, &memory)?;
        assert_eq!(read(&path), memory);
        write(&path, &Memory::default())?;
        assert_eq!(read(&path), Memory::default());
        Ok(())
    }

    #[test]
    fn nonsense_is_forgotten() -> Result<(), Box<dyn std::error::Error>> {
        let home = tempfile::tempdir()?;
        let path = home.path().join(FILE);
        for text in [
            "board = [",
            "board = [0, 70000]",
            "\0",
            "zoom = \"large\"",
            "[markers]\ndictionary = \"9X9\"",
        ] {
            save(&path, text.as_bytes(), Overwrite::Allowed)?;
            assert_eq!(read(&path), Memory::default(), "{text}");
        }
        save(&path, b"board = [2, 500]\nsquare_m = nan\nzoom = 1e9", Overwrite::Allowed)?;
        assert_eq!(read(&path), Memory::default(), "no such board");
        Ok(())
    }
}
