//! Many cameras in a process, each at an interval, on a few threads.

use std::{
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use super::{
    feed::{Feed, Moment, Taken, read_moment},
    places::{Hear, Places},
    times::now_secs,
};
use boresight_app::{Announcer, explain};
use boresight_capture::CaptureError;
use boresight_geometry::{device::Fault, frame::ImageSize, panic_message::caught};
use boresight_watch::{HOUR_SECS, NoAnswer};

/// Time between two looks while a camera is being pinned: six of them are within a minute.
const PINNING: Duration = Duration::from_secs(5);

/// Time between two checks for a due camera or a request to stop.
const LOOK: Duration = Duration::from_millis(200);

/// A camera with pictures and interval.
#[derive(Debug)]
pub struct Round {
    /// Name of the camera.
    pub name: String,
    /// Places seen by the camera.
    pub places: Places,
    /// Pictures of the camera.
    pub feed: Feed,
    /// Time between two looks.
    pub every: Duration,
    /// True if the last picture was the one before again: said once, not of each.
    pub is_frozen: bool,
}

impl Round {
    /// Looks once: at every new file, however late, or at a burst. Missing pictures are noted and
    /// announced.
    ///
    /// # Errors
    ///
    /// If nothing can be recorded.
    pub fn look(
        &mut self,
        stop: &AtomicBool,
        hear: Hear<'_>,
        announcer: &Announcer,
    ) -> anyhow::Result<()> {
        if let Feed::Away(name, config) = &self.feed {
            match Feed::parse(std::slice::from_ref(name), config, announcer) {
                Ok(feed) => self.feed = feed,
                Err(err) => return self.take(Err(err), Taken::at(now_secs()), hear, announcer),
            }
        }
        if let Feed::Live(_) = &self.feed {
            let moment = self.feed.burst();
            return self.take(moment, Taken::at(now_secs()), hear, announcer);
        }
        if let Feed::Recorded(_) = &self.feed {
            let (feed, every) = (self.feed.clone(), self.every.as_secs_f64());
            let began =
                self.places.newest_picture_secs().map_or_else(now_secs, |newest| newest + every);
            return feed.play(began, every, |moment| {
                let taken = moment.taken;
                self.take(Ok(moment), taken, hear, announcer)?;
                Ok(!stop.load(Ordering::Relaxed))
            });
        }
        if let Feed::Street(street) = &self.feed {
            let (street, every) = (street.clone(), self.every.as_secs_f64());
            let end = street.began_secs + street.days * 86_400.0;
            let mut at = self
                .places
                .newest_picture_secs()
                .map_or(street.began_secs, |newest| newest + every);
            while at < end && !stop.load(Ordering::Relaxed) {
                let taken = Taken::at(at);
                let moment = Moment { taken, burst: vec![street.picture(at)] };
                self.take(Ok(moment), taken, hear, announcer)?;
                at += every;
            }
            return Ok(());
        }
        let new = self.feed.new_files(|at| self.places.knows(at));
        let newest = self.places.newest_picture_secs();
        // A time before the newest picture's: a picture that was held up, or a clock set back.
        let by = |at_secs: f64| newest.map_or(f64::NEG_INFINITY, |newest| newest - at_secs.round());
        let is_set_back =
            !new.files.is_empty() && new.files.iter().all(|f| by(f.at_secs) > HOUR_SECS);
        let is_ahead = new.ahead_came_secs.is_some_and(|came| newest.is_none_or(|at| came > at));
        let is_silent = new.files.is_empty() && (self.is_overdue() || is_ahead);
        for file in new.files {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let taken = Taken { at_secs: file.at_secs, is_late: by(file.at_secs) > 0.0 };
            self.take(read_moment(taken, &file), taken, hear, announcer)?;
        }
        if is_silent || is_set_back {
            let is_wrong = is_set_back || is_ahead;
            let reason = if is_wrong { NoAnswer::WrongClock } else { NoAnswer::NoPicture };
            self.places.no_picture(reason, Taken::at(now_secs()), hear)?;
        }
        Ok(())
    }

    /// True for a folder never filled, or not for two intervals.
    fn is_overdue(&self) -> bool {
        let is_filled = matches!(self.feed, Feed::Folder(_)) && !self.every.is_zero();
        let newest = self.places.newest_picture_secs();
        is_filled
            && newest.is_none_or(|newest| now_secs() - newest > 2.0 * self.every.as_secs_f64())
    }

    fn take(
        &mut self,
        moment: anyhow::Result<Moment>,
        taken: Taken,
        hear: Hear<'_>,
        announcer: &Announcer,
    ) -> anyhow::Result<()> {
        let (reason, err) = match moment {
            Ok(Moment { taken, burst }) => {
                let size = burst.first().map(ImageSize::of);
                match size.map_or(Ok(()), |size| self.places.check_size(size)) {
                    Ok(()) => {
                        self.is_frozen = false;
                        return self.places.look(burst, taken, hear);
                    }
                    Err(err) => (NoAnswer::OtherSize, err),
                }
            }
            Err(err) => (reason_of(&err), err),
        };
        let was_frozen = std::mem::replace(&mut self.is_frozen, reason == NoAnswer::Frozen);
        if !(was_frozen && self.is_frozen) {
            announcer.say(&format!("{}: {err:#}", self.name));
            if let Some(action) = explain(&err) {
                announcer.say(&action);
            }
        }
        self.places.no_picture(reason, taken, hear)
    }
}

/// Why no picture came, by the error of its source.
fn reason_of(err: &anyhow::Error) -> NoAnswer {
    let fault = err.chain().find_map(|cause| match cause.downcast_ref()? {
        CaptureError::Camera { fault, .. } => Some(*fault),
        _ => None,
    });
    match fault {
        Some(Fault::NotLoggedIn) => NoAnswer::NotLoggedIn,
        Some(Fault::Unreachable | Fault::NotFound) => NoAnswer::NotReached,
        Some(Fault::Frozen) => NoAnswer::Frozen,
        _ => NoAnswer::NoPicture,
    }
}

/// Announces an unwatched camera with the reason and the next action.
pub fn say_left_out(name: &str, err: &anyhow::Error, announcer: &Announcer) {
    announcer.say(&format!("{name} isn't watched: {err:#}"));
    if let Some(action) = explain(err) {
        announcer.say(&action);
    }
}

/// Half of the machine's threads.
fn polite_threads() -> usize {
    thread::available_parallelism().map_or(1, |n| (n.get() / 2).max(1))
}

/// Looks at every camera once, or at the camera's interval until `stop` is set. A camera with a
/// failing store is announced and left out; the others continue. Returns the remaining cameras.
///
/// # Errors
///
/// If the system refuses threads.
pub fn run(
    rounds: Vec<Round>,
    is_once: bool,
    stop: &AtomicBool,
    hear: Hear<'_>,
    announcer: &Announcer,
) -> std::io::Result<Vec<Round>> {
    let threads = polite_threads().min(rounds.len()).max(1);
    let now = Instant::now();
    let waiting: Mutex<Vec<(Instant, Round)>> =
        Mutex::new(rounds.into_iter().map(|r| (now, r)).collect());
    let done = Mutex::new(Vec::new());
    let at_work = Mutex::new(0_usize);
    let lock = || waiting.lock().unwrap_or_else(PoisonError::into_inner);
    let work = || {
        while !stop.load(Ordering::Relaxed) {
            let due = {
                let mut waiting = lock();
                let first = waiting
                    .iter()
                    .enumerate()
                    .min_by_key(|(_, (due, _))| *due)
                    .map(|(i, (due, _))| (i, *due));
                let mut at_work = at_work.lock().unwrap_or_else(PoisonError::into_inner);
                match first {
                    Some((i, due)) if due <= Instant::now() => {
                        *at_work += 1;
                        Some(waiting.swap_remove(i))
                    }
                    None if *at_work == 0 => return,
                    _ => None,
                }
            };
            let Some((due, mut round)) = due else {
                thread::sleep(LOOK);
                continue;
            };
            // The end of one source ends no other.
            let looked = caught(|| round.look(stop, hear, announcer))
                .unwrap_or_else(|panic| Err(anyhow::anyhow!("the program failed ({panic})")));
            let is_pinning = matches!(round.feed, Feed::Live(_)) && round.places.is_to_be_pinned();
            let is_over = is_once && !is_pinning
                || matches!(round.feed, Feed::Files(_) | Feed::Recorded(_) | Feed::Street(_));
            match looked {
                Err(err) => {
                    say_left_out(&round.name, &err, announcer);
                }
                Ok(()) if is_over => {
                    done.lock().unwrap_or_else(PoisonError::into_inner).push(round);
                }
                Ok(()) => {
                    // Looks longer than the interval aren't made up for.
                    let every = if is_pinning { round.every.min(PINNING) } else { round.every };
                    let next = (due + every).max(Instant::now());
                    lock().push((next, round));
                }
            }
            *at_work.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        }
    };
    thread::scope(|scope| -> std::io::Result<()> {
        for n in 1..threads {
            thread::Builder::new().name(format!("watch {n}")).spawn_scoped(scope, work)?;
        }
        work();
        Ok(())
    })?;
    let mut left = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    left.extend(
        waiting
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
            .into_iter()
            .map(|(_, round)| round),
    );
    left.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(left)
}
