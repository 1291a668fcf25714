//! `boresight target`.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, ValueEnum};

use boresight_app::{
    Exit,
    commands::board_sheet::{BoardSheet, SheetKind},
    window::printed_board::new_id,
};
use boresight_files::{Overwrite, save};
use boresight_geometry::board_code::BoardId;
use boresight_present::{
    sheet::{Page, Paper, Plan, Resolution},
    text,
};
use boresight_terminal::{
    board_args::BoardArguments, board_args::Size, print, say, usage::WrongUsage,
};

/// Create a board to print or show on a screen: PDF, SVG or PNG.
///
/// The board has its true size. Without --square, the squares are as large as fits with a white
/// margin of one square, in whole millimetres (in whole pixels on a screen). The sheet also shows a
/// ruler, the board's name and the square size. If there is room, a code in the margin names the
/// board, so that other commands need no --board. The command explains how to check the print and
/// its flatness, and what to pass to `boresight guide`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    #[command(flatten)]
    board: BoardArguments,
    /// Kind of board, with the usual number of squares. For another number, use --board.
    #[arg(long, value_enum, ignore_case = true, conflicts_with = "board")]
    kind: Option<Kind>,
    /// Paper or screen; landscape or portrait, whichever fits best.
    #[arg(long, value_enum, default_value = "a4", ignore_case = true)]
    paper: Medium,
    /// File to write: *.pdf, *.svg or *.png [default: named after the board, such as
    /// checkerboard-9x6-25mm.pdf; .png for a screen].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Pixels per inch of a PNG [default: 300] or of the screen (required): its width in pixels
    /// divided by its width in inches.
    #[arg(long, value_name = "NUMBER", value_parser = resolution)]
    dpi: Option<Resolution>,
    /// Size of the screen in pixels.
    #[arg(long, value_name = "WxH", default_value = "1920x1080")]
    pixels: Size,
    /// ID in the board's code: four digits or letters [default: a new one].
    #[arg(long, value_name = "ID", conflicts_with = "no_code")]
    id: Option<BoardId>,
    /// Leave out the code in the margin, from which other commands read the board.
    #[arg(long)]
    no_code: bool,
    /// Overwrite an existing file.
    #[arg(long)]
    force: bool,
    /// Print the details as JSON on stdout.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// 9x6 inner corners, as without --kind.
    Board,
    /// A ChArUco board, of which any part can be seen: charuco:8x11:DICT_4X4_50.
    Charuco,
    /// Kalibr's AprilGrid, of which any part can be seen, too: aprilgrid:6x6.
    Aprilgrid,
    /// A grid of circles, as OpenCV's: circles:7x5.
    Circles,
    /// OpenCV's asymmetric grid of circles, every second row shifted: acircles:4x11.
    Acircles,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Medium {
    A4,
    A3,
    Letter,
    /// A screen; needs --dpi.
    Screen,
}

fn resolution(text: &str) -> Result<Resolution, String> {
    let dpi = text.parse().ok().and_then(Resolution::from_dpi);
    dpi.ok_or_else(|| "expected 20 to 1200 pixels per inch".into())
}

const EXAMPLES: &str = "\
Examples:
  boresight target --board 9x6 --paper a4 --out board.pdf
  boresight target --board 11x8 --square 30mm --paper a3
  boresight target --board 9x6 --paper screen --dpi 92
  boresight target --kind charuco
  boresight target --board charuco:5x7:DICT_5X5_100:30mm --square 40mm --paper a3
  boresight target --board aprilgrid:6x6 --square 22mm
  boresight target --board acircles:4x11 --square 20mm";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let sheet = self.sheet()?;
        let path = self.out.clone().unwrap_or_else(|| self.usual_name(&sheet.plan));
        let kind = SheetKind::of_file(&path).ok_or_else(|| {
            WrongUsage(format!("{path:?}: the name should end with .pdf, .svg or .png"))
        })?;
        let bytes = sheet.bytes(kind, self.dpi)?;
        let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
        save(&path, &bytes, overwrite)?;
        say(&format!("Written: {}", path.display()));
        for (i, step) in text::target_steps(&sheet.plan, sheet.id().is_some()).iter().enumerate() {
            say(&format!("  {}. {step}", i + 1));
        }
        if self.json {
            let paper = self.paper.to_possible_value().context("no name")?;
            print(&serde_json::to_string(&sheet.told(&path, paper.get_name()))?)?;
        }
        Ok(Exit::Good)
    }

    fn sheet(&self) -> anyhow::Result<BoardSheet> {
        let mut board = self.board.clone();
        match self.kind {
            // Fits upright paper.
            Some(Kind::Charuco) => board.name("charuco:8x11:DICT_4X4_50"),
            Some(Kind::Aprilgrid) => board.name("aprilgrid:6x6"),
            Some(Kind::Circles) => board.name("circles:7x5"),
            Some(Kind::Acircles) => board.name("acircles:4x11"),
            Some(Kind::Board) | None => {}
        }
        let config = board.config()?.board;
        let asked_mm = self.board.says_square()?.then_some(config.square_mm);
        let pages = match self.paper {
            Medium::A4 => Paper::A4.pages().to_vec(),
            Medium::A3 => Paper::A3.pages().to_vec(),
            Medium::Letter => Paper::Letter.pages().to_vec(),
            Medium::Screen => {
                let Size(size) = self.pixels;
                let resolution = self.dpi.context(
                    "a screen needs --dpi: its width in pixels divided by its width in inches, for example 1920 / 20.9 in = 92",
                )?;
                vec![Page::screen(size.width_px, size.height_px, resolution)]
            }
        };
        let sheet = BoardSheet::new(config.choice(), asked_mm, &pages)?;
        if let Some(other) = asked_mm.and_then(|mm| text::other_square(&sheet.plan, mm)) {
            say(&other);
        }
        // Markers name their board.
        if self.no_code || !sheet.plan.pattern.is_plain() {
            return Ok(sheet);
        }
        let sheet = sheet.with_code(self.id.unwrap_or_else(new_id));
        match sheet.id() {
            Some(id) => say(&text::code_in_margin(&id)),
            None => say(text::NO_ROOM_FOR_CODE),
        }
        Ok(sheet)
    }

    fn usual_name(&self, plan: &Plan) -> PathBuf {
        let extension = if self.paper == Medium::Screen { "png" } else { "pdf" };
        format!("{}.{extension}", plan.file_stem()).into()
    }
}
