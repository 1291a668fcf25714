//! `set_camera_info`, the service of a camera's driver to take, keep and publish a calibration.
//!
//! The link between a call and its answer isn't standardised. Fast DDS, the usual one, and Connext
//! write it beside the message (OMG DDS-RPC); Cyclone DDS before the message: the caller and a
//! number, eight bytes each.

use std::time::{Duration, Instant};

use rustdds::{
    GUID, RTPSEntity, SampleIdentity, SequenceNumber, TopicKind, WriteOptionsBuilder,
    no_key::DataWriter,
};

use super::{
    node::{DISCOVERED_WITHIN, Domain, Node},
    raw::{Message, Raw, RawReader, of_services, wait},
    source::topic_of,
};
use crate::ros_image::Cdr;

/// Time for a driver's answer: it writes a file.
const ANSWERED_WITHIN: Duration = Duration::from_secs(10);
/// Time before repeating the call: a driver may not have discovered us before, and setting twice is
/// setting.
const AGAIN: Duration = Duration::from_secs(1);
const SERVICE: &str = "set_camera_info";
const REQUEST: &str = "sensor_msgs::srv::dds_::SetCameraInfo_Request_";
const RESPONSE: &str = "sensor_msgs::srv::dds_::SetCameraInfo_Response_";
/// First bytes of the names of Cyclone DDS, by the list of the DDS foundation.
const CYCLONE: [u8; 2] = [1, 0x10];
const HEADER: usize = 16;

/// Answer of a driver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The service, such as `/camera/set_camera_info`.
    pub service: String,
    /// True if the driver took the calibration.
    pub is_taken: bool,
    /// The driver's words; may be empty, and hold anything.
    pub words: String,
}

/// Reason for a driver without the calibration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotSet {
    /// The program can't join the network.
    #[error("ROS 2 can't be reached: {0}")]
    NoNetwork(String),
    /// No driver offers the service.
    #[error("no driver offers one of {}", .0.join(", "))]
    NoService(Vec<String>),
    /// The driver is silent.
    #[error("{0} doesn't answer")]
    NoAnswer(String),
}

/// Asks the driver behind `source`, `ros2:/TOPIC` in `domain`, to take the calibration `info`: a
/// `sensor_msgs/msg/CameraInfo` in the Common Data Representation, the lower byte first, without
/// its encapsulation header.
///
/// # Errors
///
/// [`NotSet`] if no driver was asked, or none answered.
pub fn set_camera_info(source: &str, domain: Domain, info: &[u8]) -> Result<Answer, NotSet> {
    let node = Node::joined(domain).map_err(NotSet::NoNetwork)?;
    let services = services(&topic_of(source));
    let offered = |node: &Node| {
        let readers = node.participant.discovered_readers();
        services.iter().find_map(|service| {
            let topic = request_topic(service);
            let mut offered = readers.iter().map(|reader| &reader.subscription_topic_data);
            let server = offered.find(|offered| offered.topic_name == topic)?;
            Some((service, server.key()))
        })
    };
    let Some((service, server)) = node.wait_for(DISCOVERED_WITHIN, offered) else {
        return Err(NotSet::NoService(services));
    };
    let silent = || NotSet::NoAnswer(service.clone());
    let call = Call::to(&node, service, server).map_err(NotSet::NoNetwork)?;
    let until = Instant::now() + ANSWERED_WITHIN;
    while Instant::now() < until {
        let asked = call.ask(info).ok_or_else(silent)?;
        if let Some((is_taken, words)) = call.answer(asked, AGAIN) {
            return Ok(Answer { service: service.clone(), is_taken, words });
        }
    }
    Err(silent())
}

/// Possible names of the service of a topic's driver, the nearest first: in the camera's namespace
/// or above.
fn services(topic: &str) -> Vec<String> {
    let spaces = topic.match_indices('/').map(|(at, _)| &topic[..at]);
    spaces.rev().map(|space| format!("{space}/{SERVICE}")).collect()
}

