//! Single run: a strategy requests, a person shows, the lens is fitted and compared with the truth.

use nalgebra::{Isometry3, Vector2};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::{
    accept::{Judged, wish_at},
    course::{Course, IMAGE_SIZE, seen_margin_px},
    estimate::{Errors, calibrated, fitted},
    hand::{Person, Wish},
    situation::Situation,
    strategy::Strategy,
};
use crate::{
    params::{Hand, Params},
    setup::chance,
};
use boresight_calibrate::BundleState;
use boresight_geometry::Corner;
use boresight_guide::guidance::{GuidanceParams, LensEstimate, Progress, View, measure, progress};

/// Tries at a pose before the person gives up.
const TRIES: i32 = 6;
/// Numbers of views after which the lens is calibrated as in the program.
pub(super) const CALIBRATED_AFTER: [usize; 2] = [4, 8];
/// Number of views after which the program replaces the guessed lens.
const VIEWS_OF_A_LENS: usize = 2;

/// State of a run after a counted view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Number of the view, from 1.
    pub view: usize,
    /// Time since the start.
    pub secs: f64,
    /// Number of movements of the board since the start.
    pub tries: usize,
    /// Span of the view's corners: the larger share of the picture's width and height.
    pub span_fraction: f64,
    /// Errors of the lens with the model of the course.
    pub fitted: Errors,
    /// Errors of the lens as calibrated by the program; `None` if not computed.
    pub calibrated: Option<Errors>,
    /// True if the program's stop rule is satisfied; only for our strategies.
    pub complete: bool,
}

/// Runs `strategy` with `hand` on `course`; returns a mark per counted view.
pub fn run(
    course: &Course,
    strategy: &Strategy,
    hand: Hand,
    params: &Params,
    index: u64,
) -> Vec<Mark> {
    let mut rng = chance(params.seed, 2_000_000 + index);
    let mut chance_of_strategy = chance(params.seed, 3_000_000 + index);
    // Only whole boards are found.
    let guidance =
        GuidanceParams { plan: strategy.plan, pairs_beyond_edge: 0, ..GuidanceParams::default() };
    let mut lens_estimate = LensEstimate::guess(IMAGE_SIZE);
    let mut person = Person::new(hand, guidance.hold_secs);
    let mut state: Option<BundleState> = None;
    let (mut views, mut shown, mut poses, mut marks) =
        (Vec::<View>::new(), Vec::<Vec<Corner>>::new(), Vec::new(), Vec::new());
    let mut asked = 0;
    while shown.len() < params.guidance_views && asked < 3 * params.guidance_views {
        let situation = Situation {
            lens_estimate: &lens_estimate,
            views: &views,
            shown: &shown,
            poses: &poses,
            board: &course.board,
            params: &guidance,
            asked,
            model: course.model,
            noise_px: params.noise_px,
        };
        let Some(pose) = (strategy.wish)(&situation, &mut chance_of_strategy) else { break };
        asked += 1;
        let shown_now = show(course, strategy, &situation, pose, &mut person, &mut rng);
        let Some((corners, view)) = shown_now else { continue };
        let span_fraction = span_fraction(&corners);
        // A board facing the camera has no principal line, but its corners count all the same.
        views.extend(view);
        shown.push(corners);
        let Some((bundle, errors)) = fitted(course, &shown, state.as_ref()) else { continue };
        // Our strategies keep their guess as long as the program does. A hand measuring metres
        // can't: a wrong focal length would make every board smaller than the previous one.
        let guesses = strategy.is_ours() && hand != Hand::Metric && shown.len() < VIEWS_OF_A_LENS;
        if !guesses {
            lens_estimate.camera = bundle.state.camera;
            lens_estimate.covariance = bundle.covariance(1.0);
            remeasure(&mut views, course, &lens_estimate);
        }
        poses.clone_from(&bundle.state.cam_from_board);
        state = Some(bundle.state);
        let view = shown.len();
        let may_stop = strategy.is_ours() && view >= guidance.min_views && view.is_multiple_of(2);
        let calibrated = (may_stop || CALIBRATED_AFTER.contains(&view))
            .then(|| calibrated(course, &shown))
            .flatten();
        let complete = calibrated.as_ref().is_some_and(|(_, precision)| {
            strategy.is_ours() && progress(&views, Some(precision), &guidance) == Progress::Complete
        });
        marks.push(Mark {
            view,
            secs: person.secs,
            tries: person.tries,
            span_fraction,
            fitted: errors,
            calibrated: calibrated.map(|(errors, _)| errors),
            complete,
        });
    }
    marks
}

