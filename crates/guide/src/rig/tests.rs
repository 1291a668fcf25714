//! Facts about rigs led to common places.

use nalgebra::Isometry3;

use super::{world::World, *};

#[test]
fn whoever_shows_what_is_asked_for_has_a_calibrated_pair_in_a_minute() {
    let mut world = World::of(&[0.0, 0.12]);
    world.run(90);
    let (places, secs) = (world.kept.len(), world.secs());
    let plan = world.rig.plan().expect("places");
    let found = plan.found.as_ref().expect("a rig");
    assert!(world.rig.is_complete(), "{places} places in {secs} s: {:?}", found.findings);
    assert!(places <= 15 && secs <= 60, "{places} places, {secs} s");
    let sd_m = found.pairs[0].sd.expect("enough places").baseline_m;
    let off_m = found.rig.baseline_m(0, 1) - world.truth.baseline_m(0, 1);
    assert!(off_m.abs() < 3.0 * sd_m, "{off_m} {sd_m}");
    assert_eq!(world.rig.prompt(), RigPrompt::Complete);
}

/// Runs until the rig is complete, within `most_secs`; baselines are as stated.
fn is_calibrated_within(world: &mut World, most_secs: u64) {
    world.run(most_secs);
    let (places, secs) = (world.kept.len(), world.secs());
    let found = world.rig.plan().and_then(|plan| plan.found.clone().ok()).expect("a rig");
    assert!(world.rig.is_complete(), "{places} places in {secs} s: {:?}", found.findings);
    for (pair, sd) in found.pairs.iter().filter_map(|pair| Some((pair, pair.sd?))) {
        let [a, b] = pair.of;
        let off_m = found.rig.baseline_m(a, b) - world.truth.baseline_m(a, b);
        assert!(off_m.abs() < 3.0 * sd.baseline_m, "{a} {b}: {off_m} {}", sd.baseline_m);
    }
}

#[test]
fn four_cameras_in_the_corners_of_a_room_take_a_minute_and_a_half() {
    let mut world = World::in_corners();
    is_calibrated_within(&mut world, 90);
}

#[test]
fn a_camera_with_too_few_views_for_a_lens_is_asked_for() {
    // This person shows the board to two of four cameras again and again.
    let mut world = World { random: 0x9E37_79B9_7F4A_7C15 ^ (34 << 32), ..World::in_corners() };
    is_calibrated_within(&mut world, 120);
}

#[test]
fn a_chain_whose_ends_share_nothing_is_linked_by_its_middle() {
    let mut world = World::in_a_chain();
    is_calibrated_within(&mut world, 120);
}

#[test]
fn a_hand_that_trembles_is_asked_to_lean_the_board_and_nothing_is_taken() {
    let mut world = World { tremor_m: 0.5e-3, ..World::of(&[0.0, 0.12]) };
    world.run(20);
    assert_eq!((world.kept.len(), world.rig.prompt()), (0, RigPrompt::Rest));
    world.tremor_m = 0.0;
    world.run(5);
    assert!(!world.kept.is_empty());
}

#[test]
fn whoever_leaves_the_board_where_it_was_taken_hears_to_move_it() {
    let mut world = World::of(&[0.0, 0.12]);
    while world.kept.is_empty() && world.secs() < 30 {
        world.step();
    }
    let stays = world.pose();
    (world.from, world.to) = (stays, stays);
    world.run(3);
    assert_eq!(world.kept.len(), 1);
    let prompt = world.rig.prompt();
    let is_move = matches!(prompt, RigPrompt::OfCamera { .. } | RigPrompt::Elsewhere);
    assert!(is_move, "{prompt:?}");
}

#[test]
fn sessions_of_a_rig_take_nothing_by_themselves_and_undo_leaves_nothing() {
    let mut world = World::of(&[0.0, 0.12]);
    while world.kept.len() < 2 && world.secs() < 30 {
        world.step();
    }
    let views = |world: &World| {
        world.sessions.iter().map(|session| session.accepted().len()).collect::<Vec<_>>()
    };
    assert_eq!(views(&world), [2, 2]);
    let orders = world.rig.undo();
    world.carry_out(orders);
    assert_eq!((views(&world), world.forgotten.as_slice()), (vec![1, 1], &[2][..]));
    assert_eq!(world.rig.places().len(), 1);
}

#[test]
fn a_board_that_one_camera_sees_is_no_place() {
    let mut world = World::of(&[0.0, 0.12]);
    // Far to the left: only the first camera sees it.
    let left = Isometry3::translation(-0.38, 0.0, 0.75);
    (world.from, world.to) = (left, left);
    (world.frame, world.arrived) = (1, 80);
    for _ in 0..90 {
        world.step();
    }
    assert_eq!(world.kept.len(), 0);
    assert_eq!(world.rig.prompt(), RigPrompt::Unseen { camera: 1 });
}
