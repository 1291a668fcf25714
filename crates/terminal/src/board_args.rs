//! Arguments for board and settings.

use std::{path::PathBuf, str::FromStr};

use anyhow::{Context, bail};
use clap::{Args, Command};

use crate::announcer;
use boresight_app::{BoardFromCode, session::board_from_code::board_from_pictures};
use boresight_files::{Links, TEXT_LIMIT, read_text};
use boresight_geometry::{
    boards::{BoardChoice, InvalidChoice, length_m, millimetres},
    frame::ImageSize,
};
use boresight_run::config::Config;

/// Board and settings.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Board and settings")]
pub struct BoardArguments {
    /// Inner corners of the board, columns x rows, for example 9x6 [default: from the code in its
    /// margin, or 9x6]; or squares, dictionary and marker size of a ChArUco board, for example
    /// charuco:8x11:DICT_4X4_50:15mm; or tags of an AprilGrid, for example aprilgrid:6x6; or
    /// circles in a row and rows, for example circles:7x5, or acircles:4x11 with every second row
    /// shifted.
    #[arg(long, value_name = "BOARD")]
    board: Option<BoardChoice>,
    /// Side of a square or tag, or spacing between rows of circles, with its unit: 25mm,
    /// 2.5cm, 0.025m, 1in [default: from the code, or 25mm].
    #[arg(long, value_name = "LENGTH")]
    square: Option<Length>,
    /// Settings file. config/default.toml explains every setting.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Change one setting, for example guidance.hold_secs=0.5. Can be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = setting)]
    settings: Vec<String>,
}

/// Checks a setting for the form KEY=VALUE; the configuration checks the key.
pub fn setting(text: &str) -> Result<String, String> {
    let key = text.split_once('=').map(|(key, _)| key.trim());
    let is_key = |key: &str| key.split('.').all(|part| !part.trim().is_empty());
    match key {
        Some(key) if is_key(key) => Ok(text.to_owned()),
        _ => Err("expected KEY=VALUE, for example guidance.hold_secs=0.5".into()),
    }
}

/// Commands without reading of codes in a board's margin, with the default square.
const WITHOUT_CODE: [(&str, &str); 4] = [
    ("serve", "25mm"),
    ("check", "25mm"),
    ("simulate", "25mm"),
    ("target", "as large as fits, in whole millimetres"),
];

/// `program` with the default board in the help of each command.
pub fn with_true_defaults(program: Command) -> Command {
    WITHOUT_CODE.iter().fold(program, |program, (name, square)| {
        program.mut_subcommand(name, |command| {
            let takes_board = command.get_arguments().any(|arg| arg.get_id() == "board");
            if !takes_board {
                return command;
            }
            let square =
                format!("Side of a square or tag, or spacing between rows of circles, with its unit: 25mm, 2.5cm, 0.025m, 1in [default: {square}]");
            let board = "Inner corners of the board, columns x rows [default: 9x6]; or squares, dictionary and marker size \
                         of a ChArUco board, for example charuco:8x11:DICT_4X4_50:15mm; or tags of an AprilGrid, for example \
                         aprilgrid:6x6; or circles in a row and rows, for example circles:7x5, or acircles:4x11 with every \
                         second row shifted";
            command
                .mut_arg("board", |arg| arg.help(board).long_help(None))
                .mut_arg("square", |arg| arg.help(square).long_help(None))
        })
    })
}

/// A picture size: width x height.
#[derive(Clone, Copy, Debug)]
pub struct Size(pub ImageSize);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once(['x', 'X']).and_then(|(width, height)| {
            let (width_px, height_px) = (width.parse().ok()?, height.parse().ok()?);
            (width_px > 0 && height_px > 0).then_some(ImageSize { width_px, height_px })
        });
        parsed.map(Self).ok_or_else(|| "expected width x height, for example 1280x720".into())
    }
}

