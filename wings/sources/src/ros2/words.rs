//! A topic of the program: lines of text for other nodes.

use std::time::Duration;

use rustdds::{TopicKind, no_key::DataWriter};

use super::{
    node::{Domain, Node, dds_name},
    raw::{Raw, of_services},
};

/// `std_msgs/msg/String`.
const TEXT: &str = "std_msgs::msg::dds_::String_";
/// Time for readers to receive the last line before the program ends.
const HEARD_WITHIN: Duration = Duration::from_millis(500);

/// Publishes lines of text.
pub struct Words {
    writer: DataWriter<Vec<u8>, Raw>,
}

impl Words {
    /// Begins to publish `topic`, such as `/boresight/state`, in `domain`.
    ///
    /// # Errors
    ///
    /// The error on joining the network.
    pub fn on(topic: &str, domain: Domain) -> Result<Self, String> {
        let node = Node::joined(domain)?;
        let (participant, qos) = (&node.participant, of_services());
        let topic = participant
            .create_topic(dds_name(topic), TEXT.into(), &qos, TopicKind::NoKey)
            .map_err(|err| err.to_string())?;
        let publisher = participant.create_publisher(&qos).map_err(|err| err.to_string())?;
        let writer = publisher.create_datawriter_no_key(&topic, Some(qos));
        Ok(Self { writer: writer.map_err(|err| err.to_string())? })
    }

    /// Publishes a line, with or without readers.
    pub fn say(&self, line: &str) {
        let length = u32::try_from(line.len() + 1).unwrap_or(u32::MAX);
        let message = [length.to_le_bytes().as_slice(), line.as_bytes(), &[0]].concat();
        self.writer.write(message, None).ok();
    }
}

impl Drop for Words {
    fn drop(&mut self) {
        self.writer.wait_for_acknowledgments(HEARD_WITHIN).ok();
    }
}
