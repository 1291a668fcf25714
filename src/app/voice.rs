//! The computer's voice: says the words of a session through a program that the desktop has.

use std::{
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{Builder, JoinHandle},
    time::{Duration, Instant},
};

use crate::{
    pipeline::Onlooker,
    session::Snapshot,
    speech::{Narrator, Queue, Word},
};

/// Programs that speak their last argument and end when it's spoken.
const SPEAKERS: [(&str, &[&str]); 2] = [("spd-say", &["--wait", "--"]), ("espeak-ng", &["--"])];
/// How often the queue is looked at.
const LOOK: Duration = Duration::from_millis(20);
/// A program that speaks for longer hangs.
const LONGEST: Duration = Duration::from_secs(8);

/// A program that speaks.
#[derive(Clone, Debug)]
pub struct Speaker {
    program: PathBuf,
    arguments: &'static [&'static str],
}

impl Speaker {
    /// The first that is installed.
    pub fn find() -> Option<Self> {
        let path = std::env::var_os("PATH")?;
        SPEAKERS.iter().find_map(|(name, arguments)| {
            let program =
                std::env::split_paths(&path).map(|dir| dir.join(name)).find(|p| p.is_file())?;
            Some(Self { program, arguments })
        })
    }

    fn say(&self, text: &str) -> Option<Child> {
        Command::new(&self.program)
            .args(self.arguments)
            .arg(text)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .ok()
    }
}

/// Says what a session asks for while it looks on. Ends when dropped, after the news.
pub struct Voice {
    said: Arc<Said>,
    thread: Option<JoinHandle<()>>,
}

/// What the session and the voice share.
struct Said {
    queue: Mutex<Queue>,
    narrator: Mutex<Narrator>,
    began: Instant,
    over: AtomicBool,
}

impl Voice {
    /// Speaks through `speaker`. With `mirrored`, left and right are those of a person who faces the camera.
    ///
    /// # Errors
    ///
    /// If the system refuses a thread.
    pub fn start(speaker: Speaker, mirrored: bool) -> std::io::Result<Self> {
        let said = Arc::new(Said {
            queue: Mutex::default(),
            narrator: Mutex::default(),
            began: Instant::now(),
            over: AtomicBool::new(false),
        });
        let thread = Builder::new().name("voice".into()).spawn({
            let said = Arc::clone(&said);
            move || speak(&said, &speaker, mirrored)
        })?;
        Ok(Self { said, thread: Some(thread) })
    }

    /// Looks on at a session.
    pub fn onlooker(&self) -> Arc<dyn Onlooker> {
        Arc::clone(&self.said) as Arc<dyn Onlooker>
    }
}

impl Drop for Voice {
    fn drop(&mut self) {
        self.said.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

impl Said {
    fn offer(&self, word: Word) {
        let now_secs = self.began.elapsed().as_secs_f64();
        self.queue.lock().unwrap_or_else(PoisonError::into_inner).offer(now_secs, word);
    }
}

impl Onlooker for Said {
    fn decided(&self, snapshot: &Snapshot) {
        let news = self.narrator.lock().unwrap_or_else(PoisonError::into_inner).news(snapshot);
        news.into_iter().chain(Narrator::request(snapshot)).for_each(|word| self.offer(word));
    }
}

fn speak(said: &Said, speaker: &Speaker, mirrored: bool) {
    let mut speaking: Option<(Child, Instant)> = None;
    loop {
        let over = said.over.load(Ordering::Relaxed);
        let has_ended = speaking.as_mut().is_none_or(|(child, since)| {
            !matches!(child.try_wait(), Ok(None)) || since.elapsed() > LONGEST
        });
        let step = {
            let mut queue = said.queue.lock().unwrap_or_else(PoisonError::into_inner);
            if has_ended {
                queue.finished();
            }
            if over && queue.is_quiet() {
                break;
            }
            queue.next(said.began.elapsed().as_secs_f64())
        };
        if has_ended || step.as_ref().is_some_and(|step| step.cuts) {
            hush(speaking.take());
        }
        if let Some(step) = step {
            let text = if mirrored { &step.word.mirrored } else { &step.word.text };
            speaking = speaker.say(text).map(|child| (child, Instant::now()));
        }
        std::thread::sleep(LOOK);
    }
    hush(speaking);
}

fn hush(speaking: Option<(Child, Instant)>) {
    if let Some((mut child, _)) = speaking {
        child.kill().ok();
        child.wait().ok();
    }
}
