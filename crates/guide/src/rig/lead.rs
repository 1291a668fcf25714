//! Leads the sessions of several cameras: when to take a place, and from which of them.

use std::sync::Arc;

use nalgebra::Point2;

use super::{
    plan::{Plan, Wanted},
    rest::{Rest, apart_px, limit_widths_per_sec},
};
use crate::{
    guidance::{Role, wanted_share},
    session::{Command, Input, Prompt, Session, Snapshot, ViewNumber},
};
use boresight_calibrate::{KnownLens, RigViews, Verdict};
use boresight_geometry::{Corner, boards::Board, fit_pose, frame::ImageSize};

/// Rest of the board before a place is taken.
pub(super) const REST_SECS: f64 = 0.6;
/// Share of the last place that [`wanted_share`] goes by: a fifth of the best gain will do at
/// first, because letting the board rest costs a person seconds.
const SHOWN: f64 = 0.05;
/// Distance of corners from those of an earlier place in the same camera, in picture widths, below
/// which a place is the same: the calibration then counts it once. Two opposed tilts in one place
/// are 0.02 apart.
const SAME_PLACE_WIDTHS: f64 = 0.01;
/// Displacement of the corners while a place is taken, in picture widths, above which the board
/// didn't rest.
const MOVED_WIDTHS: f64 = 0.001;
/// Frames of each camera after which a picture that was asked for is given up.
const LONGEST_TAKING_FRAMES: usize = 45;
/// Frames of the lead during which a place counts as just taken.
const TAKEN_FRAMES: u32 = 20;

/// Common place of the board: the views of one moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Number of the place, from 1.
    pub number: u64,
    /// Each camera, with its view.
    pub views: Vec<(usize, ViewNumber)>,
}

/// Order of the fold to the program around it.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Give the input to the session of a camera.
    Give {
        /// The camera.
        camera: usize,
        /// The input.
        input: Input,
    },
    /// A place is complete: keep it, then plan anew.
    Keep(Place),
    /// A place was removed: forget it, then plan anew.
    Forget(u64),
}

/// What the fold knows of a camera.
#[derive(Clone, Debug)]
pub(super) struct CameraState {
    image_size: ImageSize,
    known_lens: Option<KnownLens>,
    rest: Rest,
    /// Each view with its corners.
    views: Vec<(ViewNumber, Vec<Corner>)>,
    pub(super) prompt: Option<Prompt>,
    /// True if the source has ended or failed.
    has_ended: bool,
}

impl CameraState {
    /// Takes over the views of the camera's session.
    fn take_over(&mut self, numbers: impl Iterator<Item = ViewNumber>, corners: &[Vec<Corner>]) {
        self.views = numbers.zip(corners.iter().cloned()).collect();
    }

    /// Corners of a view, in pixels; `None` without the view.
    fn view_px(&self, view: ViewNumber) -> Option<Vec<Point2<f64>>> {
        let (_, corners) = self.views.iter().find(|(number, _)| *number == view)?;
        Some(corners.iter().map(|corner| corner.px).collect())
    }

    /// Picture widths in pixels.
    fn widths_px(&self, widths: f64) -> f64 {
        widths * f64::from(self.image_size.width_px)
    }
}

/// Pictures that were asked for.
#[derive(Clone, Debug)]
struct Taking {
    /// Frames of any camera since.
    frames: usize,
    /// Each camera, its corners at rest, and its view.
    cameras: Vec<(usize, Vec<Point2<f64>>, Option<ViewNumber>)>,
}

/// Several sessions led to common places.
#[derive(Clone, Debug)]
pub struct RigSession {
    board: Board,
    is_synchronised: bool,
    pub(super) cameras: Vec<CameraState>,
    places: Vec<Place>,
    taking: Option<Taking>,
    plan: Option<Arc<Plan>>,
    frames_since_taken: u32,
    /// Rests since the newest place, in seconds, and the part of the current one.
    waited_secs: f64,
    rested_secs: f64,
    /// True if the board rests where it tells too little.
    pub(super) is_declined: bool,
}

