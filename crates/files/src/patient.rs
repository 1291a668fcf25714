//! Calls that a signal interrupts: repeated, but not for ever.

use std::{
    fs::File,
    io::{self, Read, Write},
};

/// Most interruptions in a row: a signal interrupts a call once, a broken file system each time.
const MOST_IN_A_ROW: u32 = 10_000;

/// A file with a bounded patience: the standard library repeats an interrupted call for ever.
#[derive(Debug)]
pub struct Patient<F> {
    file: F,
    interrupted: u32,
}

impl<F> Patient<F> {
    /// A file whose next call is the first.
    pub fn new(file: F) -> Self {
        Self { file, interrupted: 0 }
    }

    pub(super) fn call<T>(&mut self, call: impl FnOnce(&mut F) -> io::Result<T>) -> io::Result<T> {
        let result = call(&mut self.file);
        let is_interrupted =
            result.as_ref().is_err_and(|err| err.kind() == io::ErrorKind::Interrupted);
        self.interrupted = if is_interrupted { self.interrupted + 1 } else { 0 };
        if self.interrupted > MOST_IN_A_ROW {
            return Err(io::Error::other("every call is interrupted"));
        }
        result
    }
}

impl<F: Read> Read for Patient<F> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.call(|file| file.read(into))
    }
}

impl<F: Write> Write for Patient<F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.call(|file| file.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.call(Write::flush)
    }
}

/// [`File::sync_all`] with a bounded patience.
#[cfg(target_os = "linux")]
pub(super) fn sync_all(file: &File) -> io::Result<()> {
    synced(|| rustix::fs::fsync(file))
}

/// [`File::sync_data`] with a bounded patience.
#[cfg(target_os = "linux")]
pub(super) fn sync_data(file: &File) -> io::Result<()> {
    synced(|| rustix::fs::fdatasync(file))
}

#[cfg(target_os = "linux")]
fn synced(mut sync: impl FnMut() -> rustix::io::Result<()>) -> io::Result<()> {
    let mut patient = Patient::new(());
    loop {
        match patient.call(|()| Ok(sync()?)) {
            Err(err) if err.kind() == io::ErrorKind::Interrupted => {}
            done => return done,
        }
    }
}

#[cfg(not(target_os = "linux"))]
pub(super) fn sync_all(file: &File) -> io::Result<()> {
    file.sync_all()
}

#[cfg(not(target_os = "linux"))]
pub(super) fn sync_data(file: &File) -> io::Result<()> {
    file.sync_data()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Interrupted before each byte, a number of times.
    struct Interrupted(u32, u32);

    impl Read for Interrupted {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            self.1 = (self.1 + 1) % (self.0 + 1);
            if self.1 > 0 {
                return Err(io::ErrorKind::Interrupted.into());
            }
            into[0] = 7;
            Ok(1)
        }
    }

    impl Write for Interrupted {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.read(&mut bytes[..1].to_vec())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn interruptions_cost_nothing_and_do_not_last_for_ever() {
        let mut now_and_then = Patient::new(Interrupted(9000, 0));
        now_and_then.write_all(b"three").expect("written");
        now_and_then.read_exact(&mut [0; 3]).expect("read");
        let mut always = Patient::new(Interrupted(u32::MAX - 1, 0));
        assert_eq!(always.write_all(b"x").expect_err("no end").kind(), io::ErrorKind::Other);
        assert_eq!(always.read_exact(&mut [0]).expect_err("no end").kind(), io::ErrorKind::Other);
        #[cfg(target_os = "linux")]
        assert!(synced(|| Err(rustix::io::Errno::INTR)).is_err());
    }
}
