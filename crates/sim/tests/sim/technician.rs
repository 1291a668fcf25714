//! Limits of the simulated person.

use std::fs;

use boresight_sim::{
    Scene, SceneFile,
    technician::{Cue, CueKind, Instruction, Person, Technician, TechnicianParams},
};
use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector3, Vector6};

use crate::simulation::{corners_px, pose, secs, show, wanted_poses};

fn scene_with(params: TechnicianParams, seed: u64) -> Scene {
    Scene { technician: params, ..Scene::default_720p(seed) }
}

fn scene_of(person: Person, seed: u64) -> Scene {
    scene_with(person.params(), seed)
}

/// Hands without sway and sinking, leaving only intended movements.
fn without_sway(person: Person) -> TechnicianParams {
    TechnicianParams {
        sway_m: 0.0,
        sway_rad: 0.0,
        tremor_m: 0.0,
        tremor_rad: 0.0,
        sink_m: 0.0,
        ..person.params()
    }
}

fn way_m(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    (a.translation.vector - b.translation.vector).norm()
}

fn turn_deg(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    a.rotation.angle_to(&b.rotation).to_degrees()
}

fn sentence(instruction: Instruction, words: usize, at_secs: f64) -> Cue {
    Cue { seen_at: secs(at_secs), kind: CueKind::Sentence { instruction, words } }
}

/// Millimetres and degrees against the first pose, sampled from `from_secs` on.
fn track(person: &mut Technician, from_secs: f64, count: u32, hz: f64) -> Vec<Vector6<f64>> {
    let first = person.pose_at(secs(from_secs));
    (0..count)
        .map(|i| {
            let now = person.pose_at(secs(from_secs + f64::from(i) / hz));
            let shift_mm = (now.translation.vector - first.translation.vector) * 1e3;
            let turn = (now.rotation * first.rotation.inverse()).scaled_axis() * 1_f64.to_degrees();
            Vector6::new(shift_mm.x, shift_mm.y, shift_mm.z, turn.x, turn.y, turn.z)
        })
        .collect()
}

/// Standard deviation of each column.
fn rms(track: &[Vector6<f64>]) -> Vector6<f64> {
    let count = track.len() as f64;
    let mean = track.iter().sum::<Vector6<f64>>() / count;
    (track.iter().map(|at| (at - mean).component_mul(&(at - mean))).sum::<Vector6<f64>>() / count)
        .map(f64::sqrt)
}

#[test]
fn held_boards_sway_as_much_as_the_person_is_said_to() {
    for person in [Person::Steady, Person::Usual, Person::Shaky] {
        let params = person.params();
        let shift_mm = 1e3 * params.sway_m.hypot(params.tremor_m);
        let rotation_deg = params.sway_rad.hypot(params.tremor_rad).to_degrees();
        let said = Vector6::from_fn(|i, _| if i < 3 { shift_mm } else { rotation_deg });
        for seed in 0..3 {
            let mut technician = Technician::new(&scene_of(person, seed));
            // The sinking is over by then.
            let is = rms(&track(&mut technician, 60.0, 24_000, 40.0));
            let ratio = is.component_div(&said);
            assert!(ratio.iter().all(|r| (0.95..1.05).contains(r)), "{person:?}: {ratio}");
        }
    }
}

/// Mean square of a column within a band, by the Fourier coefficients.
fn power(column: &[f64], hz: f64, from_hz: f64, to_hz: f64) -> f64 {
    let count = column.len() as f64;
    let duration_secs = count / hz;
    let mean = column.iter().sum::<f64>() / count;
    let bins = (from_hz * duration_secs).ceil() as u32..(to_hz * duration_secs).ceil() as u32;
    bins.map(|bin| {
        let (mut re, mut im) = (0.0, 0.0);
        for (i, value) in column.iter().enumerate() {
            let turn = std::f64::consts::TAU * i as f64 / count;
            // Hann's window keeps the strong slow sway out of the other bands.
            let value = (value - mean) * (1.0 - turn.cos());
            re += value * (f64::from(bin) * turn).cos();
            im += value * (f64::from(bin) * turn).sin();
        }
        2.0 * (re * re + im * im) / (1.5 * count * count)
    })
    .sum()
}

