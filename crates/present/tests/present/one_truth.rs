//! The surfaces of one result, read as text: card, verdict, map, ending, terminal with its exit
//! code, phone, report and certificate, the PDF, and the engineer's lines. None contradicts
//! another.
//!
//! `BORESIGHT_SESSIONS=400 cargo test -p boresight-present one_truth -- --nocapture` runs 400
//! sessions.

use std::{
    convert::Infallible,
    sync::{Arc, Mutex},
};

use boresight_app::{
    Announcer, Exit,
    session::{result::conclude, session_report},
};
use boresight_calibrate::{AcceptanceGoal, Calibration};
use boresight_guide::session::{Command, Decision, Input, Session};
use boresight_present::{
    browser::EndedPage,
    grade::Grade,
    known::Known,
    report::{certificate_pdf, page},
    result_card::ResultCard,
    text,
};
use boresight_run::{config::Config, recording::Header};
use boresight_testkit::{
    asked_for,
    world::{SIZE, World, setup},
};
use nalgebra::{UnitQuaternion, Vector3};

/// Sessions of each kind without a wish for more.
const USUAL: u64 = 2;

/// What is wrong in a session.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Flaw {
    None,
    Noise,
    FocusMoved,
    BoardBent,
    RollingShutter,
    FewViews(usize),
    OneDirection,
    EndedEarly,
    GoalPx(f64),
    GoalMm(f64),
    OwnTypicalGoal(f64),
}

const FLAWS: [Flaw; 16] = [
    Flaw::None,
    Flaw::Noise,
    Flaw::FocusMoved,
    Flaw::BoardBent,
    Flaw::RollingShutter,
    Flaw::FewViews(1),
    Flaw::FewViews(2),
    Flaw::FewViews(3),
    Flaw::OneDirection,
    Flaw::EndedEarly,
    Flaw::GoalPx(0.5),
    Flaw::GoalPx(0.02),
    Flaw::GoalMm(2.0),
    Flaw::GoalMm(0.05),
    Flaw::OwnTypicalGoal(0.05),
    Flaw::OwnTypicalGoal(1.2),
];

/// A finished session with `flaw`, its last decision, and its settings.
fn session(flaw: Flaw, seed: u64) -> (Session, Decision, Config) {
    let mut world = World::new(seed);
    let mut config = Config::load(None, &[]).expect("the usual settings");
    match flaw {
        Flaw::Noise => world.noise_px = [0.3, 0.8, 2.0][seed as usize % 3],
        Flaw::FocusMoved => world.focus_sd = [0.003, 0.01, 0.03][seed as usize % 3],
        Flaw::BoardBent => world.bent_by_m = [0.001, 0.003, 0.01][seed as usize % 3],
        _ => {}
    }
    if let Flaw::OwnTypicalGoal(goal_px) = flaw {
        config.guidance.stop_projection_sigma_px = goal_px;
    }
    let mut setup = setup(world.board);
    setup.guidance.stop_projection_sigma_px = config.guidance.stop_projection_sigma_px;
    setup.calibration.accept = match flaw {
        Flaw::GoalPx(px) => Some(AcceptanceGoal::Projection { px }),
        Flaw::GoalMm(mm) => {
            Some(AcceptanceGoal::Length { length_m: 0.8, at_m: 2.0, within_m: 1e-3 * mm })
        }
        _ => None,
    };
    let most = match flaw {
        Flaw::FewViews(count) => count,
        Flaw::OneDirection => 5,
        Flaw::EndedEarly => 4 + (seed % 3) as usize,
        _ => 14,
    };
    let mut session = Session::new(setup);
    let slant = if flaw == Flaw::RollingShutter { 0.02 } else { 0.0 };
    for attempt in 0..60 {
        let Some(target) = session.target().cloned() else { break };
        if session.accepted().len() >= most {
            break;
        }
        let Some(pose) = world.pose_for(&target.ghost_px, 0.7_f64.powi(attempt % 6)) else {
            continue;
        };
        let pose = if flaw == Flaw::OneDirection {
            let mut pose = pose;
            pose.rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.6, 0.0, 0.0));
            session.handle(&Input::Command(Command::ForceNext));
            pose
        } else {
            pose
        };
        if let Some(whole) = world.whole_first(&target) {
            session.handle(&Input::Observed(whole));
        }
        let accepted = session.accepted().len();
        // The board's speed over the rows.
        let way = slant * f64::from(attempt % 3 - 1);
        for _ in 0..24 {
            let mut observed = world.observe(&pose);
            for corner in observed.seen.iter_mut().flat_map(|seen| &mut seen.corners) {
                corner.px.x += way * (corner.px.y - 360.0);
            }
            session.handle(&Input::Observed(observed));
            if session.accepted().len() > accepted {
                break;
            }
        }
    }
    session.handle(&Input::SourceEnded);
    let decision = session.handle(&Input::Stop);
    (session, decision, config)
}

