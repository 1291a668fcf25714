//! Camera state as known to the session.

use std::collections::{BTreeMap, BTreeSet};

use boresight_geometry::device::{CameraEvent, Control, ControlChange, Fault, Lock, Locks, Mode};
use boresight_geometry::frame::CaptureTime;

/// Camera state of a session: plain data for a window or a command line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CameraState {
    /// State of the stream.
    pub stream: Stream,
    /// The granted mode.
    pub mode: Option<Mode>,
    /// State of the controls, as read back.
    pub locks: Locks,
    /// Locked controls whose values have changed.
    pub changed: BTreeMap<Control, ControlChange>,
    /// Changed controls set by the person.
    pub set_by_hand: BTreeSet<Control>,
    /// Time before which frames show the camera in an earlier state.
    pub good_from: Option<CaptureTime>,
    /// Warnings about the running stream, with details.
    pub doubts: BTreeMap<Fault, String>,
    /// Number of changes of focus or zoom in the run.
    pub geometry_changes: u32,
    /// Number of losses of the camera in the run.
    pub losses: u32,
    /// Frames lost by the driver or skipped for a newer frame, in the run.
    pub dropped: u64,
    /// Damaged frames, rejected before detection, in the run.
    pub rejected: u64,
}

/// State of a camera's stream.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Stream {
    /// The source is no live camera.
    #[default]
    NotLive,
    /// Frames are arriving.
    Live,
    /// Streaming stopped; reconnecting.
    Lost {
        /// Fault of the camera.
        fault: Fault,
        /// Details, such as the kernel's error text; may be empty.
        detail: String,
    },
}

impl CameraState {
    /// True if views may be taken: the camera is there, focus and zoom are in place, and the stream
    /// isn't frozen.
    pub fn may_take(&self) -> bool {
        !matches!(self.stream, Stream::Lost { .. })
            && !self.changed.keys().any(|control| control.moves_geometry())
            && !self.doubts.contains_key(&Fault::Frozen)
    }

    /// True if a view may be taken from a frame captured at `time`.
    pub(super) fn may_take_of(&self, time: CaptureTime) -> bool {
        self.may_take() && self.good_from.is_none_or(|from| time >= from)
    }

    /// Applies a camera event; `has_views` is true if the session holds views taken before the
    /// event.
    pub(super) fn apply(&mut self, event: &CameraEvent, has_views: bool) {
        match event {
            CameraEvent::Started { mode } => {
                *self = Self { stream: Stream::Live, mode: Some(*mode), ..Self::default() };
            }
            CameraEvent::Returned { mode, good_from } => {
                self.good_from = Some(*good_from);
                self.stream = Stream::Live;
                self.mode = Some(*mode);
                // A returning camera was verified; a warning still valid is repeated.
                self.changed.clear();
                self.set_by_hand.clear();
                self.doubts.clear();
            }
            CameraEvent::Lost { fault, detail } => {
                // Another reason for the same loss doesn't count again.
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

    /// Notes `control`, set by the person, with the new state `lock`. If it moves the geometry and
    /// the session has views, those come from a different lens: `control` counts as changed, with
    /// views good until `views_until`.
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
