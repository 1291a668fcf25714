//! The simulated camera as a frame source, in step with the judging of frames.

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use image::GrayImage;
use nalgebra::Isometry3;

use super::{hands::Hands, renderer::Renderer, scene::Scene, technician::Cue, track::Track};
use boresight_capture::{Arrival, CaptureError, FrameSource, SourceIdentity};
use boresight_geometry::{
    Camera,
    frame::{CaptureTime, Frame, FrameId, FrameKind},
};

/// Number of poses per exposure: a power of two, so that each gets an even run of samples.
const POSES_PER_EXPOSURE: u32 = 8;

/// Source of cues from the program to the simulated person.
pub trait Cues: Send {
    /// Waits at most `patience` until the program has judged the frame `published`, the last one
    /// delivered. False if it has not.
    fn wait_judged(&mut self, published: Option<FrameId>, patience: Duration) -> bool;

    /// Next cue, in order, caused by frames up to the judged one. `None` once all are read.
    fn next_cue(&mut self) -> Option<Cue>;
}

/// Source without cues.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoCues;

impl Cues for NoCues {
    fn wait_judged(&mut self, _published: Option<FrameId>, _patience: Duration) -> bool {
        true
    }

    fn next_cue(&mut self) -> Option<Cue> {
        None
    }
}

/// Truth behind the simulated pictures, to be estimated by the program.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// True lens.
    pub camera: Camera,
    /// Pose of the board (`cam_from_board`) in the middle of each delivered frame's exposure; with
    /// a rolling shutter, of its middle row's exposure.
    pub poses: Vec<(FrameId, Isometry3<f64>)>,
}

/// Truth about the frames delivered so far, shared with the source.
#[derive(Clone, Debug)]
pub struct TruthLog {
    truth: Arc<Mutex<Truth>>,
}

impl TruthLog {
    /// Copy of the truth so far.
    pub fn snapshot(&self) -> Truth {
        self.truth.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn add(&self, id: FrameId, cam_from_board: Isometry3<f64>) {
        self.truth.lock().unwrap_or_else(PoisonError::into_inner).poses.push((id, cam_from_board));
    }
}

/// Frames of a [`Scene`].
///
/// Frame `n` is drawn while frame `n - 1` is judged, so a cue can move the board from frame `n + 1`
/// on at the earliest: the frames don't depend on the speed of the judging.
pub struct SyntheticSource {
    scene: Scene,
    renderer: Renderer,
    hands: Hands,
    /// Path of the board, for a rolling shutter.
    track: Track,
    cues: Box<dyn Cues>,
    frames_left: Option<u64>,
    next_id: u64,
    published: Option<FrameId>,
    prepared: Option<(Arc<Frame>, Isometry3<f64>)>,
    /// Frames with reusable memory, once nobody else holds them.
    pool: Vec<Arc<Frame>>,
    pool_size: usize,
    truth: TruthLog,
}

impl SyntheticSource {
    /// Source of at most `limit_frames` frames, reusing the memory of up to `pool_size` frames.
    pub fn new(
        scene: Scene,
        cues: Box<dyn Cues>,
        limit_frames: Option<u64>,
        pool_size: usize,
    ) -> Self {
        let hands = Hands::before(&[(scene.clone(), Isometry3::identity())]).remove(0);
        Self::with(scene, hands, cues, (limit_frames, pool_size))
    }

    /// Sources of several cameras in front of the first scene's person, with `cam_from_first` of
    /// each. Frames of one number are of one moment, if the scenes have equal intervals; a camera
    /// waits for the others.
    pub fn rig(
        cameras: Vec<(Scene, Isometry3<f64>)>,
        cues: Vec<Box<dyn Cues>>,
        limit_frames: Option<u64>,
        pool_size: usize,
    ) -> Vec<Self> {
        let hands = Hands::before(&cameras);
        let scenes = cameras.into_iter().zip(hands).zip(cues);
        let of =
            |(((scene, _), hands), cues)| Self::with(scene, hands, cues, (limit_frames, pool_size));
        scenes.map(of).collect()
    }

    fn with(
        scene: Scene,
        hands: Hands,
        cues: Box<dyn Cues>,
        (limit_frames, pool_size): (Option<u64>, usize),
    ) -> Self {
        let truth = Truth { camera: scene.camera, poses: Vec::new() };
        Self {
            renderer: Renderer::new(&scene),
            hands,
            track: Track::default(),
            cues,
            frames_left: limit_frames,
            next_id: 0,
            published: None,
            prepared: None,
            pool: Vec::with_capacity(pool_size),
            pool_size,
            truth: TruthLog { truth: Arc::new(Mutex::new(truth)) },
            scene,
        }
    }

    /// Truth about delivered frames; stays readable after the source has moved to its thread.
    pub fn truth(&self) -> TruthLog {
        self.truth.clone()
    }

    fn prepare(&mut self) -> (Arc<Frame>, Isometry3<f64>) {
        let id = FrameId(self.next_id);
        self.next_id += 1;
        let captured_at =
            CaptureTime { nanos: (id.0 + 1).saturating_mul(self.scene.frame_interval_nanos) };
        let mut shared = self.free_frame();
        // Nobody else holds a free frame, so this never copies.
        let frame = Arc::make_mut(&mut shared);
        (frame.id, frame.captured_at) = (id, captured_at);
        self.renderer.cover(self.hands.hand_at(captured_at));
        let middle = self.expose(id, captured_at, &mut frame.image);
        if self.pool.len() < self.pool_size {
            self.pool.push(Arc::clone(&shared));
        }
        (shared, middle)
    }

