//! Processors of this computer.

use std::thread::available_parallelism;

/// Number of cores, at least 1: as many threads as work that nobody limits.
pub fn cores() -> usize {
    available_parallelism().map_or(1, usize::from)
}
