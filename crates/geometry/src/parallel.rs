//! Independent work on several threads, with the feature `threads`. The result doesn't depend on
//! their number.

/// Computes `work(0), work(1), … work(count − 1)` in this order, on this thread and up to
/// `threads − 1` others, which end before the call returns.
///
/// Threads refused by the system are skipped, as are all without the feature `threads`. A panic of
/// `work` continues in the caller.
pub fn map<T: Send>(threads: usize, count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    #[cfg(feature = "threads")]
    if threads > 1 && count > 1 {
        return on_threads(threads, count, work);
    }
    let _ = threads;
    (0..count).map(work).collect()
}

#[cfg(feature = "threads")]
fn on_threads<T: Send>(threads: usize, count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    use std::{
        sync::{
            Mutex, PoisonError,
            atomic::{AtomicUsize, Ordering},
        },
        thread,
    };

    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(count));
    let take = || {
        let mut own = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                break;
            }
            own.push((index, work(index)));
        }
        done.lock().unwrap_or_else(PoisonError::into_inner).append(&mut own);
    };
    thread::scope(|scope| {
        for _ in 1..threads.min(count) {
            let started = thread::Builder::new().name("parallel".into()).spawn_scoped(scope, take);
            if started.is_err() {
                break;
            }
        }
        take();
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_their_order_on_any_number_of_threads() {
        let squares: Vec<usize> = (0..100).map(|i| i * i).collect();
        for threads in [0, 1, 2, 7, 200] {
            assert_eq!(map(threads, 100, |i| i * i), squares);
        }
        assert!(map(4, 0, |i| i).is_empty());
    }
}