impl RigSession {
    /// Leads sessions of cameras with the given picture sizes, and known lenses if any, from the
    /// first [plan](Self::planned) on, after the `places` of an earlier run. `is_synchronised` if
    /// one trigger starts every exposure.
    pub fn new(
        board: Board,
        cameras: impl IntoIterator<Item = (ImageSize, Option<KnownLens>)>,
        places: Vec<Place>,
        is_synchronised: bool,
    ) -> Self {
        let of = |(image_size, known_lens)| CameraState {
            image_size,
            known_lens,
            rest: Rest::default(),
            views: Vec::new(),
            prompt: None,
            has_ended: false,
        };
        let cameras = cameras.into_iter().map(of).collect();
        Self {
            board,
            is_synchronised,
            cameras,
            places,
            taking: None,
            plan: None,
            frames_since_taken: u32::MAX,
            waited_secs: 0.0,
            rested_secs: 0.0,
            is_declined: false,
        }
    }

    /// Places taken so far.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// The newest plan.
    pub fn plan(&self) -> Option<&Arc<Plan>> {
        self.plan.as_ref()
    }

    /// True if every pair of cameras meets the goal.
    pub fn is_complete(&self) -> bool {
        let found = self.plan.as_ref().and_then(|plan| plan.found.as_ref().ok());
        found.is_some_and(|rig| rig.verdict == Verdict::Good)
    }

    /// True if pictures come from fewer than two cameras.
    pub fn has_ended(&self) -> bool {
        self.cameras.iter().filter(|camera| !camera.has_ended).count() < 2
    }

    /// Views of each camera. Pictures of one place have its number; others have numbers of their
    /// own.
    pub fn views(&self) -> Vec<RigViews> {
        let mut alone = self.last_number();
        let mut of_camera = |(camera, state): (usize, &CameraState)| {
            let numbered = state.views.iter().map(|(view, corners)| {
                let place = self.places.iter().find(|place| place.views.contains(&(camera, *view)));
                let number = place.map(|place| place.number).unwrap_or_else(|| {
                    alone += 1;
                    alone
                });
                (number, corners.clone())
            });
            let views = numbered.collect();
            RigViews { image_size: state.image_size, views, known_lens: state.known_lens }
        };
        self.cameras.iter().enumerate().map(&mut of_camera).collect()
    }

    /// Largest number of a place; 0 without any.
    fn last_number(&self) -> u64 {
        self.places.iter().map(|place| place.number).max().unwrap_or(0)
    }

    /// Applies the newest state of a camera's session.
    pub fn seen(&mut self, camera: usize, snapshot: &Snapshot) -> Vec<Order> {
        let limit = limit_widths_per_sec(self.is_synchronised);
        let state = &mut self.cameras[camera];
        state.prompt = Some(snapshot.shown.prompt);
        state.has_ended = snapshot.source_ended || !snapshot.failures.is_empty();
        let numbers = || snapshot.views.iter().map(|view| view.number);
        if !state.views.iter().map(|(number, _)| *number).eq(numbers()) {
            state.take_over(numbers(), &snapshot.corners);
        }
        let width_px = f64::from(state.image_size.width_px);
        let live = snapshot.live.as_ref();
        let is_new = live.is_some_and(|live| state.rest.note(live, width_px, limit));
        // Views that the camera dropped, because its lens was touched, leave their places.
        let dropped = self.without_lost_views();
        if !dropped.is_empty() {
            return dropped;
        }
        let is_lead = camera == self.wanted().map_or(0, |wanted| wanted.lead);
        self.frames_since_taken =
            self.frames_since_taken.saturating_add(u32::from(is_new && is_lead));
        match &mut self.taking {
            Some(taking) => {
                taking.frames += usize::from(is_new);
                self.taken(snapshot, camera)
            }
            None if is_new => self.take(),
            None => Vec::new(),
        }
    }

    /// Takes over the views of a camera's session that no longer changes.
    pub fn settle(&mut self, camera: usize, session: &Session) {
        let numbers = session.accepted().iter().map(|taken| taken.number);
        self.cameras[camera].take_over(numbers, session.corners_at_one_instant());
    }

    /// Uses a new plan.
    pub fn planned(&mut self, plan: Plan) -> Vec<Order> {
        self.plan = Some(Arc::new(plan));
        self.lead()
    }

