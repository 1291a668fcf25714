//! Are judgements true? Lenses of real cameras with planted mistakes, judged by the lens of every
//! second view; the lens of all views stands for the truth.
//!
//! ```text
//! judge LIST
//! ```
//!
//! LIST is that of `split_halves`.

mod corner_lists;

use std::{collections::BTreeMap, path::Path};

use boresight_calibrate::{Answer, CalibrationParams, GivenLens, WrongPart, calibrate, judge};
use boresight_geometry::Camera;
use corner_lists::{Set, each, read_list};
use nalgebra::Vector2;

/// A planted mistake, and the code of the part that's wrong then.
struct Plant {
    name: &'static str,
    /// None for several.
    code: Option<&'static str>,
    by: fn(&mut Camera),
}

static PLANTS: [Plant; 14] = [
    Plant { name: "sound", code: None, by: |_| {} },
    Plant { name: "f +.3 %", code: Some("FOCAL-LENGTH"), by: |camera| camera.f_px *= 1.003 },
    Plant { name: "f -.3 %", code: Some("FOCAL-LENGTH"), by: |camera| camera.f_px *= 0.997 },
    Plant { name: "f +1 %", code: Some("FOCAL-LENGTH"), by: |camera| camera.f_px *= 1.01 },
    Plant { name: "f -1 %", code: Some("FOCAL-LENGTH"), by: |camera| camera.f_px *= 0.99 },
    Plant { name: "f +3 %", code: Some("FOCAL-LENGTH"), by: |camera| camera.f_px *= 1.03 },
    Plant { name: "f -3 %", code: Some("FOCAL-LENGTH"), by: |camera| camera.f_px *= 0.97 },
    Plant { name: "pp 2 px", code: Some("PRINCIPAL-POINT"), by: |camera| camera.pp_px.x += 2.0 },
    Plant { name: "pp 5 px", code: Some("PRINCIPAL-POINT"), by: |camera| camera.pp_px.y -= 5.0 },
    Plant { name: "pp 40 px", code: Some("PRINCIPAL-POINT"), by: |camera| camera.pp_px.x += 40.0 },
    Plant { name: "4:3", code: Some("STRETCHED"), by: |camera| camera.f_px.y *= 4.0 / 3.0 },
    Plant {
        name: "half size",
        code: Some("OTHER-SIZE"),
        by: |camera| {
            camera.f_px *= 0.5;
            camera.pp_px *= 0.5;
        },
    },
    Plant {
        name: "no distortion",
        code: Some("NO-DISTORTION"),
        by: |camera| camera.distortion = boresight_geometry::Distortion::default(),
    },
    Plant {
        name: "another camera",
        code: Some("FOCAL-LENGTH"),
        by: |camera| {
            camera.f_px *= 1.08;
            camera.pp_px += Vector2::new(25.0, -12.0);
            camera.distortion.k1 += 0.06;
        },
    },
];

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

fn judged(set: &Set) -> Vec<Row> {
    let params = CalibrationParams::default();
    let half: Vec<_> = set.views.iter().step_by(2).cloned().collect();
    let all = calibrate(&set.views, &set.board, set.size, &params);
    let fresh = calibrate(&half, &set.board, set.size, &params);
    let (Ok(all), Ok(fresh)) = (all, fresh) else { return Vec::new() };
    let mut rows = Vec::new();
    for plant in &PLANTS {
        let mut camera = all.camera;
        (plant.by)(&mut camera);
        let given = GivenLens { camera, image_size: set.size };
        let truth = judge(&given, &half, &set.board, &all, None);
        let found = judge(&given, &half, &set.board, &fresh, None);
        let (Ok(truth), Ok(found)) = (truth, found) else { continue };
        rows.push(Row {
            plant,
            answer: found.answer,
            truth_px: truth.off_px,
            interval_px: [found.least_px, found.off_px, found.most_px],
            goal_px: found.goal_px,
            code: found.wrong.as_ref().map(WrongPart::code),
        });
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
            let is_right = code == plant.code;
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
        let [yes, off, open] = c.told;
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