#[test]
fn sway_falls_with_frequency_and_tremor_lies_between_8_and_12_hz() {
    let params = Person::Usual.params();
    let mut technician = Technician::new(&scene_of(Person::Usual, 4));
    let track = track(&mut technician, 60.0, 4000, 40.0);
    let (mut slow, mut octave) = (0.0, 0.0);
    for (axis, sway, tremor) in [
        (0, 1e3 * params.sway_m, 1e3 * params.tremor_m),
        (1, 1e3 * params.sway_m, 1e3 * params.tremor_m),
        (4, params.sway_rad.to_degrees(), params.tremor_rad.to_degrees()),
    ] {
        let column: Vec<f64> = track.iter().map(|at| at[axis]).collect();
        let band = |from_hz, to_hz| power(&column, 40.0, from_hz, to_hz);
        let trembling = band(7.9, 12.1).sqrt() / tremor;
        assert!((0.95..1.05).contains(&trembling), "axis {axis}: {trembling}");
        assert!(band(12.5, 16.0) + band(6.5, 7.5) < 0.02 * tremor * tremor, "axis {axis}");
        let below_1_hz = band(0.0, 1.0) / (sway * sway);
        assert!((0.75..1.1).contains(&below_1_hz), "axis {axis}: {below_1_hz}");
        // A density falling with the third power has a quarter of the power in the next octave.
        slow += band(1.0, 2.4) / (sway * sway);
        octave += band(2.4, 5.8) / (sway * sway);
    }
    let ratio = (octave / slow).log(2.4);
    assert!((-2.6..-1.4).contains(&ratio), "{ratio}");
}

#[test]
fn the_board_is_where_the_seed_and_the_time_say() {
    for person in Person::ALL {
        let scene = scene_of(person, 8);
        let cues =
            [show(&scene, &wanted_poses()[0], 1, 1.0), show(&scene, &wanted_poses()[3], 2, 4.0)];
        let [mut often, mut seldom, mut other] =
            [scene.clone(), scene.clone(), scene_of(person, 9)].map(|s| Technician::new(&s));
        for cue in cues {
            for technician in [&mut often, &mut seldom, &mut other] {
                technician.read(cue.clone());
            }
        }
        for i in 0..500 {
            often.pose_at(secs(0.02 * f64::from(i)));
        }
        let there = seldom.pose_at(secs(10.0));
        assert_eq!(often.pose_at(secs(10.0)), there, "{person:?}");
        assert_ne!(other.pose_at(secs(10.0)), there, "{person:?}");
    }
}

/// Median over windows of half a second of a corner's rms distance from the mean place.
fn unrest_px(person: Person) -> f64 {
    let scene = scene_of(person, 5);
    let mut technician = Technician::new(&scene);
    let mut windows: Vec<f64> = (0..80)
        .map(|window| {
            let seen: Vec<Vec<Point2<f64>>> = (0..15)
                .map(|i| f64::from(window) * 0.5 + f64::from(i) / 30.0)
                .map(|at_secs| corners_px(&scene, &technician.pose_at(secs(at_secs))))
                .collect();
            let count = seen.len() as f64;
            let spread: f64 = (0..seen[0].len())
                .map(|corner| {
                    let mean =
                        seen.iter().map(|px| px[corner].coords).sum::<nalgebra::Vector2<f64>>()
                            / count;
                    seen.iter().map(|px| (px[corner].coords - mean).norm_squared()).sum::<f64>()
                        / count
                })
                .sum();
            (spread / seen[0].len() as f64).sqrt()
        })
        .collect();
    windows.sort_by(f64::total_cmp);
    windows[windows.len() / 2]
}

