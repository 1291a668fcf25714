//! One-time news for pages, and reasons for refusals.

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

/// Maximum number of refusal reasons on a page.
const MOST_REASONS: usize = 6;

/// Reader of all snapshots of a session: finds news and counts refusals.
#[derive(Clone, Debug, Default)]
pub struct Teller {
    narrator: Narrator,
    /// First refusal of each kind, and the count.
    refused: Vec<(Refusal, u64)>,
}

/// One-time event.
#[derive(Clone, Debug)]
pub struct News {
    /// Words to say.
    pub word: Word,
    /// View that was taken.
    pub view: Option<ViewNumber>,
}

/// News for a page.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NewsEvent<'a> {
    /// Sequence number in the session.
    pub number: u64,
    /// Age in milliseconds.
    pub age_ms: u64,
    /// Number of the view taken, from 1.
    pub view: Option<u32>,
    /// Words to say.
    #[serde(flatten)]
    pub say: &'a Word,
}

impl Teller {
    /// News in `snapshot`, oldest first. Must get every snapshot.
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

    /// Most frequent kinds of refusal with shares in per cent. Shares are rounded to 5 %, so
    /// pages don't get a new list with every frame.
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

/// Kind of a refusal in words, without numbers.
pub(super) fn kind(refusal: &Refusal) -> String {
    let value = serde_json::to_value(refusal).unwrap_or_default();
    refusal_kind(value["why"].as_str().unwrap_or_default()).to_owned()
}
