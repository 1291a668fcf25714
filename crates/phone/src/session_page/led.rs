//! The phone's page beside a session of several cameras: the picture that the person looks at, and
//! the one request.

use std::{path::Path, sync::atomic::Ordering};

use super::{
    Phone,
    result::{exports, report},
};
use crate::{PageFile, Stage};
use boresight_app::{
    RIG_REPORT, RIG_RESULT,
    session::{
        export::offered,
        rig_run::{RigHand, RigNews},
    },
};
use boresight_files::{Links, TEXT_LIMIT, read};
use boresight_guide::{rig::RigPrompt, session::Snapshot};
use boresight_present::{
    browser::Led,
    instruction::Instruction,
    speech::Rank,
    text::{phone as words, rig as rig_words},
};
use boresight_run::pipeline::Onlooker;

impl Phone {
    /// Shows `news` of the cameras `names`, and carries out what pages ask for.
    pub(super) fn lead(&self, news: &RigNews<'_>, names: &[String], hand: &RigHand) {
        if self.hub.take_undo() {
            hand.undo.store(true, Ordering::Relaxed);
        }
        if self.hub.wants_end() {
            hand.end.store(true, Ordering::Relaxed);
        }
        if news.is_over {
            return self.hub.show(Stage::Ending);
        }
        // The next news will do for a page that comes.
        if self.hub.pages() == 0 {
            return;
        }
        let (frame, Some(snapshot)) = news.cameras[news.shown] else { return };
        let reached = news.links.iter().map(|link| {
            let [a, b] = link.of.map(|camera| &names[camera]);
            format!("{}: {}", rig_words::pair_name(a, b), link.words)
        });
        let reached = reached.collect::<Vec<_>>().join(". ");
        self.hub.leading(frame, snapshot, led(news, snapshot, &names[news.shown]), reached);
    }
}

fn led(news: &RigNews<'_>, shown: &Snapshot, camera: &str) -> Led {
    let (rank, rest) = match news.prompt {
        RigPrompt::Resting { progress } => (Some(Rank::Hold), Some(progress)),
        RigPrompt::Rest => (Some(Rank::Hold), None),
        RigPrompt::Taken => (None, None),
        _ => (Some(Rank::Guidance), None),
    };
    let places = u32::try_from(news.places).unwrap_or(u32::MAX);
    let gravity = news.prompt.gravity(|_| Instruction::of(shown).gravity());
    let (camera, sentence) = (camera.to_owned(), news.sentences.clone());
    Led { camera, sentence, gravity, rank, rest, places }
}

/// Report, the rig, and its exports. Files that can't be made are left out: the page has no use for
/// an error.
pub(super) fn files(folder: &Path) -> Vec<PageFile> {
    let rig = folder.join(RIG_RESULT);
    let whole = read(&rig, TEXT_LIMIT, Links::Refused).ok();
    let whole = whole.map(|bytes| {
        PageFile::new(RIG_RESULT, words::CALIBRATION, "application/octet-stream", bytes)
    });
    let report = report(&folder.join(RIG_REPORT));
    report.into_iter().chain(whole).chain(exports(&rig, offered(true))).collect()
}
