//! Announces each change of the live camera once.

use crate::Announcer;
use boresight_geometry::device::{Control, Lock};
use boresight_guide::session::{CameraState, Stream};
use boresight_present::text::camera as words;

/// Announcer of camera states, with the last announced state.
#[derive(Debug)]
pub(super) struct CameraAnnouncer<'a> {
    announcer: &'a Announcer,
    announced: CameraState,
}

impl<'a> CameraAnnouncer<'a> {
    /// Starts with nothing announced.
    pub(super) fn new(announcer: &'a Announcer) -> Self {
        Self { announcer, announced: CameraState::default() }
    }

    /// Announces the changes in `now`.
    pub(super) fn announce(&mut self, now: &CameraState) {
        if *now == self.announced {
            return;
        }
        let before = std::mem::replace(&mut self.announced, now.clone());
        let say = |line: &str| self.announcer.say(line);
        if let Some(mode) = now.mode.filter(|_| now.mode != before.mode) {
            say(&format!("  Camera: {}", words::mode(&mode)));
        }
        for (fault, detail) in &now.doubts {
            if before.doubts.get(fault) != Some(detail) {
                let (cause, action) = words::with_detail(*fault, detail);
                say(&format!("  {}: {cause}. {action}", fault.code()));
            }
        }
        // Controls moving the geometry are obstacles; the others are restored meanwhile.
        let told = |control: &Control| !control.moves_geometry();
        for (control, change) in now.changed.iter().filter(|(control, _)| told(control)) {
            if before.changed.get(control) != Some(change) {
                say(&format!("  {}", words::put_right(change)));
            }
        }
        for control in before.changed.keys().filter(|control| told(control)) {
            let is_back = !now.changed.contains_key(control);
            if is_back && now.locks.of(*control) == before.locks.of(*control) {
                say(&format!("  {}", words::is_back(*control)));
            }
        }
        let (was, is) = (words::obstacle(&before), words::obstacle(now));
        match is {
            Some((cause, action)) if was.as_ref().is_none_or(|(before, _)| *before != cause) => {
                let code = match &now.stream {
                    Stream::Lost { fault, .. } => format!("{}: ", fault.code()),
                    Stream::NotLive | Stream::Live => String::new(),
                };
                say(&format!("  {code}{cause}. {action}"));
            }
            None if was.is_some() => say("  The camera is back."),
            _ => {}
        }
        if now.locks != before.locks {
            let locks: Vec<String> = Control::ALL
                .into_iter()
                .filter(|control| !matches!(now.locks.of(*control), Lock::Unknown | Lock::Absent))
                .map(|c| format!("{} {}", words::control(c), words::lock(now.locks.of(c))))
                .collect();
            let fixed = if locks.is_empty() {
                "it has no controls to lock".into()
            } else {
                locks.join(", ")
            };
            say(&format!("  Controls: {fixed}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use boresight_geometry::{device::ControlChange, frame::CaptureTime};

    #[test]
    fn a_control_that_is_put_right_is_told_once_and_again_when_it_is_back() {
        let said = Arc::new(Mutex::new(Vec::new()));
        let heard = Arc::clone(&said);
        let announcer = Announcer::new(move |line| {
            heard.lock().expect("whole").push(line.trim().to_owned());
        });
        let control = Control::Exposure;
        let good_until = CaptureTime { nanos: 1 };
        let change = ControlChange { control, from: 8000, to: 33333, good_until };
        let away = CameraState { changed: [(control, change)].into(), ..CameraState::default() };
        let mut announcing = CameraAnnouncer::new(&announcer);
        announcing.announce(&away);
        announcing.announce(&CameraState { dropped: 1, ..away });
        announcing.announce(&CameraState { dropped: 1, ..CameraState::default() });
        let said = said.lock().expect("whole");
        assert_eq!(
            *said,
            ["Exposure changed (8000 to 33333). Setting it back…", "Exposure is set back"]
        );
    }
}
