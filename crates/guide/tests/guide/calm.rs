//! Requests to the person last long enough to be read.
//!
//! `BORESIGHT_CALM=FOLDER` measures the sessions in the folder, too, and prints a table: prompts of
//! frames, and prompts shown.

use std::path::{Path, PathBuf};

use boresight_app::window::recordings;
use boresight_geometry::frame::CaptureTime;
use boresight_guide::{
    guidance::Progress,
    session::{Across, Input, Prompt, Session, Snapshot, Upright},
};
use boresight_testkit::world::{guided, setup};

/// Prompts in the order of display, each with the time.
struct Course {
    changes: Vec<(f64, Prompt)>,
    secs: f64,
}

impl Course {
    fn of(prompts: &[(f64, Prompt)]) -> Self {
        let mut changes: Vec<(f64, Prompt)> = Vec::new();
        for (at, prompt) in prompts {
            if changes.last().is_none_or(|(_, last)| last != prompt) {
                changes.push((*at, *prompt));
            }
        }
        Self { changes, secs: prompts.last().map_or(0.0, |(at, _)| *at) }
    }

    /// Display time of each prompt but the last.
    fn dwells_secs(&self) -> Vec<f64> {
        let mut dwells: Vec<f64> =
            self.changes.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
        dwells.sort_by(f64::total_cmp);
        dwells
    }

    /// Most changes within five seconds.
    fn most_in_five_secs(&self) -> usize {
        let times: Vec<f64> = self.changes.iter().skip(1).map(|(at, _)| *at).collect();
        (0..times.len())
            .map(|i| times[i..].iter().take_while(|at| **at - times[i] < 5.0).count())
            .max()
            .unwrap_or(0)
    }

    /// Contradictory changes within three seconds: closer and farther, left and right.
    fn contradictions(&self) -> usize {
        let soon = |from: f64, to: f64| to - from < 3.0;
        (0..self.changes.len())
            .filter(|i| {
                let (at, prompt) = self.changes[*i];
                let before = &self.changes[i.saturating_sub(2)..*i];
                before.iter().any(|(then, was)| soon(*then, at) && is_contrary(*was, prompt))
            })
            .count()
    }
}

fn is_contrary(a: Prompt, b: Prompt) -> bool {
    let one_way = |a: Prompt, b: Prompt| match (a, b) {
        (Prompt::Closer, Prompt::Farther)
        | (Prompt::TipFurther(_) | Prompt::TipMore, Prompt::TipLess) => true,
        (Prompt::Shift(a_x, a_y), Prompt::Shift(b_x, b_y)) => {
            (a_x, b_x) == (Some(Across::Left), Some(Across::Right))
                || (a_y, b_y) == (Some(Upright::Up), Some(Upright::Down))
        }
        _ => false,
    };
    one_way(a, b) || one_way(b, a)
}

/// True of a movement: the prompt disappears once it's made.
fn may_be_done(prompt: Prompt) -> bool {
    matches!(
        prompt,
        Prompt::Closer
            | Prompt::Farther
            | Prompt::Shift(..)
            | Prompt::Tip(_)
            | Prompt::TipInstead(_)
            | Prompt::TipFurther(_)
            | Prompt::TipLess
    )
}

/// Prompts of frames and prompts shown, while views were taken.
fn courses(steps: &[Snapshot]) -> (Course, Course) {
    let mut first: Option<CaptureTime> = None;
    let (mut asked, mut shown) = (Vec::new(), Vec::new());
    for step in steps {
        let (Some(_), Some(live)) = (step.decision.frame, &step.live) else { continue };
        if step.decision.progress != Progress::Collecting {
            break;
        }
        let at = live.captured_at.secs_since(*first.get_or_insert(live.captured_at));
        let miss = live.corners_px.as_ref().err();
        asked.push((at, Prompt::of_decision(&step.decision, miss)));
        shown.push((at, step.shown.prompt));
    }
    (Course::of(&asked), Course::of(&shown))
}

#[test]
fn what_is_shown_can_be_read() {
    for seed in 1..4 {
        let (world, ..) = guided(seed, |_, _| ());
        let mut session = Session::new(setup(world.board));
        let mut steps = Vec::new();
        guided(seed, |input: &Input, _| {
            let decision = session.handle(input);
            steps.push(session.snapshot(decision));
        });
        let (asked, shown) = courses(&steps);
        assert!(shown.changes.len() <= asked.changes.len(), "seed {seed}");
        assert!(shown.most_in_five_secs() <= 7, "seed {seed}: {:?}", shown.changes);
        for pair in shown.changes.windows(3) {
            let [(from, before), (to, prompt), _] = pair else { unreachable!("three") };
            let at_once = matches!(prompt, Prompt::HoldStill | Prompt::Taken);
            assert!(at_once || may_be_done(*before) || to - from > 1.19, "seed {seed}: {pair:?}");
        }
    }
}

#[test]
fn sessions_are_measured() {
    let Some(folder) = std::env::var_os("BORESIGHT_CALM") else { return };
    let mut sessions: Vec<PathBuf> = std::fs::read_dir(Path::new(&folder))
        .expect("a folder")
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.join("session.toml").exists())
        .collect();
    sessions.sort();
    println!(
        "{:<28} {:>6} {:>5} | asked: {:>5} {:>6} {:>5} | shown: {:>5} {:>6} {:>6} {:>5} {:>6}",
        "session",
        "secs",
        "views",
        "per s",
        "median",
        "in 5s",
        "per s",
        "median",
        "least",
        "in 5s",
        "contra"
    );
    let mut total = (0.0, 0, 0, 0, 0, 0);
    for path in &sessions {
        let steps = recordings::open(path).expect("a session").steps;
        let views = steps.last().map_or(0, |step| step.views.len());
        let (asked, shown) = courses(&steps);
        let median = |dwells: &[f64]| dwells.get(dwells.len() / 2).copied().unwrap_or(f64::NAN);
        let per_sec = |course: &Course| (course.changes.len() - 1) as f64 / course.secs.max(1e-9);
        let (before, after) = (asked.dwells_secs(), shown.dwells_secs());
        println!(
            "{:<28} {:>6.1} {views:>5} |        {:>5.2} {:>6.2} {:>5} |        {:>5.2} {:>6.2} {:>6.2} {:>5} {:>6}",
            path.file_name().unwrap_or_default().to_string_lossy(),
            shown.secs,
            per_sec(&asked),
            median(&before),
            asked.most_in_five_secs(),
            per_sec(&shown),
            median(&after),
            after.first().copied().unwrap_or(f64::NAN),
            shown.most_in_five_secs(),
            shown.contradictions(),
        );
        total.0 += shown.secs;
        total.1 += asked.changes.len() - 1;
        total.2 += shown.changes.len() - 1;
        total.3 = total.3.max(asked.most_in_five_secs());
        total.4 = total.4.max(shown.most_in_five_secs());
        total.5 += shown.contradictions();
    }
    println!(
        "{} sessions, {:.0} s: asked {:.2} changes/s, at most {} in 5 s; shown {:.2} changes/s, at most {} in 5 s, {} contradictions",
        sessions.len(),
        total.0,
        f64::from(u32::try_from(total.1).expect("small")) / total.0,
        total.3,
        f64::from(u32::try_from(total.2).expect("small")) / total.0,
        total.4,
        total.5
    );
}
