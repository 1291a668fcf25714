use std::{fmt, str::FromStr};

use boresight_geometry::boards::millimetres;
use serde::{Deserialize, Serialize};

/// The 0.975 quantile of the normal distribution: 95 % lie within ± this many standard deviations.
pub(crate) const TWO_SIDED_95: f64 = 1.959_964;

/// Largest acceptable error, 95 % of the time.
///
/// # Examples
///
/// ```
/// use boresight_calibrate::AcceptanceGoal;
///
/// let goal: AcceptanceGoal = "length 800mm at 2m <= 0.5mm".parse()?;
/// assert_eq!(goal, AcceptanceGoal::Length { length_m: 0.8, at_m: 2.0, within_m: 0.0005 });
/// assert_eq!(goal.to_string(), "length 800mm at 2m <= 0.5mm");
///
/// assert_eq!("0.2px".parse(), Ok(AcceptanceGoal::Projection { px: 0.2 }));
/// # Ok::<(), boresight_calibrate::NotAGoal>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum AcceptanceGoal {
    /// Limit on the distance between the image of a point and the true place, in 95 % of the
    /// picture's area. The rest are the outermost corners, where the lens model extrapolates.
    Projection {
        /// Distance in pixels.
        px: f64,
    },
    /// Limit on the error of a length across the optical axis, measured between two points in the
    /// picture as `Z |ray₂ − ray₁|`. Holds at 95 % of the places where the length fits into the
    /// picture, in every direction.
    Length {
        /// Length in metres.
        length_m: f64,
        /// Distance `Z` of the length from the camera along the optical axis, in metres; taken as
        /// known.
        at_m: f64,
        /// Largest error in metres.
        within_m: f64,
    },
}

/// Error of a text that states no goal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{reason}; write a goal like \"0.2px\" for projection, or \"length 800mm at 2m <= 0.5mm\" for a length measured at a distance"
)]
pub struct NotAGoal {
    /// Reason for the refusal.
    pub reason: String,
}

impl AcceptanceGoal {
    /// 95 % bound of the error from the board's square size alone, in the unit of [`Self::limit`].
    /// `scale_sd` is the relative standard deviation of that size. Zero for projection: directions
    /// have no scale.
    pub fn scale_part(&self, scale_sd: f64) -> f64 {
        match *self {
            Self::Projection { .. } => 0.0,
            Self::Length { length_m, .. } => TWO_SIDED_95 * length_m * scale_sd,
        }
    }

    /// Largest acceptable error: in pixels for projection, in metres for a length.
    pub fn limit(&self) -> f64 {
        match *self {
            Self::Projection { px } => px,
            Self::Length { within_m, .. } => within_m,
        }
    }
}

/// Number with unit, and the word before.
struct Quantity<'a> {
    word: &'a str,
    value: f64,
    unit: Unit,
}

#[derive(Clone, Copy, PartialEq)]
enum Unit {
    Pixel,
    Metre,
}

/// Meaning of a quantity in a length goal.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Length,
    Distance,
    Error,
}

impl FromStr for AcceptanceGoal {
    type Err = NotAGoal;

    /// Parses a goal leniently: any case, spaces or none, `<=`, `≤`, `±`, `within` or `to` before
    /// the error, `at` or `@` before the distance. Units: px; µm, mm, cm, m, in.
    fn from_str(text: &str) -> Result<Self, NotAGoal> {
        let text = text.trim().to_lowercase();
        match quantities(&text)?.as_slice() {
            [] => Err(not("there is no number with a unit")),
            [only] if only.unit == Unit::Pixel => match only.word {
                "" | "projection" | "error" | "within" | "<=" | "<" | "≤" | "±" | "+-" | "+/-"
                | "projection <=" | "projection ≤" | "projection <" | "projection within" => {
                    Ok(Self::Projection { px: only.value })
                }
                word => Err(not(format!("{word:?} is not understood"))),
            },
            all if all.iter().any(|quantity| quantity.unit == Unit::Pixel) => {
                Err(not("pixels and lengths can't be mixed"))
            }
            all => length(all),
        }
    }
}

fn not(reason: impl Into<String>) -> NotAGoal {
    NotAGoal { reason: reason.into() }
}

