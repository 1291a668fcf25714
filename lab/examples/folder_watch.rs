//! Learns a folder of pictures of a fixed camera, measures the rest, and plants known changes:
//! answers, scatter, errors, processor time.
//!
//! ```text
//! folder_watch FOLDER fx,fy,cx,cy[,k1,k2,p1,p2,k3] LEARN [--references N] [--plant EVERY] [--every N]
//! ```

mod watched;

use std::path::PathBuf;

use boresight_geometry::frame::ImageSize;
use boresight_watch::{Gallery, Glass, Lens, SIZE, Turn, View};
use nalgebra::Vector4;
use watched::{Failed, answer, learned, lens, middle, pictures, read, spent_secs, turn_by, units};

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, numbers, learn, options @ ..] = arguments.as_slice() else {
        return Err("FOLDER fx,fy,cx,cy[,k1,k2,p1,p2,k3] LEARN".into());
    };
    let option = |name: &str, usual: usize| {
        let at = options.iter().position(|o| o == name);
        at.and_then(|at| options.get(at + 1)?.parse().ok()).unwrap_or(usual)
    };
    let files = pictures(folder)?;
    let learn: usize = learn.parse()?;
    let first = read(&files[0])?;
    let lens = lens(numbers, ImageSize::of(&first))?;
    let began = spent_secs();
    let (gallery, masked) = learned(&lens, &files[..learn], option("--references", SIZE))?;
    println!("text masked: {:.2} %", 100.0 * masked.share(first.width(), first.height()));
    let patches: usize = gallery.references.iter().map(|r| r.landmarks.len()).sum();
    println!(
        "learned {} references in {:.1} s, {:.0} patches each",
        gallery.references.len(),
        spent_secs() - began,
        patches as f64 / gallery.references.len() as f64
    );
    let tested: Vec<&PathBuf> = files[learn..].iter().step_by(option("--every", 1)).collect();
    let (mut answers, mut spent) = (Vec::new(), 0.0);
    let (mut sharpness, mut contrast) = (Vec::new(), Vec::new());
    for file in &tested {
        let grey = read(file)?;
        let began = spent_secs();
        let view = View::of(grey);
        let measured = gallery.measure(&view, &lens);
        let glass = measured.as_ref().ok().and_then(|m| Glass::of(m, &gallery, &view));
        spent += spent_secs() - began;
        if let Some(glass) = glass {
            sharpness.push(glass.sharpness);
            contrast.push(glass.contrast);
        }
        if let Err(reason) = &measured {
            println!("{}: {reason:?}", file.display());
        }
        answers.push(measured.ok().map(|m| m.turn.vector().component_mul(&units(&lens))));
    }
    let found: Vec<Vector4<f64>> = answers.iter().flatten().copied().collect();
    println!(
        "answers {} of {}; {:.1} ms a picture of {} after decoding",
        found.len(),
        tested.len(),
        1e3 * spent / tested.len() as f64,
        ImageSize::of(&first)
    );
    let steps: Vec<Vector4<f64>> = answers.windows(2).filter_map(|w| Some(w[1]? - w[0]?)).collect();
    let scatter: Vec<String> = (0..4)
        .map(|i| format!("{:.4}", spread(steps.iter().map(|s| s[i])) / 2_f64.sqrt()))
        .collect();
    println!("scatter of neighbours pan px, tilt px, roll deg, focal %: {}", scatter.join(", "));
    let over: Vec<String> =
        (0..4).map(|i| format!("{:.3}", spread(found.iter().map(|s| s[i])))).collect();
    println!("scatter of all: {}", over.join(", "));
    println!(
        "glass: sharpness {:.2} ± {:.2}, contrast {:.2} ± {:.2}",
        middle(&mut sharpness.clone()),
        spread(sharpness),
        middle(&mut contrast.clone()),
        spread(contrast)
    );
    let every = option("--plant", 0);
    if every > 0 {
        plant(&lens, &gallery, &files[learn..].iter().step_by(every).collect::<Vec<_>>())?;
    }
    Ok(())
}

/// Plants moves and glass into each of `files` and prints the findings.
fn plant(lens: &Lens, gallery: &Gallery, files: &[&PathBuf]) -> Result<(), Failed> {
    let f = lens.camera.f_px;
    let deg = std::f64::consts::PI / 180.0;
    let turn = |pan: f64, tilt: f64, roll: f64, focal: f64| Turn {
        pan_rad: pan / f.x,
        tilt_rad: tilt / f.y,
        roll_rad: roll * deg,
        log_focal: (focal / 100.0).ln_1p(),
    };
    let moves = [
        ("pan 1 px", turn(1.0, 0.0, 0.0, 0.0)),
        ("pan 5 px", turn(5.0, 0.0, 0.0, 0.0)),
        ("tilt 1 px", turn(0.0, 1.0, 0.0, 0.0)),
        ("tilt -10 px", turn(0.0, -10.0, 0.0, 0.0)),
        ("roll 0.1 deg", turn(0.0, 0.0, 0.1, 0.0)),
        ("roll 0.5 deg", turn(0.0, 0.0, 0.5, 0.0)),
        ("focal 0.3 %", turn(0.0, 0.0, 0.0, 0.3)),
        ("focal 3 %", turn(0.0, 0.0, 0.0, 3.0)),
        ("mixture", turn(-1.0, 1.0, 0.1, 0.3)),
        ("pan 60 px", turn(60.0, 0.0, 0.0, 0.0)),
        ("tilt -40 px", turn(0.0, -40.0, 0.0, 0.0)),
        ("roll 5 deg", turn(0.0, 0.0, 5.0, 0.0)),
        ("focal 8 %", turn(0.0, 0.0, 0.0, 8.0)),
        ("pan 150 px", turn(150.0, 0.0, 0.0, 0.0)),
        ("all at once", turn(80.0, -30.0, 4.0, 5.0)),
    ];
    let mut usable = Vec::new();
    for file in files {
        let grey = read(file)?;
        if let Ok(own) = gallery.measure(&View::of(grey.clone()), lens) {
            usable.push((grey, own.turn));
        }
    }
    for (name, planted) in moves {
        let (mut errors, mut spent) = (Vec::new(), 0.0);
        for (grey, own) in &usable {
            let view = View::of(turn_by(grey, lens, &planted));
            let began = spent_secs();
            let found = answer(gallery, &view, lens);
            spent += spent_secs() - began;
            if let Ok(found) = found {
                // The camera's own turn first, then the planted turn.
                let truth = own.then(&planted);
                errors.push((found.turn.vector() - truth.vector()).component_mul(&units(lens)));
            }
        }
        let of = |i: usize| -> (f64, f64) {
            let mut all: Vec<f64> = errors.iter().map(|e| e[i]).collect();
            let largest = all.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            (middle(&mut all), largest)
        };
        let text: Vec<String> = (0..4).map(|i| format!("{:+.3}/{:.3}", of(i).0, of(i).1)).collect();
        println!(
            "{name:13} found {:.2} of {}; error median/largest px px deg %: {}; {:.0} ms",
            errors.len() as f64 / usable.len().max(1) as f64,
            usable.len(),
            text.join("  "),
            1e3 * spent / usable.len().max(1) as f64
        );
    }
    Ok(())
}

/// Robust standard deviation.
fn spread(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = values.into_iter().collect();
    let centre = middle(&mut all);
    1.4826 * middle(&mut all.iter().map(|v| (v - centre).abs()).collect::<Vec<_>>())
}
