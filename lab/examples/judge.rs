//! Are judgements true? Lenses of real cameras with planted mistakes, judged by the lens of every
//! second view; the lens of all views stands for the truth. No part is expected of a lens whose
//! every number is wrong.
//!
//! ```text
//! judge LIST
//! ```
//!
//! LIST is that of `split_halves`.

mod corner_lists;

use std::{collections::BTreeMap, path::Path};

use boresight_calibrate::{
    Answer, Calibration, CalibrationParams, GivenLens, Judgement, LensModel, Limits, NotJudged,
    WrongPart, calibrate, judge,
};
use boresight_geometry::{Camera, Distortion, frame::ImageSize};
use corner_lists::{Set, each, read_list};
use nalgebra::Vector2;

/// A planted mistake, and the code of the part that's wrong then.
struct Plant {
    name: &'static str,
    /// None for several.
    code: Option<&'static str>,
    by: By,
}

enum By {
    /// A change of the lens of all views.
    Change(fn(&mut Camera)),
    /// The lens of the four flattest views, with k3.
    FourFlatViews,
    /// The lens of all views with one radial term.
    OneTerm,
    /// The lens for pictures of another size.
    Size(fn(&mut GivenLens)),
}

static PLANTS: [Plant; 22] = [
    Plant { name: "sound", code: None, by: By::Change(|_| {}) },
    change("f +.3 %", "FOCAL-LENGTH", |camera| camera.f_px *= 1.003),
    change("f -.3 %", "FOCAL-LENGTH", |camera| camera.f_px *= 0.997),
    change("f +1 %", "FOCAL-LENGTH", |camera| camera.f_px *= 1.01),
    change("f -1 %", "FOCAL-LENGTH", |camera| camera.f_px *= 0.99),
    change("f +3 %", "FOCAL-LENGTH", |camera| camera.f_px *= 1.03),
    change("f -3 %", "FOCAL-LENGTH", |camera| camera.f_px *= 0.97),
    change("pp 2 px", "PRINCIPAL-POINT", |camera| camera.pp_px.x += 2.0),
    change("pp 5 px", "PRINCIPAL-POINT", |camera| camera.pp_px.y -= 5.0),
    change("pp 40 px", "PRINCIPAL-POINT", |camera| camera.pp_px.x += 40.0),
    change("4:3", "STRETCHED", |camera| camera.f_px.y *= 4.0 / 3.0),
    change("half size", "OTHER-SIZE", |camera| {
        camera.f_px *= 0.5;
        camera.pp_px *= 0.5;
    }),
    change("no distortion", "NO-DISTORTION", |camera| camera.distortion = Distortion::default()),
    change("another camera", "FOCAL-LENGTH", |camera| {
        camera.f_px *= 1.08;
        camera.pp_px += Vector2::new(25.0, -12.0);
        camera.distortion.k1 += 0.06;
    }),
    Plant { name: "four flat views", code: None, by: By::FourFlatViews },
    Plant { name: "one term", code: Some("TOO-FEW-TERMS"), by: By::OneTerm },
    Plant { name: "portrait", code: None, by: By::Size(portrait) },
    Plant { name: "cut", code: None, by: By::Size(cut) },
    Plant { name: "squeezed", code: None, by: By::Size(squeezed) },
    Plant { name: "mirrored", code: Some("AXES"), by: By::Size(mirrored) },
    Plant { name: "turned by 180°", code: Some("AXES"), by: By::Size(half_turned) },
    change("cx, cy exchanged", "AXES", |Camera { pp_px, .. }| *pp_px = pp_px.yx()),
];

fn portrait(given: &mut GivenLens) {
    let ImageSize { width_px, height_px } = given.image_size;
    let Camera { f_px, pp_px, distortion, .. } = &mut given.camera;
    *f_px = f_px.yx();
    *pp_px = [f64::from(height_px) - 1.0 - pp_px.y, pp_px.x].into();
    (distortion.p1, distortion.p2) = (distortion.p2, -distortion.p1);
    given.image_size = ImageSize { width_px: height_px, height_px: width_px };
}

/// For pictures higher by a half and larger by a quarter.
fn cut(given: &mut GivenLens) {
    let size = &mut given.image_size;
    let of_middle = given.camera.pp_px - size.centre_px();
    *size = ImageSize { width_px: size.width_px * 5 / 4, height_px: size.height_px * 15 / 8 };
    given.camera.f_px *= 1.25;
    given.camera.pp_px = size.centre_px() + 1.25 * of_middle;
}

fn squeezed(given: &mut GivenLens) {
    given.image_size.width_px *= 2;
    given.camera.f_px.x *= 2.0;
    given.camera.pp_px.x = 2.0 * given.camera.pp_px.x + 0.5;
}

fn mirrored(given: &mut GivenLens) {
    let pp_x_px = &mut given.camera.pp_px.x;
    *pp_x_px = f64::from(given.image_size.width_px) - 1.0 - *pp_x_px;
    given.camera.distortion.p2 *= -1.0;
}

fn half_turned(given: &mut GivenLens) {
    portrait(given);
    portrait(given);
}