#[test]
fn people_are_as_unsteady_as_their_names() {
    let [tripod, steady, usual, shaky] =
        [Person::Tripod, Person::Steady, Person::Usual, Person::Shaky].map(unrest_px);
    println!("unrest in px: {tripod:.2} {steady:.2} {usual:.2} {shaky:.2}");
    assert!(5.0 * tripod < usual && tripod < steady);
    assert!(1.6 * steady < usual && 1.4 * usual < shaky);
    // In the quietest windows of real videos, 0.5 s long, corners stray by 0.2 to 2 mm.
    let px_per_mm = 980.0 / 383.0;
    assert!((0.3..2.0).contains(&(usual / px_per_mm)), "{usual} px");
}

#[test]
fn tired_arms_sway_more_sink_and_recover_by_a_rest() {
    let scene = scene_of(Person::Tired, 6);
    let mut technician = Technician::new(&scene);
    let wanted = wanted_poses()[1];
    let start = technician.pose_at(secs(0.0));
    let fresh = rms(&track(&mut technician, 5.0, 600, 40.0));
    let sunk_m = technician.pose_at(secs(20.0)).translation.y - start.translation.y;
    assert!((0.001..0.02).contains(&sunk_m), "{sunk_m}");
    let tired = rms(&track(&mut technician, 70.0, 600, 40.0));
    assert!(tired.sum() > 1.7 * fresh.sum(), "{fresh} then {tired}");
    // A view is taken after a long time: the board goes down, and comes back to the next ghost.
    technician.read(Cue { seen_at: secs(90.0), kind: CueKind::Taken });
    technician.read(show(&scene, &wanted, 1, 90.0));
    let lowest = (0..80)
        .map(|i| technician.pose_at(secs(90.0 + 0.1 * f64::from(i))))
        .map(|at| corners_px(&scene, &at).iter().map(|px| px.y).fold(f64::INFINITY, f64::min))
        .fold(0.0, f64::max);
    assert!(lowest > 720.0, "{lowest}");
    let back = technician.pose_at(secs(102.0));
    assert!(turn_deg(&back, &wanted) < 14.0 && way_m(&back, &wanted) < 0.12);
    let rested = rms(&track(&mut technician, 100.0, 60, 40.0));
    assert!(rested.sum() < tired.sum(), "{rested}");
}

#[test]
fn the_person_on_a_tripod_reaches_the_ghost_in_time_and_within_the_errors() {
    for seed in 0..6 {
        let scene = Scene { technician: Person::Tripod.params(), ..Scene::random(seed) };
        for wanted in wanted_poses() {
            let mut person = Technician::new(&scene);
            let before = person.pose_at(secs(0.5));
            person.read(show(&scene, &wanted, 1, 1.0));
            let waiting = person.pose_at(secs(1.39));
            assert!((waiting.translation.vector - before.translation.vector).norm() < 1e-3);
            // Half a metre and 90° at most, at 0.5 m/s and 60°/s top speed.
            let there = person.pose_at(secs(1.0 + 0.4 + 4.0));
            let turn = wanted.rotation.angle_to(&there.rotation).to_degrees();
            assert!(turn < 4.2, "seed {seed}: {turn}°");
            let farther = there.translation.z / wanted.translation.z - 1.0;
            assert!(farther.abs() < 0.042, "seed {seed}: {farther}");
            let centre = |pose: &Isometry3<f64>| {
                pose.translation.vector.xy().component_mul(&scene.camera.f_px) / pose.translation.z
            };
            let off_px = (centre(&there) - centre(&wanted)).norm();
            assert!(off_px < 21.0 && off_px + turn > 0.5, "seed {seed}: {off_px} px");
        }
    }
}

#[test]
fn an_exact_person_puts_the_board_exactly_on_the_ghost() {
    let exact = TechnicianParams {
        rotation_error_rad: 0.0,
        lateral_error_px: 0.0,
        distance_error: 0.0,
        tremor_m: 0.0,
        tremor_rad: 0.0,
        ..Person::Tripod.params()
    };
    for wanted in wanted_poses() {
        let scene = Scene { technician: exact, ..Scene::random(7) };
        let mut person = Technician::new(&scene);
        person.read(show(&scene, &wanted, 1, 0.0));
        let there = person.pose_at(secs(5.0));
        for (is, want) in corners_px(&scene, &there).iter().zip(corners_px(&scene, &wanted)) {
            assert!((is - want).norm() < 1e-6);
        }
    }
}

