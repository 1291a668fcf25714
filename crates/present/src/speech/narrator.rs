use super::{Rank, Word};
use crate::text;
use boresight_guide::session::{Outcome, Prompt, Snapshot, ViewNumber};

/// Turns the snapshots of one session into words. It must get every snapshot: each piece of news is in only one of
/// them.
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
        news.extend(self.change_to(prompt.is_state().then_some(prompt)));
        news
    }

    /// The news of `state`, or that the one before is over; `None` without a change.
    fn change_to(&mut self, state: Option<Prompt>) -> Option<Word> {
        let before = std::mem::replace(&mut self.state, state);
        if state == before { None } else { state.map(word).or_else(|| before.map(back)) }
    }

    /// The request of `snapshot`, valid as long as it's shown; `None` for news.
    pub fn request(snapshot: &Snapshot) -> Option<Word> {
        let word = word(snapshot.shown.prompt);
        (!word.rank.is_news()).then_some(word)
    }
}

/// The news that `ended` holds no longer.
fn back(ended: Prompt) -> Word {
    let text = text::spoken_after(ended).to_owned();
    Word { rank: Rank::Back, mirrored: text.clone(), text }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn that_the_camera_is_back_is_news() {
        let mut narrator = Narrator::default();
        let mut said = |state| narrator.change_to(state).map(|word| (word.rank, word.text));
        assert_eq!(said(None), None);
        assert_eq!(said(Some(Prompt::CameraLost)), Some((Rank::Lost, "Camera lost".into())));
        assert_eq!(said(Some(Prompt::CameraLost)), None);
        assert_eq!(said(None), Some((Rank::Back, "The camera is back".into())));
        assert_eq!(said(None), None);
    }
}
