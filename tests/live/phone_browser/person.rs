//! A person who sees only the page.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::sleep,
    time::{Duration, Instant},
};

use boresight::{
    detection::Side,
    frame::{CaptureTime, FrameId},
    geometry::{Corner, Homography},
    session::{Across, Edge, Prompt, Upright},
    simulation::{
        Cues,
        technician::{Cue, CueKind, Instruction},
    },
    text,
};
use nalgebra::Point2;
use serde_json::Value;

use super::browser::Browser;

/// Contents of the page used by a person.
const SHOWN: &str = "return {
    words: el('sentence').textContent, page: shown, views: +el('views').textContent,
    frame: live && live.frame, board: live && corners(live.board),
    ghost: plan && live && live.card && plan.ghost && corners(plan.ghost.rim) };
    function corners(rim) { return rim && [0, 1, 2, 3].map(i => rim[i * rim.length / 4].slice(0, 2)); }";
/// Distance of the card's rim from the outermost inner corners, in squares.
const RIM: f64 = 1.4;

/// Cues of a person who sees only the page.
pub(super) struct PageCues {
    pub(super) judged: Arc<AtomicU64>,
    pub(super) read: Arc<Mutex<Vec<CueKind>>>,
    pub(super) now: CaptureTime,
    pub(super) interval_nanos: u64,
}

impl Cues for PageCues {
    fn wait_judged(&mut self, published: Option<FrameId>, patience: Duration) -> bool {
        let Some(published) = published else { return true };
        self.now.nanos = (published.0 + 1) * self.interval_nanos;
        let deadline = Instant::now() + patience;
        while self.judged.load(Ordering::Relaxed) <= published.0 {
            if Instant::now() > deadline {
                return false;
            }
            sleep(Duration::from_millis(1));
        }
        true
    }

    fn next_cue(&mut self) -> Option<Cue> {
        let mut read = self.read.lock().expect("no panic");
        (!read.is_empty()).then(|| Cue { seen_at: self.now, kind: read.remove(0) })
    }
}

/// Every requesting sentence, by words.
pub(super) fn prompts() -> BTreeMap<String, Prompt> {
    let edges = directions_rad().map(Edge::towards);
    let tips = edges
        .flat_map(|edge| [Prompt::Tip(edge), Prompt::TipInstead(edge), Prompt::TipFurther(edge)]);
    let across = [None, Some(Across::Left), Some(Across::Right)];
    let upright = [None, Some(Upright::Up), Some(Upright::Down)];
    let shifts = across.into_iter().flat_map(|a| upright.map(|u| Prompt::Shift(a, u)));
    let sides = [Side::Left, Side::Right, Side::Top, Side::Bottom].map(Prompt::CutOff);
    let others = [
        Prompt::ShowBoard,
        Prompt::ShowWholeFirst,
        Prompt::Closer,
        Prompt::Farther,
        Prompt::HoldStill,
        Prompt::SteadyTheBoard,
        Prompt::Blurred,
        Prompt::TipLess,
        Prompt::TipMore,
        Prompt::ToTheMiddle,
        Prompt::FollowTheOutline,
        Prompt::Clearer,
        Prompt::Contradicts,
    ];
    tips.chain(shifts)
        .chain(sides)
        .chain(others)
        .map(|prompt| (text::prompt(prompt), prompt))
        .collect()
}

fn points(value: &Value) -> Option<Vec<Point2<f64>>> {
    let point = |p: &Value| Some(Point2::new(p[0].as_f64()?, p[1].as_f64()?));
    value.as_array()?.iter().map(point).collect()
}

fn middle(points: &[Point2<f64>]) -> Point2<f64> {
    let sum = points.iter().fold(nalgebra::Vector2::zeros(), |sum, point| sum + point.coords);
    Point2::from(sum / points.len() as f64)
}

fn span(points: &[Point2<f64>]) -> f64 {
    let middle = middle(points);
    points.iter().map(|point| (point - middle).norm()).sum()
}

