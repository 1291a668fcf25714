//! Bytes of a pipe: from a command, which is always ended, or standard input.

use std::{
    io::{IsTerminal, Read, Stdin, stdin},
    os::fd::{AsFd, BorrowedFd},
    process::{ChildStderr, Command, Stdio},
    time::{Duration, Instant},
};

use crate::{
    programs::{Program, read_more, timespec},
    stream_report::Loss,
};
use boresight_geometry::device::Fault;
use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    fs::{FileType, fstat},
    process::WaitIdStatus,
};

/// Bytes kept of the command's last messages, and letters shown.
const MESSAGES_KEPT: usize = 4096;
const LETTERS_SHOWN: usize = 160;

/// An open pipe.
pub(super) enum Feed {
    Command(Running),
    Stdin(Stdin),
}

/// Result of an attempt to read.
pub(super) enum Got {
    Bytes,
    Nothing,
    End,
}

/// A running command.
pub(super) struct Running {
    program: Program,
    err: Option<ChildStderr>,
    /// The last messages.
    kept: Vec<u8>,
}

impl Feed {
    /// Starts the command `words`, without a shell.
    pub(super) fn start(words: &[String]) -> Result<Self, Loss> {
        let Some((name, arguments)) = words.split_first() else {
            return Err((Fault::NoCommand, "nothing follows pipe:".into()));
        };
        let mut command = Command::new(name);
        command.args(arguments);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut program = Program::start(command, true).map_err(|err| {
            let why = match err.kind() {
                std::io::ErrorKind::NotFound => "not found".into(),
                std::io::ErrorKind::PermissionDenied => "not executable".into(),
                _ => err.to_string(),
            };
            (Fault::NoCommand, format!("{name}: {why}"))
        })?;
        let err = program.child.stderr.take();
        Ok(Self::Command(Running { program, err, kept: Vec::new() }))
    }

    /// Standard input, and true if it's a file, which can wait.
    pub(super) fn stdin() -> Result<(Self, bool), Loss> {
        let input = stdin();
        if input.is_terminal() {
            return Err((Fault::NotPictures, "standard input is this terminal".into()));
        }
        let kind = fstat(&input).map(|stat| FileType::from_raw_mode(stat.st_mode));
        Ok((Self::Stdin(input), kind == Ok(FileType::RegularFile)))
    }

    /// Waits at most `patience` for bytes and appends them. A command's messages are read
    /// meanwhile: a full pipe would stop it.
    pub(super) fn read(&mut self, bytes: &mut Vec<u8>, patience: Duration) -> std::io::Result<Got> {
        let until = Instant::now() + patience;
        loop {
            let wait = timespec(until.saturating_duration_since(Instant::now()));
            let [pictures, messages] = self.readable(&wait)?;
            if messages && let Self::Command(running) = self {
                running.listen();
            }
            if pictures {
                let got = self.output().map_or(Ok(0), |output| read_more(output, bytes))?;
                return Ok(if got == 0 { Got::End } else { Got::Bytes });
            }
            if !messages {
                return Ok(Got::Nothing);
            }
        }
    }

    fn output(&self) -> Option<BorrowedFd<'_>> {
        match self {
            Self::Command(running) => running.program.child.stdout.as_ref().map(AsFd::as_fd),
            // Without the standard library's buffer, which would hide bytes from `poll`.
            Self::Stdin(input) => Some(input.as_fd()),
        }
    }

    /// Availability of bytes, or an end, of pictures and of messages.
    fn readable(&self, wait: &Timespec) -> std::io::Result<[bool; 2]> {
        let Some(output) = self.output() else { return Ok([true, false]) };
        let err = match self {
            Self::Command(running) => running.err.as_ref().map(AsFd::as_fd),
            Self::Stdin(_) => None,
        };
        // The same twice if there are no messages to wait for.
        let mut sources =
            [output, err.unwrap_or(output)].map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN));
        let watched = if err.is_some() { 2 } else { 1 };
        match poll(&mut sources[..watched], Some(wait)) {
            // A signal came between; the caller asks again.
            Ok(0) | Err(rustix::io::Errno::INTR) => Ok([false; 2]),
            Ok(_) => {
                let [pictures, messages] = sources.map(|source| !source.revents().is_empty());
                Ok([pictures, messages && err.is_some()])
            }
            Err(err) => Err(err.into()),
        }
    }

    /// End of a command after its output, with the last words: `None` after success, and for
    /// standard input.
    pub(super) fn failure(&mut self) -> Option<String> {
        let Self::Command(running) = self else { return None };
        let how = running.failure()?;
        Some(self.with_last_words(how))
    }

    /// `what`, followed by the command's last words.
    pub(super) fn with_last_words(&mut self, what: String) -> String {
        let Self::Command(running) = self else { return what };
        let words = running.last_words();
        if words.is_empty() { what } else { format!("{what}: {words}") }
    }
}

impl Running {
    fn listen(&mut self) {
        let mut chunk = [0; MESSAGES_KEPT];
        let got = self.err.as_mut().and_then(|err| err.read(&mut chunk).ok()).unwrap_or(0);
        if got == 0 {
            self.err = None;
        }
        self.kept.extend(&chunk[..got]);
        self.kept.drain(..self.kept.len().saturating_sub(MESSAGES_KEPT));
    }

    fn last_words(&mut self) -> String {
        while let Some(err) = &self.err
            && poll(&mut [PollFd::new(err, PollFlags::IN)], Some(&timespec(Duration::ZERO)))
                .is_ok_and(|n| n > 0)
        {
            self.listen();
        }
        let text = String::from_utf8_lossy(&self.kept);
        let last = text.split(['\n', '\r']).map(str::trim).rfind(|line| !line.is_empty());
        last.unwrap_or_default().chars().take(LETTERS_SHOWN).collect()
    }

    fn failure(&mut self) -> Option<String> {
        match self.program.wait() {
            Some(status) if status.exit_status() == Some(0) => None,
            Some(status) => Some(ended(&status)),
            // It has closed its output and continues.
            None => Some("its output ended".into()),
        }
    }
}

fn ended(status: &WaitIdStatus) -> String {
    match (status.exit_status(), status.terminating_signal()) {
        (Some(code), _) => format!("exit status {code}"),
        (None, Some(signal)) => format!("ended by signal {signal}"),
        (None, None) => "it ended".into(),
    }
}
