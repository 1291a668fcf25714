//! The lines of a journal as text, for any storage.

use super::{
    envelope::{self, Unread, checksum},
    format::{Envelope, InputLine, Line, Stored},
};
use boresight_guide::session::{Decision, Input};

/// Writer of a journal's lines. A written line counts once confirmed by [`Self::kept`].
#[derive(Debug)]
pub struct JournalText {
    next_seq: u64,
    /// CRC-32 of `session.toml`, for the first line.
    header_crc32: String,
    /// Number of lines safe from a power cut, and the number stated by the journal.
    synced: u64,
    synced_told: u64,
}

impl JournalText {
    /// Writer for a new session with the text `header` in `session.toml`.
    pub fn new(header: &str) -> Self {
        Self::after(0, checksum(header.as_bytes()))
    }

    /// Writer after `lines` lines, for a session with the given checksum of the header.
    pub(super) fn after(lines: u64, header_crc32: String) -> Self {
        Self { next_seq: lines, header_crc32, synced: 0, synced_told: 0 }
    }

    /// Text of an input with the decision, and the newline.
    ///
    /// # Errors
    ///
    /// If a number can't be written.
    pub fn line(
        &self,
        input: &Input,
        decision: &Decision,
        stored: Option<Stored>,
    ) -> serde_json::Result<Vec<u8>> {
        let decision = serde_json::value::to_raw_value(decision)?;
        let input = InputLine::from(input);
        self.enclosed(Line { input, decision, stored, session: None, synced: None })
    }

    /// Reads the line numbered `seq`, from 0, in `text`.
    ///
    /// # Errors
    ///
    /// The reason why it isn't one.
    pub fn read(text: &[u8], seq: u64) -> Result<Line, String> {
        envelope::parse(text.trim_ascii_end(), seq).map_err(|unread| match unread {
            Unread::Damaged(reason) | Unread::Newer(reason) => reason,
        })
    }

    /// Text of `line` as the next one, with what it states about the lines before.
    pub(super) fn enclosed(&self, mut line: Line) -> serde_json::Result<Vec<u8>> {
        line.session = (self.next_seq == 0).then(|| self.header_crc32.clone());
        line.synced = (self.synced > self.synced_told).then_some(self.synced);
        let body = serde_json::value::to_raw_value(&line)?;
        let envelope = Envelope {
            seq: self.next_seq,
            crc32: checksum(body.get().as_bytes()),
            session: None,
            synced: None,
            body,
        };
        let mut bytes = serde_json::to_vec(&envelope)?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    /// Confirms that the newest line is kept; the next line follows it.
    pub fn kept(&mut self) {
        self.synced_told = self.synced;
        self.next_seq += 1;
    }

    /// Confirms that every kept line outlasts a power cut.
    pub(super) fn synced(&mut self) {
        self.synced = self.next_seq;
    }
}

#[cfg(test)]
mod tests {
    use serde_json::value::RawValue;

    use super::*;

    #[test]
    fn no_changed_bit_of_a_line_goes_unseen() {
        let mut journal = JournalText::new("header");
        for seq in 0..3 {
            let decision = RawValue::from_string("{}".into()).expect("JSON");
            let input = InputLine::Stop;
            let line = Line { input, decision, stored: None, session: None, synced: None };
            let text = journal.enclosed(line).expect("written");
            journal.kept();
            // The next line states it.
            journal.synced();
            let whole = text.trim_ascii_end();
            JournalText::read(whole, seq).expect("whole");
            for bit in 0..8 * whole.len() {
                let mut changed = whole.to_vec();
                changed[bit / 8] ^= 1 << (bit % 8);
                let read = JournalText::read(&changed, seq);
                assert!(read.is_err(), "{}", String::from_utf8_lossy(&changed));
            }
        }
    }
}
