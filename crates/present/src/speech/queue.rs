use std::collections::VecDeque;

use super::{Rank, Word};

/// Maximum waiting time of a request.
pub const STALE_SECS: f64 = 1.0;
/// Minimum time between two beginnings of guidance.
pub const GUIDANCE_GAP_SECS: f64 = 2.0;
/// Time after which an unchanged request is repeated.
pub const REPEAT_SECS: f64 = 8.0;

/// Next step of the voice.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The word to say.
    pub word: Word,
    /// Waiting time, in seconds.
    pub waited_secs: f64,
    /// True if this word cuts the current word short.
    pub cuts: bool,
}

/// Words waiting for a voice. Times are seconds of any monotonic clock.
///
/// - News is said in the order of rank, then of arrival; it's never cut short. A view taken is
///   always said. Of lost and back only the newest waits; a loss that ended before its turn isn't
///   said.
/// - Any other word is cut short by a word of higher rank.
/// - Of requests only the newest waits, and at most for [`STALE_SECS`].
/// - Guidance is begun every [`GUIDANCE_GAP_SECS`] at most. A request said last is repeated only
///   after [`REPEAT_SECS`].
#[derive(Clone, Debug, Default)]
pub struct Queue {
    news: VecDeque<(f64, Word)>,
    request: Option<(f64, Word)>,
    speaking: Option<Rank>,
    /// Last request said, and the start time.
    said: Option<(f64, Word)>,
    guided_secs: Option<f64>,
}

impl Queue {
    /// Offers a word at `now_secs`. A request may be offered as often as it's shown.
    pub fn offer(&mut self, now_secs: f64, word: Word) {
        if word.rank.is_news() {
            // Earlier requests are over.
            self.request = None;
            self.said = None;
            if word.rank != Rank::Taken {
                let is_unheard = self.news.iter().any(|(_, waits)| waits.rank == Rank::Lost);
                self.news.retain(|(_, waits)| waits.rank == Rank::Taken);
                if word.rank == Rank::Back && is_unheard {
                    return;
                }
            }
            self.news.push_back((now_secs, word));
        } else if !self.was_said(now_secs, &word) {
            self.request = Some((now_secs, word));
        } else {
            self.request = None;
        }
    }

    fn was_said(&self, now_secs: f64, word: &Word) -> bool {
        self.said
            .as_ref()
            .is_some_and(|(at_secs, said)| said == word && now_secs - at_secs < REPEAT_SECS)
    }

    /// Word to begin at `now_secs`, if any. Counts as being said until [`Self::finished`].
    pub fn next(&mut self, now_secs: f64) -> Option<Step> {
        if self.request.as_ref().is_some_and(|(at_secs, _)| now_secs - at_secs > STALE_SECS) {
            self.request = None;
        }
        let cuts = self.speaking.is_some();
        if let Some(at) = self.first_news() {
            if self.speaking.is_some_and(Rank::is_news) {
                return None;
            }
            let (at_secs, word) = self.news.remove(at)?;
            self.speaking = Some(word.rank);
            return Some(Step { word, waited_secs: now_secs - at_secs, cuts });
        }
        let (_, word) = self.request.as_ref()?;
        let too_soon = word.rank == Rank::Guidance
            && self.guided_secs.is_some_and(|guided| now_secs - guided < GUIDANCE_GAP_SECS);
        if too_soon || self.speaking.is_some_and(|speaking| speaking >= word.rank) {
            return None;
        }
        let (at_secs, word) = self.request.take()?;
        if word.rank == Rank::Guidance {
            self.guided_secs = Some(now_secs);
        }
        self.speaking = Some(word.rank);
        self.said = Some((now_secs, word.clone()));
        Some(Step { word, waited_secs: now_secs - at_secs, cuts })
    }

    /// Marks the current word as finished.
    pub fn finished(&mut self) {
        self.speaking = None;
    }

    /// True if all news has been said to the end.
    pub fn is_quiet(&self) -> bool {
        self.news.is_empty() && !self.speaking.is_some_and(Rank::is_news)
    }

