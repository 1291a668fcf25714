//! Messages as bytes, and waiting for them.

use std::{
    convert::Infallible,
    sync::Arc,
    task::{Wake, Waker},
    thread::{self, Thread},
    time::{Duration, Instant},
};

use rustdds::{
    Duration as DdsDuration, QosPolicies, QosPolicyBuilder, RepresentationIdentifier,
    bytes::Bytes,
    no_key::{
        Decode, DefaultDecoder, DeserializedCacheChange, DeserializerAdapter, SerializerAdapter,
        SimpleDataReader,
    },
    policy,
};

/// Reads and writes messages as bytes, with the encapsulation header.
pub(super) struct Raw;

pub(super) type RawReader = SimpleDataReader<Vec<u8>, Raw>;
pub(super) type Message = DeserializedCacheChange<Vec<u8>>;

/// Header of a message: plain, of the first version, the lower byte first or last.
const LOWER_FIRST: [u8; 4] = [0, 1, 0, 0];
const HIGHER_FIRST: [u8; 4] = [0, 0, 0, 0];

impl DeserializerAdapter<Vec<u8>> for Raw {
    type Error = Infallible;
    type Decoded = Vec<u8>;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: Vec<u8>) -> Vec<u8> {
        decoded
    }
}

#[derive(Clone)]
pub(super) struct AsItIs;

impl Decode<'_, Vec<u8>> for AsItIs {
    type Error = Infallible;

    fn decode_bytes(
        self,
        bytes: &[u8],
        encoding: RepresentationIdentifier,
    ) -> Result<Vec<u8>, Infallible> {
        let lower_first = encoding == RepresentationIdentifier::CDR_LE;
        let header = if lower_first { LOWER_FIRST } else { HIGHER_FIRST };
        Ok([header.as_slice(), bytes].concat())
    }
}

impl DefaultDecoder<Vec<u8>> for Raw {
    type Decoder = AsItIs;
    const DECODER: AsItIs = AsItIs;
}

/// Written messages have no header: the library sets it, the lower byte first.
impl SerializerAdapter<Vec<u8>> for Raw {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(value: &Vec<u8>) -> Result<Bytes, Infallible> {
        Ok(Bytes::copy_from_slice(value))
    }
}

/// Quality of service of ROS 2 for sensors: a lost picture isn't sent again, because the next one
/// is worth more.
pub(super) fn of_sensors() -> QosPolicies {
    let newest = policy::History::KeepLast { depth: 4 };
    QosPolicyBuilder::new()
        .reliability(policy::Reliability::BestEffort)
        .durability(policy::Durability::Volatile)
        .history(newest)
        .build()
}

/// Quality of service of ROS 2 for services: nothing gets lost.
pub(super) fn of_services() -> QosPolicies {
    let max_blocking_time = DdsDuration::from_millis(100);
    QosPolicyBuilder::new()
        .reliability(policy::Reliability::Reliable { max_blocking_time })
        .durability(policy::Durability::Volatile)
        .history(policy::History::KeepLast { depth: 10 })
        .build()
}

struct Unparks(Thread);

impl Wake for Unparks {
    fn wake(self: Arc<Self>) {
        self.0.unpark();
    }
}

/// Waits at most `patience` for a result of `taken` among the received messages.
pub(super) fn wait<T>(
    reader: &RawReader,
    patience: Duration,
    mut taken: impl FnMut(&RawReader) -> Option<T>,
) -> Option<T> {
    let until = Instant::now() + patience;
    loop {
        // Before the look, so nothing can come unnoticed between look and wait.
        reader.set_waker(Some(Waker::from(Arc::new(Unparks(thread::current())))));
        reader.drain_read_notifications();
        if let Some(found) = taken(reader) {
            return Some(found);
        }
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return None;
        }
        thread::park_timeout(left);
    }
}
