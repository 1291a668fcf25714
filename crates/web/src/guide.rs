//! The worker's session.

use std::{io::Cursor, sync::Arc};

use anyhow::{Context, anyhow, ensure};
use image::{GrayImage, ImageFormat};
use js_sys::Date;
use serde::Serialize;
use serde_json::value::RawValue;
use wasm_bindgen::prelude::{JsError, wasm_bindgen};

use crate::{
    folder::Folder,
    judging::Given,
    request::{self, Request, told},
};
use boresight_app::{
    Announcer, REPORT_FILE, RESULT_FILE,
    session::{
        export::{self, FORMATS, Format},
        result::calibration_file,
        session_report::{Recorded, of_recorded},
    },
};
use boresight_capture::{Upright, decoded};
use boresight_detect::{Detector, DetectorParams, Search, Track};
use boresight_geometry::{
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
    markers::Dictionary,
};
use boresight_guide::{
    guidance::Progress,
    session::{Command, Input, Observation, Outcome, Session, Snapshot},
};
use boresight_present::{
    browser::{EndedPage, Live, News, NewsEvent, PageFile, Plan, PlanSource, Teller, counted},
    report::{Thumbnail, page},
    text::phone as words,
};
use boresight_run::recording::Header;

/// Maximum time for searching a picture of a stream, as in the program.
const LONGEST_SEARCH_MS: f64 = 250.0;
/// Bytes per coloured pixel of a canvas.
const RGBA: usize = 4;
/// Name of the session's folder.
const NAME: &str = "boresight-session";

/// Session with detector and stored folder.
#[wasm_bindgen]
pub struct Guide {
    header: Header,
    session: Session,
    detector: Detector,
    track: Track,
    kind: FrameKind,
    keeps_all: bool,
    next_frame: u64,
    /// Bytes of the next picture, written by the worker.
    room: Vec<u8>,
    /// Earlier picture that may still be accepted.
    in_hand: Option<(FrameId, GrayImage)>,
    folder: Folder,
    teller: Teller,
    news: u64,
    stage: &'static str,
    newest: Option<Arc<Snapshot>>,
    /// Plan last sent to the page.
    plan: Option<PlanSource>,
    files: Vec<PageFile>,
    /// Calibration to judge.
    given: Option<Given>,
}

/// Width and height of a PNG or JPEG file.
///
/// # Errors
///
/// For any other file.
#[wasm_bindgen]
pub fn size_of(file: &[u8]) -> Result<Vec<u32>, JsError> {
    let picture = picture_of(file).map_err(told)?;
    Ok(vec![picture.width(), picture.height()])
}

/// Dictionaries of ChArUco boards, with numbers of markers, as JSON.
///
/// # Errors
///
/// None known.
#[wasm_bindgen]
pub fn dictionaries() -> Result<String, JsError> {
    let named: Vec<_> = Dictionary::all().map(|it| (it.name(), it.count())).collect();
    Ok(serde_json::to_string(&named)?)
}

/// Picture in a file, read as by the program.
fn picture_of(file: &[u8]) -> anyhow::Result<GrayImage> {
    let format = image::guess_format(file).ok();
    let format = format.filter(|it| matches!(it, ImageFormat::Png | ImageFormat::Jpeg));
    let format = format.context(words::NO_PICTURE)?;
    decoded(Cursor::new(file), format, Upright::AsMarked).map_err(|why| anyhow!(why))
}

#[wasm_bindgen]
impl Guide {
    /// New session requested by the page with JSON: pictures of `width_px` by `height_px` from a
    /// stream, or photographs. With `keeps_all`, every picture is kept, not only those of views.
    ///
    /// # Errors
    ///
    /// For an impossible board.
    #[wasm_bindgen(constructor)]
    pub fn new(
        request: &str,
        width_px: u32,
        height_px: u32,
        are_photographs: bool,
        keeps_all: bool,
    ) -> Result<Self, JsError> {
        let new = || {
            let request: Request = serde_json::from_str(request)?;
            let image_size = ImageSize { width_px, height_px };
            let config = request.config()?;
            let session = Session::new(config.session(image_size)?);
            let header = Header::new(&request.source, image_size, config);
            anyhow::Ok(Self {
                folder: Folder::new(&header)?,
                header,
                session,
                detector: Detector::new(DetectorParams::default()),
                track: Track::default(),
                kind: if are_photographs { FrameKind::Photograph } else { FrameKind::Video },
                keeps_all,
                next_frame: 0,
                room: Vec::new(),
                in_hand: None,
                teller: Teller::default(),
                news: 0,
                stage: "guiding",
                newest: None,
                plan: None,
                files: Vec::new(),
                given: None,
            })
        };
        new().map_err(told)
    }

