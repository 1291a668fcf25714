//! Asks the scene behind the board about a focal length that seems to differ between views.

use std::path::{Path, PathBuf};

use nalgebra::Point2;

use crate::{Announcer, SavedSession, cores};
use boresight_calibrate::Calibration;
use boresight_capture::{Upright, read_picture_turned};
use boresight_geometry::{
    Corner,
    frame::{FrameId, SceneScale},
};
use boresight_guide::session::{Input, Session};
use boresight_present::text;
use boresight_scene::{Lens, scene_scales};

/// Focal lengths of `pictures` by the scene behind the board, relative to one of them. `None` for a
/// picture that can't be read, or tells nothing.
pub(crate) fn of_pictures(
    (pictures, upright): (&[PathBuf], Upright),
    views: &[Vec<Corner>],
    found: &Calibration,
) -> Vec<Option<SceneScale>> {
    let lens = Lens::new(found.camera, None, found.image_size);
    scene_scales(&lens, pictures.len(), cores(), |index| {
        let image = read_picture_turned(&pictures[index], upright).ok()?;
        let seen = views.get(index)?.iter().filter(|corner| corner.is_seen());
        let board_px: Vec<Point2<f64>> = seen.map(|corner| corner.px).collect();
        Some((image, board_px))
    })
}

/// Paths of the stored pictures of a session's accepted views.
pub(crate) fn stored_pictures(path: &Path, session: &Session) -> Vec<PathBuf> {
    let accepted = session.accepted().iter();
    accepted.map(|taken| path.join(FrameId(taken.view.frame_id.0).stored_name())).collect()
}

/// Session in `path`, with the testimony of the scene if its calibration asks for it: measured once
/// from the stored pictures, and recorded like every input.
///
/// # Errors
///
/// As [`SavedSession::resume`], and if the journal can't be written.
pub(super) fn asked(
    path: &Path,
    session: Session,
    announcer: &Announcer,
) -> anyhow::Result<Session> {
    let is_open = session.scene().is_empty();
    let asking = session.calibration().filter(|found| is_open && found.asks_for_scene());
    let Some(found) = asking else { return Ok(session) };
    announcer.say(text::session_news::ASKS_SCENE);
    let pictures = stored_pictures(path, &session);
    let corners = session.corners_at_one_instant();
    let scales = of_pictures((&pictures, Upright::AsStored), corners, found);
    let numbered = session.accepted().iter().zip(scales);
    let known: Vec<_> =
        numbered.filter_map(|(taken, scale)| Some((taken.number, scale?))).collect();
    if known.is_empty() {
        return Ok(session);
    }
    let (mut folder, SavedSession { mut session, .. }) = SavedSession::resume(path)?;
    let input = Input::Scene(known);
    let decision = session.handle(&input);
    folder.journal_mut().append(&input, &decision, None, true)?;
    Ok(session)
}
