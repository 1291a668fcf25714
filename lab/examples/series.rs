//! Runs a folder through station and watch as in the program: learning, adopting, cycle, test.
//! Changes are planted from a picture on, several of them one after the other into the same camera.
//! Prints each change of state; writes the lines.
//!
//! ```text
//! series FOLDER fx,fy,cx,cy[,k1…] [--pin] [--plant WHAT@NUMBER[..NUMBER]]… [--lines FILE.jsonl]
//! ```
//!
//! WHAT is `pan=2` or `tilt=2` (px), `roll=0.2` (degrees), `focal=0.3` (per cent), `shift=2` (px, of
//! the whole picture), `blur`, `dirt`, `fog`, `veil`, `dark` or `covered`. Times come from the
//! names: `2023-06-13T03_11_46`, or seconds since 1970.

mod watched;

use std::{collections::BTreeMap, io::Write, path::Path};

use boresight_geometry::frame::ImageSize;
use boresight_watch::{Input, NoAnswer, Station, Turn, Watch};
use image::GrayImage;
use watched::{
    Failed, blurred, cubic, dirty, foggy, lens, noisy, pictures, read, spent_secs, turn_by, veiled,
};

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, numbers, options @ ..] = arguments.as_slice() else {
        return Err(
            "FOLDER fx,fy,cx,cy[,k1…] [--pin] [--plant WHAT@NUMBER[..NUMBER]]… [--lines FILE]"
                .into(),
        );
    };
    let given = |name: &str| -> Vec<&str> {
        let pairs = options.windows(2).filter(|pair| pair[0] == name);
        pairs.map(|pair| pair[1].as_str()).collect()
    };
    let files = pictures(folder)?;
    let lens = lens(numbers, ImageSize::of(&read(&files[0])?))?;
    let mut lines = given("--lines").first().map(std::fs::File::create).transpose()?;
    let planted: Vec<Planted> =
        given("--plant").into_iter().map(Planted::parse).collect::<Result<_, _>>()?;
    let mut camera = Watched {
        station: Station::new(lens.clone()),
        watch: Watch::new(&lens),
        shelf: BTreeMap::new(),
        before: "",
        none: BTreeMap::new(),
        findings: BTreeMap::new(),
        spent_secs: 0.0,
    };
    camera.station.is_pinned = options.iter().any(|option| option == "--pin");
    // Everything before the first change is shared.
    let common = planted.iter().map(|p| p.from).min().unwrap_or(files.len()).min(files.len());
    for (number, file) in files.iter().enumerate().take(common) {
        camera.look(number, file, read(file)?, &mut lines)?;
    }
    for planted in &planted {
        println!("== {}={}@{}", planted.what, planted.amount, planted.from);
        let mut camera = camera.clone();
        for (number, file) in files.iter().enumerate().skip(common) {
            let mut grey = read(file)?;
            if (planted.from..planted.until).contains(&number) {
                grey = planted.apply(&grey, &lens);
            }
            camera.look(number, file, grey, &mut lines)?;
        }
        camera.conclude(files.len());
    }
    if planted.is_empty() {
        camera.conclude(files.len());
    }
    Ok(())
}

#[derive(Clone)]
struct Watched {
    station: Station,
    watch: Watch,
    shelf: BTreeMap<u64, GrayImage>,
    before: &'static str,
    none: BTreeMap<String, u32>,
    findings: BTreeMap<&'static str, u32>,
    spent_secs: f64,
}

