//! Boards leaving the picture determine the lens better than whole boards: out to the picture's
//! edge.

use boresight_calibrate::CalibrationParams;
use boresight_detect::{Miss, Side};
use boresight_geometry::Corner;
use boresight_guide::{
    guidance::{Progress, Purpose},
    session::{Command, Input, Outcome, Session},
};
use boresight_present::text;
use boresight_testkit::world::{SIZE, World, guided_from, setup};
use nalgebra::{Isometry3, Point2};

/// Cells along each side of the picture; the outer tenth is two cells deep.
const CELLS: usize = 20;

/// Share of the cells in the picture's outer tenth with a corner of an accepted view.
fn outer_tenth(session: &Session) -> f64 {
    let mut hit = [[false; CELLS]; CELLS];
    for accepted in session.accepted() {
        for corner in accepted.view.corners.iter().filter(|corner| corner.is_seen()) {
            let cell = |at: f64, size: u32| (at / f64::from(size) * CELLS as f64) as usize;
            let (x, y) = (cell(corner.px.x, SIZE.width_px), cell(corner.px.y, SIZE.height_px));
            hit[y.min(CELLS - 1)][x.min(CELLS - 1)] = true;
        }
    }
    let is_outer = |at: usize| !(2..CELLS - 2).contains(&at);
    let outer = (0..CELLS * CELLS)
        .map(|cell| (cell / CELLS, cell % CELLS))
        .filter(|(y, x)| is_outer(*y) || is_outer(*x));
    let (mut held, mut all) = (0, 0);
    for (y, x) in outer {
        held += usize::from(hit[y][x]);
        all += 1;
    }
    held as f64 / f64::from(all)
}

/// A guided session with boards beyond the picture's edge, or without.
fn session(seed: u64, limit_px: Option<f64>) -> (World, Session) {
    let mut world = World::new(seed);
    world.noise_px = 0.005;
    let mut setup = setup(world.board);
    setup.calibration = CalibrationParams::default();
    setup.guidance.stop_corner_sigma_px = limit_px;
    setup.guidance.min_views = 8;
    let (world, session, _) = guided_from(world, Session::new(setup), |_, _| ());
    (world, session)
}

