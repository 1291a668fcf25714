//! Finds the board in many pictures on several threads; results keep the order of the pictures.

use std::{
    sync::atomic::{AtomicUsize, Ordering},
    thread::Builder,
};

use boresight_detect::{Detection, Detector, DetectorParams, Miss, Prediction, Search};
use boresight_geometry::board::Checkerboard;
use image::GrayImage;

use super::error::PipelineError;

/// The detection in a picture, or why the picture could not be loaded.
pub type Seen<E> = Result<Result<Detection, Miss>, E>;

/// Detects the board in `count` pictures that `load` provides, on `threads` threads; `near` predicts where it
/// is.
///
/// Every picture is searched independently, so the result doesn't depend on the number of threads. `done` is
/// called with the index of each finished picture, on the thread that finished it.
///
/// # Errors
///
/// [`PipelineError`] if a thread could not be started or panicked.
pub fn detect_many<E: Send>(
    count: usize,
    threads: usize,
    board: &Checkerboard,
    load: impl Fn(usize) -> Result<GrayImage, E> + Sync,
    near: impl Fn(usize) -> Option<Prediction> + Sync,
    done: impl Fn(usize) + Sync,
) -> Result<Vec<Seen<E>>, PipelineError> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut detector = Detector::new(DetectorParams::default());
        let mut found = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return found;
            }
            let near = near(index);
            let search = Search { near: near.as_ref(), ..Search::FULL };
            found.push((index, load(index).map(|image| detector.search(&image, board, search))));
            done(index);
        }
    };
    let mut found = std::thread::scope(|scope| {
        let mut workers = Vec::new();
        for _ in 0..threads.clamp(1, count.max(1)) {
            let worker = Builder::new()
                .name("detector".into())
                .spawn_scoped(scope, work)
                .map_err(|source| PipelineError::Spawn { worker: "detector", source })?;
            workers.push(worker);
        }
        let mut found = Vec::with_capacity(count);
        for worker in workers {
            let part =
                worker.join().map_err(|_| PipelineError::WorkerPanicked { worker: "detector" })?;
            found.extend(part);
        }
        Ok::<_, PipelineError>(found)
    })?;
    found.sort_by_key(|(index, _)| *index);
    Ok(found.into_iter().map(|(_, result)| result).collect())
}