#[test]
fn the_person_keeps_to_the_speed_limits_and_holds_still() {
    let steady = without_sway(Person::Steady);
    let scene = scene_with(TechnicianParams { look_away_every_secs: 0.0, ..steady }, 11);
    let mut person = Technician::new(&scene);
    for (i, wanted) in wanted_poses().iter().enumerate() {
        person.read(show(&scene, wanted, i as u64, 3.0 * i as f64));
    }
    let step_secs = 0.005;
    let mut last = person.pose_at(secs(0.0));
    for i in 1..6000 {
        let next = person.pose_at(secs(f64::from(i) * step_secs));
        let speed = (next.translation.vector - last.translation.vector).norm() / step_secs;
        let turning = next.rotation.angle_to(&last.rotation).to_degrees() / step_secs;
        assert!(speed < 0.51 && turning < 62.0, "{speed} m/s, {turning}°/s");
        last = next;
    }
    // Told to hold still, the person stops correcting, for some time.
    person.read(sentence(Instruction::HoldStill, 2, 30.0));
    let held = person.pose_at(secs(33.0));
    for i in 0..100 {
        let now = person.pose_at(secs(33.0 + 0.05 * f64::from(i)));
        let moved: Vec<f64> = corners_px(&scene, &now)
            .iter()
            .zip(corners_px(&scene, &held))
            .map(|(a, b)| (a - b).norm())
            .collect();
        assert!(moved.iter().all(|px| *px < 1e-6), "{moved:?}");
    }
}

#[test]
fn a_pose_that_is_not_taken_is_corrected_until_it_is_good() {
    let scene = scene_of(Person::Tripod, 12);
    let wanted = wanted_poses()[2];
    let mut person = Technician::new(&scene);
    person.read(show(&scene, &wanted, 1, 0.0));
    let early = person.pose_at(secs(4.0));
    let late = person.pose_at(secs(25.0));
    let off = |pose: &Isometry3<f64>| wanted.rotation.angle_to(&pose.rotation).to_degrees();
    assert!(off(&late) < 0.3 && off(&early) > 1.0, "{} then {}", off(&early), off(&late));
    person.read(Cue { seen_at: secs(25.0), kind: CueKind::Taken });
    person.read(Cue { seen_at: secs(26.0), kind: CueKind::Finished });
    let lowered = person.pose_at(secs(40.0));
    let clear = corners_px(&scene, &lowered).iter().all(|px| px.y > 760.0);
    assert!(clear || lowered.translation.y > lowered.translation.z);
}

#[test]
fn the_usual_person_errs_as_far_as_a_person_does() {
    let (mut turns_deg, mut farther) = (Vec::new(), Vec::new());
    for seed in 0..120 {
        let person = TechnicianParams { patience_secs: 60.0, ..without_sway(Person::Usual) };
        let scene = scene_with(person, seed);
        let wanted = wanted_poses()[seed as usize % 8];
        let mut technician = Technician::new(&scene);
        technician.read(show(&scene, &wanted, 1, 0.0));
        // Two seconds for a glance away, and no more than four for the way.
        let there = technician.pose_at(secs(7.0));
        turns_deg.push(turn_deg(&there, &wanted));
        farther.push(there.translation.z / wanted.translation.z - 1.0);
    }
    turns_deg.sort_by(f64::total_cmp);
    println!("turned {:.1}° in the median, {:.1}° at most", turns_deg[60], turns_deg[119]);
    assert!(turns_deg[119] < 10.1 && turns_deg[60] > 4.0, "{turns_deg:?}");
    assert!(farther.iter().all(|share| share.abs() < 0.151), "{farther:?}");
    let sd = (farther.iter().map(|share| share * share).sum::<f64>() / 120.0).sqrt();
    assert!((0.06..0.11).contains(&sd), "{sd}");
}

