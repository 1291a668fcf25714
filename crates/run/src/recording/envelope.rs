//! Envelope of a journal line: number and checksum.

use serde::{Deserialize, de::IgnoredAny};
use serde_json::value::RawValue;

use super::format::{Envelope, Line, Stored};

/// Fields of a line for a pass through the whole journal.
pub(super) struct Glance {
    /// Picture stored with the line, if any.
    pub(super) stored: Option<Stored>,
    /// True if the session was resumed here.
    pub(super) is_resumed: bool,
    /// Checksum of `session.toml` in the line.
    pub(super) header_crc32: Option<String>,
    /// Number of synced lines stated by the line.
    pub(super) synced: Option<u64>,
}

/// Reads the envelope of a line with a correct checksum.
pub(super) fn enveloped(text: &[u8]) -> Result<Envelope, String> {
    let envelope: Envelope = serde_json::from_slice(text).map_err(|err| err.to_string())?;
    if envelope.crc32 != checksum(envelope.body.get().as_bytes()) {
        return Err("its checksum does not match".into());
    }
    Ok(envelope)
}

/// Reads the envelope of the line numbered `seq`, from 0.
fn numbered(text: &[u8], seq: u64) -> Result<Envelope, String> {
    let envelope = enveloped(text)?;
    if envelope.seq != seq {
        return Err(format!("it is number {}, number {seq} was due", envelope.seq));
    }
    Ok(envelope)
}

/// Reason for an unreadable line.
pub(super) enum Unread {
    /// The line has changed since the time of writing.
    Damaged(String),
    /// The line is unchanged, with contents unknown to the program's version.
    Newer(String),
}

/// Reads the line numbered `seq`, from 0.
pub(super) fn parse(text: &[u8], seq: u64) -> Result<Line, Unread> {
    let envelope = numbered(text, seq).map_err(Unread::Damaged)?;
    serde_json::from_str(envelope.body.get()).map_err(|err| {
        let reason = err.to_string();
        // serde's words for unknown parts of a type.
        let is_unknown =
            reason.starts_with("unknown field") || reason.starts_with("unknown variant");
        if is_unknown { Unread::Newer(reason) } else { Unread::Damaged(reason) }
    })
}

/// Reads the fields of a [`Glance`] from the line numbered `seq`, from 0, skipping numbers.
pub(super) fn glance(text: &[u8], seq: u64) -> Result<Glance, String> {
    glimpse(numbered(text, seq)?)
}

/// Reads the fields of a [`Glance`] from a line.
pub(super) fn glimpse(envelope: Envelope) -> Result<Glance, String> {
    #[derive(Deserialize)]
    struct Body<'a> {
        #[serde(borrow)]
        input: &'a RawValue,
        #[serde(rename = "decision")]
        _decision: IgnoredAny,
        #[serde(default)]
        stored: Option<Stored>,
        #[serde(default)]
        session: Option<String>,
        #[serde(default)]
        synced: Option<u64>,
    }
    let Envelope { session: old_session, synced: old_synced, body, .. } = envelope;
    let Body { input, stored, session, synced, .. } =
        serde_json::from_str(body.get()).map_err(|err| err.to_string())?;
    let is_resumed = input.get() == "\"resumed\"";
    let (header_crc32, synced) = (session.or(old_session), synced.or(old_synced));
    Ok(Glance { stored, is_resumed, header_crc32, synced })
}

/// CRC-32 in hexadecimal digits.
pub(super) fn checksum(bytes: &[u8]) -> String {
    format!("{:08x}", crc32fast::hash(bytes))
}
