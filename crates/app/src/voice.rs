//! The computer's voice: speaks the words of a session through a program of the desktop.

use std::{
    path::PathBuf,
    process::{Child, Command, Stdio},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread::{Builder, JoinHandle},
    time::{Duration, Instant},
};

use crate::Companion;
use boresight_guide::session::Snapshot;
use boresight_present::{
    instruction::Instruction,
    speech::{Narrator, Queue, Rank, Word},
    text,
};
use boresight_run::pipeline::{Onlooker, Onlookers};

/// Programs to speak the last argument and end afterwards.
const SPEAKERS: [(&str, &[&str]); 2] = [("spd-say", &["--wait", "--"]), ("espeak-ng", &["--"])];
/// Time between two looks at the queue.
const LOOK: Duration = Duration::from_millis(20);
/// Longest time for a sentence; a program speaking for longer hangs.
const LONGEST: Duration = Duration::from_secs(8);

/// A speech program.
#[derive(Clone, Debug)]
struct Speaker {
    program: PathBuf,
    arguments: &'static [&'static str],
}

impl Speaker {
    /// First installed program.
    fn find() -> Option<Self> {
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

/// Speaks the requests of a session while switched on. Ends when dropped, after the news.
pub struct Voice {
    said: Arc<Said>,
    thread: Option<JoinHandle<()>>,
}

/// State shared by the session and the voice.
struct Said {
    queue: Mutex<Queue>,
    narrator: Mutex<Narrator>,
    began: Instant,
    on: AtomicBool,
    /// True if left and right are swapped for a person facing the camera.
    mirrored: AtomicBool,
    over: AtomicBool,
}

/// Reason for silence.
#[derive(Debug, thiserror::Error)]
pub enum NoVoice {
    /// No speech program.
    #[error("{}", text::NO_VOICE)]
    NoProgram,
    /// The system refused a thread.
    #[error("could not start the voice")]
    Thread(#[from] std::io::Error),
}

impl Default for Voice {
    fn default() -> Self {
        Self::new()
    }
}

impl Voice {
    /// A voice that is switched off.
    pub fn new() -> Self {
        let said = Arc::new(Said {
            queue: Mutex::default(),
            narrator: Mutex::default(),
            began: Instant::now(),
            on: AtomicBool::new(false),
            mirrored: AtomicBool::new(false),
            over: AtomicBool::new(false),
        });
        Self { said, thread: None }
    }

    /// Switches the voice on or off. With `mirrored`, left and right are swapped for a person
    /// facing the camera.
    ///
    /// # Errors
    ///
    /// [`NoVoice`]; the voice is then off.
    pub fn switch(&mut self, on: bool, mirrored: bool) -> Result<(), NoVoice> {
        self.said.mirrored.store(mirrored, Ordering::Relaxed);
        if on && self.thread.is_none() {
            let speaker = Speaker::find().ok_or(NoVoice::NoProgram)?;
            let said = Arc::clone(&self.said);
            let thread = Builder::new().name("voice".into()).spawn(move || speak(&said, &speaker));
            self.thread = Some(thread?);
        }
        if self.said.on.swap(on, Ordering::Relaxed) && !on {
            *self.said.queue() = Queue::default();
        }
        Ok(())
    }

    /// Speaks a test sentence.
    ///
    /// # Errors
    ///
    /// [`NoVoice`].
    pub fn test(&mut self) -> Result<(), NoVoice> {
        let mirrored = self.said.mirrored.load(Ordering::Relaxed);
        self.switch(true, mirrored)?;
        let said = text::VOICE_TEST.to_owned();
        self.said.offer(Word { rank: Rank::Taken, text: said.clone(), mirrored: said });
        Ok(())
    }

    /// Speaks passing requests while switched on; the second text to a person facing the camera.
    /// Repeated requests are heard when there is time for them.
    pub fn requests(&self) -> impl Fn(&str, &str) + Send + use<> {
        let said = Arc::clone(&self.said);
        move |text, mirrored| said.request(text, mirrored)
    }

    /// The voice beside sessions.
    pub fn companion(&self) -> Arc<dyn Companion> {
        Arc::new(Speaking(Arc::clone(&self.said)))
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
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn request(&self, text: &str, mirrored: &str) {
        let (text, mirrored) = (text.to_owned(), mirrored.to_owned());
        self.offer(Word { rank: Rank::Guidance, text, mirrored });
    }

    fn offer(&self, word: Word) {
        if self.on.load(Ordering::Relaxed) {
            let now_secs = self.began.elapsed().as_secs_f64();
            self.queue().offer(now_secs, word);
        }
    }
}

struct Speaking(Arc<Said>);

impl Companion for Speaking {
    fn onlookers(&self) -> Onlookers {
        vec![Arc::clone(&self.0) as _]
    }

    fn rig_asks(&self, sentence: &str) {
        self.0.request(sentence, sentence);
    }
}

impl Onlooker for Said {
    fn decided(&self, snapshot: &Snapshot) {
        let mut narrator = self.narrator.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instruction::of(snapshot);
        let news = narrator.news(&now);
        drop(narrator);
        if self.on.load(Ordering::Relaxed) {
            news.into_iter().chain(Narrator::request(&now)).for_each(|word| self.offer(word));
        }
    }
}

fn speak(said: &Said, speaker: &Speaker) {
    let mut speaking: Option<(Child, Instant)> = None;
    loop {
        let over = said.over.load(Ordering::Relaxed);
        let has_ended = speaking.as_mut().is_none_or(|(child, since)| {
            !matches!(child.try_wait(), Ok(None)) || since.elapsed() > LONGEST
        });
        let step = {
            let mut queue = said.queue();
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
            let mirrored = said.mirrored.load(Ordering::Relaxed);
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
