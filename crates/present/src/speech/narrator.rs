use super::{Rank, Word};
use crate::{instruction::Instruction, text};
use boresight_guide::session::{Prompt, ViewNumber};

/// Turns the instructions of a session into words. Must get every instruction: each piece of news
/// is in only one of them.
#[derive(Clone, Debug, Default)]
pub struct Narrator {
    state: Option<Prompt>,
    last_view: Option<ViewNumber>,
}

impl Narrator {
    /// News in `now`, oldest first.
    pub fn news(&mut self, now: &Instruction) -> Vec<Word> {
        let mut news = Vec::new();
        if let Some(view) = now.taken
            && self.last_view != Some(view)
        {
            self.last_view = Some(view);
            news.push(taken());
        }
        let state = Some(now.prompt(false)).filter(|prompt| prompt.is_state());
        news.extend(self.change_to(state.map(|prompt| (prompt, Self::word(now)))));
        news
    }

    /// News of `state`, or of the end of the previous state; `None` without a change.
    fn change_to(&mut self, state: Option<(Prompt, Word)>) -> Option<Word> {
        let (prompt, word) = state.unzip();
        let before = std::mem::replace(&mut self.state, prompt);
        if prompt == before { None } else { word.or_else(|| before.map(back)) }
    }

    /// Words of `now`, news or not.
    pub fn word(now: &Instruction) -> Word {
        let [prompt, mirrored] = [false, true].map(|mirrored| now.prompt(mirrored));
        let rank = match prompt {
            Prompt::Taken | Prompt::Complete => Rank::Taken,
            prompt if prompt.is_state() => Rank::Lost,
            Prompt::HoldStill => Rank::Hold,
            _ => Rank::Guidance,
        };
        Word { rank, text: text::spoken(prompt), mirrored: text::spoken(mirrored) }
    }

    /// Request of `now`, valid while shown; `None` for news.
    pub fn request(now: &Instruction) -> Option<Word> {
        let word = Self::word(now);
        (!word.rank.is_news()).then_some(word)
    }
}

/// News of a view taken, independent of the current instruction.
fn taken() -> Word {
    let text = text::spoken(Prompt::Taken);
    Word { rank: Rank::Taken, mirrored: text.clone(), text }
}

/// News of the end of `ended`.
fn back(ended: Prompt) -> Word {
    let text = text::spoken_after(ended).to_owned();
    Word { rank: Rank::Back, mirrored: text.clone(), text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn that_the_camera_is_back_is_news() {
        let mut narrator = Narrator::default();
        let lost = || {
            let text = text::spoken(Prompt::CameraLost);
            (Prompt::CameraLost, Word { rank: Rank::Lost, mirrored: text.clone(), text })
        };
        let mut said = |state| narrator.change_to(state).map(|word| (word.rank, word.text));
        assert_eq!(said(None), None);
        assert_eq!(said(Some(lost())), Some((Rank::Lost, "Camera lost".into())));
        assert_eq!(said(Some(lost())), None);
        assert_eq!(said(None), Some((Rank::Back, "The camera is back".into())));
        assert_eq!(said(None), None);
    }
}
