//! Tones by a program of the desktop. Silence without such a program is no error.

use std::{
    io::Write,
    path::PathBuf,
    process::{Child, Command, Stdio},
};

const SAMPLES_PER_SEC: u32 = 22_050;
/// Programs to play raw sound from standard input, with the arguments for the format.
const PLAYERS: [(&str, &[&str]); 2] = [
    ("paplay", &["--raw", "--rate=22050", "--channels=1", "--format=s16le"]),
    ("aplay", &["-q", "-t", "raw", "-r", "22050", "-c", "1", "-f", "S16_LE", "-"]),
];

/// An audible event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// A view was taken.
    Taken,
    /// The session is complete.
    Complete,
    /// Tone of a failure.
    UserError,
    /// Closeness of a camera being pushed back.
    Near {
        /// Pitch: the higher, the nearer.
        hertz: u16,
    },
}

/// Starts playerswithout waiting.
#[derive(Debug)]
pub struct Sound {
    player: Option<(PathBuf, &'static [&'static str])>,
    playing: Vec<Child>,
}

impl Sound {
    /// Looks for a player.
    pub fn found() -> Self {
        Self { player: first_of(&PLAYERS), playing: Vec::new() }
    }

    /// Plays `tone`; silent without a program that can.
    pub fn play(&mut self, tone: Tone) {
        self.playing.retain_mut(|child| matches!(child.try_wait(), Ok(None)));
        let Some((program, arguments)) = &self.player else { return };
        let child = Command::new(program)
            .args(*arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut child) = child else { return };
        if let Some(mut stdin) = child.stdin.take() {
            // Less than a pipe holds: never waits. A dead player plays nothing.
            stdin.write_all(&samples(tone)).ok();
        }
        self.playing.push(child);
    }
}

impl Drop for Sound {
    fn drop(&mut self) {
        for mut child in self.playing.drain(..) {
            child.kill().ok();
            child.wait().ok();
        }
    }
}

type Program = (&'static str, &'static [&'static str]);

fn first_of(programs: &[Program]) -> Option<(PathBuf, &'static [&'static str])> {
    let path = std::env::var_os("PATH")?;
    programs.iter().find_map(|(name, arguments)| {
        let found = std::env::split_paths(&path).map(|dir| dir.join(name)).find(|p| p.is_file())?;
        Some((found, *arguments))
    })
}

/// 16-bit samples, little endian: one, two rising or two falling notes with soft ends.
fn samples(tone: Tone) -> Vec<u8> {
    let near;
    let notes: &[f32] = match tone {
        Tone::Taken => &[880.0],
        Tone::Complete => &[660.0, 990.0],
        Tone::UserError => &[440.0, 330.0],
        Tone::Near { hertz } => {
            near = [f32::from(hertz)];
            &near
        }
    };
    let length = SAMPLES_PER_SEC / 6;
    let mut bytes = Vec::with_capacity(notes.len() * length as usize * 2);
    for hertz in notes {
        for i in 0..length {
            let share = i as f32 / length as f32;
            let swing = (std::f32::consts::TAU * hertz * i as f32 / SAMPLES_PER_SEC as f32).sin();
            let loudness = (std::f32::consts::PI * share).sin() * 0.5;
            let sample = (swing * loudness * f32::from(i16::MAX)) as i16;
            bytes.extend_from_slice(&sample.to_le_bytes());
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_fits_in_a_pipe_and_ends_softly() {
        for tone in [Tone::Taken, Tone::Complete, Tone::UserError, Tone::Near { hertz: 800 }] {
            let bytes = samples(tone);
            assert!(bytes.len() < 60_000, "{}", bytes.len());
            let last = i16::from_le_bytes([bytes[bytes.len() - 2], bytes[bytes.len() - 1]]);
            assert!(last.abs() < 200, "{last}");
        }
    }
}
