//! Views of pictures or of a corner table, as commands take them.

use std::path::PathBuf;

use anyhow::bail;

use boresight_app::commands::calibration_views::{
    CalibrationViews, from_pictures, from_table, is_table,
};
use boresight_capture::Upright;
use boresight_geometry::boards::Board;
use boresight_terminal::{
    announcer,
    board_args::Size,
    progress::{FINDING, Progress},
    usage::WrongUsage,
};

/// Views of pictures, or of one corner table of pictures of `image_size`.
pub(super) fn views_of(
    (inputs, upright): (&[PathBuf], Upright),
    image_size: Option<Size>,
    board: &Board,
    with_thumbnails: bool,
) -> anyhow::Result<CalibrationViews> {
    match inputs {
        [table] if is_table(table) => {
            let Size(image_size) = image_size.ok_or_else(|| {
                let wanted = "a corner table needs --image-size WxH, the size of its pictures";
                WrongUsage(wanted.into())
            })?;
            from_table(table, image_size, board, with_thumbnails)
        }
        inputs if inputs.iter().any(|path| is_table(path)) => {
            bail!("give pictures, or one corner table, not both")
        }
        inputs => {
            let progress = Progress::new(FINDING, inputs.len());
            let step = || progress.step();
            let views =
                from_pictures((inputs, upright), board, with_thumbnails, &announcer(), step)?;
            progress.finish();
            Ok(views)
        }
    }
}
