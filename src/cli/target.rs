//! `boresight target`.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use clap::{Args, ValueEnum};
use serde_json::json;

use super::{
    board_args::BoardArguments,
    board_args::Size,
    terminal::{print, say},
};
use crate::{
    app::Exit,
    files::{Overwrite, save},
    target::{Page, Paper, Plan, Resolution, Square, pdf, plan, png, sheet, svg},
    text,
};

/// Create a board at true size to print or show on a screen: PDF, SVG or PNG.
///
/// Without --square, the squares are as large as fits with a white margin of one square, in whole millimetres (in
/// whole pixels on a screen). The sheet also shows a ruler, the board's name and the square size. The command
/// explains how to check the print and its flatness, and what to pass to `boresight guide`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  boresight target --board 9x6 --paper a4 --out board.pdf")]
pub(super) struct Arguments {
    #[command(flatten)]
    board: BoardArguments,
    /// Paper or screen; landscape or portrait, whichever fits best.
    #[arg(long, value_enum, default_value = "a4", ignore_case = true)]
    paper: Medium,
    /// File to write: *.pdf, *.svg or *.png [default: checkerboard-CxR-SQUARE.pdf, or .png for a screen].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Pixels per inch of a PNG [default: 300] or of the screen (required): its width in pixels divided by its width
    /// in inches.
    #[arg(long, value_name = "NUMBER", value_parser = resolution)]
    dpi: Option<Resolution>,
    /// Size of the screen in pixels.
    #[arg(long, value_name = "WxH", default_value = "1920x1080")]
    pixels: Size,
    /// Overwrite an existing file.
    #[arg(long)]
    force: bool,
    /// Print the details as JSON on stdout.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Medium {
    A4,
    A3,
    Letter,
    /// A screen; needs --dpi.
    Screen,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Pdf,
    Svg,
    Png,
}

fn resolution(text: &str) -> Result<Resolution, String> {
    let dpi = text.parse().ok().and_then(Resolution::from_dpi);
    dpi.ok_or_else(|| "expected 20 to 1200 pixels per inch".into())
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let plan = self.plan()?;
        let path = self.out.clone().unwrap_or_else(|| self.usual_name(&plan));
        let format = format(&path)?;
        let sheet = sheet(&plan, &text::target_lines(&plan));
        let bytes = match format {
            Format::Pdf => pdf(&sheet),
            Format::Svg => svg(&sheet).into_bytes(),
            Format::Png => {
                let usual = Resolution::from_dpi(300.0).context("no resolution")?;
                let resolution = plan.page.pixels.or(self.dpi).unwrap_or(usual);
                png(&sheet, resolution).context("use a lower --dpi")?
            }
        };
        let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
        save(&path, &bytes, overwrite)?;
        say(&format!("Written: {}", path.display()));
        for (i, step) in text::target_steps(&plan).iter().enumerate() {
            say(&format!("  {}. {step}", i + 1));
        }
        if self.json {
            print(&self.report(&plan, &path)?)?;
        }
        Ok(Exit::Good)
    }

    fn plan(&self) -> anyhow::Result<Plan> {
        let config = self.board.config()?.board;
        let asked_mm = self.board.says_square()?.then_some(config.square_mm);
        let square = asked_mm.map_or(Square::Largest, |mm| Square::Exactly { mm });
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
        let plan = plan(config.columns, config.rows, square, &pages)
            .map_err(|err| anyhow!("{err}: {}", text::does_not_fit(&err)))?;
        if let Some(other) = asked_mm.and_then(|mm| text::other_square(&plan, mm)) {
            say(&other);
        }
        Ok(plan)
    }

    fn usual_name(&self, plan: &Plan) -> PathBuf {
        let extension = if self.paper == Medium::Screen { "png" } else { "pdf" };
        let square = (1000.0 * plan.square_mm).round() / 1000.0;
        format!("checkerboard-{}x{}-{square}mm.{extension}", plan.columns, plan.rows).into()
    }

    fn report(&self, plan: &Plan, path: &Path) -> anyhow::Result<String> {
        let paper = self.paper.to_possible_value().context("no name")?;
        let report = json!({
            "schema": "boresight.target/1",
            "file": path.display().to_string(),
            "board": { "columns": plan.columns, "rows": plan.rows, "square_mm": plan.square_mm },
            "paper": paper.get_name(),
            "page_mm": [plan.page.width_mm, plan.page.height_mm],
            "top_left_mm": [plan.left_mm, plan.top_mm],
            "white_mm": plan.white_mm(),
            "ruler_mm": plan.ruler_mm,
        });
        Ok(report.to_string())
    }
}

fn format(path: &Path) -> anyhow::Result<Format> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match extension.as_str() {
        "pdf" => Ok(Format::Pdf),
        "svg" => Ok(Format::Svg),
        "png" => Ok(Format::Png),
        _ => bail!("{path:?}: the name should end with .pdf, .svg or .png"),
    }
}