impl Watched {
    fn look(
        &mut self,
        number: usize,
        file: &Path,
        grey: GrayImage,
        lines: &mut Option<std::fs::File>,
    ) -> Result<(), Failed> {
        let at = seconds(file).ok_or("no time in a name")?;
        let began = spent_secs();
        let inputs = self.station.look(grey, at, &self.watch, &mut self.shelf).inputs;
        self.spent_secs += spent_secs() - began;
        for input in inputs {
            if let Some(lines) = lines {
                writeln!(lines, "{}", serde_json::to_string(&input)?)?;
            }
            if let Input::Picture(picture) = &input
                && let Some(reason) = picture.none
                && !matches!(reason, NoAnswer::NoReferences)
            {
                let reason = format!("{reason:?}").split(' ').next().unwrap_or("").to_owned();
                *self.none.entry(reason).or_insert(0) += 1;
            }
            let decision = self.watch.handle(&input);
            for finding in &decision.findings {
                *self.findings.entry(finding.code()).or_insert(0) += 1;
            }
            let code = decision.state.code();
            if code != self.before {
                let hours = (at - decision.since_secs) / 3600.0;
                let name = file.file_stem().unwrap_or_default().to_string_lossy();
                println!(
                    "{number} {name} {code}, off {:.2?} px, since {hours:.1} h; visible {:.2?} px; findings {:?}",
                    decision.off_px.as_slice(),
                    decision.smallest_visible_px.as_slice(),
                    decision.findings
                );
                self.before = code;
            }
        }
        Ok(())
    }

    fn conclude(&self, pictures: usize) {
        println!(
            "{pictures} pictures, {:.1} ms of processor each; without an answer {:?}; pictures with findings {:?}; at the end {}, {:?}",
            1e3 * self.spent_secs / pictures as f64,
            self.none,
            self.findings,
            self.before,
            self.watch.decision().findings
        );
    }
}

struct Planted {
    what: String,
    amount: f64,
    from: usize,
    until: usize,
}

impl Planted {
    fn parse(text: &str) -> Result<Self, Failed> {
        let (what, when) = text.split_once('@').ok_or("WHAT@NUMBER")?;
        let (what, amount) = what.split_once('=').unwrap_or((what, "0"));
        let (from, until) = when.split_once("..").unwrap_or((when, "999999"));
        Ok(Self {
            what: what.into(),
            amount: amount.parse()?,
            from: from.parse()?,
            until: until.parse()?,
        })
    }

    fn apply(&self, grey: &GrayImage, lens: &boresight_watch::Lens) -> GrayImage {
        let (f, amount) = (lens.camera.f_px, self.amount);
        let turn = match self.what.as_str() {
            "pan" => Turn { pan_rad: amount / f.x, ..Turn::default() },
            "tilt" => Turn { tilt_rad: amount / f.y, ..Turn::default() },
            "roll" => Turn { roll_rad: amount.to_radians(), ..Turn::default() },
            "focal" => Turn { log_focal: (amount / 100.0).ln_1p(), ..Turn::default() },
            "shift" => return shifted(grey, amount),
            "blur" => return blurred(grey),
            "dirt" => return dirty(grey),
            "fog" => return foggy(grey),
            "veil" => return veiled(grey),
            "dark" => return noisy(grey, 0.02),
            _ => return GrayImage::from_pixel(grey.width(), grey.height(), image::Luma([30])),
        };
        turn_by(grey, lens, &turn)
    }
}

/// Picture of a camera whose lens was knocked: everything has moved by as much.
fn shifted(grey: &GrayImage, by_px: f64) -> GrayImage {
    GrayImage::from_fn(grey.width(), grey.height(), |x, y| {
        image::Luma([cubic(grey, nalgebra::Point2::new(f64::from(x) - by_px, f64::from(y)))])
    })
}

/// Seconds since 1970 from a name.
fn seconds(file: &Path) -> Option<f64> {
    let name = file.file_stem()?.to_str()?;
    if let Ok(secs) = name.parse::<f64>() {
        return Some(secs);
    }
    let parts: Vec<i64> =
        name.split(['-', 'T', '_']).map(str::parse).collect::<Result<_, _>>().ok()?;
    let [year, month, day, hour, minute, second] = parts.try_into().ok()?;
    // Days since 1970 of a civil date (Hinnant 2013).
    let (y, m) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day - 1 - 719_468;
    Some((((days * 24 + hour) * 60 + minute) * 60 + second) as f64)
}