    /// Removes the newest place with its views.
    pub fn undo(&mut self) -> Vec<Order> {
        let Some(place) = self.places.pop() else { return Vec::new() };
        self.frames_since_taken = u32::MAX;
        let mut orders = self.remove(&place.views);
        orders.push(Order::Forget(place.number));
        orders
    }

    fn remove(&self, views: &[(usize, ViewNumber)]) -> Vec<Order> {
        let of = |(camera, view): &(usize, ViewNumber)| Order::Give {
            camera: *camera,
            input: Input::Command(Command::Remove { view: *view }),
        };
        views.iter().map(of).collect()
    }

    /// Places whose views are no longer among their sessions' views.
    fn without_lost_views(&mut self) -> Vec<Order> {
        let cameras = &self.cameras;
        let is_there = |(camera, view): &(usize, ViewNumber)| {
            let state = &cameras[*camera];
            // The session hasn't shown its views yet.
            state.prompt.is_none() || state.views.iter().any(|(number, _)| number == view)
        };
        let lost = self.places.extract_if(.., |place| !place.views.iter().all(is_there));
        lost.map(|place| Order::Forget(place.number)).collect()
    }

    /// Requests the wanted place from the cameras that see it.
    fn lead(&self) -> Vec<Order> {
        let order = |camera: usize| Order::Give { camera, input: self.led(camera) };
        (0..self.cameras.len()).map(order).collect()
    }

    fn led(&self, camera: usize) -> Input {
        let targets = self.wanted().map_or(&[][..], |wanted| &wanted.targets);
        let target = targets.iter().find(|(of, _)| *of == camera);
        Input::Led(target.map(|(_, target)| target.clone()))
    }

    pub(super) fn wanted(&self) -> Option<&Wanted> {
        self.plan.as_ref()?.wanted.as_ref()
    }

    pub(super) fn is_taking(&self) -> bool {
        self.taking.is_some()
    }

    pub(super) fn has_just_taken(&self) -> bool {
        self.frames_since_taken < TAKEN_FRAMES
    }

    /// Cameras that see the board.
    pub fn seeing(&self) -> Vec<usize> {
        let sees = |camera: &usize| {
            let state = &self.cameras[*camera];
            state.rest.corners_px.is_some() && !state.has_ended
        };
        (0..self.cameras.len()).filter(sees).collect()
    }

    /// Cameras that places link with `camera`, and itself, by bit.
    pub(super) fn linked(&self, camera: usize) -> u32 {
        let by_place = |place: &Place| place.views.iter().fold(0, |all, (of, _)| all | 1 << of);
        let mut linked = 1 << camera;
        loop {
            let touching = self.places.iter().map(by_place).filter(|place| place & linked != 0);
            let more = touching.fold(linked, |all, place| all | place);
            if more == linked {
                return linked;
            }
            linked = more;
        }
    }

    /// Time that the board has rested in all of `cameras`.
    pub(super) fn rested_secs(&self, cameras: &[usize]) -> f64 {
        let secs = cameras.iter().map(|camera| self.cameras[*camera].rest.secs);
        secs.fold(f64::INFINITY, f64::min)
    }

    /// True if the board is where none of `cameras` saw it at an earlier place of all of them.
    fn is_new(&self, cameras: &[usize]) -> bool {
        self.places.iter().all(|place| {
            cameras.iter().any(|camera| {
                let state = &self.cameras[*camera];
                let view = place.views.iter().find(|(of, _)| of == camera);
                let before = view.and_then(|(_, view)| state.view_px(*view));
                match (before, &state.rest.corners_px) {
                    (Some(before), Some(now)) => {
                        apart_px(&before, now) > state.widths_px(SAME_PLACE_WIDTHS)
                    }
                    (before, _) => before.is_none(),
                }
            })
        })
    }