/// A length in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length {
    millimetres: f64,
}

impl BoardArguments {
    /// Configuration from the arguments. Names obsolete settings on stderr.
    pub fn config(&self) -> anyhow::Result<Config> {
        let mut config = Config::load(self.config.as_deref(), &self.settings)?;
        if let Some(board) = self.board {
            config.board = config.board.chosen(board);
        }
        if let Some(Length { millimetres }) = self.square {
            config.board.square_mm = millimetres;
        }
        config.board()?;
        Ok(config)
    }

    /// Configuration `taken_with`, overridden by `--set` and `--square`.
    pub fn config_over(&self, taken_with: &Config) -> anyhow::Result<Config> {
        if self.board.is_some() || self.config.is_some() {
            bail!(
                "a session knows its board and settings: leave out --board and --config; --square and --set correct them"
            );
        }
        let mut config = taken_with.with(&self.settings)?;
        if let Some(Length { millimetres }) = self.square {
            config.board.square_mm = millimetres;
        }
        Ok(config)
    }

    /// Sets the board as `--board` does.
    pub fn name(&mut self, board: &str) {
        self.board = board.parse().ok();
    }

    /// True if any argument is given.
    #[cfg(feature = "window")]
    pub fn says_something(&self) -> bool {
        self.board.is_some()
            || self.square.is_some()
            || self.config.is_some()
            || !self.settings.is_empty()
    }

    /// True if the arguments name the size of the squares, or use the default.
    pub fn says_square(&self) -> anyhow::Result<bool> {
        Ok(self.square.is_some() || self.sets_of_board("square_mm")?)
    }

    /// True if the arguments or the settings name the board's counts, or one with markers.
    pub fn names_board(&self) -> anyhow::Result<bool> {
        let says_counts =
            self.board.is_some() || self.sets_of_board("columns")? || self.sets_of_board("rows")?;
        Ok(says_counts || self.names_markers()?)
    }

    fn names_markers(&self) -> anyhow::Result<bool> {
        Ok(self.board.is_some_and(|board| !board.pattern.is_plain())
            || self.sets_of_board("dictionary")?
            || self.sets_of_board("tag_spacing")?)
    }

    /// Properties of the board left to a code in the margin, which only plain boards have.
    pub fn open_to_code(&self) -> anyhow::Result<BoardFromCode> {
        let says_square = self.says_square()? || self.names_markers()?;
        Ok(BoardFromCode::unless_given(self.names_board()?, says_square))
    }

    /// Configuration, with the board from a code in `pictures` if the arguments name none.
    pub fn config_for(&self, pictures: &[PathBuf]) -> anyhow::Result<Config> {
        let mut config = self.config()?;
        let open = self.open_to_code()?;
        if open != BoardFromCode::Nothing {
            board_from_pictures(pictures, &mut config, open, &announcer())?;
        }
        Ok(config)
    }

    /// True if the settings file or a `--set` has the key of the board.
    fn sets_of_board(&self, key: &str) -> anyhow::Result<bool> {
        let path = ["board", key];
        let sets = |setting: &String| {
            setting.split_once('=').is_some_and(|(key, _)| key.split('.').map(str::trim).eq(path))
        };
        let in_file = match &self.config {
            Some(file) => {
                let text = read_text(file, TEXT_LIMIT, Links::Followed)?;
                let table: toml::Table = toml::from_str(&text)
                    .with_context(|| format!("not a configuration: {file:?}"))?;
                table.get(path[0]).is_some_and(|board| board.get(path[1]).is_some())
            }
            None => false,
        };
        Ok(in_file || self.settings.iter().any(sets))
    }
}

impl FromStr for Length {
    type Err = InvalidChoice;

    fn from_str(text: &str) -> Result<Self, InvalidChoice> {
        // Rounded to a nanometre, to print the typed value again.
        Ok(Self { millimetres: millimetres(length_m(text)?) })
    }
}