    /// Index of the most important news; the oldest of several.
    fn first_news(&self) -> Option<usize> {
        let highest = self.news.iter().map(|(_, word)| word.rank).max()?;
        self.news.iter().position(|(_, word)| word.rank == highest)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn word(rank: Rank, text: &str) -> Word {
        Word { rank, text: text.into(), mirrored: text.into() }
    }

    fn said(step: Option<Step>) -> Option<(String, bool)> {
        step.map(|step| (step.word.text, step.cuts))
    }

    #[test]
    fn a_view_taken_cuts_guidance_short_and_is_never_cut() {
        let mut queue = Queue::default();
        queue.offer(0.0, word(Rank::Guidance, "closer"));
        assert_eq!(said(queue.next(0.0)), Some(("closer".into(), false)));
        queue.offer(0.5, word(Rank::Taken, "taken"));
        assert_eq!(said(queue.next(0.5)), Some(("taken".into(), true)));
        queue.offer(0.6, word(Rank::Lost, "lost"));
        queue.offer(0.6, word(Rank::Hold, "hold"));
        assert_eq!(queue.next(0.6), None, "news is finished first");
        queue.finished();
        assert_eq!(said(queue.next(1.0)), Some(("lost".into(), false)));
        queue.finished();
        assert_eq!(said(queue.next(1.2)), Some(("hold".into(), false)));
        assert!(queue.is_quiet());
    }

    #[test]
    fn guidance_comes_every_two_seconds_and_only_while_it_holds() {
        let mut queue = Queue::default();
        queue.offer(0.0, word(Rank::Guidance, "closer"));
        assert!(queue.next(0.0).is_some());
        queue.finished();
        queue.offer(0.5, word(Rank::Guidance, "left"));
        assert_eq!(queue.next(0.5), None, "too soon");
        assert_eq!(queue.next(2.0), None, "and now it's old");
        queue.offer(2.1, word(Rank::Guidance, "left"));
        assert_eq!(said(queue.next(2.1)), Some(("left".into(), false)));
        queue.finished();
        queue.offer(5.0, word(Rank::Guidance, "left"));
        assert_eq!(queue.next(5.0), None, "it was said");
        queue.offer(10.2, word(Rank::Guidance, "left"));
        assert!(queue.next(10.2).is_some(), "and is still wanted");
    }

    #[test]
    fn hold_cuts_guidance_and_guidance_cuts_nothing() {
        let mut queue = Queue::default();
        queue.offer(0.0, word(Rank::Hold, "hold"));
        assert!(queue.next(0.0).is_some());
        queue.offer(0.1, word(Rank::Guidance, "left"));
        assert_eq!(queue.next(0.1), None);
        queue.finished();
        assert!(queue.next(0.4).is_some());
        queue.offer(0.5, word(Rank::Hold, "hold"));
        assert_eq!(said(queue.next(0.5)), Some(("hold".into(), true)));
    }

    #[test]
    fn what_is_back_is_not_said_to_be_lost() {
        let mut queue = Queue::default();
        queue.offer(0.0, word(Rank::Taken, "taken"));
        assert!(queue.next(0.0).is_some());
        queue.offer(0.2, word(Rank::Lost, "lost"));
        queue.offer(0.6, word(Rank::Back, "back"));
        queue.finished();
        assert_eq!(queue.next(1.0), None, "it was never said that it's lost");
        queue.offer(2.0, word(Rank::Lost, "lost"));
        assert_eq!(said(queue.next(2.0)), Some(("lost".into(), false)));
        queue.offer(2.1, word(Rank::Back, "back"));
        queue.finished();
        assert_eq!(said(queue.next(3.0)), Some(("back".into(), false)));
    }

    #[test]
    fn a_camera_that_flaps_for_a_minute_is_no_news_of_minutes() {
        let mut queue = Queue::default();
        let mut now = 0.0;
        let mut until = f64::NEG_INFINITY;
        let mut speak = |queue: &mut Queue, now: f64| {
            if now >= until {
                queue.finished();
            }
            let step = queue.next(now)?;
            until = now + 2.5;
            Some(step.word.text)
        };
        for _ in 0..60 {
            queue.offer(now, word(Rank::Lost, "lost"));
            speak(&mut queue, now);
            queue.offer(now + 0.5, word(Rank::Back, "back"));
            speak(&mut queue, now + 0.5);
            now += 1.0;
        }
        let mut after = Vec::new();
        while now < 70.0 {
            queue.offer(now, word(Rank::Guidance, "closer"));
            after.extend(speak(&mut queue, now));
            now += 0.1;
        }
        assert!(
            after.iter().position(|said| said == "closer").is_some_and(|at| at < 2),
            "{after:?}"
        );
    }

    proptest! {
        /// The queue's promises hold for all offers and durations.
        #[test]
        fn promises_are_kept(
            offers in proptest::collection::vec((0.01_f64..0.6, 0_u8..12, 0.2_f64..1.8), 1..400),
        ) {
            let mut queue = Queue::default();
            let (mut now, mut until, mut guided) = (0.0, None::<f64>, f64::NEG_INFINITY);
            let mut speaking = Rank::Guidance;
            let (mut taken_in, mut taken_out) = (0, 0);
            for (gap, kind, length) in offers {
                let rank = match kind {
                    0 => Rank::Taken,
                    1 => Rank::Lost,
                    2 => Rank::Back,
                    3..5 => Rank::Hold,
                    _ => Rank::Guidance,
                };
                taken_in += u32::from(rank == Rank::Taken);
                queue.offer(now, word(rank, &format!("{kind}")));
                let next_offer = now + gap;
                while now < next_offer {
                    if until.is_some_and(|until| until <= now) {
                        queue.finished();
                        until = None;
                    }
                    if let Some(step) = queue.next(now) {
                        let rank = step.word.rank;
                        prop_assert_eq!(step.cuts, until.is_some());
                        if step.cuts {
                            prop_assert!(rank > speaking && !speaking.is_news());
                        }
                        if rank == Rank::Guidance {
                            prop_assert!(now - guided >= GUIDANCE_GAP_SECS);
                            guided = now;
                        }
                        if !rank.is_news() {
                            prop_assert!(step.waited_secs <= STALE_SECS);
                        }
                        taken_out += u32::from(rank == Rank::Taken);
                        speaking = rank;
                        until = Some(now + length);
                    }
                    now += 0.01;
                }
            }
            let others = queue.news.iter().filter(|(_, word)| word.rank != Rank::Taken).count();
            prop_assert!(others <= 1, "only the newest state waits");
            for _ in 0..=taken_in {
                queue.finished();
                taken_out += u32::from(queue.next(now).is_some_and(|s| s.word.rank == Rank::Taken));
            }
            prop_assert_eq!(taken_in, taken_out, "no view is lost");
        }
    }
}
