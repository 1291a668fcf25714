//! A board to print or show on a screen, as a file.

use std::path::Path;

use anyhow::{Context, anyhow};
use serde::Serialize;

use boresight_geometry::{
    board_code::{BoardCode, BoardId},
    boards::BoardChoice,
};
use boresight_present::{
    sheet::{Page, Paper, Plan, Resolution, Square, pdf, plan_of, png, sheet, svg},
    text,
};

/// Name and version of [`TargetFile`].
pub const TARGET_SCHEMA: &str = "boresight.target/1";

/// Pixels per inch of a PNG on paper.
const USUAL_DPI: f64 = 300.0;

/// Kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SheetKind {
    /// For printing.
    Pdf,
    /// For drawing programs.
    Svg,
    /// For screens.
    Png,
}

impl SheetKind {
    /// Kind from a file name; `None` for an unknown extension.
    pub fn of_file(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        Self::by_name(&ending)
    }

    /// Kind named `pdf`, `svg` or `png`.
    pub fn by_name(name: &str) -> Option<Self> {
        match name {
            "pdf" => Some(Self::Pdf),
            "svg" => Some(Self::Svg),
            "png" => Some(Self::Png),
            _ => None,
        }
    }
}

/// Paper by name, in any letter case.
pub fn paper(name: &str) -> Option<Paper> {
    Paper::ALL.into_iter().find(|paper| paper.name().eq_ignore_ascii_case(name))
}

/// What `target --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct TargetFile {
    /// [`TARGET_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.target/1")))]
    pub schema: String,
    /// The written file.
    pub file: String,
    /// ID in the code in the margin; null without one.
    pub id: Option<String>,
    /// The board.
    pub board: TargetBoard,
    /// The paper, or `screen`.
    pub paper: String,
    /// Width and height of the page.
    pub page_mm: [f64; 2],
    /// The board's place on the page.
    pub top_left_mm: [f64; 2],
    /// White around the board where it's narrowest.
    pub white_mm: f64,
    /// Length of the ruler.
    pub ruler_mm: f64,
}

/// A printed board.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct TargetBoard {
    /// Inner corners in a row.
    pub columns: u16,
    /// Inner corners in a column.
    pub rows: u16,
    /// Side of a square or tag, or spacing between rows of circles.
    pub square_mm: f64,
    /// Dictionary of a ChArUco board's markers, or of an AprilGrid's tags; null on a plain board.
    pub dictionary: Option<String>,
    /// Side of a marker.
    pub marker_mm: Option<f64>,
    /// White between the tags of an AprilGrid, as a share of a tag's side; null on other boards.
    pub tag_spacing: Option<f64>,
    /// Number of an AprilGrid's first tag; null on other boards.
    pub first_tag: Option<u16>,
    /// `symmetric` or `asymmetric` for a grid of circles; null on other boards.
    pub circles: Option<String>,
}

/// Board on its page, with an optional code in the margin.
#[derive(Clone, Debug)]
pub struct BoardSheet {
    /// Layout of the page.
    pub plan: Plan,
    code: Option<BoardCode>,
}

impl BoardSheet {
    /// Places the board on the best of `pages`, with squares of `square_mm` or as large as fits.
    /// Unnamed sides of markers are 0.75 of a square.
    ///
    /// # Errors
    ///
    /// If the board fits on no page, or can't have these markers.
    pub fn new(board: BoardChoice, square_mm: Option<f64>, pages: &[Page]) -> anyhow::Result<Self> {
        let square = square_mm.map_or(Square::Largest, |mm| Square::Exactly { mm });
        let plan = plan_of(&board, square, pages)
            .map_err(|err| anyhow!("{err}: {}", text::does_not_fit(&err)))?;
        plan.drawn().map_or(Ok(()), |board| board.target().check())?;
        Ok(Self { plan, code: None })
    }

    /// The sheet with the code for `id`, unless there is no room. Boards with markers need no code.
    #[must_use]
    pub fn with_code(mut self, id: BoardId) -> Self {
        self.code = margin_code(&self.plan, id).filter(|_| self.plan.pattern.is_plain());
        self
    }

    /// ID in the code.
    pub fn id(&self) -> Option<String> {
        self.code.as_ref().map(|code| code.id().to_string())
    }

    /// The file's bytes; a PNG on paper in the given resolution, or of 300 pixels per inch.
    ///
    /// # Errors
    ///
    /// If a PNG would be too large.
    pub fn bytes(
        &self,
        kind: SheetKind,
        resolution: Option<Resolution>,
    ) -> anyhow::Result<Vec<u8>> {
        let lines = text::target_lines(&self.plan, self.id().as_deref());
        let sheet = match &self.code {
            Some(code) => sheet(&self.plan, &lines).with_code(&self.plan, code),
            None => sheet(&self.plan, &lines),
        };
        Ok(match kind {
            SheetKind::Pdf => pdf(&sheet),
            SheetKind::Svg => svg(&sheet).into_bytes(),
            SheetKind::Png => {
                let usual = Resolution::from_dpi(USUAL_DPI).context("no resolution")?;
                let resolution = self.plan.page.pixels.or(resolution).unwrap_or(usual);
                png(&sheet, resolution).context("use a lower --dpi")?
            }
        })
    }

    /// Output of `target --json` for the sheet in `file` on the named paper.
    pub fn told(&self, file: &Path, paper: &str) -> TargetFile {
        let plan = &self.plan;
        let (tags, circles) = (plan.pattern.tags(), plan.pattern.circles());
        let markers = plan.drawn().and_then(|board| board.markers());
        TargetFile {
            schema: TARGET_SCHEMA.into(),
            file: file.display().to_string(),
            id: self.id(),
            board: TargetBoard {
                columns: plan.columns,
                rows: plan.rows,
                square_mm: plan.square_mm,
                dictionary: markers.map(|markers| markers.dictionary.name().into()),
                marker_mm: markers.map(|markers| plan.square_mm * markers.side_squares),
                tag_spacing: tags.map(|tags| tags.spacing),
                first_tag: tags.map(|tags| tags.first),
                circles: circles.map(|rows| rows.name().into()),
            },
            paper: paper.into(),
            page_mm: [plan.page.width_mm, plan.page.height_mm],
            top_left_mm: [plan.left_mm, plan.top_mm],
            white_mm: plan.white_mm(),
            ruler_mm: plan.ruler_mm,
        }
    }
}

/// Code for the margin of `plan`. `None` without room.
fn margin_code(plan: &Plan, id: BoardId) -> Option<BoardCode> {
    BoardCode::new(&plan.board()?, id).filter(|_| !plan.edges_with_room().is_empty())
}