    /// Asks for the pictures of a place, if the board rests where it tells enough.
    fn take(&mut self) -> Vec<Order> {
        self.is_declined = false;
        let seeing = self.seeing();
        if seeing.len() < 2 {
            return Vec::new();
        }
        let rested_secs = self.rested_secs(&seeing);
        self.waited_secs += (rested_secs - self.rested_secs).max(0.0);
        self.rested_secs = rested_secs;
        if rested_secs < REST_SECS || self.is_complete() || self.awaits_plan() {
            return Vec::new();
        }
        self.is_declined = !self.is_new(&seeing) || !self.is_worth_it(&seeing);
        if self.is_declined {
            return Vec::new();
        }
        let resting = |camera: &usize| {
            let corners_px = self.cameras[*camera].rest.corners_px.clone();
            (*camera, corners_px.unwrap_or_default(), None)
        };
        let cameras = seeing.iter().map(resting).collect();
        self.taking = Some(Taking { frames: 0, cameras });
        let force = |camera: &usize| Order::Give {
            camera: *camera,
            input: Input::Command(Command::ForceNext),
        };
        seeing.iter().map(force).collect()
    }

    /// True while the newest place isn't in the plan yet: the next one depends on it.
    fn awaits_plan(&self) -> bool {
        self.plan.as_ref().is_none_or(|plan| plan.places != self.places.len())
    }

    /// True if the place tells a share of what the wanted one would; the longer the board has
    /// rested since the newest place, here or elsewhere, the less is enough.
    fn is_worth_it(&self, seeing: &[usize]) -> bool {
        let Some(plan) = &self.plan else { return true };
        let (Some(worth), Some(wanted)) = (&plan.worth, &plan.wanted) else { return true };
        // Too few places state no uncertainty, whatever they tell.
        if plan.found.as_ref().is_ok_and(|rig| rig.covariance.is_none()) {
            return true;
        }
        let rig = worth.rig();
        let points_m = self.board.corners_in_board_m();
        let place = seeing.iter().find_map(|camera| {
            let corners_px = self.cameras[*camera].rest.corners_px.as_ref()?;
            let corners: Vec<Corner> =
                corners_px.iter().map(|px| Corner::isotropic(*px, 1.0)).collect();
            let pose = fit_pose(&rig.cameras[*camera], &points_m, &corners).ok()?;
            Some(rig.cam_from_rig[*camera].inverse() * pose.cam_from_board)
        });
        let gain = place.map_or(0.0, |place| worth.gain(&place));
        let share = gain / wanted.gain.max(f64::MIN_POSITIVE);
        share >= wanted_share(self.waited_secs, Some(SHOWN))
    }

    /// Notes a picture that was asked for; completes the place with the last one.
    fn taken(&mut self, snapshot: &Snapshot, camera: usize) -> Vec<Order> {
        let Some(taking) = &mut self.taking else { return Vec::new() };
        let in_places = |view: ViewNumber| {
            self.places.iter().any(|place| place.views.contains(&(camera, view)))
        };
        if let Some((.., view)) = taking.cameras.iter_mut().find(|(of, ..)| *of == camera)
            && view.is_none()
        {
            let newest = snapshot.views.last().filter(|it| it.role == Role::Forced);
            *view = newest.map(|newest| newest.number).filter(|number| !in_places(*number));
        }
        let given_up = taking.frames > LONGEST_TAKING_FRAMES * self.cameras.len();
        if !given_up && taking.cameras.iter().any(|(.., view)| view.is_none()) {
            return Vec::new();
        }
        let Some(Taking { cameras, .. }) = self.taking.take() else { return Vec::new() };
        let views: Vec<(usize, ViewNumber)> =
            cameras.iter().filter_map(|(camera, .., view)| Some((*camera, (*view)?))).collect();
        let moved = |(camera, at_rest, view): &(usize, Vec<Point2<f64>>, Option<ViewNumber>)| {
            let state = &self.cameras[*camera];
            let taken_px = view.and_then(|view| state.view_px(view));
            taken_px.is_some_and(|px| apart_px(&px, at_rest) > state.widths_px(MOVED_WIDTHS))
        };
        if views.len() < 2 || (!self.is_synchronised && cameras.iter().any(moved)) {
            for state in &mut self.cameras {
                state.rest.secs = 0.0;
            }
            return self.remove(&views);
        }
        let place = Place { number: self.last_number() + 1, views };
        self.places.push(place.clone());
        (self.frames_since_taken, self.waited_secs) = (0, 0.0);
        vec![Order::Keep(place)]
    }
}
