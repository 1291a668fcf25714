//! Recorded bags: MCAP files and databases of ROS 2, packed or not.

use std::{fs, path::Path, time::Duration};

use boresight::capture::Arrival;
use boresight_sources::open_bag;

use crate::harness::{Outcome, run, scratch};

/// Pictures read from a bag, which has eight.
const MOST_PICTURES: usize = 40;

/// Bags that others wrote, of a kind.
fn seeds(ending: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/bags");
    let mut files: Vec<_> =
        fs::read_dir(folder).expect("bags").map(|entry| entry.expect("listable").path()).collect();
    files.sort();
    let is_one = |file: &std::path::PathBuf| file.to_string_lossy().contains(ending);
    files.into_iter().filter(is_one).map(|file| fs::read(file).expect("readable")).collect()
}

fn read(file: &Path, input: &[u8], topic: Option<&str>) -> Outcome {
    fs::write(file, input).expect("written");
    let mut bag = match open_bag(file, topic) {
        Ok(bag) => bag,
        Err(err) if err.to_string().is_empty() => return Err("no words".into()),
        Err(_) => return Ok(false),
    };
    for _ in 0..MOST_PICTURES {
        match bag.next_frame(Duration::ZERO) {
            Ok(Arrival::Frame(frame)) if frame.image.is_empty() => {
                return Err("an empty picture".into());
            }
            Ok(Arrival::End) => break,
            Ok(_) => {}
            Err(err) if err.to_string().is_empty() => return Err("no words".into()),
            Err(_) => break,
        }
    }
    Ok(true)
}

#[test]
fn mcap_files() {
    let (place, seeds) = (scratch(), seeds(".mcap"));
    let file = place.path().join("bag.mcap");
    run("mcap", |mutator| mutator.bytes(&seeds), |input| read(&file, input, None));
}

#[test]
fn databases() {
    let (place, seeds) = (scratch(), seeds(".db3"));
    let file = place.path().join("bag.db3");
    let topic = Some("/left/image_raw");
    let mut number = 0;
    run(
        "db3",
        |mutator| mutator.bytes(&seeds),
        |input| {
            number += 1;
            read(&file, input, topic.filter(|_| number % 4 == 0))
        },
    );
}
