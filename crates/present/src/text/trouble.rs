//! Troubles and actions of a session, in the display order of the window and the phone's
//! page.

use super::{
    camera::{self, printable},
    window as words,
};
use boresight_geometry::{boards::BoardChoice, device::Fault};
use boresight_guide::session::{Snapshot, Stream};

/// Trouble with an action.
#[derive(Clone, Debug, PartialEq)]
pub struct Trouble {
    /// Cause in one sentence.
    pub what: String,
    /// Next action; may be empty.
    pub action: String,
    /// Words of a device or program about it; may be empty.
    pub detail: String,
    /// A board that could be used instead, as long as the session keeps no views.
    pub board: Option<BoardChoice>,
    /// True for a doubt about the camera: views can still be taken, and the result states it.
    pub is_doubt: bool,
}

impl Trouble {
    /// Trouble without a detail.
    pub fn plain((what, action): (String, String)) -> Self {
        Self { what, action, detail: String::new(), board: None, is_doubt: false }
    }
}

/// All troubles, most important first: a failed worker, an obstacle to taking views, doubts about
/// the pictures, another board. Each is named once.
pub fn troubles(snapshot: &Snapshot) -> Vec<Trouble> {
    let of_fault = |fault: Fault, detail: &str| {
        let (what, action) = camera::fault(fault);
        let detail = printable(detail);
        Trouble { detail, ..Trouble::plain((what.into(), action.into())) }
    };
    let failures = snapshot.failures.iter().map(|(worker, reason)| {
        Trouble::plain((words::failed(worker, reason), words::FAILED_ACTION.into()))
    });
    let camera = &snapshot.camera;
    let lost = match &camera.stream {
        Stream::Lost { fault, detail } => Some(Trouble {
            action: camera::action_while_lost(*fault).into(),
            ..of_fault(*fault, detail)
        }),
        _ => camera::geometry_moved(camera).map(Trouble::plain),
    };
    let frozen = |fault: &Fault| *fault == Fault::Frozen;
    let doubts = || camera.doubts.iter().map(|(fault, detail)| (*fault, detail.as_str()));
    let (first, others) =
        (doubts().filter(|(fault, _)| frozen(fault)), doubts().filter(|(fault, _)| !frozen(fault)));
    let doubts = first.chain(others).map(|(fault, detail)| Trouble {
        // A frozen picture is no doubt.
        is_doubt: fault != Fault::Frozen,
        ..of_fault(fault, detail)
    });
    let board = words::other_board(snapshot)
        .map(|said| Trouble { board: snapshot.shown.prompt.other_board(), ..Trouble::plain(said) });
    let mut troubles: Vec<Trouble> = Vec::new();
    for trouble in failures.chain(lost).chain(doubts).chain(board) {
        if !troubles.iter().any(|told| told.what == trouble.what) {
            troubles.push(trouble);
        }
    }
    troubles
}
