//! State of a watched camera for people and programs.

use serde::Serialize;
use serde_json::Value;

use super::{
    camera::WatchedCamera,
    times::{day_in_words, for_programs, in_words},
};
use crate::words::{self, Scale};
use boresight_app::{Exit, prometheus::Page};
use boresight_watch::{Cause, Decision, Lens, NoAnswer, State};

/// Schema of a line.
const SCHEMA: &str = "boresight.watch-state/1";

/// The state of a watched camera, as programs read it.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct StateLine {
    /// `boresight.watch-state/1`.
    pub schema: &'static str,
    /// Name of the camera.
    pub camera: String,
    /// `LEARNING`, `OK`, `MOVED`, `ZOOM`, `LENS` or `CANNOT-TELL`.
    pub state: &'static str,
    /// Since when: a time like `2026-03-12T14:05:00Z`; empty before the first picture.
    pub since: String,
    /// As of when: the newest picture's time, or when one was missing; empty before.
    pub at: String,
    /// The state in a sentence.
    pub sentence: String,
    /// What to do; empty if nothing.
    pub action: String,
    /// How far the camera is from where it was at this hour of the day; `null` while learning.
    pub off: Option<Amounts>,
    /// The smallest change that is found within two days; `null` while learning.
    pub smallest_visible: Option<Amounts>,
    /// Why there is no answer, such as `no-picture`, or why it vouches for nothing, such as
    /// `unsure`; `null` otherwise.
    pub reason: Option<String>,
    /// When the references were learned; empty before.
    pub reference: String,
    /// When a picture last had an answer; empty if none had.
    pub answered: String,
    /// Pictures with an answer, and without.
    pub pictures: [u64; 2],
    /// What else is to know: code and sentence.
    pub findings: Vec<FindingLine>,
}

/// A change in the picture's px and in degrees or per cent.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct Amounts {
    /// Along the picture's middle row; positive to the left, as seen from behind the camera.
    pub pan_px: f64,
    /// The same as an angle.
    pub pan_deg: f64,
    /// Along its middle column; positive down.
    pub tilt_px: f64,
    /// The same as an angle.
    pub tilt_deg: f64,
    /// About the line of sight; positive anticlockwise.
    pub roll_deg: f64,
    /// Focal length; positive is larger.
    pub focal_percent: f64,
}

/// A finding.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct FindingLine {
    /// `PINNED`, `ALSO-SHIFTED`, `SWAYS-MORE`, `LEFT-OUT` or `SHAKES`.
    pub code: &'static str,
    /// In a sentence.
    pub sentence: String,
}

impl Amounts {
    fn of(px: &nalgebra::Vector4<f64>, lens: &Lens) -> Self {
        let round = |value: f64| (value * 1e4).round() / 1e4;
        let f = lens.camera.f_px;
        Self {
            pan_px: round(px[0]),
            pan_deg: round((px[0] / f.x).to_degrees()),
            tilt_px: round(px[1]),
            tilt_deg: round((px[1] / f.y).to_degrees()),
            roll_deg: round((px[2] / lens.half_diagonal_px()).to_degrees()),
            focal_percent: round(100.0 * px[3] / lens.half_diagonal_px()),
        }
    }
}

