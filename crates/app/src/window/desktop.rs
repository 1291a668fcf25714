//! Desktop around the program: detection, and opening of files.

use std::{
    io,
    path::Path,
    process::{Child, Command, Stdio},
    thread::Builder,
};

/// The system's program to open a file with the default application.
const OPENER: &str = if cfg!(target_os = "macos") {
    "open"
} else if cfg!(windows) {
    "explorer"
} else {
    "xdg-open"
};

/// True if there is a display to open a window on. X11 and Wayland displays are named by the
/// environment; other systems always have a display.
pub fn has_display() -> bool {
    let named = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    cfg!(any(not(unix), target_os = "macos"))
        || ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"].iter().any(|name| named(name))
}

/// Opens `file` with the desktop's program, without waiting.
///
/// # Errors
///
/// If the desktop has no program to open files.
pub fn show(file: &Path) -> io::Result<()> {
    let mut opener = Command::new(OPENER);
    opener.arg(file).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    await_end(opener.spawn()?);
    Ok(())
}

/// Waits for the end of `child` in the background, to leave no zombie.
fn await_end(mut child: Child) {
    // Without a thread, the child is forgotten when the program ends.
    Builder::new().name("viewer".into()).spawn(move || child.wait()).ok();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn a_viewer_that_has_ended_leaves_nothing_behind() {
        let child = Command::new("true").spawn().expect("a program");
        let process = std::path::PathBuf::from(format!("/proc/{}", child.id()));
        await_end(child);
        let began = std::time::Instant::now();
        while process.exists() && began.elapsed().as_secs() < 20 {
            std::thread::yield_now();
        }
        assert!(!process.exists());
    }
}
