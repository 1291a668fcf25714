//! Many sessions at once, by any program running others in parallel: a plan, shards, and a table of
//! results.
//!
//! [`plan`] lists sessions and recorded bags as a manifest. [`run`] applies one [`Action`] to the
//! items of a [`Shard`]; each result is a [`Row`] in its own file, named by its inputs. [`gather`]
//! reads the rows back in one order. An existing row is done: a shard may be run twice,
//! interrupted, or run by two machines at once, with the same rows.
//!
//! | file | holds |
//! |---|---|
//! | `address` | addresses in an object store |
//! | `item` | a session or bag as a line of a manifest |
//! | `cloud`, `no_cloud` | object stores with or without the feature; imported as `buckets` |
//! | `place` | a folder, or a prefix in an object store |
//! | `manifest` | the sessions below some folders, one a line |
//! | `job` | work on each item, and the name of its result |
//! | `row` | one result |
//! | `recorded` | the row of a session's own result, without a batch |
//! | `work` | an item, from its session to its row |
//! | `taken` | a session taken from a bag |
//! | `not_worked` | failures of items |
//! | `shard` | a worker's part of the manifest, from an argument or a scheduler's variables |
//! | `store` | the results of a batch |
//! | `child` | the worker process, which may crash or hang |
//! | `desk` | workplace of a thread: a worker, and copies from an object store |
//! | `run` | a shard, from its first item to its last |
//! | `gather` | the rows in order, and the missing ones |
//! | `parquet_table` | the rows as a Parquet file, with the feature of that name |
//! | `changes` | decisions and verdicts different from the recorded ones |
//! | `metrics` | progress of a run, for Prometheus |

mod address;
mod changes;
mod child;
#[cfg(feature = "cloud")]
mod cloud;
pub mod command;
mod desk;
mod gather;
mod item;
mod job;
mod manifest;
mod metrics;
#[cfg(not(feature = "cloud"))]
mod no_cloud;
mod not_worked;
#[cfg(feature = "parquet")]
mod parquet_table;
mod place;
mod recorded;
mod row;
mod run;
mod shard;
mod store;
mod taken;
mod work;

#[cfg(feature = "cloud")]
use cloud as buckets;
#[cfg(not(feature = "cloud"))]
use no_cloud as buckets;

pub use changes::{Change, Changes, changes};
#[cfg(feature = "cloud")]
pub use cloud::{CloudError, Why};
pub use gather::{Gathered, gather};
pub use item::Item;
pub use job::{Action, Id, JOB_SCHEMA, Job};
pub use manifest::{Manifest, ManifestError, plan};
pub use metrics::write as write_metrics;
pub use not_worked::NotWorked;
#[cfg(feature = "parquet")]
pub use parquet_table::gather_parquet;
pub use recorded::recorded;
pub use row::{DecisionsEntry, LensRow, ROW_SCHEMA, Row, StatedRow};
pub use run::{Batch, Event, Tally, run};
pub use shard::{Shard, ShardError};
pub use store::{OtherJob, Store};
pub use work::work;
