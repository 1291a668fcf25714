//! Troubles of a session and their actions, in the order in which the window and the phone's page show them.

use super::{
    camera::{self, printable},
    window as words,
};
use boresight_geometry::{device::Fault, target::BoardChoice};
use boresight_guide::session::{Snapshot, Stream};

/// A trouble and its action.
#[derive(Clone, Debug, PartialEq)]
pub struct Trouble {
    /// Cause in one sentence.
    pub what: String,
    /// The next action; may be empty.
    pub action: String,
    /// Words of a device or program about it; may be empty.
    pub detail: String,
    /// A board that could be used instead.
    pub board: Option<BoardChoice>,
    /// True if views can be taken all the same: a doubt about the camera, which the result states.
    pub is_doubt: bool,
}

impl Trouble {
    /// A trouble without a detail.
    pub fn plain((what, action): (String, String)) -> Self {
        Self { what, action, detail: String::new(), board: None, is_doubt: false }
    }
}

/// Every trouble, the most important first: a worker that failed, an obstacle to taking views, doubts about the
/// pictures, another board. Each is named once.
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
        // A picture that stands still is none of the board.
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
