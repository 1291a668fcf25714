use super::{Rank, Word};
use crate::text;
use boresight_guide::session::{Outcome, Prompt, Snapshot, ViewNumber};

/// Turns the snapshots of one session into words. It must see every snapshot: news is in one of them only.
#[derive(Clone, Debug, Default)]
pub struct Narrator {
    state: Option<Prompt>,
    last_view: Option<ViewNumber>,
}

impl Narrator {
    /// The news in `snapshot`, oldest first.
    pub fn news(&mut self, snapshot: &Snapshot) -> Vec<Word> {
        let mut news = Vec::new();
        if let Outcome::Accepted { view, .. } = snapshot.decision.outcome
            && self.last_view != Some(view)
        {
            self.last_view = Some(view);
            news.push(word(Prompt::Taken));
        }
        let prompt = snapshot.shown.prompt;
        let state = prompt.is_state().then_some(prompt);
        if state != self.state {
            news.extend(state.map(word));
            self.state = state;
        }
        news
    }

    /// What `snapshot` asks for, as long as it's shown; `None` for news.
    pub fn request(snapshot: &Snapshot) -> Option<Word> {
        let word = word(snapshot.shown.prompt);
        (!word.rank.is_news()).then_some(word)
    }
}

fn word(prompt: Prompt) -> Word {
    let rank = match prompt {
        Prompt::Taken | Prompt::Complete => Rank::Taken,
        prompt if prompt.is_state() => Rank::Lost,
        Prompt::HoldStill => Rank::Hold,
        _ => Rank::Guidance,
    };
    let mirrored = text::spoken(prompt.mirrored());
    Word { rank, text: text::spoken(prompt), mirrored }
}
