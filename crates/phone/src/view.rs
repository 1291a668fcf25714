//! A session as the page's JSON: a part that changes with every frame, and a part that changes with a view.

use nalgebra::Point2;
use serde::Serialize;

use super::hub::{AdjustPage, Hub, Offer, Stage, State};
use boresight_guide::{
    guidance::Refusal,
    session::{Gravity, Outcome, Snapshot, ViewNumber},
};
use boresight_present::{
    ghost::Card,
    instruction::{Instruction, Moment},
    speech::{Narrator, Rank, Word},
    text::{self, Trouble, report::refusal_kind, window as words},
};

/// Reasons for refusing frames that the page lists.
const MOST_REASONS: usize = 6;

/// Fields that change with every frame.
#[derive(Serialize)]
pub(super) struct Live<'a> {
    stage: &'static str,
    /// Number of the frame that this is about.
    frame: Option<u64>,
    /// The sentence, and the same with left and right exchanged.
    sentence: [String; 2],
    tone: Gravity,
    /// Share of the hold that has passed, 0 to 1.
    hold: Option<f64>,
    /// What the session is about now.
    moment: Option<Moment>,
    /// True if the card is shown.
    card: bool,
    /// Closeness of the board to the card, 0 to 1.
    close: Option<f32>,
    /// Points around the board, in the picture's pixels, if its outline is shown.
    board: Option<Vec<[f64; 2]>>,
    /// Direction in which the board recedes.
    away_rad: Option<f64>,
    views: usize,
    /// Number of the view taken last, from 1; 0 without one.
    taken: u32,
    /// True if the pictures are rendered.
    simulated: bool,
    to_go: Option<usize>,
    paused: bool,
    /// Why the newest frame wasn't taken.
    reason: Option<String>,
    /// The trouble and the next action.
    trouble: Option<(String, String)>,
    /// Words to say while the state lasts.
    say: Option<Say<'a>>,
    /// The newest view that can be restored.
    removed: Option<u32>,
    /// Choices for a new session.
    offer: Option<&'a Offer>,
    /// Where to push a watched camera, the same for a person who faces it, and how far.
    push: Option<([&'static str; 2], &'a str)>,
}

/// Something to say.
#[derive(Serialize)]
pub(super) struct Say<'a> {
    rank: Rank,
    text: std::borrow::Cow<'a, str>,
    mirrored: std::borrow::Cow<'a, str>,
}

impl<'a> Say<'a> {
    pub(super) fn of(word: &'a Word) -> Self {
        Self { rank: word.rank, text: (&word.text).into(), mirrored: (&word.mirrored).into() }
    }

    fn owned(word: Word) -> Self {
        Self { rank: word.rank, text: word.text.into(), mirrored: word.mirrored.into() }
    }
}

/// Fields that change with a view.
#[derive(Default, Serialize)]
pub(super) struct Plan {
    size: [u32; 2],
    ghost: Option<Ghost>,
    views: Vec<View>,
    wheel: Vec<Slot>,
    /// Directions of opposed views.
    pairs: Vec<[f64; 2]>,
    refused: Vec<(String, u64)>,
    /// Points on edges where a watched camera should show them.
    outline: Vec<[i32; 2]>,
}

/// The card, in the picture's pixels.
#[derive(Serialize)]
struct Ghost {
    /// Points around it and their nearness.
    rim: Vec<[f64; 3]>,
}

