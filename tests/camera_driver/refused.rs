//! A camera that this user may not open, and one that another program has: what the program says to a person,
//! and that it goes on once the reason is gone.

use std::{
    io::{BufRead, BufReader},
    os::unix::{fs::PermissionsExt, process::CommandExt},
    path::Path,
    process::{Child, Command, Stdio},
    sync::{
        atomic::{AtomicU32, Ordering::Relaxed},
        mpsc::{Receiver, channel},
    },
    time::Instant,
};

use boresight::device::Fault;

use crate::{LONG, cameras, row, tell};

/// The program that the person uses.
const PROGRAM: &str = "/app/boresight";
/// A user without rights.
const NOBODY: u32 = 65534;
/// Said once pictures may be taken.
const READY: &str = "Controls:";

/// Sessions begun, each in a folder of its own.
static SESSIONS: AtomicU32 = AtomicU32::new(0);

/// The program on the camera at `node`, as a person started it.
struct Started {
    child: Child,
    lines: Receiver<String>,
}

impl Started {
    fn new(node: &Path, user: u32) -> Self {
        let mut child = Command::new(PROGRAM)
            .args(["guide", "--headless", "--set", "camera.mode=640x480@30:MJPG", "--source"])
            .arg(node)
            .arg("--out")
            .arg(std::env::temp_dir().join(format!("guided-{}", SESSIONS.fetch_add(1, Relaxed))))
            .uid(user)
            .stdin(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("starts");
        let stderr = child.stderr.take().expect("is read");
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            BufReader::new(stderr).lines().map_while(Result::ok).try_for_each(|l| sender.send(l))
        });
        Self { child, lines }
    }

    /// The next line that has `word` in it.
    fn says(&self, word: &str) -> String {
        let (began, mut said) = (Instant::now(), String::new());
        loop {
            match self.lines.recv_timeout(LONG.saturating_sub(began.elapsed())) {
                Ok(line) if line.contains(word) => return line.trim().into(),
                Ok(line) => said = format!("{said}\n{line}"),
                Err(_) => panic!("no {word:?} in: {said}"),
            }
        }
    }

    /// Its exit code, once it has ended by itself.
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
    std::fs::set_permissions(path, PermissionsExt::from_mode(0o666)).expect("root may");
}

#[test]
#[ignore = "needs the camera of tests/vm"]
fn a_camera_that_this_user_may_not_open_is_named_with_the_remedy() {
    let node = cameras(1).remove(0).node.path;
    std::fs::set_permissions(&node, PermissionsExt::from_mode(0o600)).expect("root may");
    let refused = Started::new(&node, NOBODY);
    let said = refused.says(Fault::NotPermitted.code());
    assert!(said.contains(node.to_str().expect("text")), "{said}");
    let remedy = refused.says("This user may not open the camera. Run: sudo usermod -aG video");
    assert_eq!(refused.code(), Some(1));

    permit(&node);
    let allowed_at = Instant::now();
    let running = Started::new(&node, NOBODY);
    running.says(READY);
    row("no right to open it", &format!("{said}. {remedy}"), allowed_at.elapsed());

    // A camera that is plugged in anew has a new node, with rights of its own.
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
    let holder = Started::new(&node, 0);
    holder.says(READY);
    let second = Started::new(&node, 0);
    let said = second.says(Fault::Busy.code());
    let who = format!("boresight, process {}", holder.child.id());
    assert!(said.contains(&who), "no {who:?} in {said}");
    let remedy = second.says("Another program uses the camera. Close that program.");
    assert_eq!(second.code(), Some(1));

    let ended_at = Instant::now();
    drop(holder);
    Started::new(&node, 0).says(READY);
    row("another program has it", &format!("{said}. {remedy}"), ended_at.elapsed());
}
