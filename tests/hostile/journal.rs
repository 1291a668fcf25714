//! Journals with right checksums and wrong contents, replayed.

use std::fs;

use boresight::{
    config::Config,
    recording::{Journal, RecordingError, replay},
    session::Session,
};
use serde_json::{Value, json};

use crate::{
    harness::{only_numbers, run, scratch},
    world::{SIZE, guided},
};

/// Bodies of the lines of a guided session.
fn bodies() -> Vec<Value> {
    let place = scratch();
    let path = place.path().join("session");
    let config = Config::load(None, &[]).expect("defaults");
    let header = boresight::recording::Header::new("sim", SIZE, config);
    let mut folder = boresight::recording::SessionFolder::create(&path, &header).expect("created");
    guided(3, |input, decision| {
        folder.journal_mut().append(input, decision, None, false).expect("appended");
    });
    let text = fs::read_to_string(path.join("journal.jsonl")).expect("there");
    let body = |line: &str| serde_json::from_str::<Value>(line).map(|mut line| line["body"].take());
    text.lines().map(body).collect::<Result<_, _>>().expect("JSON")
}

fn commands() -> Vec<Value> {
    let mode = json!({"size": [320, 240], "layout": "mjpeg", "interval_secs": [1, 30]});
    vec![
        json!({"command": "force_next"}),
        json!({"command": "undo_last"}),
        json!({"command": {"remove": {"view": 0}}}),
        json!({"command": "restore"}),
        json!({"command": "pause"}),
        json!({"command": "resume"}),
        json!({"camera": {"started": {"mode": mode}}}),
        json!({"camera": {"lost": {"fault": "USB-BW", "detail": ""}}}),
        json!({"camera": {"returned": {"mode": mode, "good_from_nanos": 7}}}),
        json!({"worker_failed": {"worker": "detector", "reason": "<b>"}}),
        json!("resumed"),
        json!("source_ended"),
        json!("stop"),
    ]
}

#[test]
fn journals() {
    let (bodies, commands) = (bodies(), commands());
    let config = Config::load(None, &[]).expect("defaults");
    let place = scratch();
    let file = place.path().join("journal.jsonl");
    run(
        "journal",
        |mutator| {
            let from = mutator.below(bodies.len());
            let mut journal = Vec::new();
            for seq in 0..2 + mutator.below(40) {
                let mut body = bodies[(from + seq) % bodies.len()].clone();
                if mutator.chance(0.1) {
                    body["input"] = mutator.one(&commands).clone();
                }
                if mutator.chance(0.05) {
                    let times = 1 + mutator.below(2);
                    mutator.json(&mut body["input"], times);
                }
                if mutator.chance(0.02) && body["input"]["observed"].is_object() {
                    body["input"]["observed"]["frame"] = json!(u64::MAX);
                }
                let body = body.to_string();
                let crc32 = format!("{:08x}", crc32fast::hash(body.as_bytes()));
                journal.extend(
                    format!("{{\"seq\":{seq},\"crc32\":\"{crc32}\",\"body\":{body}}}\n").bytes(),
                );
            }
            if mutator.chance(0.05) {
                journal = mutator.bytes(&[journal]);
            }
            journal
        },
        |input| {
            fs::write(&file, input).expect("written");
            let contents = Journal::read_until_damage(&file).map_err(|err| err.to_string())?;
            if contents.lines.is_empty() {
                return Ok(false);
            }
            let mut session = Session::new(config.session(SIZE).map_err(|err| err.to_string())?);
            let mut no_number = Ok(());
            let replayed = replay(&mut session, &contents.lines, |_, decision| {
                if no_number.is_ok() {
                    no_number = only_numbers(decision);
                }
            });
            // A whole line may still have another meaning.
            match replayed {
                Ok(_) | Err(RecordingError::Damaged { .. } | RecordingError::Newer { .. }) => {}
                Err(err) => return Err(err.to_string()),
            }
            no_number?;
            if let Some(calibration) = session.calibration() {
                only_numbers(&calibration.camera)?;
            }
            Ok(!session.accepted().is_empty())
        },
    );
}
