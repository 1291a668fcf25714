//! The capture thread: ask the source for frames and events, and pass them on.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use crossbeam_channel::{Receiver, Sender};

use boresight_capture::{Arrival, FrameSource};
use boresight_geometry::{device::Control, frame::Frame};
use boresight_guide::session::Input;

/// Longest wait of a source before the stop flag is read again.
pub const SOURCE_PATIENCE: Duration = Duration::from_millis(100);

/// Fetches frames until the source ends or breaks, `publish` returns false, or `stop` is set.
/// Camera events go straight to the inbox and may overtake frames; each carries the time from which
/// frames are good.
pub(super) fn capture(
    mut source: Box<dyn FrameSource>,
    stop: &AtomicBool,
    inbox: &Sender<Input>,
    control_requests: &Receiver<(Control, i64)>,
    mut publish: impl FnMut(Arc<Frame>) -> bool,
) {
    while !stop.load(Ordering::Relaxed) {
        for (control, value) in control_requests.try_iter() {
            source.adjust(control, value);
        }
        match source.next_frame(SOURCE_PATIENCE) {
            Ok(Arrival::Frame(frame)) => {
                if !publish(frame) {
                    return;
                }
            }
            Ok(Arrival::Event(event)) => {
                if inbox.send(Input::Camera(event)).is_err() {
                    return;
                }
            }
            Ok(Arrival::NothingYet) => {}
            Ok(Arrival::End) => {
                // The slot closes when the thread ends, and the detector after it. The reader of
                // the snapshots stops the session after the last frame.
                inbox.send(Input::SourceEnded).ok();
                return;
            }
            Err(err) => {
                let reason = with_causes(&err);
                inbox.send(Input::WorkerFailed { worker: "capture".into(), reason }).ok();
                return;
            }
        }
    }
}

fn with_causes(err: &dyn std::error::Error) -> String {
    let mut text = err.to_string();
    let mut cause = err.source();
    while let Some(err) = cause {
        text = format!("{text}: {err}");
        cause = err.source();
    }
    text
}
