//! The program on the network of ROS 2. It joins a domain once, because others need a second to see
//! it, and stays until its end.

use std::{
    collections::BTreeMap,
    net::Ipv4Addr,
    sync::{Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

use rustdds::{DomainParticipant, DomainParticipantBuilder};

use crate::RosImageType;
use boresight_capture::CaptureError;
use boresight_geometry::device::Fault;

/// Time for others to announce themselves: they answer a newcomer at once, unless a packet gets
/// lost.
pub(super) const DISCOVERED_WITHIN: Duration = Duration::from_secs(5);
const LOOK: Duration = Duration::from_millis(20);
/// Prefix of the names of topics in DDS.
const TOPIC: &str = "rt";

/// A part of the network: nodes see each other only within a domain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Domain {
    number: u16,
    /// True for nodes on this computer only.
    is_local: bool,
}

impl Domain {
    /// Domain by the environment's variables, as in ROS 2: `ROS_DOMAIN_ID`, 0 by default, and
    /// `ROS_LOCALHOST_ONLY`.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if the number is invalid.
    pub fn of(variable: impl Fn(&str) -> Option<String>) -> Result<Self, CaptureError> {
        let value = |name| variable(name).filter(|value| !value.is_empty());
        let number = value("ROS_DOMAIN_ID").map_or(Ok(0), |id| match id.parse() {
            Ok(id @ 0..=232) => Ok(id),
            _ => Err(CaptureError::Camera {
                fault: Fault::NoSuchTopic,
                detail: format!("ROS_DOMAIN_ID is {id:?}, and must be 0 to 232"),
            }),
        })?;
        Ok(Self { number, is_local: value("ROS_LOCALHOST_ONLY").is_some_and(|is| is == "1") })
    }
}

/// A published image topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageTopic {
    /// Name in ROS, such as `/camera/image_raw`.
    pub name: String,
    /// Type of the messages.
    pub kind: RosImageType,
    /// Number of publishers.
    pub publishers: usize,
}

/// The program among the others.
#[derive(Clone)]
pub(super) struct Node {
    pub(super) participant: DomainParticipant,
    since: Instant,
}

static JOINED: Mutex<BTreeMap<Domain, Node>> = Mutex::new(BTreeMap::new());

impl Node {
    /// The program in `domain`.
    ///
    /// # Errors
    ///
    /// The error on joining.
    pub(super) fn joined(domain: Domain) -> Result<Self, String> {
        let mut joined = JOINED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(node) = joined.get(&domain) {
            return Ok(node.clone());
        }
        let mut builder = DomainParticipantBuilder::new(domain.number);
        if domain.is_local {
            builder = builder.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let participant = builder.build().map_err(|err| err.to_string())?;
        let node = Self { participant, since: Instant::now() };
        joined.insert(domain, node.clone());
        Ok(node)
    }

    /// Waits for a result of `found`; `None` if there is none until `patience` after joining.
    pub(super) fn wait_for<T>(
        &self,
        patience: Duration,
        found: impl Fn(&Self) -> Option<T>,
    ) -> Option<T> {
        loop {
            if let Some(what) = found(self) {
                return Some(what);
            }
            if self.since.elapsed() >= patience {
                return None;
            }
            thread::sleep(LOOK);
        }
    }

    /// Image topics published now, by name.
    pub(super) fn topics(&self) -> Vec<ImageTopic> {
        let mut topics = BTreeMap::new();
        for writer in self.participant.discovered_writers() {
            let data = writer.publication_topic_data;
            let name = data.topic_name.strip_prefix(TOPIC).filter(|name| name.starts_with('/'));
            if let (Some(name), Some(kind)) = (name, RosImageType::named(&data.type_name)) {
                let topic = ImageTopic { name: name.into(), kind, publishers: 0 };
                topics.entry(name.to_owned()).or_insert(topic).publishers += 1;
            }
        }
        topics.into_values().collect()
    }
}

/// Image topics published in `domain` now, by name, as far as announced until `patience` after the
/// first call: a second suffices on a good network.
pub fn topics(domain: Domain, patience: Duration) -> Vec<ImageTopic> {
    let Ok(node) = Node::joined(domain) else { return Vec::new() };
    node.wait_for(patience, |_| None::<()>);
    node.topics()
}

/// Name in DDS of the ROS topic `name`.
pub(super) fn dds_name(name: &str) -> String {
    format!("{TOPIC}{name}")
}