/// Reaction of a person to the words with board and ghost on the page.
fn instruction(prompt: Prompt, shown: &Value) -> Instruction {
    let (board, ghost) = (points(&shown["board"]), points(&shown["ghost"]));
    match prompt {
        Prompt::HoldStill | Prompt::SteadyTheBoard | Prompt::Blurred => Instruction::HoldStill,
        Prompt::ShowBoard => Instruction::ShowBoard,
        Prompt::ShowWholeFirst => Instruction::ShowWholeFirst,
        Prompt::Closer | Prompt::Farther => {
            let usual = if prompt == Prompt::Closer { 0.8 } else { 1.2 };
            let ratio = board.zip(ghost).map(|(board, ghost)| span(&board) / span(&ghost));
            let way = |ratio: &f64| (*ratio < 1.0) == (prompt == Prompt::Closer);
            Instruction::Distance { ratio: ratio.filter(way).unwrap_or(usual) }
        }
        Prompt::Shift(..) | Prompt::CutOff(_) => match board.zip(ghost) {
            Some((board, ghost)) => {
                let by = middle(&ghost) - middle(&board);
                Instruction::Shift { right_px: by.x, down_px: by.y }
            }
            None => {
                let [right, down] = prompt.shift().unwrap_or_default();
                let (right_px, down_px) = (120.0 * f64::from(right), 120.0 * f64::from(down));
                Instruction::Shift { right_px, down_px }
            }
        },
        Prompt::Tip(edge) | Prompt::TipInstead(edge) | Prompt::TipFurther(edge) => {
            let azimuth_rad = directions_rad().find(|rad| Edge::towards(*rad) == edge);
            Instruction::Tip { azimuth_rad: azimuth_rad.unwrap_or(0.0), tilt_rad: 0.65 }
        }
        _ => Instruction::MatchGhost,
    }
}

/// Directions of the edges, clockwise from the right.
fn directions_rad() -> impl Iterator<Item = f64> {
    (0..8).map(|i| f64::from(i) * std::f64::consts::FRAC_PI_4)
}

/// All inner corners of the card, from the four corners of the rim.
fn ghost_px(outer: &[Point2<f64>], columns: usize, rows: usize) -> Option<Vec<Point2<f64>>> {
    let (right, down) = ((columns - 1) as f64 + RIM, (rows - 1) as f64 + RIM);
    let board = [[-RIM, -RIM], [right, -RIM], [right, down], [-RIM, down]].map(Point2::from);
    let corners: Vec<Corner> = outer.iter().map(|px| Corner::isotropic(*px, 1.0)).collect();
    let homography = Homography::fit(&board, &corners).ok()?;
    let all = (0..rows).flat_map(|y| (0..columns).map(move |x| Point2::new(x as f64, y as f64)));
    all.map(|at| homography.map(&at)).collect()
}

/// Reads the page until the session is over.
pub(super) fn read_page(
    browser: &Browser,
    (columns, rows): (usize, usize),
    read: &Mutex<Vec<CueKind>>,
    over: &AtomicBool,
) -> Vec<(f64, String)> {
    let prompts = prompts();
    let began = Instant::now();
    let (mut words, mut views, mut ghost) = (String::new(), 0, Value::Null);
    let mut target = 0;
    let mut log = Vec::new();
    while !over.load(Ordering::Relaxed) {
        let shown = browser.run(SHOWN);
        let mut cues = Vec::new();
        let now_views = shown["views"].as_u64().unwrap_or(0);
        if now_views > views {
            cues.push(CueKind::Taken);
        }
        views = now_views;
        if shown["page"] == "result" {
            cues.push(CueKind::Finished);
        }
        // The card isn't always there.
        if !shown["ghost"].is_null() && shown["ghost"] != ghost {
            ghost = shown["ghost"].clone();
            let outer = points(&ghost).filter(|outer| outer.len() == 4);
            if let Some(ghost_px) = outer.and_then(|outer| ghost_px(&outer, columns, rows)) {
                target += 1;
                cues.push(CueKind::Show { ghost_px, target });
            }
        }
        let now_words = shown["words"].as_str().unwrap_or_default();
        if now_words != words {
            words = now_words.to_owned();
            log.push((began.elapsed().as_secs_f64(), words.clone()));
            if let Some(prompt) = prompts.get(&words) {
                let instruction = instruction(*prompt, &shown);
                let words = words.split_whitespace().count();
                cues.push(CueKind::Sentence { instruction, words });
            }
        }
        read.lock().expect("no panic").extend(cues);
        sleep(Duration::from_millis(30));
    }
    log
}
