//! Habits of simulated people to cope with.

use std::time::Duration;

use boresight_capture::{Arrival, FrameSource};
use boresight_detect::{DetectorParams, Miss, detect};
use boresight_geometry::Corner;
use boresight_sim::{
    NoCues, Renderer, Scene, SyntheticSource,
    technician::{Cue, CueKind, Instruction, Technician, TechnicianParams},
};
use image::GrayImage;
use nalgebra::{Isometry3, Point2, Vector3};

use crate::simulation::{corners_px, pose, secs, show, wanted_poses};

/// An exact person with the habit.
fn scene_with(habit: TechnicianParams, seed: u64) -> Scene {
    Scene { technician: habit, ..Scene::default_720p(seed) }
}

fn is_inside(px: &Point2<f64>) -> bool {
    (0.0..1280.0).contains(&px.x) && (0.0..720.0).contains(&px.y)
}

fn way_m(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (a.translation.vector - b.translation.vector).norm()
}

#[test]
fn who_does_not_look_shows_the_board_in_ever_other_ways() {
    let habit = TechnicianParams {
        wanders: true,
        sway_m: 0.0,
        sway_rad: 0.0,
        tremor_m: 0.0,
        tremor_rad: 0.0,
        ..TechnicianParams::default()
    };
    let scene = scene_with(habit, 3);
    let (mut told, mut alone) = (Technician::new(&scene), Technician::new(&scene));
    let (mut largest_tilt_deg, mut widths, mut count, mut moved) = (0.0_f64, Vec::new(), 0, 0);
    let mut last = alone.pose_at(secs(0.0));
    for step in 0..600_u32 {
        let at_secs = 0.1 * f64::from(step);
        let [pose, other] = [&mut alone, &mut told].map(|person| person.pose_at(secs(at_secs)));
        assert_eq!(pose, other, "whatever is shown and told");
        if step % 20 == 0 {
            let wanted = &wanted_poses()[step as usize / 20 % 9];
            told.read(show(&scene, wanted, u64::from(step) + 1, at_secs));
            let kind =
                CueKind::Sentence { instruction: Instruction::Distance { ratio: 0.7 }, words: 3 };
            told.read(Cue { seen_at: secs(at_secs), kind });
        }
        let tilt_rad = (pose.rotation * Vector3::z()).angle(&Vector3::z());
        largest_tilt_deg = largest_tilt_deg.max(tilt_rad.to_degrees());
        let px = corners_px(&scene, &pose);
        widths.push((px[8] - px[0]).norm() / 1280.0);
        count += usize::from(px.iter().all(is_inside));
        moved += usize::from(way_m(&pose, &last) > 0.03);
        last = pose;
    }
    widths.sort_by(f64::total_cmp);
    println!(
        "tilts up to {largest_tilt_deg:.0}°, widths {:.2} to {:.2}, {count} of 600 whole, {moved} moving",
        widths[0], widths[599]
    );
    // Overshoot carries the hand a little beyond.
    assert!((25.0..50.0).contains(&largest_tilt_deg), "{largest_tilt_deg}°");
    assert!(widths[0] > 0.2 && widths[0] < 0.4 && widths[599] > 0.55 && widths[599] < 0.85);
    assert!(count > 500 && moved > 10, "{count} whole, {moved} moving");
}

#[test]
fn who_walks_away_shows_no_board_for_half_a_minute_and_comes_back() {
    for seed in 1..=10 {
        let habit = TechnicianParams { leaves_for_secs: 30.0, ..TechnicianParams::default() };
        let scene = scene_with(habit, seed);
        let mut person = Technician::new(&scene);
        person.read(show(&scene, &wanted_poses()[0], 1, 0.5));
        let mut without = Vec::new();
        for step in 0..600 {
            let at_secs = 0.1 * f64::from(step);
            let pose = person.pose_at(secs(at_secs));
            if !corners_px(&scene, &pose).iter().any(is_inside) {
                without.push(at_secs);
            }
            if step == 200 {
                // Shown in the person's absence: seen afterwards.
                person.read(show(&scene, &wanted_poses()[3], 2, at_secs));
            }
        }
        let (from, to) = (without[0], without[without.len() - 1]);
        println!("seed {seed}: no board from {from:.1} to {to:.1} s");
        assert!((3.0..16.0).contains(&from), "seed {seed}: from {from} s");
        assert!((26.0..33.0).contains(&(to - from)), "seed {seed}: {} s", to - from);
        assert_eq!(without.len(), ((to - from) * 10.0).round() as usize + 1, "in one go");
        let back = person.pose_at(secs(60.0));
        let goal = wanted_poses()[3];
        assert!(way_m(&back, &goal) < 0.12, "seed {seed}: {} m away", way_m(&back, &goal));
    }
}

