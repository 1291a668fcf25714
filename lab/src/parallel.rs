//! Independent trials on all cores.

use std::thread::available_parallelism;

use boresight_geometry::parallel;

/// Results of `work(0), work(1), … work(count − 1)` in order, computed on all cores.
pub(super) fn map<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    parallel::map(available_parallelism().map_or(1, usize::from), count, work)
}