fn length(quantities: &[Quantity<'_>]) -> Result<AcceptanceGoal, NotAGoal> {
    let mut found: [Option<f64>; 3] = [None; 3];
    let mut put = |part: Part, value: f64| match found[part as usize].replace(value) {
        None => Ok(()),
        Some(_) => Err(not("two numbers mean the same")),
    };
    let mut unnamed = Vec::new();
    for quantity in quantities {
        match part_after(quantity.word)? {
            Some(part) => put(part, quantity.value)?,
            None => unnamed.push(quantity.value),
        }
    }
    for value in unnamed {
        // "0.5mm over 800mm at 2m": the length is named, so the first number is the error.
        let part = if found[Part::Length as usize].is_none() { Part::Length } else { Part::Error };
        if found[part as usize].replace(value).is_some() {
            return Err(not("two numbers mean the same"));
        }
    }
    let [length_m, at_m, within_m] = found;
    let length_m = length_m.ok_or_else(|| not("the length to measure is missing"))?;
    let at_m = at_m.ok_or_else(|| not("the distance is missing (\"at 2m\")"))?;
    let within_m = within_m.ok_or_else(|| not("the error accepted is missing (\"<= 0.5mm\")"))?;
    if within_m >= length_m {
        return Err(not("the error accepted is as large as the length"));
    }
    Ok(AcceptanceGoal::Length { length_m, at_m, within_m })
}

/// Meaning of the number after `word`; `None` if the word leaves the meaning open.
fn part_after(word: &str) -> Result<Option<Part>, NotAGoal> {
    match word {
        "" | "a" => Ok(None),
        "length" | "lengths" | "a length of" | "length of" | "over" | "of" | "for" | "in"
        | "on" => Ok(Some(Part::Length)),
        "at" | "@" | "from" | "away" | "distance" | "at distance" | "at a distance of" => {
            Ok(Some(Part::Distance))
        }
        "<=" | "=<" | "≤" | "<" | "±" | "+-" | "+/-" | "within" | "to" | "to within" | "error"
        | "error <=" | "is within" | "under" | "below" | "at most" | "max" => Ok(Some(Part::Error)),
        other => Err(not(format!("{other:?} is not understood"))),
    }
}

/// Units by name, each with the number of units per pixel or metre, as a divisor: 0.5 mm is then
/// exactly 0.0005 m.
const UNITS: [(&str, f64, Unit); 10] = [
    ("pixels", 1.0, Unit::Pixel),
    ("pixel", 1.0, Unit::Pixel),
    ("px", 1.0, Unit::Pixel),
    ("µm", 1e6, Unit::Metre),
    ("μm", 1e6, Unit::Metre),
    ("um", 1e6, Unit::Metre),
    ("mm", 1e3, Unit::Metre),
    ("cm", 1e2, Unit::Metre),
    ("m", 1.0, Unit::Metre),
    ("in", 1.0 / 0.0254, Unit::Metre),
];

/// Numbers of the lower-case `text`, each with unit and the word before.
fn quantities(text: &str) -> Result<Vec<Quantity<'_>>, NotAGoal> {
    let mut all = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let Some(start) = rest.find(|c: char| c.is_ascii_digit() || c == '.' || c == '-') else {
            return Err(not(format!("{:?} is not understood", rest.trim())));
        };
        // "+-" and "+/-" are words containing a minus.
        let start = if rest[..start].ends_with(['+', '/']) { start + 1 } else { start };
        let (word, tail) = rest.split_at(start);
        let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-');
        let end = tail.find(|c: char| !is_number(c)).unwrap_or(tail.len());
        let (number, tail) = tail.split_at(end);
        let tail = tail.trim_start();
        let end = tail.find(|c: char| !c.is_alphabetic()).unwrap_or(tail.len());
        let letters = &tail[..end];
        if letters.is_empty() {
            return Err(not(format!("{number:?} has no unit")));
        }
        // The next word may follow without a space, as in "800mmat2m".
        let ends_there = |name: &str| {
            let word = letters.strip_prefix(name);
            word.is_some_and(|word| part_after(word).is_ok())
        };
        let Some((name, factor, unit)) = UNITS.iter().find(|(name, ..)| ends_there(name)) else {
            return Err(not(format!("{letters:?} is not a unit (px, µm, mm, cm, m, in)")));
        };
        let tail = &tail[name.len()..];
        let value: f64 = number.parse().map_err(|_| not(format!("{number:?} is not a number")))?;
        let value = value / factor;
        if !(value.is_finite() && value > 0.0) {
            return Err(not(format!("{number:?} is not a positive number")));
        }
        all.push(Quantity {
            word: word.trim().trim_matches([',', ':']).trim(),
            value,
            unit: *unit,
        });
        rest = tail.trim_start();
    }
    Ok(all)
}

