//! Pictures of a topic as a frame source.
//!
//! A topic counts as a live camera: its newest picture is worth more than an old one. Its publisher
//! may disappear and come back; the middleware finds it again. Pictures have the times in their
//! headers, on this computer's clock.

use std::time::{Duration, Instant};

use image::GrayImage;
use rustdds::{GUID, TopicKind};

use super::{
    node::{DISCOVERED_WITHIN, Domain, ImageTopic, Node, dds_name},
    raw::{Message, RawReader, of_sensors, wait},
};
use crate::{
    Arrival, CaptureError, FrameSource, RosFlaw, RosImages, SourceIdentity,
    address::TOPIC,
    camera_time::CameraTime,
    stream_report::{Loss, START_PATIENCE, STEADY_PATIENCE, StreamReport},
};
use boresight_capture::listed;
use boresight_geometry::{
    device::{CameraInfo, Fault, Mode, PixelLayout},
    frame::ImageSize,
};

/// An image topic of ROS 2.
pub struct Ros2 {
    /// Name with the prefix: `ros2:/camera/image_raw`.
    name: String,
    reader: RawReader,
    images: RosImages,
    /// The followed publisher, and the number of the newest picture. Of several publishers of the
    /// topic, the first is followed.
    followed: Option<(GUID, i64)>,
    time: CameraTime,
    report: StreamReport,
}

impl Ros2 {
    /// Prefix of topic names.
    pub const PREFIX: &str = TOPIC;

    /// Full name of a source, with the topic's first slash added if missing.
    pub fn full_name(name: &str) -> String {
        format!("{}{}", Self::PREFIX, topic_of(name))
    }

    /// Opens `ros2:/TOPIC` in `domain` and waits for the first picture, whose size is required of
    /// all.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] without a publisher of pictures, or if none is readable.
    pub fn open(name: &str, domain: Domain) -> Result<Self, CaptureError> {
        let failed = |(fault, detail): Loss| CaptureError::Camera { fault, detail };
        let topic = topic_of(name);
        let node = Node::joined(domain).map_err(|err| failed((Fault::NoSuchTopic, err)))?;
        let published =
            |node: &Node| node.topics().into_iter().find(|published| published.name == topic);
        let Some(ImageTopic { kind, .. }) = node.wait_for(DISCOVERED_WITHIN, published) else {
            return Err(failed((Fault::NoSuchTopic, others(&node.topics()))));
        };
        let broken = |err: rustdds::dds::CreateError| failed((Fault::NoSuchTopic, err.to_string()));
        let (participant, qos) = (&node.participant, of_sensors());
        let dds_topic = participant
            .create_topic(dds_name(&topic), kind.dds_name().into(), &qos, TopicKind::NoKey)
            .map_err(broken)?;
        let subscriber = participant.create_subscriber(&qos).map_err(broken)?;
        let reader =
            subscriber.create_simple_datareader_no_key(&dds_topic, Some(qos)).map_err(broken)?;
        let (mut images, mut followed) = (RosImages::new(kind), None);
        let until = Instant::now() + START_PATIENCE;
        let mut flaw = None;
        let (stamp_nanos, image) = loop {
            let left = until.saturating_duration_since(Instant::now());
            let Some((message, _)) = wait(&reader, left, |it| newest(it, &mut followed)) else {
                return Err(failed(without_picture(flaw)));
            };
            match images.read(&message) {
                Ok((header, image)) => break (header.stamp_nanos, image),
                Err(RosFlaw::Encoding(encoding)) => {
                    return Err(failed((Fault::NoFormat, encoding)));
                }
                Err(why) => flaw = Some(why),
            }
        };
        let (size, layout) = (ImageSize::of(&image), PixelLayout::Decoded);
        let report = StreamReport::new(Mode { size, layout, interval_secs: None }, true);
        let (name, time) = (Self::full_name(name), CameraTime::default());
        let mut source = Self { name, reader, images, followed, time, report };
        source.take(stamp_nanos, image);
        Ok(source)
    }

    fn take(&mut self, stamp_nanos: Option<u64>, image: GrayImage) {
        let now = self.report.now_nanos();
        let nanos = stamp_nanos.map_or(now, |stamp| self.time.here(stamp, now));
        if let Err(loss) = self.report.take(image, nanos) {
            self.lose(loss);
        }
    }

    fn lose(&mut self, loss: Loss) {
        (self.followed, self.time) = (None, CameraTime::default());
        self.report.lose(loss);
    }
}

/// The newest message of the followed publisher, if any, and the number of skipped ones before:
/// replaced, or, by their numbers, lost in transit.
fn newest(reader: &RawReader, followed: &mut Option<(GUID, i64)>) -> Option<(Vec<u8>, u64)> {
    let (mut newest, mut lost) = (None, 0);
    // A message in an unsupported encoding is an error, and as good as none.
    while let Ok(Some(message)) = reader.try_take_one() {
        let Message { writer_guid, sequence_number, sample, .. } = message;
        let number = i64::from(sequence_number);
        match followed {
            Some((guid, _)) if *guid != writer_guid => continue,
            Some((_, last)) => lost += u64::try_from(number - *last - 1).unwrap_or(0),
            None => {}
        }
        *followed = Some((writer_guid, number));
        lost += u64::from(newest.replace(sample).is_some());
    }
    newest.map(|message| (message, lost))
}

/// The topic's name in ROS, with a slash first.
pub(super) fn topic_of(name: &str) -> String {
    format!("/{}", name.strip_prefix(Ros2::PREFIX).unwrap_or(name).trim_matches('/'))
}

fn others(topics: &[ImageTopic]) -> String {
    let names: Vec<String> = topics.iter().map(|topic| topic.name.clone()).collect();
    if names.is_empty() { String::new() } else { format!("there are {}", listed(&names, ", ")) }
}

fn without_picture(flaw: Option<RosFlaw>) -> Loss {
    let nothing = || format!("nothing for {} s", START_PATIENCE.as_secs());
    (Fault::NoFirstFrame, flaw.map_or_else(nothing, |flaw| flaw.to_string()))
}

impl FrameSource for Ros2 {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: self.name.clone(), image_size: Some(self.report.mode().size) }
    }

    fn waits(&self) -> bool {
        false
    }

    fn camera_facts(&self) -> Option<CameraInfo> {
        self.report.facts(&self.name, "ros2")
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        if let Some(arrival) = self.report.next() {
            return Ok(arrival);
        }
        let Self { reader, followed, .. } = self;
        if let Some((message, lost)) = wait(reader, patience, |it| newest(it, followed)) {
            self.report.count(lost, 0);
            match self.images.read(&message) {
                Ok((header, image)) => self.take(header.stamp_nanos, image),
                Err(_) => self.report.count(0, 1),
            }
        } else if self.report.is_silent(STEADY_PATIENCE) {
            let detail = format!("nothing for {} s", STEADY_PATIENCE.as_secs());
            self.lose((Fault::StreamLost, detail));
        }
        Ok(self.report.next().unwrap_or(Arrival::NothingYet))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_begins_with_a_slash_whether_it_was_typed_or_not() {
        for name in ["ros2:/camera/image_raw", "ros2:camera/image_raw", "/camera/image_raw/"] {
            assert_eq!(topic_of(name), "/camera/image_raw", "{name}");
        }
    }
}
