//! Sessions and results in S3-compatible object stores, with the feature `cloud`.
//!
//! The only place to wait for them. Endpoint and credentials come from the environment's variables
//! `AWS_…`.
//!
//! | file | holds |
//! |---|---|
//! | `client` | a bucket: requests, retries and time limits |
//! | `objects` | objects below a prefix: read, stored, listed |
//! | `sessions` | the sessions below a prefix, and copies of them |
//! | `error` | errors of a store |

mod client;
mod error;
mod objects;
mod sessions;

pub use error::{CloudError, Why};
pub(super) use objects::Prefix;
pub(super) use sessions::{Fetched, Sessions};
