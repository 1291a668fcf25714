//! Many sessions at once, by whatever runs programs in parallel: a plan, shards, and one table of results.
//!
//! [`plan`] lists sessions as a manifest. [`run`] applies one [`Action`] to the items of a [`Shard`]; each result is a
//! [`Row`] in its own file, named by what determines it. [`gather`] reads the rows back in one order. A row that is
//! there is done, so a shard may be run twice, interrupted, or run by two machines at once: the rows are the same.
//!
//! | file | holds |
//! |---|---|
//! | `manifest` | the sessions below some folders, one a line |
//! | `job` | what is done with each item, and the name of its result |
//! | `row` | one result |
//! | `work` | one item, from its session to its row |
//! | `shard` | a worker's part of the manifest, from an argument or a scheduler's variables |
//! | `store` | the folder of results |
//! | `child` | the process that works, and that may crash or hang |
//! | `run` | a shard, from its first item to its last |
//! | `gather` | the rows in order, and which are missing |
//! | `parquet_table` | the rows as a Parquet file, with the feature of that name |
//! | `changes` | decisions and verdicts that differ from the recorded ones |
//! | `metrics` | how a run goes, for Prometheus |

mod changes;
mod child;
mod gather;
mod job;
mod manifest;
mod metrics;
#[cfg(feature = "parquet")]
mod parquet_table;
mod row;
mod run;
mod shard;
mod store;
mod work;

pub use changes::{Change, Changes, changes};
pub use gather::{Gathered, gather};
pub use job::{Action, Id, JOB_SCHEMA, Job};
pub use manifest::{Item, Manifest, ManifestError, plan};
pub use metrics::write as write_metrics;
#[cfg(feature = "parquet")]
pub use parquet_table::gather_parquet;
pub use row::{DecisionsEntry, LensRow, ROW_SCHEMA, Row};
pub use run::{Batch, Event, Tally, run};
pub use shard::{Shard, ShardError};
pub use store::{OtherJob, Store};
pub use work::work;