#[derive(Serialize)]
struct View {
    number: u32,
    /// Name for people.
    name: String,
    /// The edge that was away, and the same mirrored.
    edge: [&'static str; 2],
    direction_rad: f64,
    partner: Option<String>,
}

#[derive(Serialize)]
struct Slot {
    slot_rad: f64,
    view: Option<String>,
    wanted: bool,
}

/// Number of a view as people count, from 1.
pub(super) fn counted(view: ViewNumber) -> u32 {
    view.0.saturating_add(1)
}

/// The live part.
pub(super) fn live(state: &State) -> Live<'_> {
    let stage = match state.stage {
        Stage::Waiting(_) => "waiting",
        Stage::Starting => "starting",
        Stage::Guiding => "guiding",
        Stage::Adjusting(_) => "adjusting",
        Stage::Ending => "ending",
        Stage::Ended(_) => "ended",
    };
    let empty = Live {
        stage,
        frame: None,
        sentence: [words::STARTING.into(), words::STARTING.into()],
        tone: Gravity::Plain,
        hold: None,
        moment: None,
        card: false,
        close: None,
        board: None,
        away_rad: None,
        views: 0,
        taken: 0,
        simulated: state.simulated,
        to_go: None,
        paused: false,
        reason: None,
        trouble: None,
        say: None,
        removed: None,
        offer: match &state.stage {
            Stage::Waiting(offer) => Some(offer),
            _ => None,
        },
        push: None,
    };
    if let Stage::Adjusting(page) = &state.stage {
        return Live {
            sentence: page.sentence.clone(),
            tone: page.gravity,
            close: page.close.map(|close| round(close, 1e3) as f32),
            say: page.aloud.as_ref().map(Say::of),
            push: Some((page.arrow, &page.number)),
            ..empty
        };
    }
    let Some(snapshot) = &state.snapshot else { return empty };
    let guiding = matches!(state.stage, Stage::Guiding);
    let seen = snapshot.live.as_ref();
    let now = Instruction::of(snapshot);
    Live {
        frame: seen.map(|live| live.frame_id.0),
        sentence: match state.stage {
            Stage::Ending => [words::ENDING.into(), words::ENDING.into()],
            _ => [now.sentence(false), now.sentence(true)],
        },
        tone: now.gravity(),
        hold: now.hold.map(|hold| round(hold, 100.0)),
        moment: Some(now.moment),
        card: now.card.is_some(),
        close: now.close.map(|close| (close * 1e3).round() / 1e3),
        board: now
            .board
            .as_ref()
            .and_then(Card::rim)
            .map(|rim| rim.iter().map(|(px, _)| xy(px)).collect()),
        away_rad: seen
            .and_then(|live| live.measured.as_ref())
            .map(|measured| round(measured.tilt_azimuth_rad, 1e3)),
        views: snapshot.views.len(),
        taken: snapshot.views.iter().map(|view| counted(view.number)).max().unwrap_or(0),
        to_go: snapshot.views_to_go,
        paused: snapshot.paused,
        reason: match &snapshot.decision.outcome {
            Outcome::Refused { refusal } if *refusal != Refusal::NotFound => {
                Some(text::refusal(refusal))
            }
            _ => None,
        },
        trouble: trouble(snapshot),
        say: Narrator::request(&now).filter(|_| guiding).map(Say::owned),
        removed: snapshot.removed.map(|number| number.0),
        ..empty
    }
}

/// The most important trouble, with the device's words.
fn trouble(snapshot: &Snapshot) -> Option<(String, String)> {
    let Trouble { what, action, detail, .. } = text::troubles(snapshot).into_iter().next()?;
    let what = if detail.is_empty() { what } else { format!("{what} ({detail})") };
    Some((what, action))
}

/// The part that changes with a view, or the edges of a watched camera; `None` before the first frame.
pub(super) fn plan(state: &State, hub: &Hub) -> Option<Plan> {
    if let Stage::Adjusting(page) = &state.stage {
        let AdjustPage { image_size_px: size, ref outline, .. } = **page;
        return Some(Plan { size, outline: outline.clone(), ..Plan::default() });
    }
    let snapshot = state.snapshot.as_ref()?;
    let size = snapshot.setup.image_size;
    let name = |index: usize| Some(snapshot.views.get(index)?.number.to_string());
    let refused = hub.refused().into_iter().take(MOST_REASONS);
    Some(Plan {
        size: [size.width_px, size.height_px],
        ghost: ghost(snapshot),
        views: snapshot
            .views
            .iter()
            .map(|view| View {
                number: view.number.0,
                name: view.number.to_string(),
                edge: [false, true].map(|m| words::direction_name(view.tilt_azimuth_rad, m)),
                direction_rad: round(view.tilt_azimuth_rad, 1e3),
                partner: view.partner.map(|partner| partner.to_string()),
            })
            .collect(),
        wheel: snapshot
            .wheel()
            .iter()
            .map(|slot| Slot {
                slot_rad: round(slot.slot_rad, 1e3),
                view: slot.view.and_then(name),
                wanted: slot.wanted,
            })
            .collect(),
        pairs: snapshot
            .pairs
            .iter()
            .filter_map(|pair| {
                let direction =
                    |at: usize| Some(round(snapshot.views.get(at)?.tilt_azimuth_rad, 1e3));
                Some([direction(pair.first)?, direction(pair.second)?])
            })
            .collect(),
        refused: refused.map(|(refusal, count)| (kind(&refusal), count)).collect(),
        outline: Vec::new(),
    })
}

/// The kind of a refusal, without its numbers.
fn kind(refusal: &Refusal) -> String {
    let value = serde_json::to_value(refusal).unwrap_or_default();
    refusal_kind(value["why"].as_str().unwrap_or_default()).to_owned()
}

fn ghost(snapshot: &Snapshot) -> Option<Ghost> {
    let target = snapshot.target.as_ref()?;
    let card = Card::new(&target.ghost_px, &snapshot.setup.board, &snapshot.lens)?;
    let rim = card.rim()?.into_iter().map(|(px, near)| {
        let [x, y] = xy(&px);
        [x, y, round(f64::from(near), 100.0)]
    });
    Some(Ghost { rim: rim.collect() })
}

fn xy(px: &Point2<f64>) -> [f64; 2] {
    [round(px.x, 10.0), round(px.y, 10.0)]
}

fn round(value: f64, steps: f64) -> f64 {
    if value.is_finite() { (value * steps).round() / steps } else { 0.0 }
}
