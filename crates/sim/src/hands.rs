//! One person's board in front of one or several cameras.

use std::{
    collections::BTreeMap,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use nalgebra::Isometry3;

use super::{
    scene::Scene,
    technician::{Cue, CueKind, Hand, Technician, matching_pose},
};
use boresight_geometry::frame::{CaptureTime, ImageSize};

/// Poses kept for cameras that ask later; more than two frames' poses.
const KEPT: usize = 4096;

/// Board in a person's hands, as one of the cameras sees it.
pub(super) struct Hands {
    shared: Arc<Shared>,
    camera: usize,
    cam_from_first: Isometry3<f64>,
    lens: boresight_geometry::Camera,
    image_size: ImageSize,
}

struct Shared {
    person: Mutex<Watched>,
    has_delivered: Condvar,
}

/// The person, and what the cameras have seen.
struct Watched {
    technician: Technician,
    /// Poses in the first camera's frame, by time: every camera sees the same.
    poses: BTreeMap<CaptureTime, Isometry3<f64>>,
    /// Number of frames that each camera has delivered.
    delivered: Vec<u64>,
}

impl Hands {
    /// The person of the first scene, in front of a camera with each scene's lens at each place.
    pub(super) fn before(cameras: &[(Scene, Isometry3<f64>)]) -> Vec<Self> {
        let Some((first, _)) = cameras.first() else { return Vec::new() };
        let shared = Arc::new(Shared {
            person: Mutex::new(Watched {
                technician: Technician::new(first),
                poses: BTreeMap::new(),
                delivered: vec![0; cameras.len()],
            }),
            has_delivered: Condvar::new(),
        });
        let of = |(camera, (scene, cam_from_first)): (usize, &(Scene, Isometry3<f64>))| Self {
            shared: Arc::clone(&shared),
            camera,
            cam_from_first: *cam_from_first,
            lens: scene.camera,
            image_size: scene.image_size,
        };
        cameras.iter().enumerate().map(of).collect()
    }

    fn person(&self) -> MutexGuard<'_, Watched> {
        self.shared.person.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Pose of the board in the camera's frame at `time`; of the nearest earlier time asked for, if
    /// the person has moved on.
    pub(super) fn pose_at(&self, time: CaptureTime) -> Isometry3<f64> {
        let mut person = self.person();
        let Watched { technician, poses, delivered } = &mut *person;
        if delivered.len() == 1 {
            return self.cam_from_first * technician.pose_at(time);
        }
        let newest = poses.last_key_value().map(|(newest, _)| *newest);
        if newest.is_none_or(|newest| newest < time) {
            poses.insert(time, technician.pose_at(time));
            if poses.len() > KEPT {
                poses.pop_first();
            }
        }
        let there = poses.range(..=time).next_back().or_else(|| poses.first_key_value());
        self.cam_from_first * there.map_or_else(Isometry3::identity, |(_, pose)| *pose)
    }

    /// Hand on the board at `time`; none where several cameras look.
    pub(super) fn hand_at(&self, time: CaptureTime) -> Option<Hand> {
        let mut person = self.person();
        if person.delivered.len() > 1 {
            return None;
        }
        person.technician.hand_at(time)
    }

    /// Shows or tells the person a cue of this camera's session.
    pub(super) fn read(&self, cue: Cue) {
        let mut person = self.person();
        let technician = &mut person.technician;
        let cue = match cue {
            cue if self.camera == 0 => Some(cue),
            // The person thinks in the first camera's frame.
            Cue { seen_at, kind: CueKind::Show { ghost_px, target } } => {
                let board_m = technician.corners_in_board_m();
                let pose = matching_pose(&self.lens, self.image_size, board_m, &ghost_px);
                let ghost_px = pose.and_then(|pose| {
                    let pose = self.cam_from_first.inverse() * pose;
                    let first = technician.camera();
                    board_m.iter().map(|point| first.px_from_board(&pose, point)).collect()
                });
                ghost_px.map(|ghost_px| Cue { seen_at, kind: CueKind::Show { ghost_px, target } })
            }
            _ => None,
        };
        if let Some(cue) = cue {
            technician.read(cue);
        }
    }

    /// Waits at most `patience` until no other camera is behind frame `next`. False if one is.
    pub(super) fn wait_for_others(&self, next: u64, patience: Duration) -> bool {
        let person = self.person();
        let is_behind = |person: &mut Watched| {
            let mut others =
                person.delivered.iter().enumerate().filter(|(camera, _)| *camera != self.camera);
            others.any(|(_, delivered)| *delivered < next)
        };
        let waited = self.shared.has_delivered.wait_timeout_while(person, patience, is_behind);
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }

    /// Notes that the camera has delivered `frames` frames.
    pub(super) fn delivered(&self, frames: u64) {
        self.person().delivered[self.camera] = frames;
        self.shared.has_delivered.notify_all();
    }
}

impl Drop for Hands {
    fn drop(&mut self) {
        // Nobody waits for a camera that is gone.
        self.delivered(u64::MAX);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cues, NoCues, SyntheticSource};
    use boresight_capture::{Arrival, FrameSource};

    #[test]
    fn cameras_of_a_rig_see_one_board_at_one_moment() {
        let image_size = ImageSize { width_px: 160, height_px: 90 };
        let scene = Scene { image_size, ..Scene::ordinary_webcam(1) };
        let apart = Isometry3::translation(-0.1, 0.0, 0.0);
        let cameras = vec![(scene.clone(), Isometry3::identity()), (scene, apart)];
        let cues = (0..2).map(|_| Box::new(NoCues) as Box<dyn Cues>).collect();
        let mut sources = SyntheticSource::rig(cameras, cues, Some(4), 2);
        let mut has_frame = |camera: usize| {
            let arrival = sources[camera].next_frame(Duration::from_millis(1));
            matches!(arrival, Ok(Arrival::Frame(_)))
        };
        for _ in 0..3 {
            assert!(has_frame(1) && !has_frame(1), "a camera waits for the other");
            assert!(has_frame(0));
        }
        let [first, second] = [0, 1].map(|camera| sources[camera].truth().snapshot().poses);
        for ((number, seen), (other, also)) in first.iter().zip(&second) {
            let off_m = (also.translation.vector - (apart * seen).translation.vector).norm();
            assert!(number == other && off_m < 1e-12, "{off_m}");
        }
        assert_eq!(first.len(), 3);
        // Whoever is left goes on alone.
        sources.truncate(1);
        let last = sources[0].next_frame(Duration::from_secs(1));
        assert!(matches!(last, Ok(Arrival::Frame(_))));
    }
}
