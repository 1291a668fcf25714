//! Secrets in a file.

use std::path::Path;

use super::{FileError, Links, Overwrite, plain::file_or_nothing, read_text, save::save_with_mode};

/// Text of the file at `path`, readable by the owner only. Without a file, stores and returns
/// `fresh`; if several programs store at once, all return the text of the first.
///
/// # Errors
///
/// [`FileError::NotPrivate`] if others may read the file; as [`read_text`] and [`super::save()`].
/// Links are refused.
pub fn read_or_make_private(
    path: &Path,
    limit_bytes: u64,
    fresh: impl FnOnce() -> String,
) -> Result<String, FileError> {
    if !file_or_nothing(path)? {
        let fresh = fresh();
        match save_with_mode(path, fresh.as_bytes(), Overwrite::Never, 0o600) {
            Err(FileError::Exists { .. }) => {}
            saved => return saved.map(|()| fresh),
        }
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let kept = super::open(path, Links::Refused)?;
        let mode = kept.metadata().map_err(FileError::reading(path))?.permissions().mode();
        if mode & 0o077 != 0 {
            return Err(FileError::NotPrivate { path: path.to_path_buf() });
        }
    }
    read_text(path, limit_bytes, Links::Refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secret_is_made_once_and_read_again() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("key");
        let of = |fresh: &str| read_or_make_private(&path, 100, || fresh.to_owned());
        assert_eq!(of("first").expect("made"), "first");
        assert_eq!(of("second").expect("read"), "first");
    }

    #[test]
    fn two_programs_that_start_at_once_have_the_same_secret() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("key");
        // A second program stores its text between the look and the write.
        let slower = read_or_make_private(&path, 100, || {
            let faster = read_or_make_private(&path, 100, || "theirs".into());
            assert_eq!(faster.expect("made"), "theirs");
            "ours".into()
        });
        assert_eq!(slower.expect("read"), "theirs");
    }

    #[cfg(unix)]
    #[test]
    fn a_secret_that_others_can_read_is_none() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("key");
        let of = |path: &Path| read_or_make_private(path, 100, || "fresh".into());
        assert_eq!(of(&path).expect("made"), "fresh");
        let mode = path.metadata().expect("there").permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        let link = place.path().join("link");
        symlink(&path, &link).expect("made");
        assert!(matches!(of(&link), Err(FileError::NotAFile { .. })));
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o640)).expect("changed");
        assert!(matches!(of(&path), Err(FileError::NotPrivate { .. })));
    }
}