const fn change(name: &'static str, code: &'static str, by: fn(&mut Camera)) -> Plant {
    Plant { name, code: Some(code), by: By::Change(by) }
}

/// What was said of a planted mistake.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    told: [u32; 3],
    false_true: u32,
    false_off: u32,
    inside: u32,
    of: u32,
    cause_right: u32,
    causes: u32,
}

/// A planted mistake as judged.
struct Row {
    plant: &'static Plant,
    answer: Answer,
    truth_px: f64,
    interval_px: [f64; 3],
    goal_px: f64,
    code: Option<&'static str>,
}

fn planted(by: &By, set: &Set, all: &Calibration) -> Option<GivenLens> {
    let mut given = GivenLens { camera: all.camera, image_size: set.size };
    let camera = &mut given.camera;
    match by {
        By::Change(change) => change(camera),
        By::FourFlatViews => {
            let mut flattest: Vec<_> = all.views.iter().zip(&set.views).collect();
            flattest.sort_by(|a, b| a.0.tilt_rad.total_cmp(&b.0.tilt_rad));
            let four: Vec<_> = flattest.into_iter().take(4).map(|(_, view)| view.clone()).collect();
            let models = vec![LensModel::K1K2P1P2K3];
            let params = CalibrationParams { models, ..CalibrationParams::default() };
            *camera = calibrate(&four, &set.board, set.size, &params).ok()?.camera;
        }
        By::OneTerm => {
            let models = vec![LensModel::K1];
            let params = CalibrationParams { models, ..CalibrationParams::default() };
            *camera = calibrate(&set.views, &set.board, set.size, &params).ok()?.camera;
        }
        By::Size(change) => change(&mut given),
    }
    Some(given)
}

/// What a judgement says. A lens that misses the picture is off without limit; `None` without an
/// answer.
fn told(judged: Result<Judgement, NotJudged>) -> Option<Row> {
    let (answer, interval_px, wrong) = match judged {
        Ok(found) => (found.answer, [found.least_px, found.off_px, found.most_px], found.wrong),
        Err(NotJudged::Misses { wrong, .. }) => (Answer::Off, [f64::INFINITY; 3], wrong),
        Err(reason) if reason.answer() == Answer::Off => (Answer::Off, [f64::INFINITY; 3], None),
        Err(_) => return None,
    };
    let code = wrong.as_ref().map(WrongPart::code);
    Some(Row { plant: &PLANTS[0], answer, truth_px: 0.0, interval_px, goal_px: 0.0, code })
}

fn judged(set: &Set) -> Vec<Row> {
    let params = CalibrationParams::default();
    let half: Vec<_> = set.views.iter().step_by(2).cloned().collect();
    let all = calibrate(&set.views, &set.board, set.size, &params);
    let fresh = calibrate(&half, &set.board, set.size, &params);
    let (Ok(all), Ok(fresh)) = (all, fresh) else { return Vec::new() };
    let mut rows = Vec::new();
    for plant in &PLANTS {
        let Some(given) = planted(&plant.by, set, &all) else { continue };
        let truth = judge(&given, &half, &set.board, &all, None);
        let found = judge(&given, &half, &set.board, &fresh, None);
        let (Some(truth), Some(found)) = (told(truth), told(found)) else { continue };
        let truth_px = truth.interval_px[1];
        rows.push(Row { plant, truth_px, goal_px: Limits::of(set.size).goal_px, ..found });
    }
    rows
}

fn main() -> anyhow::Result<()> {
    let list = std::env::args().nth(1).unwrap_or_default();
    let sets = read_list(Path::new(&list))?;
    let mut counts = BTreeMap::<&str, Count>::new();
    for (set, rows) in each(&sets, judged) {
        for Row { plant, answer, truth_px, interval_px, goal_px, code } in rows {
            let count = counts.entry(plant.name).or_default();
            let is_off = answer == Answer::Off;
            let [least, off, most] = interval_px;
            let is_inside = (least..=most).contains(&truth_px);
            let is_right = code == plant.code || matches!(plant.by, By::FourFlatViews);
            count.of += 1;
            count.told[answer as usize] += 1;
            count.false_true += u32::from(answer == Answer::True && truth_px > goal_px);
            count.false_off += u32::from(is_off && truth_px < goal_px);
            count.inside += u32::from(is_inside);
            count.causes += u32::from(is_off);
            count.cause_right += u32::from(is_off && is_right);
            if !is_inside || (is_off && !is_right) {
                println!(
                    "{}: {}: {} {off:.2} ({least:.2} to {most:.2}), true {truth_px:.2}, {code:?}",
                    set.name,
                    plant.name,
                    answer.code()
                );
            }
        }
    }
    println!("mistake          of true off can't  false true, off  inside  cause right");
    let (mut inside, mut of) = (0, 0);
    for (name, c) in &counts {
        let [yes, open, off] = c.told;
        println!(
            "{name:15} {:3}  {yes:3} {off:3}   {open:3}  {:10} {:4}  {:3}  {:3} of {}",
            c.of, c.false_true, c.false_off, c.inside, c.cause_right, c.causes
        );
        inside += c.inside;
        of += c.of;
    }
    println!("inside {inside} of {of}");
    Ok(())
}
