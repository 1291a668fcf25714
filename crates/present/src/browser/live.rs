//! A session as the page's JSON: a part that changes with every frame, and a part that changes with
//! a view.

use std::sync::Arc;

use serde::Serialize;

use super::{ValidMap, teller::kind};
use crate::{
    ghost::Card,
    instruction::{Instruction, Moment, Movement},
    known::Known,
    speech::{Narrator, Rank, Word},
    text::{self, Trouble, window as words},
};
use boresight_guide::{
    guidance::Refusal,
    session::{Gravity, Snapshot, ViewNumber},
};

/// Fields that change with every frame.
#[derive(Clone, Debug, Serialize)]
pub struct Live {
    /// `waiting`, `starting`, `guiding`, `adjusting`, `ending` or `ended`.
    pub stage: &'static str,
    /// Frame number.
    pub frame: Option<u64>,
    /// Sentence, and the mirrored form with left and right exchanged.
    pub sentence: [String; 2],
    /// Gravity of the sentence.
    pub tone: Gravity,
    /// Elapsed share of the hold, 0 to 1.
    pub hold: Option<f64>,
    /// Current moment of the session.
    pub moment: Option<Moment>,
    /// Sign of the requested movement, plain and mirrored.
    pub sign: [Option<Movement>; 2],
    /// True if the card is shown.
    pub card: bool,
    /// Closeness of the board to the card, 0 to 1.
    pub close: Option<f32>,
    /// Points around the board with nearness, in the picture's pixels, if the outline is shown.
    pub board: Option<Vec<[f64; 3]>>,
    /// Number of views.
    pub views: usize,
    /// Number of the newest view, from 1; 0 without views.
    pub taken: u32,
    /// True if the pictures are rendered.
    pub simulated: bool,
    /// True if paused.
    pub paused: bool,
    /// Trouble and next action.
    pub trouble: Option<(String, String)>,
    /// Doubt that still permits taking views, and the next action.
    pub doubt: Option<(String, String)>,
    /// Words to say while the state lasts.
    pub say: Option<Word>,
    /// Newest view that can be restored.
    pub removed: Option<u32>,
    /// Name of the camera on show, if several are led to common places.
    pub led: Option<String>,
}

/// Request to a person in front of several cameras, beside the state of the one on show.
#[derive(Clone, Debug)]
pub struct Led {
    /// Name of the camera on show.
    pub camera: String,
    /// Request, and the mirrored form with left and right exchanged.
    pub sentence: [String; 2],
    /// Gravity of the request.
    pub gravity: Gravity,
    /// Words to say while the state lasts have this rank; `None` to say nothing.
    pub rank: Option<Rank>,
    /// Elapsed share of the board's rest, 0 to 1.
    pub rest: Option<f64>,
    /// Number of places taken.
    pub places: u32,
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
    /// Reasons for refusing frames, with shares in per cent.
    refused: Vec<(String, u64)>,
    /// Points on the edges expected from a watched camera.
    outline: Vec<[i32; 2]>,
    /// Map of the area valid so far.
    map: Option<ValidMap>,
}

/// Source of a plan. Equal sources give equal plans, and most frames leave the source unchanged.
#[derive(Clone, Debug)]
pub struct PlanSource {
    /// Newest state.
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

/// Card, in the picture's pixels.
#[derive(Clone, Debug, Serialize)]
struct Ghost {
    /// Points around the card with nearness.
    rim: Vec<[f64; 3]>,
    /// Squares of the board: columns, rows.
    squares: [usize; 2],
}

#[derive(Clone, Debug, Serialize)]
struct View {
    number: u32,
    /// Display name.
    name: String,
    /// Edge tipped away, plain and mirrored.
    edge: [String; 2],
    direction_rad: f64,
    partner: Option<String>,
}

#[derive(Clone, Debug, Serialize)]
struct Slot {
    slot_rad: f64,
    view: Option<String>,
    wanted: bool,
}

/// View number as shown, from 1.
pub fn counted(view: ViewNumber) -> u32 {
    view.0.saturating_add(1)
}

impl Live {
    /// State before the first frame.
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
            close: None,
            board: None,
            views: 0,
            taken: 0,
            simulated,
            paused: false,
            trouble: None,
            doubt: None,
            say: None,
            removed: None,
            led: None,
        }
    }

    /// State of `snapshot` at `stage`.
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
            close: now.close.map(|close| (close * 1e3).round() / 1e3),
            board: now.board.as_ref().and_then(rim),
            views: snapshot.views.len(),
            taken: snapshot.views.iter().map(|view| counted(view.number)).max().unwrap_or(0),
            paused: snapshot.paused,
            trouble: first(troubles),
            doubt: first(doubts),
            say: Narrator::request(&now).filter(|_| stage == "guiding"),
            removed: snapshot.removed.map(|number| number.0),
            ..Self::empty(stage, simulated)
        }
    }

    /// The same with the request of `led` in place of the camera's own.
    #[must_use]
    pub fn led(self, led: &Led) -> Self {
        let [text, mirrored] = led.sentence.clone();
        let rests = led.rest.is_some();
        Self {
            say: led.rank.map(|rank| Word { rank, text, mirrored }),
            sentence: led.sentence.clone(),
            tone: led.gravity,
            hold: led.rest.map(|rest| round(rest, 100.0)),
            card: self.card && !rests,
            close: self.close.filter(|_| !rests),
            views: led.places as usize,
            taken: led.places,
            removed: None,
            led: Some(led.camera.clone()),
            ..self
        }
    }
}

/// Most important of `troubles`, with the device's words.
fn first(troubles: Vec<Trouble>) -> Option<(String, String)> {
    let Trouble { what, action, detail, .. } = troubles.into_iter().next()?;
    let what = if detail.is_empty() { what } else { format!("{what} ({detail})") };
    Some((what, action))
}

impl Plan {
    /// Plan of a watched camera: its picture size, and points on the expected edges.
    #[must_use]
    pub fn of_edges(size: [u32; 2], outline: Vec<[i32; 2]>) -> Self {
        Self { size, outline, ..Self::default() }
    }

    /// Plan of a session.
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
                    edge: [false, true].map(|m| words::part_away(view.tilt_azimuth_rad, m)),
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
            map: snapshot
                .calibration
                .as_deref()
                .and_then(|calibration| ValidMap::of(calibration, &Known::of(snapshot)?)),
        }
    }
}

impl Plan {
    /// The same without the camera's own views, which are places of several cameras.
    #[must_use]
    pub fn led(self) -> Self {
        let Self { size, ghost, map, .. } = self;
        Self { size, ghost, map, ..Self::default() }
    }
}

fn ghost(snapshot: &Snapshot) -> Option<Ghost> {
    let target = snapshot.target.as_ref()?;
    let board = &snapshot.setup.board;
    let card = Card::new(&target.ghost_px, board, &snapshot.lens)?;
    Some(Ghost { rim: rim(&card)?, squares: board.target().grid().map(|count| count + 1) })
}

fn rim(card: &Card) -> Option<Vec<[f64; 3]>> {
    let rim = card.rim()?.into_iter();
    let rim =
        rim.map(|(px, near)| [round(px.x, 10.0), round(px.y, 10.0), round(f64::from(near), 100.0)]);
    Some(rim.collect())
}

fn round(value: f64, steps: f64) -> f64 {
    if value.is_finite() { (value * steps).round() / steps } else { 0.0 }
}