    /// Draws the picture exposed around `captured_at`, and returns the pose
    /// then.
    fn expose(
        &mut self,
        id: FrameId,
        captured_at: CaptureTime,
        image: &mut GrayImage,
    ) -> Isometry3<f64> {
        let readout_secs = self.scene.readout_secs.clamp(0.0, self.frame_interval_secs());
        if readout_secs > 0.0 {
            return self.expose_rolling(id, captured_at, readout_secs, image);
        }
        let (poses, middle) = self.poses_during_exposure(captured_at);
        self.renderer.render(&poses, id.0, image);
        middle
    }

    /// Draws rows successively: row `r` of `h` has the middle of its exposure `(r / (h − 1) −
    /// ½) · readout_secs` after `captured_at`.
    fn expose_rolling(
        &mut self,
        id: FrameId,
        captured_at: CaptureTime,
        readout_secs: f64,
        image: &mut GrayImage,
    ) -> Isometry3<f64> {
        let middle_secs = captured_at.nanos as f64 * 1e-9;
        let exposure_secs = self.exposure_secs();
        let half_secs = 0.5 * (exposure_secs + readout_secs);
        self.track.follow(&self.hands, middle_secs - half_secs, middle_secs + half_secs);
        let (track, last_row) = (&self.track, self.scene.image_size.height_px.saturating_sub(1));
        let poses_of_row = |row: u32| {
            let share = f64::from(row) / f64::from(last_row.max(1)) - 0.5;
            let row_secs = middle_secs + share * readout_secs;
            (0..POSES_PER_EXPOSURE)
                .map(|i| (f64::from(i) + 0.5) / f64::from(POSES_PER_EXPOSURE) - 0.5)
                .map(|share| track.pose_at(row_secs + share * exposure_secs))
                .collect()
        };
        self.renderer.render_rolling(&poses_of_row, id.0, image);
        self.track.pose_at(middle_secs)
    }

    /// Exposure time, limited to the neighbouring frames' middles.
    fn exposure_secs(&self) -> f64 {
        self.scene.exposure_secs.clamp(0.0, self.frame_interval_secs())
    }

    fn frame_interval_secs(&self) -> f64 {
        self.scene.frame_interval_nanos as f64 * 1e-9
    }

    /// Poses spread evenly over the exposure around `captured_at`, and the pose in the middle.
    fn poses_during_exposure(
        &mut self,
        captured_at: CaptureTime,
    ) -> (Vec<Isometry3<f64>>, Isometry3<f64>) {
        let exposure_nanos = (self.exposure_secs() * 1e9) as u64;
        let start_nanos = captured_at.nanos - (exposure_nanos / 2).min(captured_at.nanos);
        let hands = &self.hands;
        let mut poses = Vec::with_capacity(POSES_PER_EXPOSURE as usize);
        let mut middle = None;
        for i in 0..POSES_PER_EXPOSURE {
            if i == POSES_PER_EXPOSURE / 2 {
                middle = Some(hands.pose_at(captured_at));
            }
            let share = (f64::from(i) + 0.5) / f64::from(POSES_PER_EXPOSURE);
            let nanos = start_nanos + (share * exposure_nanos as f64) as u64;
            poses.push(hands.pose_at(CaptureTime { nanos }));
        }
        let middle = middle.unwrap_or_else(|| hands.pose_at(captured_at));
        (poses, middle)
    }

    /// Unused frame: from the pool, or a new one.
    fn free_frame(&mut self) -> Arc<Frame> {
        match self.pool.iter_mut().position(|frame| Arc::get_mut(frame).is_some()) {
            Some(free) => self.pool.swap_remove(free),
            None => Arc::new(Frame {
                id: FrameId(0),
                captured_at: CaptureTime { nanos: 0 },
                kind: FrameKind::Video,
                name: String::new(),
                image: GrayImage::new(
                    self.scene.image_size.width_px,
                    self.scene.image_size.height_px,
                ),
            }),
        }
    }
}

impl FrameSource for SyntheticSource {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity {
            name: format!("sim:{}", self.scene.name),
            image_size: Some(self.scene.image_size),
        }
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        if self.frames_left == Some(0) {
            return Ok(Arrival::End);
        }
        if self.prepared.is_none() && !self.hands.wait_for_others(self.next_id, patience) {
            return Ok(Arrival::NothingYet);
        }
        let prepared = match self.prepared.take() {
            Some(prepared) => prepared,
            None => self.prepare(),
        };
        if !self.cues.wait_judged(self.published, patience) {
            self.prepared = Some(prepared);
            return Ok(Arrival::NothingYet);
        }
        while let Some(cue) = self.cues.next_cue() {
            self.hands.read(cue);
        }
        let (frame, middle) = prepared;
        self.published = Some(frame.id);
        self.frames_left = self.frames_left.map(|left| left - 1);
        self.truth.add(frame.id, middle);
        self.hands.delivered(frame.id.0 + 1);
        Ok(Arrival::Frame(frame))
    }
}