/// Everything that is shown of one result.
struct Shown {
    card: ResultCard,
    map: Option<Known>,
    exit: Exit,
    /// Name and text of each surface.
    said: Vec<(&'static str, String)>,
}

fn shown(
    session: &Session,
    decision: Decision,
    config: Config,
) -> Option<(Arc<Calibration>, Shown)> {
    let calibration = Arc::clone(session.calibration()?);
    let header = Header::new("pipe:camera", SIZE, config);
    let snapshot = session.snapshot(decision);
    let card = ResultCard::of(&snapshot)?;
    let lines = Arc::new(Mutex::new(Vec::new()));
    let teller = Arc::clone(&lines);
    let announcer =
        Announcer::new(move |line| teller.lock().expect("no panic").push(line.to_owned()));
    let concluded = conclude(session, &header, &announcer);
    let terminal = lines.lock().expect("no panic").join("\n");
    let json = concluded.result.to_json().expect("JSON").to_string();
    let map = Known::of(&snapshot);
    let phone = EndedPage::of(session, &concluded.result, Vec::new());
    let phone_text = serde_json::to_string(&phone).expect("JSON");
    let recorded = session_report::Recorded {
        name: "one".into(),
        place: "one".into(),
        command: "boresight report one".into(),
        header: &header,
        session,
        calibration: concluded.result.clone(),
        result: Some(json.as_bytes()),
        lines: std::iter::empty::<Result<_, Infallible>>(),
        picture: |_| None,
        check: None,
        stated: &header.config.certificate,
    };
    let report = session_report::of_recorded(recorded).expect("no line");
    let html = words_of(&page(&report));
    let pdf = certificate_pdf(&report).map_or_else(|_| String::new(), |pdf| words_of_pdf(&pdf));
    let met = map.as_ref().and_then(Known::met);
    let engineer = text::result::result_lines(&calibration, met)
        .into_iter()
        .map(|(name, value)| format!("{name}: {value}"))
        .chain(text::result::accuracies(&snapshot))
        .collect::<Vec<_>>()
        .join("\n");
    let prompt = text::prompt(snapshot.shown.prompt);
    let error =
        card.error.as_ref().map_or(String::new(), |it| format!("±{} {}", it.number, it.unit));
    let card_text = format!(
        "{}\n{error}\n{}\n{}\n{}",
        text::grade(card.grade),
        text::result::your_goal(&card.goal),
        card.what,
        card.action
    );
    let said = vec![
        ("card", card_text),
        ("prompt", prompt),
        ("verdict", text::verdict_on(&calibration).to_owned()),
        ("ending", text::session_news::ending(session)),
        ("terminal", terminal),
        ("phone", phone_text),
        ("voice", phone.aloud.to_owned()),
        ("report", html),
        ("pdf", pdf),
        ("engineer", engineer),
    ];
    Some((calibration, Shown { card, map, exit: concluded.exit, said }))
}

/// Words of a page without tags.
fn words_of(html: &str) -> String {
    let body = html.split_once("<body").map_or(html, |(_, body)| body);
    let mut words = String::new();
    let mut is_tag = true;
    for letter in body.chars() {
        match letter {
            '<' => is_tag = true,
            '>' => {
                is_tag = false;
                words.push(' ');
            }
            letter if !is_tag => words.push(letter),
            _ => {}
        }
    }
    words.replace("&#39;", "'").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Texts shown by a PDF.
fn words_of_pdf(pdf: &[u8]) -> String {
    let text: String = pdf.iter().map(|byte| char::from(*byte)).collect();
    let shown = text.lines().filter_map(|line| line.strip_suffix(" Tj"));
    let letters = |shown: &str| match shown.strip_prefix('<') {
        // Beyond ASCII, letters are numbers of one byte each.
        Some(hex) => hex
            .trim_end_matches('>')
            .as_bytes()
            .chunks(2)
            .filter_map(|byte| u8::from_str_radix(std::str::from_utf8(byte).ok()?, 16).ok())
            .map(char::from)
            .collect(),
        None => shown.trim_matches(['(', ')']).replace('\\', ""),
    };
    shown.map(letters).collect::<Vec<String>>().join(" ")
}

/// Goals that a text names: number and unit after the word.
fn goals(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("oal").map(|(at, word)| (at.saturating_sub(1), word)) {
        // Followed by what was reached.
        if text[..at].ends_with("Meets your ") || text[..at].ends_with("Doesn't meet your ") {
            continue;
        }
        let after: String = text[at + 4..].chars().take(24).collect();
        let after = after.trim_start_matches([':', ' ']);
        let after = after.strip_prefix("is ").or(after.strip_prefix("of ")).unwrap_or(after);
        let number: String =
            after.chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
        let unit: String = after[number.len()..].trim_start().chars().take(2).collect();
        if !number.is_empty() && ["px", "mm"].contains(&unit.as_str()) {
            found.push(format!("{number} {unit}"));
        }
    }
    found
}

/// Shares of the picture that meet the goal, as a text states them.
fn shares(text: &str) -> Vec<String> {
    let marks = [" % of the picture, where boards were (goal", "meets the goal: "];
    let before = text.match_indices(marks[0]).map(|(at, _)| {
        let from = text[..at].rfind(|c: char| !c.is_ascii_digit()).map_or(0, |from| from + 1);
        text[from.min(at)..at].trim().to_owned()
    });
    let after = text.match_indices(marks[1]).map(|(at, mark)| {
        text[at + mark.len()..].chars().take_while(char::is_ascii_digit).collect()
    });
    before.chain(after).filter(|share: &String| !share.is_empty()).collect()
}

/// Contradictions between the surfaces.
fn contradictions(calibration: &Calibration, shown: &Shown) -> Vec<String> {
    let mut found = Vec::new();
    let Shown { card, map, exit, said } = shown;
    let mut object = |what: String| found.push(what);
    let grade_said = text::grade(card.grade);
    let of = |name: &str| said.iter().find(|(it, _)| *it == name).map_or("", |(_, text)| text);
    // One grade.
    for surface in ["verdict", "terminal", "phone", "report", "pdf", "card"] {
        let others = [Grade::Care, Grade::Unfinished, Grade::NotTrustworthy];
        let text = of(surface);
        if surface == "pdf" && text.is_empty() {
            continue;
        }
        if !text.contains(grade_said) {
            object(format!("{surface}: {grade_said} is missing"));
        }
        for other in others.into_iter().filter(|other| *other != card.grade) {
            let other = text::grade(other);
            if text.contains(other) {
                object(format!("{surface}: {other} beside {grade_said}"));
            }
        }
    }
    // One exit code.
    let is_missed = calibration.acceptance.is_some_and(|judged| !judged.is_met());
    let is_usable = matches!(card.grade, Grade::Good | Grade::Care);
    if (*exit == Exit::Good) != (is_usable && !is_missed) {
        object(format!("exit {exit:?} beside {grade_said}"));
    }
    // One goal, and one share of the picture.
    for (surface, text) in said {
        for goal in goals(text).into_iter().filter(|goal| *goal != card.goal) {
            object(format!("{surface}: goal {goal} beside {}", card.goal));
        }
    }
    let known = map.as_ref().filter(|known| known.goal().is_some());
    let share = known.map(|known| format!("{:.0}", 100.0 * known.share()));
    for (surface, text) in said {
        for other in shares(text).into_iter().filter(|other| Some(other) != share.as_ref()) {
            object(format!("{surface}: {other} % of the picture beside {share:?}"));
        }
    }
    // One picture of the cause, only where the grade asks for it.
    for surface in ["report", "phone"] {
        let caption = card.cause.as_ref().map(|cause| cause.caption.as_str());
        if caption.is_some_and(|it| !of(surface).contains(it)) || caption.is_some_and(|_| is_usable)
        {
            object(format!("{surface}: the cause {caption:?} beside {grade_said}"));
        }
    }
    // One number.
    if let Some(error) = card.error.as_ref().filter(|_| is_usable) {
        let number = format!("±{} {}", error.number, error.unit);
        for surface in ["report", "pdf"] {
            if !of(surface).is_empty() && !of(surface).contains(&number) {
                object(format!("{surface}: {number} is missing"));
            }
        }
    }
    // Nothing praises what must not be used, and nothing warns of what is good.
    let praise =
        ["goal is reached", "ready to use", "You can use", "Next check due", "Use it. ", "✓"];
    let praise = praise.iter().filter(|_| !is_usable);
    let blame = ["can't be used", "don't use", "Unfinished"];
    let blame = blame.iter().filter(|_| card.grade == Grade::Good && !is_missed);
    let is_met = card.error.as_ref().is_some_and(|error| error.of_goal <= 1.0);
    let of_missed = ["goal is reached", "Use it where", "Meets your goal", "In the whole picture"];
    let of_missed = of_missed.iter().filter(|_| !is_met);
    let of_met = ["Doesn't meet your goal", "goal isn't reached", "short of the goal"];
    let of_met = of_met.iter().filter(|_| is_met);
    for word in praise.chain(blame).chain(of_missed).chain(of_met) {
        for (surface, text) in said.iter().filter(|(_, text)| text.contains(word)) {
            let at = text.find(word).unwrap_or(0);
            let near: String = text[at..].chars().take(60).collect();
            object(format!(
                "{surface}: \u{201c}{near}\u{201d} beside {grade_said}, goal met: {is_met}"
            ));
        }
    }
    // The map's words agree with the map.
    let bright = known.map_or(0.0, Known::share);
    if card.what == text::result::USE_WHERE_BRIGHT && bright == 0.0 {
        object("bright nowhere".into());
    }
    if card.grade == Grade::NotTrustworthy && bright > 0.0 {
        object("bright beside Not trustworthy".into());
    }
    found
}

#[test]
fn no_surface_contradicts_another() {
    let each = asked_for("BORESIGHT_SESSIONS").map_or(USUAL, |all| all.div_ceil(16));
    let mut grades = [0; 4];
    let (mut count, mut without) = (0, 0);
    let mut all = Vec::new();
    for seed in 0..each {
        for flaw in FLAWS {
            let (session, decision, config) = session(flaw, 100 + seed);
            count += 1;
            let Some((calibration, shown)) = shown(&session, decision, config) else {
                without += 1;
                continue;
            };
            grades[shown.card.grade as usize] += 1;
            let found = contradictions(&calibration, &shown);
            for what in &found {
                println!("{flaw:?}, seed {seed}: {what}");
            }
            all.extend(found);
        }
    }
    println!(
        "{count} sessions: {grades:?} Good, Use with care, Unfinished, Not trustworthy; {without} without a result; {} contradictions",
        all.len()
    );
    assert!(grades.iter().all(|count| *count > 0), "{grades:?}");
    assert_eq!(all, Vec::<String>::new());
}