#[test]
fn a_plan_that_may_leave_the_picture_knows_its_corners_as_well() {
    let sessions: u64 =
        std::env::var("BORESIGHT_SESSIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    let (mut whole, mut beyond) = ([0.0; 2], [0.0; 2]);
    for seed in 1..=sessions {
        for (limit_px, sums) in [(None, &mut whole), (Some(0.04), &mut beyond)] {
            let (_, session) = session(seed, limit_px);
            assert_eq!(session.progress(), Progress::Complete, "seed {seed}, {limit_px:?}");
            let calibration = session.calibration().expect("calibrated");
            let more = [outer_tenth(&session), calibration.projection_sd.max_px];
            for (sum, more) in sums.iter_mut().zip(more) {
                *sum += more / sessions as f64;
            }
        }
    }
    println!(
        "outer tenth {:.3}, {:.3}; sd in the corners {:.3}, {:.3} px",
        whole[0], beyond[0], whole[1], beyond[1]
    );
    assert!(beyond[1] < 1.1 * whole[1], "{beyond:?} {whole:?}");
}

/// Runs a session until the target leaves the picture.
fn asked_beyond_edge(seed: u64) -> (World, Session) {
    let mut world = World::new(seed);
    world.noise_px = 0.005;
    let mut setup = setup(world.board);
    setup.guidance.stop_projection_sigma_px = 1e-3;
    setup.guidance.max_views = 10_000;
    setup.guidance.pairs_beyond_edge = 1;
    setup.guidance.stop_corner_sigma_px = Some(0.04);
    ask_beyond_edge(world, Session::new(setup))
}

/// Continues until the target leaves the picture.
fn ask_beyond_edge(mut world: World, mut session: Session) -> (World, Session) {
    for _ in 0..60 {
        let target = session.target().expect("collecting").clone();
        if target.purpose == Purpose::BeyondEdge {
            assert!(target.leaves_picture);
            return (world, session);
        }
        let Some(pose) = world.pose_for(&target.ghost_px, 0.5) else { continue };
        for _ in 0..24 {
            let outcome = session.handle(&Input::Observed(world.observe(&pose))).outcome;
            if matches!(outcome, Outcome::Accepted { .. }) {
                break;
            }
        }
    }
    unreachable!("no pose beyond the edge");
}

/// A whole board, facing the camera.
fn whole_pose(world: &World) -> Isometry3<f64> {
    let depth_m = 16.0 * world.board.square_m() * world.camera.f_px.x / f64::from(SIZE.width_px);
    Isometry3::new(nalgebra::Vector3::new(0.0, 0.0, depth_m), nalgebra::Vector3::new(0.4, 0.3, 0.0))
}

#[test]
fn a_part_that_cannot_be_told_is_asked_to_be_shown_whole_first() {
    let (mut world, mut session) = asked_beyond_edge(3);
    let ghost = session.target().expect("a pose").ghost_px.clone();
    let pose = world.pose_for(&ghost, 0.0).expect("a pose");
    // Without a previous detection, the part can't be identified.
    let away = Isometry3::translation(40.0, 0.0, 1.0);
    session.handle(&Input::Observed(world.observe(&away)));
    let mut decision = None;
    for _ in 0..90 {
        decision = Some(session.handle(&Input::Observed(world.observe(&pose))));
    }
    let shown = session.snapshot(decision.expect("a frame")).shown;
    assert_eq!(text::prompt(shown.prompt), "Start with the whole board");
}

#[test]
fn a_whole_board_does_not_count_as_one_beyond_the_edge() {
    let (mut world, mut session) = asked_beyond_edge(3);
    let whole = whole_pose(&world);
    // Longer than the target lasts, even if a view is taken meanwhile and its partner follows.
    for _ in 0..750 {
        session.handle(&Input::Observed(world.observe(&whole)));
    }
    assert!(session.accepted().iter().all(|taken| !taken.was_beyond_edge));
    // The person can't or won't: whole boards are the targets from then on.
    assert_ne!(purpose(&session), Some(Purpose::BeyondEdge));
}

#[test]
fn the_ghost_beyond_the_edge_shows_most_of_the_board() {
    let (_, session) = asked_beyond_edge(5);
    let ghost: &[Point2<f64>] = &session.target().expect("a pose").ghost_px;
    let seen: Vec<Corner> = ghost
        .iter()
        .map(|px| Corner::isotropic(*px, 1.0))
        .filter(|corner| {
            (0.0..f64::from(SIZE.width_px)).contains(&corner.px.x)
                && (0.0..f64::from(SIZE.height_px)).contains(&corner.px.y)
        })
        .collect();
    assert!(seen.len() < ghost.len() && seen.len() * 10 >= ghost.len() * 6, "{}", seen.len());
}

/// Purpose of the target.
fn purpose(session: &Session) -> Option<Purpose> {
    session.target().map(|target| target.purpose)
}

/// Shows the board at the target until a view is taken.
fn take(world: &mut World, session: &mut Session) {
    let target = session.target().expect("collecting").clone();
    if let Some(whole) = world.whole_first(&target) {
        session.handle(&Input::Observed(whole));
    }
    let pose = world.pose_for(&target.ghost_px, 0.0).expect("a pose");
    let mut observe = || session.handle(&Input::Observed(world.observe(&pose))).outcome;
    let is_taken = (0..90).any(|_| matches!(observe(), Outcome::Accepted { .. }));
    assert!(is_taken, "not taken");
}

#[test]
fn a_view_beyond_the_edge_that_is_undone_is_asked_for_again() {
    let (mut world, mut session) = asked_beyond_edge(3);
    take(&mut world, &mut session);
    assert!(matches!(purpose(&session), Some(Purpose::Partner { .. })));
    session.handle(&Input::Command(Command::UndoLast));
    assert_eq!(purpose(&session), Some(Purpose::BeyondEdge));
}

#[test]
fn who_takes_a_view_back_is_asked_beyond_the_edge_again() {
    let (mut world, mut session) = asked_beyond_edge(3);
    // The board isn't tilted: nothing is taken.
    let flat = Isometry3::translation(0.0, 0.0, whole_pose(&world).translation.z);
    for _ in 0..300 {
        session.handle(&Input::Observed(world.observe(&flat)));
    }
    assert_ne!(purpose(&session), Some(Purpose::BeyondEdge), "the person can't show it");
    session.handle(&Input::Command(Command::UndoLast));
    take(&mut world, &mut session);
    assert_eq!(purpose(&session), Some(Purpose::BeyondEdge));
}

#[test]
fn a_rest_does_not_count_as_not_being_able_to_reach_beyond_the_edge() {
    let (mut world, mut session) = asked_beyond_edge(3);
    let whole = whole_pose(&world);
    let away = Isometry3::translation(40.0, 0.0, 1.0);
    session.handle(&Input::Observed(world.observe(&whole)));
    for _ in 0..900 {
        session.handle(&Input::Observed(world.observe(&away)));
    }
    session.handle(&Input::Observed(world.observe(&whole)));
    assert_eq!(purpose(&session), Some(Purpose::BeyondEdge));
}

#[test]
fn a_pause_does_not_count_as_not_being_able_to_reach_beyond_the_edge() {
    let (mut world, mut session) = asked_beyond_edge(3);
    let ghost_px = session.target().expect("asked for").ghost_px.clone();
    session.handle(&Input::Observed(world.observe(&whole_pose(&world))));
    session.handle(&Input::Command(Command::Pause));
    for _ in 0..600 {
        let mut frame = world.observe(&whole_pose(&world));
        let cut_off_by = Some(Side::Left);
        frame.seen = Err(Miss::PartialBoard { found: 20, wanted: 54, size: [0; 2], cut_off_by });
        session.handle(&Input::Observed(frame));
    }
    session.handle(&Input::Command(Command::Resume));
    assert_eq!(purpose(&session), Some(Purpose::BeyondEdge));
    assert_eq!(session.target().map(|target| &target.ghost_px), Some(&ghost_px), "no smaller one");
}

#[test]
fn a_slow_camera_is_not_asked_for_parts_that_it_cannot_tell() {
    let mut world = World::new(3);
    world.step_nanos = 166_000_000;
    let mut setup = setup(world.board);
    setup.guidance.stop_projection_sigma_px = 1e-3;
    setup.guidance.max_views = 10_000;
    let mut session = Session::new(setup);
    for _ in 0..60 {
        let Some(target) = session.target().cloned() else { break };
        assert_ne!(target.purpose, Purpose::BeyondEdge);
        let Some(pose) = world.pose_for(&target.ghost_px, 0.5) else { continue };
        for _ in 0..24 {
            let outcome = session.handle(&Input::Observed(world.observe(&pose))).outcome;
            if matches!(outcome, Outcome::Accepted { .. }) {
                break;
            }
        }
    }
}
