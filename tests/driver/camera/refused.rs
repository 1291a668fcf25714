//! A camera not permitted to the user, and a camera in use by another program: messages to the
//! person, and the continuation once the reason is gone.

use std::{
    fs::{self, File},
    os::unix::{fs::PermissionsExt, process::CommandExt},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicU32, Ordering::Relaxed},
    time::{Duration, Instant},
};

use boresight::device::Fault;

use super::{LONG, cameras, row, tell};

/// Program as used by the person.
const PROGRAM: &str = "/app/boresight";
/// A user without rights.
const NOBODY: u32 = 65534;
/// Message once pictures may be taken.
const READY: &str = "Controls:";

/// Number of begun sessions, each with a folder and a file each.
static SESSIONS: AtomicU32 = AtomicU32::new(0);

/// The program on the camera at `node`, as started by a person.
struct Started {
    child: Child,
    /// Messages to the person, and the number of lines read.
    said: PathBuf,
    read: usize,
}

impl Started {
    fn new(node: &Path, user: u32) -> Self {
        let name = format!("guided-{}", SESSIONS.fetch_add(1, Relaxed));
        let folder = std::env::temp_dir().join(name);
        let said = folder.with_extension("said");
        let child = Command::new(PROGRAM)
            .args(["guide", "--headless", "--set", "camera.mode=640x480@30:MJPG", "--source"])
            .arg(node)
            .arg("--out")
            .arg(folder)
            .uid(user)
            .stdin(Stdio::null())
            .stderr(File::create(&said).expect("a file"))
            .spawn()
            .expect("starts");
        Self { child, said, read: 0 }
    }

    /// Next line with `word` inside.
    fn says(&mut self, word: &str) -> String {
        let began = Instant::now();
        loop {
            let text = fs::read_to_string(&self.said).expect("readable");
            let whole = text.rfind('\n').map_or("", |end| &text[..end]);
            for line in whole.lines().skip(self.read) {
                self.read += 1;
                if line.contains(word) {
                    return line.trim().into();
                }
            }
            assert!(began.elapsed() < LONG, "no {word:?} in: {text}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Exit code, once ended unaided.
    fn code(mut self) -> Option<i32> {
        self.child.wait().expect("ends").code()
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// Lets everyone use the node at `path`, as the group `video` may on an ordinary system.
fn permit(path: &Path) {
    fs::set_permissions(path, PermissionsExt::from_mode(0o666)).expect("root may");
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn a_camera_that_this_user_may_not_open_is_named_with_the_remedy() {
    let node = cameras(1).remove(0).node.path;
    fs::set_permissions(&node, PermissionsExt::from_mode(0o600)).expect("root may");
    let mut refused = Started::new(&node, NOBODY);
    let said = refused.says(Fault::NotPermitted.code());
    assert!(said.contains(node.to_str().expect("text")), "{said}");
    let remedy = refused.says("No permission to use the camera. Run: sudo usermod -aG video");
    assert_eq!(refused.code(), Some(1));

    permit(&node);
    let allowed_at = Instant::now();
    let mut running = Started::new(&node, NOBODY);
    running.says(READY);
    row("no right to open it", &format!("{said}. {remedy}"), allowed_at.elapsed());

    // A replugged camera has a new node, with rights of its own.
    tell("unplug");
    running.says(Fault::Unplugged.code());
    tell("plug");
    let said = running.says(Fault::NotPermitted.code());
    permit(&cameras(1)[0].node.path);
    let allowed_at = Instant::now();
    running.says("The camera is back");
    row("no right after it was replugged", &said, allowed_at.elapsed());
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn a_camera_that_another_program_has_is_named_with_that_program() {
    let node = cameras(1).remove(0).node.path;
    let mut holder = Started::new(&node, 0);
    holder.says(READY);
    let mut second = Started::new(&node, 0);
    let said = second.says(Fault::Busy.code());
    let who = format!("boresight, process {}", holder.child.id());
    assert!(said.contains(&who), "no {who:?} in {said}");
    let remedy = second.says("Another program is using the camera. Close that program.");
    assert_eq!(second.code(), Some(1));

    let ended_at = Instant::now();
    drop(holder);
    Started::new(&node, 0).says(READY);
    row("another program has it", &format!("{said}. {remedy}"), ended_at.elapsed());
}
