use std::collections::BTreeMap;

use egui::{Context, TextureHandle, TextureOptions};

use crate::{keys::UiAction, picture::grey};
use boresight_app::{
    BoardFromCode,
    explain::UserError,
    session::rig_run::MOST_CAMERAS,
    window::services::{
        CameraView, OtherKind, PrintedBoard, RigRequest, SeenCode, SessionRequest, is_camera_name,
    },
};
use boresight_geometry::{
    boards::{BOARD_KINDS, BoardChoice, BoardKind, MarkerSide, Pattern},
    markers::{Dictionary, InvalidMarkers, marker_count},
};
use boresight_present::text::start as words;

/// Names of sources other than cameras.
pub(crate) const SIMULATION: &str = "sim";
const ANY: &str = "auto";
/// Longest start of a camera's name in the names of files.
const LONGEST_NAME: usize = 12;

/// The person's choices on the page.
pub struct StartPage {
    /// Session to start.
    pub draft: SessionRequest,
    /// Last choice of each kind of board, to return to from another one.
    last: [Pattern; BOARD_KINDS.len()],
    /// Sources of the cameras chosen for one session together; `None` for a single camera.
    pub rig: Option<Vec<String>>,
    /// Text in the field for streams and files.
    pub(super) typed: String,
    /// True while the sheet with all choices is open.
    pub is_changing: bool,
    /// True if the board comes from the camera or the person.
    pub knows_board: bool,
    /// Last counted board.
    counted: Option<[u16; 2]>,
    /// Number of the paper to print on.
    pub paper: usize,
    /// Result of printing.
    pub printed: Option<Result<PrintedBoard, UserError>>,
    /// True if a window shows the board.
    pub shows_board: bool,
    /// Last seen code.
    code: Option<SeenCode>,
    /// True if the square's side comes from a code, a print, or the person.
    pub knows_square: bool,
    textures: BTreeMap<String, (u64, TextureHandle)>,
}

/// Options to choose from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Choices {
    /// Connected cameras.
    pub cameras: Vec<CameraView>,
    /// Modes of the chosen camera.
    pub modes: Vec<String>,
    /// Recently used streams and files.
    pub streams: Vec<String>,
    /// Names of papers.
    pub papers: Vec<&'static str>,
    /// True for a mirrored picture; `None` until the person has answered.
    pub mirrored: Option<bool>,
    /// True if sessions fill the screen while the person is away.
    pub full_screen: bool,
}

impl StartPage {
    /// Page with the initial `draft`.
    pub fn new(draft: SessionRequest) -> Self {
        let marked = smallest_that_suffices(draft.board);
        let usual = |kind: &BoardKind| {
            let usual = (kind.usual)();
            usual.dictionary().map_or(usual, |_| marked)
        };
        Self {
            last: BOARD_KINDS.each_ref().map(usual),
            draft,
            rig: None,
            typed: String::new(),
            is_changing: false,
            knows_board: false,
            counted: None,
            paper: 0,
            printed: None,
            shows_board: false,
            code: None,
            knows_square: false,
            textures: BTreeMap::new(),
        }
    }

    /// Takes over the cameras' news: chooses an only camera, and uses a counted board.
    pub fn see(&mut self, choices: &Choices) {
        let usable = || choices.cameras.iter().filter(|camera| camera.trouble.is_none());
        let is_here = choices.cameras.iter().any(|camera| camera.source == self.draft.source);
        let is_open = self.draft.source == ANY || (self.names_camera() && !is_here);
        if is_open && let Some(camera) = usable().next() {
            self.choose(&camera.source.clone());
        }
        self.knows_board |= self.is_changing;
        let camera = self.camera(choices);
        let board = camera.and_then(|camera| camera.board);
        let code = camera.and_then(|camera| camera.code.clone());
        // Each count and each code is taken once: later changes by the person stay.
        if let Some(board) = board.filter(|board| self.counted != Some(*board)) {
            let before = self.choice();
            self.choose_kind(Pattern::Plain.kind_index());
            self.draft.board = board;
            // Another board may have other squares.
            self.knows_square &= before == self.choice();
            (self.counted, self.knows_board) = (Some(board), true);
        }
        if let Some(code) = code.filter(|code| self.code.as_ref() != Some(code)) {
            self.choose_kind(Pattern::Plain.kind_index());
            (self.draft.board, self.draft.square_m) = (code.board, code.square_m);
            (self.knows_square, self.knows_board) = (true, true);
            self.code = Some(code);
        }
    }