/// Runs `say` with the conversion of the lens's numbers into words.
pub fn with_scale<T>(lens: &Lens, say: impl FnOnce(&Scale<'_>) -> T) -> T {
    let f_px = lens.camera.f_px.into();
    say(&Scale {
        f_px,
        half_diagonal_px: lens.half_diagonal_px(),
        when: &in_words,
        day: &day_in_words,
    })
}

impl StateLine {
    /// State of `camera` for someone who listens: like [`Self::asked`] if only a person can mend
    /// the newest look's lack.
    pub fn heard(camera: &WatchedCamera) -> Self {
        let decision = camera.watch().decision();
        if decision.lacks.is_some_and(NoAnswer::is_for_a_person) {
            Self::asked(camera)
        } else {
            Self::after(camera, decision)
        }
    }

    /// State of `camera` for someone who asks once: see [`boresight_watch::Watch::asked`].
    pub fn asked(camera: &WatchedCamera) -> Self {
        Self::after(camera, &camera.watch().asked())
    }

    fn after(camera: &WatchedCamera, decision: &Decision) -> Self {
        let (name, newest) = (camera.name(), camera.newest_secs());
        let line = Self::of_decision(name, camera.lens(), decision, newest, camera.pictures());
        let is_learning = matches!(decision.state, State::Learning { .. });
        if !(is_learning && camera.is_to_be_pinned()) {
            return line;
        }
        let (sentence, action) = words::PINNING;
        Self { sentence: sentence.into(), action: action.into(), ..line }
    }

    /// State of a camera after `decision`.
    pub fn of_decision(
        name: &str,
        lens: &Lens,
        decision: &Decision,
        at_secs: Option<f64>,
        pictures: [u64; 2],
    ) -> Self {
        with_scale(lens, |scale| {
            let (sentence, action) = words::state(decision, scale);
            let is_known = decision.smallest_visible_px[0].is_finite();
            let time = |secs: Option<f64>| {
                secs.filter(|secs| *secs > 0.0).map_or(String::new(), for_programs)
            };
            Self {
                schema: SCHEMA,
                camera: name.into(),
                state: decision.state.code(),
                since: time(Some(decision.since_secs)),
                at: time(at_secs),
                sentence,
                action,
                off: is_known.then(|| Amounts::of(&decision.off_px, lens)),
                smallest_visible: is_known
                    .then(|| Amounts::of(&decision.smallest_visible_px, lens)),
                reason: reason(decision),
                reference: time(Some(decision.reference_secs)),
                answered: time(decision.answered_secs),
                pictures,
                findings: decision
                    .findings
                    .iter()
                    .map(|f| FindingLine { code: f.code(), sentence: words::finding(f) })
                    .collect(),
            }
        })
    }

    /// Lines for a person.
    pub fn lines(&self, smallest: &str) -> Vec<String> {
        let mut lines = vec![
            format!("{}: {}. {} {}", self.camera, self.state, self.sentence, self.action)
                .trim()
                .to_owned(),
        ];
        lines.extend(self.findings.iter().map(|f| format!("  {}", f.sentence)));
        lines.push(format!("  {smallest}"));
        lines
    }
}

/// Stable name of the reason for having no answer, as in the store's lines.
fn reason(decision: &Decision) -> Option<String> {
    let reason = match decision.state {
        State::CannotTell { reason, .. } => Some(reason),
        _ => decision.lacks,
    };
    // A reason with numbers is an object of one key.
    match serde_json::to_value(reason?).ok()? {
        Value::Object(named) => named.into_iter().next().map(|(name, _)| name),
        name => name.as_str().map(str::to_owned),
    }
}

/// State of a camera for someone who asks once, as lines.
pub fn lines(camera: &WatchedCamera) -> Vec<String> {
    let smallest = with_scale(camera.lens(), |scale| {
        words::smallest_visible(camera.watch().decision(), scale)
    });
    StateLine::asked(camera).lines(&smallest)
}

/// Exit code of a state.
pub fn exit(state: State) -> Exit {
    match state {
        State::Ok => Exit::Good,
        State::Moved(Cause::Turned | Cause::Either) => Exit::Moved,
        State::Moved(Cause::Knocked) | State::Zoom | State::Blurred => Exit::Recalibrate,
        State::Learning { .. } => Exit::NotTrustworthy,
        State::CannotTell { .. } => Exit::CannotTell,
    }
}

/// Worst of several states: a needed calibration, then a movement, then an unclear state.
pub fn worst(states: impl IntoIterator<Item = State>) -> Exit {
    states.into_iter().map(exit).max().unwrap_or(Exit::Good)
}

/// Metrics of a camera for Prometheus.
#[derive(Clone, Debug)]
pub struct CameraMetrics {
    line: StateLine,
    answered_secs: Option<f64>,
    glass: [Option<f64>; 2],
}

impl CameraMetrics {
    /// Metrics of a camera in the state of `line`.
    pub fn of(camera: &WatchedCamera, line: StateLine) -> Self {
        let answer = camera.newest_answer();
        Self {
            line: StateLine { camera: harmless(camera.name()), ..line },
            answered_secs: camera.watch().decision().answered_secs,
            glass: [answer.and_then(|a| a.sharp), answer.and_then(|a| a.contrast)],
        }
    }
}

/// Adds the states of cameras to a page for Prometheus.
pub fn metrics(page: &mut Page, cameras: &[&CameraMetrics]) {
    let mut states = Vec::new();
    let mut pictures = Vec::new();
    for CameraMetrics { line, .. } in cameras {
        let name = line.camera.as_str();
        for code in State::CODES {
            states.push((
                [("camera", name), ("state", code)],
                f64::from(u8::from(line.state == code)),
            ));
        }
        for (answer, count) in ["yes", "no"].into_iter().zip(line.pictures) {
            pictures.push(([("camera", name), ("answer", answer)], count as f64));
        }
    }
    let help = "1 for the state that the camera is in.";
    page.add(
        "boresight_watch_state",
        help,
        states.iter().map(|(labels, value)| (&labels[..], *value)),
    );
    let findings = cameras.iter().flat_map(|camera| {
        let name = camera.line.camera.as_str();
        camera.line.findings.iter().map(move |f| [("camera", name), ("finding", f.code)])
    });
    let findings: Vec<_> = findings.collect();
    let help = "1 for each finding besides the state.";
    page.add("boresight_watch_finding", help, findings.iter().map(|labels| (&labels[..], 1.0)));
    let reasons = cameras.iter().filter_map(|CameraMetrics { line, .. }| {
        Some([("camera", line.camera.as_str()), ("reason", line.reason.as_deref()?)])
    });
    let reasons: Vec<_> = reasons.collect();
    let help = "1 for the reason why there is no answer.";
    page.add("boresight_watch_reason", help, reasons.iter().map(|labels| (&labels[..], 1.0)));
    let mut gauge = |name: &str, help: &str, of: &dyn Fn(&CameraMetrics) -> Option<f64>| {
        let values: Vec<([(&str, &str); 1], f64)> = cameras
            .iter()
            .filter_map(|camera| Some(([("camera", camera.line.camera.as_str())], of(camera)?)))
            .collect();
        page.add(name, help, values.iter().map(|(labels, value)| (&labels[..], *value)));
    };
    for (part, help, of) in PARTS {
        gauge(&format!("boresight_watch_{part}"), help, &|c| c.line.off.map(|a| of(&a)));
        let visible = "The smallest change of it that is found within two days.";
        let name = format!("boresight_watch_{part}_smallest_visible");
        gauge(&name, visible, &|c| c.line.smallest_visible.map(|a| of(&a)));
    }
    let answered = "When a picture last had an answer, in seconds since 1970.";
    gauge("boresight_watch_last_answer_seconds", answered, &|c| c.answered_secs);
    let sharp = "Logarithm of sharpness against the references.";
    gauge("boresight_watch_sharpness", sharp, &|c| c.glass[0]);
    let contrast = "Logarithm of contrast against the references.";
    gauge("boresight_watch_contrast", contrast, &|c| c.glass[1]);
    page.add(
        "boresight_watch_pictures_total",
        "Pictures with and without an answer.",
        pictures.iter().map(|(labels, value)| (&labels[..], *value)),
    );
}

type Of = fn(&Amounts) -> f64;
const PARTS: [(&str, &str, Of); 4] = [
    ("pan_pixels", "How far the camera points to the left of where it did, px.", |a| a.pan_px),
    ("tilt_pixels", "How far the camera points below where it did, px.", |a| a.tilt_px),
    ("roll_degrees", "How far the camera is turned anticlockwise, degrees.", |a| a.roll_deg),
    ("focal_percent", "How much larger everything is, per cent.", |a| a.focal_percent),
];

/// A name escaped for the quotes of a label.
fn harmless(name: &str) -> String {
    name.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}
