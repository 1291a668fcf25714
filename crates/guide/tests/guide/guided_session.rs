//! Whole guided sessions on projected corners: planner, solver and stop rule in closed loop.

use boresight_calibrate::{CalibrationParams, Verdict};
use boresight_geometry::Corner;
use boresight_guide::{guidance::Progress, session::AcceptedView};
use boresight_testkit::world::{World, guided, guided_in};

#[test]
fn guided_sessions_end_with_the_truth_inside_their_uncertainty() {
    let sessions: u64 =
        std::env::var("BORESIGHT_SESSIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(20);
    let (mut inside, mut views, mut complete) = (0, Vec::new(), 0);
    let first: u64 =
        std::env::var("BORESIGHT_FIRST").ok().and_then(|n| n.parse().ok()).unwrap_or(1);
    for seed in first..first + sessions {
        let (world, session, attempts) = guided(seed, |_, _| ());
        let calibration = session.calibration().expect("calibrated");
        let off = calibration.camera.pp_px - world.camera.pp_px;
        let covariance = calibration.pp_covariance_px2();
        let d2 = (off.transpose() * covariance.try_inverse().expect("definite") * off).x;
        inside += u64::from(d2 <= 4.0);
        complete += u64::from(session.progress() == Progress::Complete);
        views.push(session.accepted().len());
        println!(
            "{seed}: {:?} {:?} {} views, {attempts} attempts, PP off ({:.2}, {:.2}) sd {:.2} d² {d2:.2}, f off {:.2} sd {:.2}, {} k1 {:.3}/{:.3}, findings {:?}",
            session.progress(),
            calibration.verdict,
            session.accepted().len(),
            off.x,
            off.y,
            covariance[(0, 0)].sqrt(),
            calibration.camera.f_px.x - world.camera.f_px.x,
            calibration.sd()[0],
            calibration.model.code(),
            calibration.camera.distortion.k1,
            world.camera.distortion.k1,
            calibration.findings.iter().map(|f| f.code.code()).collect::<Vec<_>>(),
        );
        assert_ne!(calibration.verdict, Verdict::Untrustworthy, "seed {seed}");
    }
    views.sort_unstable();
    println!(
        "inside 2 sd: {inside} of {sessions}; complete {complete}; median views {}",
        views[views.len() / 2]
    );
    assert!(inside * 100 >= 80 * sessions, "{inside} of {sessions}");
    assert!(views[views.len() / 2] <= 8);
    assert_eq!(complete, sessions);
}

#[test]
fn a_bent_board_costs_no_views_that_cannot_unbend_it() {
    let mut world = World::new(3);
    world.bent_by_m = 0.001;
    let (_, session, _) = guided_in(world, CalibrationParams::default(), |_, _| ());
    let calibration = session.calibration().expect("calibrated");
    let codes: Vec<_> = calibration.findings.iter().map(|finding| finding.code.code()).collect();
    assert!(codes.contains(&"BOARD-BENT"), "{codes:?}");
    assert_ne!(calibration.verdict, Verdict::Untrustworthy, "{codes:?}");
    assert_eq!(session.progress(), Progress::Complete, "{codes:?}");
    assert!(session.accepted().len() <= 12, "{} views, {codes:?}", session.accepted().len());
    let is_part = |taken: &AcceptedView| !taken.view.corners.iter().all(Corner::is_seen);
    assert!(session.accepted().iter().any(is_part), "no board beyond the edge: {codes:?}");
}

#[test]
fn a_focus_that_moves_costs_no_views_that_cannot_hold_it_still() {
    let mut world = World::new(3);
    world.focus_sd = 0.01;
    let (_, session, _) = guided_in(world, CalibrationParams::default(), |_, _| ());
    let calibration = session.calibration().expect("calibrated");
    let codes: Vec<_> = calibration.findings.iter().map(|finding| finding.code.code()).collect();
    assert_eq!(calibration.verdict, Verdict::Untrustworthy, "{codes:?}");
    let is_over = matches!(session.progress(), Progress::Complete | Progress::Exhausted);
    assert!(is_over, "{codes:?}");
}