/// Brings the board to the requested pose until the view counts; returns corners and measured view.
/// `None` if the person gives up.
fn show(
    course: &Course,
    strategy: &Strategy,
    situation: &Situation<'_>,
    pose: Isometry3<f64>,
    person: &mut Person,
    rng: &mut ChaCha8Rng,
) -> Option<(Vec<Corner>, Option<View>)> {
    let believed = &situation.lens_estimate.camera;
    let wish = wish_at(pose, &course.board, believed)?;
    let mut goal = person.goal(&wish, &course.board, &course.lens);
    for attempt in 0..TRIES {
        let care = 0.6_f64.powi(attempt);
        person.bring(&goal, &course.lens, believed, care, rng);
        let Some(corners) = seen(course, &person.at, situation.noise_px, rng) else {
            person.step_back(&mut goal);
            continue;
        };
        let mut wishes = vec![wish.clone()];
        if situation.shown.is_empty() && strategy.accept.follows_the_live_picture() {
            wishes.extend(redrawn(course, pose, &corners));
        }
        match strategy.accept.judge(&wishes, &corners, person.secs, situation) {
            Judged::Taken(view) => return Some((corners, view.map(|view| *view))),
            Judged::Refused => {}
            Judged::Unwanted => return None,
        }
    }
    None
}

/// Ghost of `pose` through the lens estimated from the live picture alone.
fn redrawn(course: &Course, pose: Isometry3<f64>, corners: &[Corner]) -> Option<Wish> {
    let (bundle, _) = fitted(course, &[corners.to_vec()], None)?;
    wish_at(pose, &course.board, &bundle.state.camera)
}

/// Corners with noise; `None` if any is too close to the picture's edge to be found.
fn seen(
    course: &Course,
    pose: &Isometry3<f64>,
    noise_px: f64,
    rng: &mut ChaCha8Rng,
) -> Option<Vec<Corner>> {
    let (right, bottom) =
        (f64::from(IMAGE_SIZE.width_px) - 1.0, f64::from(IMAGE_SIZE.height_px) - 1.0);
    let margin_px = seen_margin_px();
    course
        .board
        .corners_in_board_m()
        .iter()
        .map(|m| {
            let px = course.lens.px_from_board(pose, m)?;
            let mut normal = || -> f64 {
                let value: f64 = StandardNormal.sample(rng);
                noise_px * value
            };
            let px = px + Vector2::new(normal(), normal());
            let inside = px.x.min(px.y).min(right - px.x).min(bottom - px.y) >= margin_px;
            inside.then(|| Corner::isotropic(px, noise_px))
        })
        .collect()
}

fn span_fraction(corners: &[Corner]) -> f64 {
    let (low, high) =
        boresight_guide::guidance::view::bounds_px(corners.iter().map(|corner| corner.px));
    let size = (high - low).component_div(&Vector2::new(
        f64::from(IMAGE_SIZE.width_px),
        f64::from(IMAGE_SIZE.height_px),
    ));
    size.max()
}

/// Measures the views again through the newest lens, as in a session; keeps views outside that
/// lens's field.
fn remeasure(views: &mut [View], course: &Course, lens_estimate: &LensEstimate) {
    for view in views {
        let frame = (view.frame_id, view.captured_at);
        let again = measure(frame, &view.corners, view.blur_px, &course.board, lens_estimate);
        if let Ok(again) = again {
            *view = View { partner_frame: view.partner_frame, ..again };
        }
    }
}