    /// Has the views judge the calibration `text` of the file `name`, too.
    ///
    /// # Errors
    ///
    /// If the file isn't a known calibration.
    pub fn judges(&mut self, name: &str, text: &str) -> Result<(), JsError> {
        self.given = Some(Given::new(name, text).map_err(told)?);
        Ok(())
    }

    /// Page before the first picture.
    ///
    /// # Errors
    ///
    /// None known.
    pub fn begin(&self) -> Result<String, JsError> {
        Ok(serde_json::to_string(&Live::empty(self.stage, false))?)
    }

    /// Buffer of `len` bytes for the next picture.
    pub fn room(&mut self, len: usize) -> *mut u8 {
        self.room.resize(len, 0);
        self.room.as_mut_ptr()
    }

    /// Judges the picture in [`Self::room`], a brightness plane first. Returns the events for the
    /// page.
    ///
    /// # Errors
    ///
    /// If the room is too small, or memory is full.
    pub fn look(&mut self, seconds: f64) -> Result<String, JsError> {
        let size = self.session.setup().image_size;
        let pixels = size.width_px as usize * size.height_px as usize;
        let mut room = std::mem::take(&mut self.room);
        room.truncate(pixels);
        let picture = GrayImage::from_raw(size.width_px, size.height_px, room);
        self.judge(picture, seconds, String::new()).map_err(told)
    }

    /// As [`Self::look`], for a picture with colours: red, green, blue and an ignored byte; or blue
    /// first.
    ///
    /// # Errors
    ///
    /// As there.
    pub fn look_coloured(&mut self, seconds: f64, is_blue_first: bool) -> Result<String, JsError> {
        // ITU-R BT.601, as in cameras; in 256ths.
        let weights: [u32; 3] = if is_blue_first { [29, 150, 77] } else { [77, 150, 29] };
        for at in 0..self.room.len() / RGBA {
            let colour = &self.room[at * RGBA..];
            let sum: u32 = weights.iter().zip(colour).map(|(w, c)| w * u32::from(*c)).sum();
            self.room[at] = (sum >> 8) as u8;
        }
        self.look(seconds)
    }

    /// As [`Self::look`], for a photograph in a file.
    ///
    /// # Errors
    ///
    /// If the file isn't a known picture.
    pub fn look_at_file(&mut self, file: &[u8], name: &str) -> Result<String, JsError> {
        picture_of(file)
            .and_then(|picture| self.judge(Some(picture), 0.0, name.to_owned()))
            .map_err(told)
    }

    /// Executes the person's command, given as JSON.
    ///
    /// # Errors
    ///
    /// For an unknown command.
    pub fn command(&mut self, command: &str) -> Result<String, JsError> {
        let mut command = || {
            let command = request::command(command)?;
            self.go_on(&command)?;
            self.input(&Input::Command(command))
        };
        command().map_err(told)
    }

    /// Ends the source of pictures.
    ///
    /// # Errors
    ///
    /// If memory is full.
    pub fn source_ended(&mut self) -> Result<String, JsError> {
        self.input(&Input::SourceEnded).map_err(told)
    }

    /// True once no further view is requested.
    pub fn is_over(&self) -> bool {
        self.newest.as_ref().is_some_and(|newest| {
            newest.decision.progress != Progress::Collecting || newest.source_ended
        })
    }

    /// Ends the session: verdict, numbers and files.
    ///
    /// # Errors
    ///
    /// If memory is full.
    pub fn end(&mut self) -> Result<String, JsError> {
        self.conclude().map_err(told)
    }

    /// File `number` in the list of the result.
    pub fn file(&self, number: usize) -> Option<Vec<u8>> {
        self.files.get(number).map(|file| file.bytes.to_vec())
    }

    /// Media type of file `number`.
    pub fn media_type(&self, number: usize) -> Option<String> {
        self.files.get(number).map(|file| file.media_type.to_owned())
    }
}

impl Guide {
    fn judge(
        &mut self,
        picture: Option<GrayImage>,
        seconds: f64,
        name: String,
    ) -> anyhow::Result<String> {
        let picture = picture.context("the picture has fewer pixels than it should")?;
        self.next_frame += 1;
        let (frame_id, began) = (FrameId(self.next_frame), Date::now());
        let captured_at = CaptureTime { nanos: (seconds.max(0.0) * 1e9) as u64 };
        let is_stream = self.kind == FrameKind::Video;
        let near = self.track.predict(self.kind, captured_at);
        let keep_on = || !is_stream || Date::now() - began < LONGEST_SEARCH_MS;
        let search = Search { near: near.as_ref(), keep_on: &keep_on, is_quick: false };
        let board = self.session.setup().board;
        let seen = self.detector.search(&picture, &board, search);
        let recognise = || self.detector.recognise(&picture, Some(&board), &keep_on);
        let seen = self.track.or_other(self.kind, captured_at, seen, recognise);
        self.track.add(self.kind, captured_at, &seen);
        let input = Input::Observed(Observation {
            frame_id,
            captured_at,
            kind: self.kind,
            name,
            image_size: ImageSize::of(&picture),
            seen,
        });
        let decision = self.session.handle(&input);
        let accepted = match decision.outcome {
            Outcome::Accepted { frame, .. } => Some(FrameId(frame)),
            _ => None,
        };
        let stored = if self.keeps_all || accepted == Some(frame_id) {
            Some(self.folder.store(frame_id, &picture)?)
        } else {
            let held = self.in_hand.as_ref().filter(|(id, _)| Some(*id) == accepted);
            held.map(|(id, picture)| self.folder.store(*id, picture)).transpose()?
        };
        self.folder.append(&input, &decision, stored)?;
        let in_hand = self.session.frame_in_hand();
        if in_hand == Some(frame_id) {
            self.in_hand = Some((frame_id, picture));
        } else {
            self.room = picture.into_raw();
            self.in_hand.take_if(|(id, _)| Some(*id) != in_hand);
        }
        let snapshot = self.session.snapshot(decision);
        self.told(snapshot)
    }

