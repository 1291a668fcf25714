//! What pages are told once, and why frames were refused.

use serde::Serialize;

use crate::{
    instruction::Instruction,
    speech::{Narrator, Rank, Word},
    text::report::refusal_kind,
};
use boresight_guide::{
    guidance::Refusal,
    session::{Outcome, Snapshot, ViewNumber},
};

/// Reasons for refusing frames that a page lists.
const MOST_REASONS: usize = 6;

/// Reader of every snapshot of a session: finds news and counts refusals.
#[derive(Clone, Debug, Default)]
pub struct Teller {
    narrator: Narrator,
    /// A refusal of each kind, and how often there was one.
    refused: Vec<(Refusal, u64)>,
}

/// Something that happened once.
#[derive(Clone, Debug)]
pub struct News {
    /// Words to say.
    pub word: Word,
    /// The view that was taken.
    pub view: Option<ViewNumber>,
}

/// News as a page reads it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NewsEvent<'a> {
    /// Its number in the session.
    pub number: u64,
    /// How long ago it came.
    pub age_ms: u64,
    /// Number of the view that was taken, from 1.
    pub view: Option<u32>,
    /// Words to say.
    #[serde(flatten)]
    pub say: &'a Word,
}

impl Teller {
    /// The news in `snapshot`, oldest first. It must get every snapshot.
    pub fn tell(&mut self, snapshot: &Snapshot) -> Vec<News> {
        if let Outcome::Refused { refusal } = snapshot.decision.outcome {
            let same = |(kind, _): &&mut (Refusal, u64)| {
                std::mem::discriminant(kind) == std::mem::discriminant(&refusal)
            };
            match self.refused.iter_mut().find(same) {
                Some((_, count)) => *count += 1,
                None => self.refused.push((refusal, 1)),
            }
        }
        let now = Instruction::of(snapshot);
        let news = self.narrator.news(&now).into_iter();
        let of_view = |word: &Word| now.taken.filter(|_| word.rank == Rank::Taken);
        news.map(|word| News { view: of_view(&word), word }).collect()
    }

    /// The most frequent kinds of refusals, each with its share of all in per cent, in steps of 5: pages aren't sent a list
    /// anew with every frame.
    pub fn refused(&self) -> Vec<(Refusal, u64)> {
        let all: u64 = self.refused.iter().map(|(_, count)| count).sum();
        let mut refused = self.refused.clone();
        refused.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        refused.truncate(MOST_REASONS);
        refused
            .iter_mut()
            .for_each(|(_, count)| *count = 5 * ((20 * *count + all / 2) / all.max(1)));
        refused.retain(|(_, share)| *share > 0);
        refused
    }
}

/// The kind of a refusal in words, without its numbers.
pub(super) fn kind(refusal: &Refusal) -> String {
    let value = serde_json::to_value(refusal).unwrap_or_default();
    refusal_kind(value["why"].as_str().unwrap_or_default()).to_owned()
}