#[test]
fn hands_overshoot_and_come_back() {
    let far = pose([0.0, 35.0, 0.0], [0.1, 0.05, 0.7]);
    for person in Person::ALL {
        let exact = TechnicianParams {
            rotation_error_rad: 0.0,
            lateral_error_px: 0.0,
            distance_error: 0.0,
            ..without_sway(person)
        };
        let exact = TechnicianParams { tremor_m: 0.0, tremor_rad: 0.0, ..exact };
        for seed in 0..8 {
            let scene = scene_with(exact, seed);
            let mut technician = Technician::new(&scene);
            let start = technician.pose_at(secs(0.0));
            technician.read(show(&scene, &far, 1, 0.0));
            let way = far.translation.vector - start.translation.vector;
            let share = |at: &Isometry3<f64>| {
                (at.translation.vector - start.translation.vector).dot(&way) / way.norm_squared()
            };
            let shares: Vec<f64> =
                (0..800).map(|i| share(&technician.pose_at(secs(0.01 * f64::from(i))))).collect();
            let most = shares.iter().copied().fold(0.0, f64::max);
            let said = exact.overshoot;
            assert!(
                most < 1.0 + 1.6 * said + 1e-6 && most > 1.0 + 0.4 * said - 1e-6,
                "{person:?}: {most}"
            );
            assert!((shares[799] - 1.0).abs() < 1e-6, "{person:?}");
            // Damped: the swing after the overshoot is much smaller.
            let peak = shares.iter().position(|share| *share == most).unwrap_or(0);
            let least_after = shares[peak..].iter().copied().fold(f64::INFINITY, f64::min);
            assert!(1.0 - least_after < 0.3 * (most - 1.0) + 1e-6, "{person:?}: {least_after}");
        }
    }
}

/// Delay from showing a ghost to the first movement.
fn delay_secs(person: Person, seed: u64, shown_secs: f64) -> f64 {
    let still = TechnicianParams { tremor_m: 0.0, tremor_rad: 0.0, ..without_sway(person) };
    let scene = scene_with(still, seed);
    let mut technician = Technician::new(&scene);
    let start = technician.pose_at(secs(shown_secs));
    technician.read(show(&scene, &wanted_poses()[0], 1, shown_secs));
    (0..300)
        .map(|i| 0.01 * f64::from(i))
        .find(|delay| way_m(&technician.pose_at(secs(shown_secs + delay)), &start) > 1e-9)
        .expect("it moves")
}

#[test]
fn a_person_who_looks_away_sees_the_ghost_late() {
    let delays: Vec<f64> =
        (0..600).map(|seed| delay_secs(Person::Usual, seed, 5.0 + 0.05 * seed as f64)).collect();
    assert!(delays.iter().all(|delay| (0.3..2.52).contains(delay)), "{delays:?}");
    let late = delays.iter().filter(|delay| **delay > 0.53).count();
    // 1.5 s of every 21.5 s.
    assert!((24..66).contains(&late), "{late} of 600");
    let soon: Vec<f64> = delays.into_iter().filter(|delay| *delay <= 0.53).collect();
    let mean = soon.iter().sum::<f64>() / soon.len() as f64;
    assert!((0.37..0.44).contains(&mean), "{mean}");
    for seed in 0..20 {
        let delay = delay_secs(Person::Tripod, seed, 5.0 + seed as f64);
        assert!((0.39..0.43).contains(&delay), "{delay}");
    }
}

/// A person just arrived at the ghost, at 4 s, without sway or glances.
fn arrived(person: Person, wanted: &Isometry3<f64>) -> (Scene, Technician) {
    let attentive = TechnicianParams { look_away_every_secs: 0.0, ..without_sway(person) };
    let scene = scene_with(TechnicianParams { patience_secs: 60.0, ..attentive }, 13);
    let mut technician = Technician::new(&scene);
    technician.read(show(&scene, wanted, 1, 0.0));
    technician.pose_at(secs(4.0));
    (scene, technician)
}

