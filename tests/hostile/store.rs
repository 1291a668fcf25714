//! Stores of watched cameras: lines with mended checksums, and whatever else. A store that isn't
//! whole says so, and is whole once it's recovered.

use std::fs;

use boresight::{
    frame::ImageSize,
    geometry::Camera,
    station::{Named, StateLine, Store, Taken, WatchedCamera, recover, street::Street},
    watch::{Lens, NoAnswer},
};
use hmac_sha256::Hash;
use nalgebra::Point2;
use serde_json::Value;

use crate::{
    harness::{Outcome, only_numbers, run, scratch},
    mutator::Mutator,
};

const HOURS: u32 = 9;
const SIZE: ImageSize = ImageSize { width_px: 160, height_px: 120 };

fn camera() -> Camera {
    Camera::pinhole(105.0, Point2::new(81.0, 59.0))
}

/// Lines of a store without their numbers and checksums.
fn good_lines() -> Vec<Value> {
    let place = scratch();
    let mut street = Street::new(3);
    (street.image_size, street.camera) = (SIZE, camera());
    let lens = Lens::new(camera(), None, SIZE);
    let (mut camera, _) =
        WatchedCamera::open(place.path(), "mast", None, (Some(lens), true)).expect("opened");
    for hour in 0..HOURS {
        let at_secs = street.began_secs + 3600.0 * f64::from(hour);
        camera.look(vec![street.picture(at_secs)], Taken::at(at_secs)).expect("recorded");
    }
    let at_secs = street.began_secs + 3600.0 * f64::from(HOURS);
    camera.no_picture(NoAnswer::TooDark, Taken::at(at_secs)).expect("recorded");
    let text = fs::read_to_string(place.path().join("watch.jsonl")).expect("lines");
    let mut lines: Vec<Value> =
        text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let sample = serde_json::json!({"at": at_secs, "turn": [12.5, -3.0, 0.25, 40.0]});
    lines.push(serde_json::json!({"kind": "learned", "at": at_secs, "references": 0,
        "samples": vec![sample; 40], "in_use": {"text": [[1, 2, 30, 40]], "is_learned": true,
        "references": []}}));
    lines.push(serde_json::json!({"kind": "accepted", "at": at_secs, "reason": "a new pole"}));
    for line in &mut lines {
        let fields = line.as_object_mut().expect("an object");
        fields.remove("seq");
        fields.remove("sum");
    }
    lines
}

/// Lines with their numbers and checksums.
fn text_of(lines: &[Value]) -> Vec<u8> {
    let mut text = String::new();
    for (seq, line) in lines.iter().enumerate() {
        let mut line = line.clone();
        if let Some(fields) = line.as_object_mut() {
            fields.entry("seq").or_insert(seq.into());
        }
        let mut line = line.to_string();
        line.pop();
        let sum: String =
            Hash::hash(line.as_bytes())[..8].iter().map(|byte| format!("{byte:02x}")).collect();
        text += &format!("{line},\"sum\":\"{sum}\"}}\n");
    }
    text.into_bytes()
}

fn mutated(mutator: &mut Mutator, good: &[Value]) -> Vec<u8> {
    let mut lines = good.to_vec();
    for _ in 0..mutator.below(4) {
        let (one, other) = (mutator.below(lines.len()), mutator.below(lines.len()));
        match mutator.below(4) {
            0 if lines.len() > 1 => drop(lines.remove(one)),
            1 => lines.swap(one, other),
            2 => lines.insert(other, lines[one].clone()),
            _ => {
                let times = 1 + mutator.below(3);
                mutator.json(&mut lines[one], times);
            }
        }
    }
    let text = text_of(&lines);
    if mutator.chance(0.3) { mutator.bytes(&[text]) } else { text }
}

#[test]
fn stores() {
    let place = scratch();
    let (folder, good) = (place.path(), good_lines());
    let lens = Lens::new(camera(), None, SIZE);
    let named = Named { path: "lens.json".into(), sha256: String::new() };
    Store::create(folder, "mast", named, &lens, true).expect("created");
    let file = fs::read(folder.join("watch.json")).expect("readable");
    let states = |camera: &WatchedCamera| -> Outcome {
        only_numbers(&StateLine::heard(camera))?;
        Ok(true)
    };
    run(
        "store",
        |mutator| mutated(mutator, &good),
        |input| {
            fs::write(folder.join("watch.json"), &file).expect("written");
            fs::write(folder.join("watch.jsonl"), input).expect("written");
            match WatchedCamera::look_at(folder) {
                Ok(camera) => states(&camera),
                Err(err) if format!("{err:#}").is_empty() => Err("no words".into()),
                Err(_) => {
                    let recovered = recover(folder, 1.78e9);
                    fs::remove_file(folder.join("watch.damaged.jsonl")).ok();
                    // A line of a later version is no damage.
                    let Ok(_) = recovered else { return Ok(false) };
                    let camera = WatchedCamera::look_at(folder)
                        .map_err(|err| format!("recovered, but {err:#}"))?;
                    states(&camera).map(|_| false)
                }
            }
        },
    );
}