    fn input(&mut self, input: &Input) -> anyhow::Result<String> {
        let decision = self.session.handle(input);
        self.folder.append(input, &decision, None)?;
        let snapshot = self.session.snapshot(decision);
        self.told(snapshot)
    }

    /// Continues an ended session, as the program resumes a session.
    fn go_on(&mut self, command: &Command) -> anyhow::Result<()> {
        if *command == Command::TakeMore {
            ensure!(self.stage == "ended", "the session hasn't ended");
            self.stage = "guiding";
            self.input(&Input::Resumed)?;
        }
        Ok(())
    }

    /// Events for the page about `snapshot`.
    fn told(&mut self, snapshot: Snapshot) -> anyhow::Result<String> {
        let mut events = Vec::new();
        for News { word, view } in self.teller.tell(&snapshot) {
            self.news += 1;
            let (number, view) = (self.news, view.map(counted));
            events.push(("news", raw(&NewsEvent { number, age_ms: 0, view, say: &word })?));
        }
        let snapshot = Arc::new(snapshot);
        let source = PlanSource { snapshot: Arc::clone(&snapshot), refused: self.teller.refused() };
        if self.plan.as_ref() != Some(&source) {
            events.push(("plan", raw(&Plan::of(&source))?));
            self.plan = Some(source);
        }
        events.push(("live", raw(&Live::of(&snapshot, self.stage, false))?));
        self.newest = Some(snapshot);
        Ok(serde_json::to_string(&events)?)
    }

    fn conclude(&mut self) -> anyhow::Result<String> {
        self.stage = "ended";
        self.input(&Input::Stop)?;
        let (session, header) = (&self.session, &self.header);
        let calibration = calibration_file(session, header);
        let json = serde_json::to_string_pretty(&calibration.to_json()?)?;
        let report = of_recorded(Recorded {
            name: NAME.into(),
            place: words::IN_BROWSER.into(),
            command: format!("boresight replay {NAME}"),
            header,
            session,
            calibration: calibration.clone(),
            result: Some(json.as_bytes()),
            lines: self.folder.lines(),
            picture: |frame| Thumbnail::of(&self.folder.picture(frame)?),
            check: None,
            stated: &header.config.certificate,
        })
        .map_err(|why| anyhow!(why))?;
        let report = page(&report);
        let archive = self.folder.archive(NAME, json.as_bytes(), report.as_bytes())?;
        let exports = FORMATS.iter().filter(|format| **format != Format::Json);
        let exports = exports.filter_map(|format| {
            let text = export::of_session(session, &json, *format, "camera", &Announcer::silent());
            let bytes = text.ok()?.into_bytes();
            Some(PageFile::new(format.file(), format.label(), "application/octet-stream", bytes))
        });
        let exports: Vec<_> = exports.collect();
        let of_all = [
            PageFile::new(REPORT_FILE, words::REPORT, "text/html", report.into_bytes()),
            PageFile::new(RESULT_FILE, words::CALIBRATION, "application/json", json.into_bytes()),
            PageFile::new("boresight-session.tar", words::SESSION, "application/x-tar", archive),
        ];
        let files = of_all.into_iter().chain(exports).collect();
        let ended = EndedPage::of(session, &calibration, files);
        let mut ended = EndedPage { can_restart: true, can_go_on: true, ..ended };
        if let Some(given) = &self.given {
            ended = given.onto(ended, session, &header.config)?;
        }
        self.files.clone_from(&ended.files);
        let newest = self.newest.as_ref().context("a session that ends has a state")?;
        let live = Live::of(newest, self.stage, false);
        Ok(serde_json::to_string(&[("ended", raw(&ended)?), ("live", raw(&live)?)])?)
    }
}

fn raw(value: &impl Serialize) -> serde_json::Result<Box<RawValue>> {
    serde_json::value::to_raw_value(value)
}