#[test]
fn the_person_does_what_the_sentence_says_after_reading_it() {
    let wanted = wanted_poses()[2];
    let after_sentence = |instruction: Instruction| {
        let (scene, mut technician) = arrived(Person::Usual, &wanted);
        let before = technician.pose_at(secs(4.0));
        technician.read(sentence(instruction, 4, 4.0));
        // A reaction of at least 0.3 s, and a second for four words.
        let reading = technician.pose_at(secs(5.25));
        assert_eq!(reading, before, "{instruction:?}");
        (scene, before, technician.pose_at(secs(9.0)))
    };
    let (_, before, now) = after_sentence(Instruction::Distance { ratio: 0.8 });
    let ratio = now.translation.z / before.translation.z;
    assert!((0.76..0.86).contains(&ratio) && turn_deg(&before, &now) < 1e-6, "{ratio}");
    let (scene, before, now) =
        after_sentence(Instruction::Shift { right_px: -80.0, down_px: 30.0 });
    let centre = |at: &Isometry3<f64>| scene.camera.px_from_board(at, &Point2::origin());
    let moved = centre(&now).expect("in front") - centre(&before).expect("in front");
    assert!((-105.0..-50.0).contains(&moved.x) && (18.0..40.0).contains(&moved.y), "{moved}");
    // Receding to the bottom by 30°: the normal leans about the axis to the left.
    let azimuth_rad = 90_f64.to_radians();
    let (_, before, now) =
        after_sentence(Instruction::Tip { azimuth_rad, tilt_rad: 30_f64.to_radians() });
    let asked = Isometry3::from_parts(
        before.translation,
        UnitQuaternion::from_scaled_axis(Vector3::new(30_f64.to_radians(), 0.0, 0.0)),
    );
    let off = |at: &Isometry3<f64>| {
        (at.rotation * Vector3::z()).angle(&(asked.rotation * Vector3::z())).to_degrees()
    };
    assert!(off(&now) < 0.35 * off(&before), "{} then {}", off(&before), off(&now));
    let (_, before, now) = after_sentence(Instruction::MatchGhost);
    assert!(turn_deg(&now, &wanted) < turn_deg(&before, &wanted).max(6.0) && now != before);
    let (_, before, now) = after_sentence(Instruction::HoldStill);
    assert_eq!(before, now);
}

#[test]
fn a_sentence_that_does_not_stay_is_not_read() {
    let wanted = wanted_poses()[4];
    let closer = Instruction::Distance { ratio: 0.8 };
    let (_, mut technician) = arrived(Person::Usual, &wanted);
    let before = technician.pose_at(secs(4.0));
    // Two sentences in turn, five times a second: neither is understood.
    for i in 0..20 {
        let (at_secs, even) = (4.0 + 0.2 * f64::from(i), i % 2 == 0);
        assert_eq!(technician.pose_at(secs(at_secs)), before);
        let instruction = if even { closer } else { Instruction::ShowBoard };
        technician.read(sentence(instruction, 5, at_secs));
    }
    technician.read(sentence(closer, 5, 8.0));
    let understood = technician.pose_at(secs(13.0));
    assert!(understood.translation.z < 0.9 * before.translation.z);
    // A person with the board on a tripod looks at the ghost only.
    let (_, mut technician) = arrived(Person::Tripod, &wanted);
    technician.read(sentence(closer, 2, 5.0));
    let moved_m = way_m(&technician.pose_at(secs(5.0)), &technician.pose_at(secs(10.0)));
    assert!(moved_m < 0.001, "{moved_m}");
}