    /// Sentence about the board in view, or the next action, with a line below.
    pub(super) fn said(&self, choices: &Choices) -> (String, String) {
        if let Some(trouble) = self.camera(choices).and_then(|camera| camera.trouble.as_ref()) {
            return (trouble.what.clone(), trouble.action.clone().unwrap_or_default());
        }
        if let Some(other) = self.other(choices) {
            return (other.said.clone(), String::new());
        }
        if !self.has_source(choices) {
            return (words::NO_CAMERA.into(), String::new());
        }
        if self.asks_for_board(choices) {
            return (words::HOLD_UP.into(), String::new());
        }
        let is_known = self.knows_square || !self.draft.pattern.is_plain();
        let said = words::board_to_use(self.choice(), self.draft.square_m, is_known);
        let is_seen = self.camera(choices).is_some_and(|camera| camera.rim.is_some());
        let line = match self.trouble(choices) {
            Some(trouble) => trouble,
            None if self.code().is_some() => words::FROM_CODE,
            None if !is_known => words::SIZE_OPEN,
            None if is_seen || self.camera(choices).is_none() => "",
            None => words::ANOTHER,
        };
        (said, line.into())
    }

    /// True if nothing is known of the board, and a camera could see it.
    pub(super) fn asks_for_board(&self, choices: &Choices) -> bool {
        !self.knows_board && self.camera(choices).is_some_and(|camera| camera.trouble.is_none())
    }