#[test]
fn who_only_hears_follows_sentences_and_no_ghost() {
    let habit = TechnicianParams {
        hears_only: true,
        sway_m: 0.0,
        tremor_m: 0.0,
        sink_m: 0.0,
        ..TechnicianParams::default()
    };
    let scene = scene_with(habit, 2);
    let mut person = Technician::new(&scene);
    let start = person.pose_at(secs(0.0));
    person.read(show(&scene, &wanted_poses()[0], 1, 0.5));
    assert!(way_m(&person.pose_at(secs(5.0)), &start) < 1e-3, "the ghost isn't seen");
    let kind = CueKind::Sentence { instruction: Instruction::Distance { ratio: 0.7 }, words: 3 };
    person.read(Cue { seen_at: secs(5.0), kind });
    let ratio = person.pose_at(secs(10.0)).translation.z / start.translation.z;
    // The person answers with 0.7 to 1.2 times what is asked.
    assert!((0.65..0.78).contains(&ratio), "the distance is {ratio} of what it was");
}

#[test]
fn a_hand_covers_a_part_of_the_board_from_time_to_time() {
    let habit = TechnicianParams { covers_every_secs: 8.0, ..TechnicianParams::default() };
    let scene = scene_with(habit, 4);
    let mut person = Technician::new(&scene);
    let mut times = Vec::new();
    let corners_m = scene.board.corners_in_board_m();
    let mut most = 0;
    for step in 0..3000 {
        let Some(hand) = person.hand_at(secs(0.1 * f64::from(step))) else { continue };
        times.push(step);
        let below = corners_m.iter().filter(|at| hand.distance_m(at) < 0.0).count();
        most = most.max(below);
        assert!(3 * below < 2 * corners_m.len(), "a hand is smaller than the board: {below}");
    }
    let covers = 1 + times.windows(2).filter(|pair| pair[1] > pair[0] + 1).count();
    let share = times.len() as f64 / 3000.0;
    println!("{covers} covers in 300 s, {share:.2} of the time, up to {most} corners");
    assert!((22..45).contains(&covers) && (0.1..0.25).contains(&share));
    assert!(most >= 4, "{most} corners");
}

#[test]
fn corners_below_a_hand_are_not_seen() {
    let scene = Scene { clutter: 0.0, ..Scene::default_720p(4) };
    let habit = TechnicianParams { covers_every_secs: 8.0, ..TechnicianParams::default() };
    let mut person = Technician::new(&scene_with(habit, 4));
    let corners_m = scene.board.corners_in_board_m();
    let mut renderer = Renderer::new(&scene);
    let view = pose([20.0, 15.0, 5.0], [0.0, 0.0, 0.36]);
    let (mut tried, mut told) = (0, 0);
    for step in 0..1200 {
        let Some(hand) = person.hand_at(secs(0.5 * f64::from(step))) else { continue };
        let is_below = |at: &Point2<f64>| hand.distance_m(at) < -0.01;
        if corners_m.iter().filter(|at| is_below(at)).count() < 2 {
            continue;
        }
        tried += 1;
        let mut picture = GrayImage::new(1, 1);
        renderer.cover(Some(hand));
        renderer.render(&[view], 0, &mut picture);
        match detect(&picture, &scene.board, DetectorParams::default()) {
            Ok(found) => {
                for (corner, at) in found.corners.iter().zip(&corners_m) {
                    assert!(!(corner.is_seen() && is_below(at)), "a corner below the hand");
                }
            }
            Err(Miss::PartialBoard { found, wanted, .. }) => {
                told += 1;
                assert!(found < wanted, "{found} of {wanted}");
            }
            Err(_) => {}
        }
    }
    println!("{tried} pictures with a hand, {told} called a part");
    assert!(tried > 10 && 2 * told > tried, "{told} of {tried} are told to be a part");
    // And the hand goes.
    renderer.cover(None);
    let mut picture = GrayImage::new(1, 1);
    renderer.render(&[view], 0, &mut picture);
    assert!(detect(&picture, &scene.board, DetectorParams::default()).is_ok());
}

#[test]
fn the_camera_shows_the_hand() {
    let habit = TechnicianParams { covers_every_secs: 2.0, ..TechnicianParams::default() };
    let scene = Scene { frame_interval_nanos: 200_000_000, ..scene_with(habit, 4) };
    let mut person = Technician::new(&scene);
    let mut source = SyntheticSource::new(scene.clone(), Box::new(NoCues), Some(30), 2);
    let (mut covered, mut whole) = (0, 0);
    while let Arrival::Frame(frame) = source.next_frame(Duration::ZERO).expect("never breaks") {
        let hand = person.hand_at(frame.captured_at);
        let corners_m = scene.board.corners_in_board_m();
        let is_below = |at: &Point2<f64>| hand.is_some_and(|hand| hand.distance_m(at) < -0.01);
        let found = detect(&frame.image, &scene.board, DetectorParams::default());
        let is_whole = found.is_ok_and(|found| found.corners.iter().all(Corner::is_seen));
        if corners_m.iter().any(is_below) {
            covered += 1;
            assert!(!is_whole, "frame {}", frame.id.0);
        } else if hand.is_none() {
            whole += usize::from(is_whole);
        }
    }
    println!("{covered} pictures with corners below the hand, {whole} with the whole board");
    assert!(covered > 2 && whole > 5, "{covered}, {whole}");
}