impl fmt::Display for AcceptanceGoal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Projection { px } => write!(f, "{px}px"),
            Self::Length { length_m, at_m, within_m } => {
                let (length, within) = (millimetres(length_m), millimetres(within_m));
                write!(f, "length {length}mm at {at_m}m <= {within}mm")
            }
        }
    }
}

impl TryFrom<String> for AcceptanceGoal {
    type Error = NotAGoal;

    fn try_from(text: String) -> Result<Self, NotAGoal> {
        text.parse()
    }
}

impl From<AcceptanceGoal> for String {
    fn from(goal: AcceptanceGoal) -> Self {
        goal.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENGTH: AcceptanceGoal =
        AcceptanceGoal::Length { length_m: 0.8, at_m: 2.0, within_m: 0.0005 };

    #[test]
    fn goals_are_read_as_people_write_them() {
        for text in [
            "length 800mm at 2m <= 0.5mm",
            "length 800 mm at 2 m <= 0.5 mm",
            "length800mmat2m<=0.5mm",
            "800mm at 2m within 0.5mm",
            "80 cm @ 200cm ≤ .5mm",
            "Length of 0.8m at 2M <0.5mm",
            "800mm at 2m ± 500µm",
            "800mm at 2m +-0.5mm",
            "0.5mm over 800mm at 2m",
            "at 2m, 800mm to 0.5mm",
            "length: 800mm at 2m to within 0.5mm",
        ] {
            assert_eq!(text.parse(), Ok(LENGTH), "{text}");
        }
        for text in ["0.2px", "0.2 px", "0.2 pixels", "projection <= 0.2px", "≤ 0.2 PX", ".2px"] {
            assert_eq!(text.parse(), Ok(AcceptanceGoal::Projection { px: 0.2 }), "{text}");
        }
    }

    #[test]
    fn what_is_no_goal_is_refused_with_a_reason_and_an_example() {
        for (text, reason) in [
            ("", "no number"),
            ("good", "not understood"),
            ("0.2", "has no unit"),
            ("0.2 furlong", "not a unit (px, µm, mm, cm, m, in)"),
            ("800 metres at 2m <= 1mm", "\"metres\" is not a unit"),
            ("0px", "not a positive"),
            ("-1px", "not a positive"),
            ("1.2.3px", "not a number"),
            ("800mm at 2m", "error accepted is missing"),
            ("800mm <= 0.5mm", "distance is missing"),
            ("at 2m <= 0.5mm", "length to measure is missing"),
            ("800mm at 2m <= 0.5px", "can't be mixed"),
            ("800mm at 2m <= 900mm", "as large as the length"),
            ("800mm at 2m at 3m <= 1mm", "the same"),
            ("800mm near 2m <= 0.5mm", "\"near\" is not understood"),
            ("0.2px please", "not understood"),
        ] {
            let refused = text.parse::<AcceptanceGoal>().expect_err(text).to_string();
            assert!(refused.contains(reason), "{text}: {refused}");
            assert!(refused.contains("length 800mm at 2m <= 0.5mm"), "{refused}");
        }
    }

    #[test]
    fn a_goal_reads_itself() {
        let odd = AcceptanceGoal::Length { length_m: 0.033, at_m: 0.75, within_m: 0.000_01 };
        for goal in [LENGTH, odd, AcceptanceGoal::Projection { px: 0.125 }] {
            assert_eq!(goal.to_string().parse(), Ok(goal));
        }
    }
}
