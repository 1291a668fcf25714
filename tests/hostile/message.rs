//! Messages of ROS 2 and pictures in memory, as from pipes: accepted input has its stated size.

use boresight::capture::Decompressor;
use boresight_sources::{RosImageType, RosImages};

use crate::{
    harness::{Outcome, run},
    jpeg::jpegs,
    picture::pngs,
};

/// A message in CDR, lower byte first: numbers are at multiples of four.
struct Message(Vec<u8>);

impl Message {
    fn new() -> Self {
        let mut message = Self(vec![0, 1, 0, 0]);
        message.number(7);
        message.number(500);
        message.text("camera");
        message
    }

    fn number(&mut self, number: u32) {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
        self.0.extend(number.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.number(text.len() as u32 + 1);
        self.0.extend(text.bytes().chain([0]));
    }

    fn bytes(mut self, bytes: &[u8]) -> Vec<u8> {
        self.number(bytes.len() as u32);
        self.0.extend(bytes);
        self.0
    }
}

fn images() -> Vec<Vec<u8>> {
    let forms = [
        ("mono8", 1),
        ("bgr8", 3),
        ("rgba8", 4),
        ("mono16", 2),
        ("bayer_rggb8", 1),
        ("yuv422_yuy2", 2),
    ];
    let image = |(encoding, bytes): (&str, usize)| {
        let (width, height) = (16_usize, 8_usize);
        let mut message = Message::new();
        message.number(height as u32);
        message.number(width as u32);
        message.text(encoding);
        message.0.push(0);
        message.number((width * bytes) as u32);
        message.bytes(&vec![90; width * height * bytes])
    };
    forms.into_iter().map(image).collect()
}

fn compressed() -> Vec<Vec<u8>> {
    let message = |picture: Vec<u8>| {
        let mut message = Message::new();
        message.text("jpeg");
        message.bytes(&picture)
    };
    [jpegs(), pngs()].concat().into_iter().map(message).collect()
}

fn read(kind: RosImageType, input: &[u8]) -> Outcome {
    match RosImages::new(kind).read(input) {
        Ok((header, image)) => {
            if header.frame_id.len() > input.len() || image.is_empty() {
                return Err(format!("{header:?} of {} bytes", input.len()));
            }
            Ok(true)
        }
        Err(flaw) if flaw.to_string().is_empty() => Err("no words".into()),
        Err(_) => Ok(false),
    }
}

#[test]
fn raw_messages() {
    let seeds = images();
    assert!(seeds.iter().all(|seed| read(RosImageType::Image, seed) == Ok(true)));
    run("ros", |mutator| mutator.bytes(&seeds), |input| read(RosImageType::Image, input));
}

#[test]
fn compressed_messages() {
    let seeds = compressed();
    assert!(seeds.iter().all(|seed| read(RosImageType::Compressed, seed) == Ok(true)));
    run("ros", |mutator| mutator.bytes(&seeds), |input| read(RosImageType::Compressed, input));
}

#[test]
fn pictures_in_memory() {
    let seeds = [jpegs(), pngs()].concat();
    let mut decompressor = Decompressor::default();
    run(
        "picture",
        |mutator| mutator.bytes(&seeds),
        |input| Ok(decompressor.picture(input).is_ok_and(|image| !image.is_empty())),
    );
}
