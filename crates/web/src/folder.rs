//! In-memory folder of a session.

use std::{collections::BTreeMap, io::Cursor};

use image::{GrayImage, ImageFormat};

use boresight_app::{REPORT_FILE, RESULT_FILE};
use boresight_capture::{Upright, decoded};
use boresight_geometry::frame::FrameId;
use boresight_guide::session::{Decision, Input};
use boresight_run::recording::{Header, JournalText, Line, Stored, stored_png};

/// Header, journal and pictures, in the program's folder format.
pub(crate) struct Folder {
    header: String,
    journal: JournalText,
    lines: Vec<Vec<u8>>,
    /// PNG files by frame number.
    pictures: BTreeMap<u64, Vec<u8>>,
}

impl Folder {
    pub(crate) fn new(header: &Header) -> anyhow::Result<Self> {
        let header = header.text()?;
        let journal = JournalText::new(&header);
        Ok(Self { header, journal, lines: Vec::new(), pictures: BTreeMap::new() })
    }

    /// Stores a picture.
    pub(crate) fn store(&mut self, id: FrameId, picture: &GrayImage) -> anyhow::Result<Stored> {
        let (png, stored) = stored_png(id, picture)?;
        self.pictures.insert(id.0, png);
        Ok(stored)
    }

    /// Appends an input with the decision.
    pub(crate) fn append(
        &mut self,
        input: &Input,
        decision: &Decision,
        stored: Option<Stored>,
    ) -> anyhow::Result<()> {
        self.lines.push(self.journal.line(input, decision, stored)?);
        self.journal.kept();
        Ok(())
    }

    /// Lines of the journal, read back.
    pub(crate) fn lines(&self) -> impl Iterator<Item = Result<Line, String>> + '_ {
        (0..).zip(&self.lines).map(|(seq, line)| JournalText::read(line, seq))
    }

    /// Picture of a frame, if stored.
    pub(crate) fn picture(&self, frame: u64) -> Option<GrayImage> {
        let png = Cursor::new(self.pictures.get(&frame)?);
        decoded(png, ImageFormat::Png, Upright::AsStored).ok()
    }

    /// Tar file of the folder, including result and report.
    pub(crate) fn archive(
        &self,
        name: &str,
        result: &[u8],
        report: &[u8],
    ) -> anyhow::Result<Vec<u8>> {
        let mut archive = tar::Builder::new(Vec::new());
        let mut add = |file: &str, bytes: &[u8]| {
            let mut entry = tar::Header::new_ustar();
            entry.set_size(bytes.len() as u64);
            entry.set_mode(0o644);
            archive.append_data(&mut entry, format!("{name}/{file}"), bytes)
        };
        add("session.toml", self.header.as_bytes())?;
        add("journal.jsonl", &self.lines.concat())?;
        for (frame, png) in &self.pictures {
            add(&FrameId(*frame).stored_name(), png)?;
        }
        add(RESULT_FILE, result)?;
        add(REPORT_FILE, report)?;
        Ok(archive.into_inner()?)
    }
}
