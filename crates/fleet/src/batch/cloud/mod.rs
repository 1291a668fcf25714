//! Sessions and results in S3-compatible object stores, with the feature `cloud`.
//!
//! The only place to wait for them. Endpoint and credentials come from the environment's variables
//! `AWS_…`.
//!
//! | file | holds |
//! |---|---|
//! | `client` | one bucket: how it's asked, how often, and how long |
//! | `objects` | objects below a prefix: read, stored, listed |
//! | `sessions` | the sessions below a prefix, and copies of them |
//! | `error` | why a store can't be used |

mod client;
mod error;
mod objects;
mod sessions;

pub use error::{CloudError, Why};
pub(super) use objects::Prefix;
pub(super) use sessions::{Fetched, Sessions};
