//! A session as the page's JSON: a part that changes with every frame, and a part that changes with a view.

use std::sync::Arc;

use nalgebra::Point2;
use serde::Serialize;

use super::{ValidMap, teller::kind};
use crate::{
    ghost::Card,
    instruction::{Instruction, Moment, Movement},
    speech::{Narrator, Word},
    text::{self, Trouble, window as words},
};
use boresight_guide::{
    guidance::Refusal,
    session::{Gravity, Outcome, Snapshot, ViewNumber},
};

/// Fields that change with every frame.
#[derive(Clone, Debug, Serialize)]
pub struct Live {
    /// `waiting`, `starting`, `guiding`, `adjusting`, `ending` or `ended`.
    pub stage: &'static str,
    /// Number of the frame that this is about.
    pub frame: Option<u64>,
    /// The sentence, and the same with left and right exchanged.
    pub sentence: [String; 2],
    /// How grave the sentence is.
    pub tone: Gravity,
    /// Share of the hold that has passed, 0 to 1.
    pub hold: Option<f64>,
    /// What the session is about now.
    pub moment: Option<Moment>,
    /// Sign of the movement that the sentence asks for, and the same with left and right exchanged.
    pub sign: [Option<Movement>; 2],
    /// True if the card is shown.
    pub card: bool,
    /// True if so much of it lies outside the picture that it's shown beside the board, small and whole.
    pub beside: bool,
    /// Closeness of the board to the card, 0 to 1.
    pub close: Option<f32>,
    /// Points around the board, in the picture's pixels, if its outline is shown.
    pub board: Option<Vec<[f64; 2]>>,
    /// Direction in which the board recedes.
    pub away_rad: Option<f64>,
    /// Number of views.
    pub views: usize,
    /// Number of the view taken last, from 1; 0 without one.
    pub taken: u32,
    /// True if the pictures are rendered.
    pub simulated: bool,
    /// Views still to take, as far as that can be told.
    pub to_go: Option<usize>,
    /// True if the person paused.
    pub paused: bool,
    /// Why the newest frame wasn't taken.
    pub reason: Option<String>,
    /// The trouble and the next action.
    pub trouble: Option<(String, String)>,
    /// A doubt, with which views are taken all the same, and the next action.
    pub doubt: Option<(String, String)>,
    /// Words to say while the state lasts.
    pub say: Option<Word>,
    /// The newest view that can be restored.
    pub removed: Option<u32>,
}

/// Fields that change with a view.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Plan {
    size: [u32; 2],
    ghost: Option<Ghost>,
    views: Vec<View>,
    wheel: Vec<Slot>,
    /// Directions of opposed views.
    pairs: Vec<[f64; 2]>,
    /// Reasons for refusing frames, with their shares in per cent.
    refused: Vec<(String, u64)>,
    /// Points on edges where a watched camera should show them.
    outline: Vec<[i32; 2]>,
    /// Where the picture is known well enough so far.
    map: Option<ValidMap>,
}

/// What a plan shows: plans of equal sources are equal, and most frames change nothing of it.
#[derive(Clone, Debug)]
pub struct PlanSource {
    /// The newest state.
    pub snapshot: Arc<Snapshot>,
    /// See [`Teller::refused`](super::Teller::refused).
    pub refused: Vec<(Refusal, u64)>,
}

impl PartialEq for PlanSource {
    fn eq(&self, other: &Self) -> bool {
        let (a, b) = (&self.snapshot, &other.snapshot);
        let calibrations = [a, b].map(|it| it.calibration.as_ref().map(Arc::as_ptr));
        calibrations[0] == calibrations[1]
            && Arc::ptr_eq(&a.views, &b.views)
            && (&a.target, &a.lens) == (&b.target, &b.lens)
            && self.refused == other.refused
    }
}

/// The card, in the picture's pixels.
#[derive(Clone, Debug, Serialize)]
struct Ghost {
    /// Points around it and their nearness.
    rim: Vec<[f64; 3]>,
}