fn request_topic(service: &str) -> String {
    format!("rq{service}Request")
}

/// Both ends of a service.
struct Call {
    writer: DataWriter<Vec<u8>, Raw>,
    reader: RawReader,
    names_before_message: bool,
}

impl Call {
    fn to(node: &Node, service: &str, server: GUID) -> Result<Self, String> {
        let (participant, qos) = (&node.participant, of_services());
        let topic = |name: String, kind: &str| {
            let topic = participant.create_topic(name, kind.into(), &qos, TopicKind::NoKey);
            topic.map_err(|err| err.to_string())
        };
        let requests = topic(request_topic(service), REQUEST)?;
        let responses = topic(format!("rr{service}Reply"), RESPONSE)?;
        let publisher = participant.create_publisher(&qos).map_err(|err| err.to_string())?;
        let subscriber = participant.create_subscriber(&qos).map_err(|err| err.to_string())?;
        // First, so a server hearing a request knows the address of the answer.
        let reader = subscriber.create_simple_datareader_no_key(&responses, Some(qos.clone()));
        let writer = publisher.create_datawriter_no_key(&requests, Some(qos));
        Ok(Self {
            writer: writer.map_err(|err| err.to_string())?,
            reader: reader.map_err(|err| err.to_string())?,
            names_before_message: server.to_bytes().starts_with(&CYCLONE),
        })
    }

    /// The caller's name in Cyclone DDS: any unique eight bytes.
    fn name(&self) -> [u8; 8] {
        let [.., a, b, c, d, e, f, g, h] = self.writer.guid().to_bytes();
        [a, b, c, d, e, f, g, h]
    }

    /// Sends a request; returns the number of the answer.
    fn ask(&self, info: &[u8]) -> Option<i64> {
        const NUMBER: i64 = 1;
        let options = WriteOptionsBuilder::new();
        if self.names_before_message {
            let header = [self.name(), NUMBER.to_le_bytes()].concat();
            let request = [header.as_slice(), info].concat();
            return self.writer.write_with_options(request, options.build()).map(|_| NUMBER).ok();
        }
        // As in Fast DDS: the receiver of the answer.
        let to = SampleIdentity {
            writer_guid: self.reader.guid(),
            sequence_number: SequenceNumber::new(0),
        };
        let options = options.related_sample_identity(to).build();
        let sent = self.writer.write_with_options(info.to_vec(), options).ok()?;
        Some(sent.sequence_number.into())
    }

    /// Waits for the answer with the given number: true if the calibration was taken, and the
    /// driver's words.
    fn answer(&self, number: i64, patience: Duration) -> Option<(bool, String)> {
        wait(&self.reader, patience, |reader| {
            while let Ok(Some(message)) = reader.try_take_one() {
                if let Some(answer) = self.read(&message, number) {
                    return Some(answer);
                }
            }
            None
        })
    }

    fn read(&self, message: &Message, number: i64) -> Option<(bool, String)> {
        let mut cdr = Cdr::of(&message.sample)?;
        let is_ours = if self.names_before_message {
            cdr.take(HEADER)? == [self.name(), number.to_le_bytes()].concat()
        } else {
            let to = message.related_sample_identity()?;
            i64::from(to.sequence_number) == number
                && [self.reader.guid(), self.writer.guid()].contains(&to.writer_guid)
        };
        let is_taken = cdr.byte()? != 0;
        let words = cdr.text()?.to_owned();
        is_ours.then_some((is_taken, words))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_is_looked_for_in_the_topics_namespace_and_above() {
        let names =
            ["/camera/color/set_camera_info", "/camera/set_camera_info", "/set_camera_info"];
        assert_eq!(services("/camera/color/image_raw"), names);
        assert_eq!(services("/image"), ["/set_camera_info"]);
    }
}
