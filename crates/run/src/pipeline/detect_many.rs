//! Finds the board in many pictures on several threads; results keep the order of the pictures.

use std::{
    sync::atomic::{AtomicUsize, Ordering},
    thread::Builder,
};

use boresight_detect::{Detection, Detector, DetectorParams, Miss, Prediction, Search};
use boresight_geometry::boards::Board;
use image::GrayImage;

use super::error::PipelineError;

/// The detection in a picture, or the loading error.
pub type Seen<E> = Result<Result<Detection, Miss>, E>;

/// Most pictures of a set without the named board to search for other boards before giving up.
const LOOKS_FOR_OTHERS: usize = 5;

/// Detects the board in `count` pictures from `load`, on `threads` threads; `near` predicts its
/// place. If none shows the named board and some show another one, all pictures are searched for
/// others.
///
/// Every picture is searched independently, so the result doesn't depend on the number of threads.
/// `done` is called with the index of each finished picture, on the thread that finished it.
///
/// # Errors
///
/// [`PipelineError`] if a thread could not be started or panicked.
pub fn detect_many<E: Send>(
    count: usize,
    threads: usize,
    board: &Board,
    load: impl Fn(usize) -> Result<GrayImage, E> + Sync,
    near: impl Fn(usize) -> Option<Prediction> + Sync,
    done: impl Fn(usize) + Sync,
) -> Result<Vec<Seen<E>>, PipelineError> {
    let all: Vec<usize> = (0..count).collect();
    let mut found = on_threads(&all, threads, &|detector, index| {
        let near = near(index);
        let search = Search { near: near.as_ref(), ..Search::FULL };
        let seen = load(index).map(|image| detector.search(&image, board, search));
        done(index);
        seen
    })?;
    if found.iter().any(|seen| matches!(seen, Ok(Ok(_)))) {
        return Ok(found);
    }
    let is_open = |index: &usize| matches!(&found[*index], Ok(Err(miss)) if miss.leaves_open());
    let open: Vec<usize> = all.into_iter().filter(is_open).collect();
    let every = open.len().div_ceil(LOOKS_FOR_OTHERS).max(1);
    let first: Vec<usize> = open.iter().copied().step_by(every).collect();
    let recognise = |detector: &mut Detector, index: usize| {
        let image = load(index).ok()?;
        detector.recognise(&image, Some(board), &|| true)
    };
    if on_threads(&first, threads, &recognise)?.iter().any(Option::is_some) {
        for (index, other) in open.iter().zip(on_threads(&open, threads, &recognise)?) {
            if let Some(other) = other {
                found[*index] = Ok(Err(Miss::OtherBoard(other)));
            }
        }
    }
    Ok(found)
}

/// Results of `look` for each of `indices`, in order, on at most `threads` threads.
fn on_threads<T: Send>(
    indices: &[usize],
    threads: usize,
    look: &(impl Fn(&mut Detector, usize) -> T + Sync),
) -> Result<Vec<T>, PipelineError> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut detector = Detector::new(DetectorParams::default());
        let mut found = Vec::new();
        loop {
            let place = next.fetch_add(1, Ordering::Relaxed);
            let Some(index) = indices.get(place) else { return found };
            found.push((place, look(&mut detector, *index)));
        }
    };
    let mut found = std::thread::scope(|scope| {
        let mut workers = Vec::new();
        for _ in 0..threads.clamp(1, indices.len().max(1)) {
            let worker = Builder::new()
                .name("detector".into())
                .spawn_scoped(scope, work)
                .map_err(|source| PipelineError::Spawn { worker: "detector", source })?;
            workers.push(worker);
        }
        let mut found = Vec::with_capacity(indices.len());
        for worker in workers {
            let part =
                worker.join().map_err(|_| PipelineError::WorkerPanicked { worker: "detector" })?;
            found.extend(part);
        }
        Ok::<_, PipelineError>(found)
    })?;
    found.sort_by_key(|(place, _)| *place);
    Ok(found.into_iter().map(|(_, result)| result).collect())
}
