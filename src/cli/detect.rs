//! `boresight detect`.

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use anyhow::bail;
use clap::Args;

use image::GrayImage;

use super::this_command::with_board;
use boresight_app::{
    Exit,
    commands::{json::DetectedLine, weighed_picture},
    session::source::{SourceName, is_recording},
};
use boresight_capture::{Arrival, FrameSource, read_picture_turned};
use boresight_detect::{Detector, DetectorParams, Miss, WeighedGrid, agreed};
use boresight_files::{Overwrite, make_folder, save};
use boresight_formats::corner_table::{self, Digits};
use boresight_present::text::{self, weighed};
use boresight_terminal::{
    announcer,
    board_args::BoardArguments,
    print,
    progress::{FINDING, Progress},
    say,
    stdin::Given,
};

/// Detect the board's corners in pictures.
///
/// Prints a corner table, or one JSON object per picture. A picture of a video or bag is called
/// FILE#NUMBER.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Pictures (PNG, JPEG, BMP, PGM, PPM, TIFF, WebP), folders of them, video files or recorded
    /// bags; - reads one picture from standard input.
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<PathBuf>,
    /// Topic of the pictures in a recorded bag, for example /camera/image_raw [default: the only
    /// one with pictures].
    #[arg(long, value_name = "TOPIC")]
    topic: Option<String>,
    #[command(flatten)]
    board: BoardArguments,
    /// Read the pixels as they're stored, not turned as the pictures' EXIF orientation says.
    #[arg(long)]
    as_stored: bool,
    /// Say what was weighed for each picture, grid by grid, and draw the grids into pictures in
    /// this folder.
    #[arg(long, value_name = "DIR")]
    explain: Option<PathBuf>,
    /// Overwrite existing pictures in the folder of --explain.
    #[arg(long, requires = "explain")]
    force: bool,
    /// Print one JSON object per picture instead of the table.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight detect pictures > corners.vnl
  boresight detect --board 9x6 pictures/*.png > corners.vnl
  boresight detect --board 9x6 --json picture.png
  boresight detect --board 9x6 --explain why refused.png
  boresight detect --board 9x6 drive.mcap --topic /camera/image_raw";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let given = Given::of_pictures(&self.images)?;
        let (recordings, pictures): (Vec<PathBuf>, Vec<PathBuf>) =
            given.files.iter().cloned().partition(|path| is_recording(path));
        let mut config = self.board.config_for(&pictures)?;
        config.camera.topic = self.topic.clone().unwrap_or(config.camera.topic);
        config.camera.as_stored |= self.as_stored;
        let board = config.board()?;
        let mut detector = Detector::new(DetectorParams::default());
        let (mut unreadable, mut pictures_seen) = (0, 0);
        let mut misses = Vec::new();
        // The search for other boards takes as long as for the named one: it's for the first
        // picture and, if none shows the named board, for the last one.
        let (mut has_sought, mut last_open) = (false, None);
        if !self.json {
            print(corner_table::HEADER.trim_end())?;
        }
        let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
        let progress = Progress::new(FINDING, given.files.len());
        if let Some(folder) = &self.explain {
            make_folder(folder)?;
            progress.say(weighed::ABOUT);
        }
        let mut look = |name: &str, image: &GrayImage| {
            let started = Instant::now();
            let (seen, weighed) = match &self.explain {
                Some(_) => detector.explain(image, &board),
                None => (detector.detect(image, &board), Vec::new()),
            };
            let millis = started.elapsed().as_secs_f64() * 1e3;
            let seen = seen.map_err(|miss| {
                if !miss.leaves_open() || misses.len() < pictures_seen {
                    return miss;
                }
                if has_sought {
                    last_open = Some((misses.len(), name.to_owned(), image.clone()));
                    return miss;
                }
                has_sought = true;
                let other = detector.recognise(image, Some(&board), &|| true);
                other.map_or(miss, Miss::OtherBoard)
            });
            pictures_seen += 1;
            if let Err(miss) = &seen {
                progress.say(&format!("{name}: {}", text::miss(miss)));
                misses.push(*miss);
            }
            if let Some(folder) = &self.explain {
                explain(&progress, (folder, name, overwrite), image, weighed)?;
            }
            let line = if self.json {
                serde_json::to_string(&DetectedLine::of(name, &board, &seen, millis))?
            } else {
                let corners = seen.as_ref().ok().map(|detection| detection.corners.as_slice());
                corner_table::lines(name, corners, Digits::FourDecimals)
            };
            progress.aside(|| print(line.trim_end()))
        };
        for path in &given.files {
            let name = given.name(path);
            let read = if recordings.contains(path) {
                let source = SourceName::parse(&name, &config, &announcer());
                let source = source.and_then(|source| source.open(None));
                source.and_then(|open| in_turn(open.source, path, &mut look))
            } else {
                match read_picture_turned(path, config.camera.upright()) {
                    Ok(image) => {
                        look(&name, &image)?;
                        Ok(())
                    }
                    Err(err) => Err(err.into()),
                }
            };
            if let Err(err) = read {
                unreadable += 1;
                progress.say(&format!("boresight: {err:#}"));
                if self.json {
                    let line = DetectedLine::without(&name, &board, Some(format!("{err:#}")));
                    let line = serde_json::to_string(&line)?;
                    progress.aside(|| print(&line))?;
                }
            }
            progress.step();
        }
        let is_open = misses.len() == pictures_seen && agreed(&misses).is_none();
        if let Some((index, name, image)) = last_open.filter(|_| is_open)
            && let Some(other) = detector.recognise(&image, Some(&board), &|| true)
        {
            misses[index] = Miss::OtherBoard(other);
            progress.say(&format!("{name}: {}", text::miss(&misses[index])));
        }
        progress.finish();
        if pictures_seen > 1 {
            text::misses(&misses, pictures_seen).iter().for_each(|line| say(line));
        }
        if misses.len() == pictures_seen
            && let Some(choice) = agreed(&misses)
        {
            say(&text::agreed(&with_board(choice)));
        }
        if unreadable > 0 {
            bail!("{unreadable} of {} files could not be read", given.files.len());
        }
        Ok(Exit::Good)
    }
}

/// Prints the grids `weighed` for the picture `name`, and draws the grids into `folder`.
fn explain(
    progress: &Progress,
    (folder, name, overwrite): (&Path, &str, Overwrite),
    image: &GrayImage,
    mut grids: Vec<WeighedGrid>,
) -> anyhow::Result<()> {
    WeighedGrid::likeliest_first(&mut grids);
    for line in weighed::weighed(&grids) {
        progress.say(&format!("  {line}"));
    }
    if grids.is_empty() {
        progress.say(&format!("  {}", weighed::NO_GRID));
    }
    let name = Path::new(name).file_name().unwrap_or_default().to_string_lossy();
    let path = folder.join(format!("{}.png", name.trim_end_matches(".png")));
    save(&path, &weighed_picture(image, &grids)?, overwrite)?;
    progress.say(&format!("  Written: {}", path.display()));
    Ok(())
}

/// Hands each picture of the recording `path` to `look`, under number.
fn in_turn(
    mut source: Box<dyn FrameSource>,
    path: &Path,
    look: &mut dyn FnMut(&str, &GrayImage) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    const PATIENCE: Duration = Duration::from_secs(1);
    loop {
        match source.next_frame(PATIENCE)? {
            Arrival::Frame(frame) => {
                look(&format!("{}#{}", path.display(), frame.id.0), &frame.image)?;
            }
            Arrival::End => return Ok(()),
            Arrival::Event(_) | Arrival::NothingYet => {}
        }
    }
}
