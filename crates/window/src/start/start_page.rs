use std::collections::BTreeMap;

use egui::{Context, TextureHandle, TextureOptions};

use crate::picture::grey;
use boresight_app::{
    BoardFromCode,
    explain::UserError,
    window::host::{CameraView, OtherKind, PrintedBoard, SeenCode, SessionRequest, is_camera_name},
};
use boresight_geometry::{
    boards::{BOARD_KINDS, BoardChoice, BoardKind, MarkerSide, Pattern},
    markers::{Dictionary, InvalidMarkers, marker_count},
};

/// Names of sources other than cameras.
pub(crate) const SIMULATION: &str = "sim";
const ANY: &str = "auto";

/// The person's choices on the page.
pub struct StartPage {
    /// Session to start.
    pub draft: SessionRequest,
    /// Last choice of each kind of board, to return to from another one.
    last: [Pattern; BOARD_KINDS.len()],
    /// Text in the field for streams and files.
    pub(super) typed: String,
    /// True if the board in front of the camera is counted.
    pub(super) counts: bool,
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
            typed: String::new(),
            counts: false,
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
        let camera = self.camera(choices).filter(|_| self.draft.pattern.is_plain());
        let board = camera.and_then(|camera| camera.board).filter(|_| self.counts);
        let code = camera.and_then(|camera| camera.code.clone());
        if let Some(board) = board {
            self.draft.board = board;
        }
        // Each code is taken once: later changes by the person stay.
        if let Some(code) = code.filter(|code| self.code.as_ref() != Some(code)) {
            (self.draft.board, self.draft.square_m) = (code.board, code.square_m);
            self.knows_square = true;
            self.code = Some(code);
        }
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
        self.counts = false;
        self.printed = None;
    }

    /// Chooses a recognised board, as far as known.
    pub(super) fn take(&mut self, OtherKind { pattern, board, .. }: OtherKind) {
        if pattern.dictionary().is_some() {
            self.last[pattern.kind_index()] = pattern;
        }
        self.choose_kind(pattern.kind_index());
        self.draft.board = board.unwrap_or(self.draft.board);
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

    /// Frees the pictures and stops counting when leaving the page.
    pub(crate) fn leave(&mut self) {
        self.textures.clear();
        self.counts = false;
    }

    /// Camera with the board to count.
    pub(crate) fn counted(&self, choices: &Choices) -> Option<String> {
        let is_plain = self.draft.pattern.is_plain();
        self.camera(choices).filter(|_| is_plain).map(|camera| camera.source.clone())
    }
}

/// Markers of a dictionary with enough markers for the board: the first and smallest has the
/// largest cells.
fn smallest_that_suffices([columns, rows]: [u16; 2]) -> Pattern {
    let needed = marker_count([usize::from(columns) + 1, usize::from(rows) + 1]);
    let suffices = |dictionary: &Dictionary| dictionary.count() >= needed;
    let dictionary = Dictionary::all().find(suffices).or_else(|| Dictionary::all().last());
    Pattern::Charuco { dictionary: dictionary.unwrap_or_default(), side: MarkerSide::Usual }
}