#[derive(Clone, Debug, Serialize)]
struct View {
    number: u32,
    /// Name for people.
    name: String,
    /// The edge that was away, and the same mirrored.
    edge: [&'static str; 2],
    direction_rad: f64,
    partner: Option<String>,
}

#[derive(Clone, Debug, Serialize)]
struct Slot {
    slot_rad: f64,
    view: Option<String>,
    wanted: bool,
}

/// Number of a view as people count, from 1.
pub fn counted(view: ViewNumber) -> u32 {
    view.0.saturating_add(1)
}

impl Live {
    /// Before the first frame.
    pub fn empty(stage: &'static str, simulated: bool) -> Self {
        Self {
            stage,
            frame: None,
            sentence: [words::STARTING.into(), words::STARTING.into()],
            tone: Gravity::Plain,
            hold: None,
            moment: None,
            sign: [None, None],
            card: false,
            beside: false,
            close: None,
            board: None,
            away_rad: None,
            views: 0,
            taken: 0,
            simulated,
            to_go: None,
            paused: false,
            reason: None,
            trouble: None,
            doubt: None,
            say: None,
            removed: None,
        }
    }

    /// What `snapshot` shows at that stage.
    pub fn of(snapshot: &Snapshot, stage: &'static str, simulated: bool) -> Self {
        let seen = snapshot.live.as_ref();
        let now = Instruction::of(snapshot);
        let (doubts, troubles): (Vec<_>, Vec<_>) =
            text::troubles(snapshot).into_iter().partition(|trouble| trouble.is_doubt);
        Self {
            frame: seen.map(|live| live.frame_id.0),
            sentence: match stage {
                "ending" => [words::ENDING.into(), words::ENDING.into()],
                _ => [now.sentence(false), now.sentence(true)],
            },
            tone: now.gravity(),
            hold: now.hold.map(|hold| round(hold, 100.0)),
            moment: Some(now.moment),
            sign: [now.movement(false), now.movement(true)],
            card: now.card.is_some(),
            beside: now.card.as_ref().is_some_and(|it| it.lies_outside(snapshot.setup.image_size)),
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
                // "Got it!" is about the view, not about the frames after it.
                _ if now.moment == Moment::Taken => None,
                Outcome::Refused { refusal } if *refusal != Refusal::NotFound => {
                    Some(text::refusal(refusal))
                }
                _ => None,
            },
            trouble: first(troubles),
            doubt: first(doubts),
            say: Narrator::request(&now).filter(|_| stage == "guiding"),
            removed: snapshot.removed.map(|number| number.0),
            ..Self::empty(stage, simulated)
        }
    }
}

/// The most important of `troubles`, with the device's words.
fn first(troubles: Vec<Trouble>) -> Option<(String, String)> {
    let Trouble { what, action, detail, .. } = troubles.into_iter().next()?;
    let what = if detail.is_empty() { what } else { format!("{what} ({detail})") };
    Some((what, action))
}

impl Plan {
    /// Of a watched camera: the size of its picture, and points on the edges that it should show.
    #[must_use]
    pub fn of_edges(size: [u32; 2], outline: Vec<[i32; 2]>) -> Self {
        Self { size, outline, ..Self::default() }
    }

    /// The plan of a session.
    pub fn of(PlanSource { snapshot, refused }: &PlanSource) -> Self {
        let size = snapshot.setup.image_size;
        let name = |index: usize| Some(snapshot.views.get(index)?.number.to_string());
        let direction = |at: usize| Some(round(snapshot.views.get(at)?.tilt_azimuth_rad, 1e3));
        Self {
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
                .filter_map(|pair| Some([direction(pair.first)?, direction(pair.second)?]))
                .collect(),
            refused: refused.iter().map(|(refusal, share)| (kind(refusal), *share)).collect(),
            outline: Vec::new(),
            map: snapshot.calibration.as_deref().and_then(ValidMap::of),
        }
    }
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