    /// Board of another kind than the chosen one, in view.
    pub(super) fn other<'a>(&self, choices: &'a Choices) -> Option<&'a OtherKind> {
        let kind = |pattern: &Pattern| pattern.kind_index();
        let other = self.camera(choices)?.other.as_ref()?;
        (kind(&other.pattern) != kind(&self.draft.pattern)).then_some(other)
    }

    /// Reason why no session can start.
    pub(super) fn trouble(&self, choices: &Choices) -> Option<&'static str> {
        if !self.has_source(choices) {
            return Some(words::NO_SOURCE);
        }
        let is_rig = || (2..=MOST_CAMERAS).contains(&self.chosen(choices).len());
        if self.rig.is_some() && !is_rig() {
            return Some(words::RIG_TROUBLE);
        }
        self.board_trouble().map(|_| words::NO_BOARD)
    }

    /// Name of the chosen source.
    pub(super) fn source_name(&self, choices: &Choices) -> Option<String> {
        match self.camera(choices) {
            Some(_) if self.rig.is_some() => {
                let names = self.chosen(choices).into_iter().map(|camera| camera.name.as_str());
                Some(words::rig(&names.collect::<Vec<_>>()))
            }
            Some(camera) => Some(words::camera(&camera.name, &camera.mode)),
            None => self.has_source(choices).then(|| self.draft.source.trim().to_owned()),
        }
    }

    /// Starts with the simulated camera.
    pub(super) fn simulation(&mut self) -> UiAction {
        self.rig = None;
        self.choose(SIMULATION);
        UiAction::Start(Box::new(self.wish()))
    }

    /// Code of the chosen board.
    pub(super) fn code(&self) -> Option<&SeenCode> {
        let draft = &self.draft;
        let names = |code: &&SeenCode| {
            draft.pattern.is_plain()
                && code.board == draft.board
                && (code.square_m - draft.square_m).abs() < 1e-7
        };
        self.code.as_ref().filter(names)
    }

    /// Chosen camera, if connected.
    pub fn camera<'a>(&self, choices: &'a Choices) -> Option<&'a CameraView> {
        choices.cameras.iter().find(|camera| camera.source == self.draft.source)
    }

    /// Cameras chosen, connected and usable: one, or those of a rig.
    pub(super) fn chosen<'a>(&self, choices: &'a Choices) -> Vec<&'a CameraView> {
        let cameras = choices.cameras.iter();
        match &self.rig {
            None => self.camera(choices).into_iter().collect(),
            Some(_) => cameras
                .filter(|camera| self.has_chosen(camera) && camera.trouble.is_none())
                .collect(),
        }
    }

    /// True if `camera` is chosen.
    pub(super) fn has_chosen(&self, camera: &CameraView) -> bool {
        match &self.rig {
            None => self.draft.source == camera.source,
            Some(sources) => sources.contains(&camera.source),
        }
    }

    /// Chooses every usable camera together, or a single one again.
    pub(super) fn choose_rig(&mut self, choices: &Choices, is_rig: bool) {
        let usable = choices.cameras.iter().filter(|camera| camera.trouble.is_none());
        let sources = usable.map(|camera| camera.source.clone()).take(MOST_CAMERAS);
        self.rig = is_rig.then(|| sources.collect());
        self.look_at_first_of_rig();
    }

    /// Chooses `camera`; of a rig, adds it or leaves it out.
    pub(super) fn click(&mut self, camera: &CameraView) {
        match &mut self.rig {
            None => self.choose(&camera.source),
            Some(sources) if sources.contains(&camera.source) => {
                sources.retain(|source| *source != camera.source);
            }
            Some(sources) => sources.push(camera.source.clone()),
        }
        self.look_at_first_of_rig();
    }

    /// The board is counted in front of one camera: the rig's first.
    fn look_at_first_of_rig(&mut self) {
        let first = self.rig.as_ref().and_then(|sources| sources.first().cloned());
        if let Some(source) = first {
            self.choose(&source);
        }
    }

    /// Starts with the choices.
    pub(super) fn start(&self, choices: &Choices) -> UiAction {
        if self.rig.is_none() {
            return UiAction::Start(Box::new(self.wish()));
        }
        let cameras = rig_names(&self.chosen(choices));
        let wish = SessionRequest { mode: ANY.into(), ..self.wish() };
        UiAction::StartRig(Box::new(RigRequest { cameras, wish }))
    }

    /// True if the source is, or was, a camera of the computer, unless the name is being typed.
    fn names_camera(&self) -> bool {
        is_camera_name(&self.draft.source) && self.typed.trim() != self.draft.source.trim()
    }

    /// True if there is a source to start with.
    pub(super) fn has_source(&self, choices: &Choices) -> bool {
        let source = self.draft.source.trim();
        match self.camera(choices) {
            Some(camera) => camera.trouble.is_none(),
            None => !source.is_empty() && source != ANY && !self.names_camera(),
        }
    }

    /// Chooses a source, and drops the previous camera's mode.
    pub(super) fn choose(&mut self, source: &str) {
        if self.draft.source != source {
            self.draft.source = source.into();
            self.draft.mode = ANY.into();
        }
        self.typed.clear();
    }

    /// Chooses a kind of board by the place in [`BOARD_KINDS`].
    pub(super) fn choose_kind(&mut self, kind: usize) {
        let draft = &mut self.draft;
        self.last[draft.pattern.kind_index()] = draft.pattern;
        draft.pattern = self.last[kind];
        draft.board = draft.board.map(|points| BOARD_KINDS[kind].nearest(points));
        self.printed = None;
    }

    /// Chooses a recognised board, as far as known.
    pub(super) fn take(&mut self, OtherKind { pattern, board, .. }: OtherKind) {
        if pattern.dictionary().is_some() {
            self.last[pattern.kind_index()] = pattern;
        }
        self.choose_kind(pattern.kind_index());
        self.draft.board = board.unwrap_or(self.draft.board);
        self.knows_board = true;
    }

    /// Chosen board, with the side of the markers in squares.
    pub(crate) fn in_squares(&self) -> BoardChoice {
        BoardChoice::of(self.draft.board, self.draft.pattern.in_squares_of(self.draft.square_m))
    }

    /// Chosen board.
    pub(super) fn choice(&self) -> BoardChoice {
        BoardChoice::of(self.draft.board, self.draft.pattern)
    }

    /// Reason why the chosen board can't have the markers.
    pub(super) fn board_trouble(&self) -> Option<InvalidMarkers> {
        let board = self.choice().drawn(self.draft.square_m)?;
        board.target().check().err()
    }

    /// Notes the printed size of the chosen board's squares.
    pub(crate) fn note_printed(&mut self, square_m: f64) {
        if let Pattern::Charuco { side: MarkerSide::Metres(side_m), .. } = &mut self.draft.pattern {
            *side_m = *side_m / self.draft.square_m * square_m;
        }
        self.knows_square = true;
        self.draft.square_m = square_m;
    }

    /// A new session from the choices.
    pub(super) fn wish(&self) -> SessionRequest {
        let is_said = self.knows_square || !self.draft.pattern.is_plain();
        SessionRequest {
            source: self.draft.source.trim().into(),
            board_code: if is_said { BoardFromCode::Nothing } else { BoardFromCode::All },
            go_on_with: None,
            first: None,
            ..self.draft.clone()
        }
    }

    /// The newest picture of `camera`.
    pub(super) fn texture(&mut self, ctx: &Context, camera: &CameraView) -> Option<&TextureHandle> {
        let picture = camera.picture.as_ref()?;
        let shown = self.textures.get(&camera.source).map(|(number, _)| *number);
        if shown != Some(camera.number) {
            let pixels = grey(picture);
            match self.textures.get_mut(&camera.source) {
                Some((number, texture)) => {
                    *number = camera.number;
                    texture.set(pixels, TextureOptions::LINEAR);
                }
                None => {
                    let texture = ctx.load_texture(&camera.source, pixels, TextureOptions::LINEAR);
                    self.textures.insert(camera.source.clone(), (camera.number, texture));
                }
            }
        }
        self.textures.get(&camera.source).map(|(_, texture)| texture)
    }

    /// Frees the pictures and closes the sheet when leaving the page.
    pub(crate) fn leave(&mut self) {
        self.textures.clear();
        self.is_changing = false;
    }

    /// Camera with the board to count.
    pub(crate) fn counted(&self, choices: &Choices) -> Option<String> {
        self.camera(choices).map(|camera| camera.source.clone())
    }
}

