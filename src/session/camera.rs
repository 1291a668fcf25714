//! The live camera as the session knows it.

use std::collections::{BTreeMap, BTreeSet};

use crate::device::{CameraEvent, Control, ControlChange, Fault, Lock, Locks, Mode};
use crate::frame::CaptureTime;

/// What the session knows about its camera: plain data for a window or a command line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CameraState {
    /// Whether pictures come.
    pub stream: Stream,
    /// What the driver granted.
    pub mode: Option<Mode>,
    /// How the controls stand.
    pub locks: Locks,
    /// Locked controls that are not what they were, and not yet back.
    pub changed: BTreeMap<Control, ControlChange>,
    /// Those of them that the person set to what they are.
    pub set_by_hand: BTreeSet<Control>,
    /// Pictures taken earlier are not of the camera as it is now.
    pub good_from: Option<CaptureTime>,
    /// What is doubtful although pictures come, with what is known besides.
    pub doubts: BTreeMap<Fault, String>,
    /// How often a control that moves the geometry changed in this run.
    pub geometry_changes: u32,
    /// How often the camera was lost in this run.
    pub losses: u32,
    /// Frames lost by the driver or skipped for a newer one, in this run.
    pub dropped: u64,
    /// Damaged frames, which nobody looked at, in this run.
    pub rejected: u64,
}

/// Whether a camera's pictures come.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Stream {
    /// The source is no live camera.
    #[default]
    NotLive,
    /// They come.
    Live,
    /// They do not; the camera is being looked for.
    Lost {
        /// Why.
        fault: Fault,
        /// What is known besides; may be empty.
        detail: String,
    },
}

impl CameraState {
    /// Whether a picture may be taken: the camera is there, focus and zoom are as they were, and the
    /// picture is not a frozen one.
    pub fn may_take(&self) -> bool {
        !matches!(self.stream, Stream::Lost { .. })
            && !self.changed.keys().any(|control| control.moves_geometry())
            && !self.doubts.contains_key(&Fault::Frozen)
    }

    /// Whether a picture taken at `time` may be taken.
    pub(super) fn may_take_of(&self, time: CaptureTime) -> bool {
        self.may_take() && self.good_from.is_none_or(|from| time >= from)
    }

    /// Applies what the camera said; `has_views` says whether views of the camera as it was are held on to.
    pub(super) fn apply(&mut self, event: &CameraEvent, has_views: bool) {
        match event {
            CameraEvent::Started { mode } => {
                *self = Self { stream: Stream::Live, mode: Some(*mode), ..Self::default() };
            }
            CameraEvent::Returned { mode, good_from } => {
                self.good_from = Some(*good_from);
                self.stream = Stream::Live;
                self.mode = Some(*mode);
                // A camera that streams again was verified; what was doubtful is looked at anew.
                self.changed.clear();
                self.set_by_hand.clear();
                self.doubts.clear();
            }
            CameraEvent::Lost { fault, detail } => {
                // Another reason for the same loss is no further loss.
                self.losses += u32::from(!matches!(self.stream, Stream::Lost { .. }));
                self.stream = Stream::Lost { fault: *fault, detail: detail.clone() };
            }
            CameraEvent::Doubtful { fault, detail } => {
                self.doubts.insert(*fault, detail.clone());
            }
            CameraEvent::Dispelled { fault } => {
                self.doubts.remove(fault);
            }
            CameraEvent::Locked { locks } => self.locks = *locks,
            CameraEvent::ControlChanged(change) => {
                self.geometry_changes += u32::from(change.control.moves_geometry());
                self.set_by_hand.remove(&change.control);
                self.changed.insert(change.control, *change);
            }
            CameraEvent::ControlRestored { control, good_from } => {
                self.good_from = self.good_from.max(Some(*good_from));
                self.changed.remove(control);
                self.set_by_hand.remove(control);
            }
            CameraEvent::ControlSet { control, lock, good_from } => {
                self.good_from = self.good_from.max(Some(*good_from));
                self.set(*control, *lock, has_views.then_some(*good_from));
            }
            CameraEvent::Counted { dropped, rejected } => {
                (self.dropped, self.rejected) = (*dropped, *rejected);
            }
        }
    }

    /// The person set `control`, and reads `lock`. Views that were taken before, if there are any, are of
    /// another lens if it moves the geometry: then it is as if it had moved by itself at `views_until`.
    fn set(&mut self, control: Control, lock: Lock, views_until: Option<CaptureTime>) {
        let before = self.changed.get(&control).map(|change| change.from);
        let before = before.or(self.locks.of(control).value());
        self.locks.note(control, lock);
        self.changed.remove(&control);
        self.set_by_hand.remove(&control);
        if let (Some(from), Some(to), Some(good_until)) = (before, lock.value(), views_until)
            && from != to
            && control.moves_geometry()
        {
            self.geometry_changes += 1;
            self.changed.insert(control, ControlChange { control, from, to, good_until });
            self.set_by_hand.insert(control);
        }
    }
}