#[test]
fn a_sentence_shown_on_the_way_waits_for_the_arrival() {
    let wanted = pose([0.0, 35.0, 0.0], [0.0, 0.0, 0.7]);
    let attentive = TechnicianParams {
        look_away_every_secs: 0.0,
        reaction_spread: 0.0,
        overshoot: 0.0,
        patience_secs: 60.0,
        ..without_sway(Person::Usual)
    };
    let scene = scene_with(attentive, 13);
    let [mut alone, mut told] = [Technician::new(&scene), Technician::new(&scene)];
    for technician in [&mut alone, &mut told] {
        technician.read(show(&scene, &wanted, 1, 0.0));
        technician.pose_at(secs(4.0));
    }
    let next = pose([-35.0, 0.0, 0.0], [0.0, 0.0, 0.4]);
    for technician in [&mut alone, &mut told] {
        technician.read(show(&scene, &next, 2, 5.0));
    }
    told.read(sentence(Instruction::Shift { right_px: 90.0, down_px: 0.0 }, 1, 5.0));
    // 70° at 60°/s top speed take two seconds at least.
    for at_secs in [5.5, 6.0, 6.5, 7.0] {
        assert_eq!(alone.pose_at(secs(at_secs)), told.pose_at(secs(at_secs)));
    }
    let (alone, told) = (alone.pose_at(secs(12.0)), told.pose_at(secs(12.0)));
    assert!(told.translation.x > alone.translation.x + 0.02, "{told} {alone}");
}

#[test]
fn a_ghost_that_leaves_the_picture_is_matched_where_it_is_seen() {
    let exact = TechnicianParams {
        rotation_error_rad: 0.0,
        lateral_error_px: 0.0,
        distance_error: 0.0,
        ..without_sway(Person::Usual)
    };
    let scene = scene_with(exact, 14);
    let wanted = pose([10.0, -30.0, 4.0], [0.235, 0.0, 0.4]);
    let whole = corners_px(&scene, &wanted);
    let seen = |px: &Point2<f64>| px.x < 1280.0;
    let hidden = whole.iter().filter(|px| !seen(px)).count();
    assert!((6..36).contains(&hidden), "{hidden}");
    // The invisible may be anywhere.
    let ghost_px: Vec<Point2<f64>> = whole
        .iter()
        .map(|px| if seen(px) { *px } else { Point2::new(px.x + 200.0, px.y) })
        .collect();
    let mut technician = Technician::new(&scene);
    let kind = CueKind::Show { ghost_px, target: 1 };
    technician.read(Cue { seen_at: secs(0.0), kind });
    let there = technician.pose_at(secs(7.0));
    assert!(turn_deg(&there, &wanted) < 1e-4 && way_m(&there, &wanted) < 1e-6);
}

#[test]
fn scene_files_name_the_person() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    let load = |text: &str| {
        fs::write(&path, text).expect("written");
        SceneFile::load(&path).map(|scene| scene.technician).map_err(|err| err.to_string())
    };
    for (name, person) in
        ["steady", "usual", "shaky", "tired", "tripod"].into_iter().zip(Person::ALL)
    {
        let text = format!("[technician]\nperson = \"{name}\"\n");
        assert_eq!(load(&text), Ok(person.params()));
    }
    assert_eq!(load(""), Ok(Person::default().params()));
    let text =
        "image_size_px = [640, 360]\n[technician]\nperson = \"shaky\"\nsway_mm = 3\nsink_mm = 9\n";
    let asked = TechnicianParams {
        sway_m: 0.003,
        sink_m: 0.009,
        lateral_error_px: 20.0,
        ..Person::Shaky.params()
    };
    let is = load(text).expect("a scene");
    assert!((is.sway_m - asked.sway_m).abs() < 1e-12 && (is.sink_m - asked.sink_m).abs() < 1e-12);
    assert_eq!(TechnicianParams { sway_m: 0.003, sink_m: 0.009, ..is }, asked);
    assert!(load("[technician]\nperson = \"nobody\"\n").is_err_and(|err| err.contains("usual")));
    for wrong in [
        "sway_mm = nan",
        "reaction_secs = -1",
        "max_speed_mm_per_s = 0",
        "overshoot = 2.0",
        "tremor_mm = inf",
    ] {
        let err = load(&format!("[technician]\n{wrong}\n")).expect_err("refused");
        assert!(err.contains("[technician]"), "{err}");
    }
}