/// Names for the folders and files of `cameras`, with their sources.
fn rig_names(cameras: &[&CameraView]) -> Vec<(String, String)> {
    let mut named: Vec<(String, String)> = Vec::with_capacity(cameras.len());
    for camera in cameras {
        let plain = |c: char| if c.is_alphanumeric() || c == '_' { c } else { '-' };
        let name: String = camera.name.chars().take(LONGEST_NAME).map(plain).collect();
        let name = match name.trim_matches('-') {
            "" => "camera",
            name => name,
        };
        let is_taken = |name: &String| named.iter().any(|(other, _)| other == name);
        let numbered = (2..).map(|number| format!("{name}-{number}"));
        let free = std::iter::once(name.to_owned()).chain(numbered).find(|name| !is_taken(name));
        named.push((free.unwrap_or_default(), camera.source.clone()));
    }
    named
}

/// Markers of a dictionary with enough markers for the board: the first and smallest has the
/// largest cells.
fn smallest_that_suffices([columns, rows]: [u16; 2]) -> Pattern {
    let needed = marker_count([usize::from(columns) + 1, usize::from(rows) + 1]);
    let suffices = |dictionary: &Dictionary| dictionary.count() >= needed;
    let dictionary = Dictionary::all().find(suffices).or_else(|| Dictionary::all().last());
    Pattern::Charuco { dictionary: dictionary.unwrap_or_default(), side: MarkerSide::Usual }
}
