//! Changes planted into a street, as text: `pan=5px@2d`, `fog=0.7@3d..3.25d`.

/// Quantity changed by a planted change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// The scene moves to the right, px in the middle of the picture.
    Pan,
    /// The scene moves down, px.
    Tilt,
    /// The scene turns clockwise, degrees.
    Roll,
    /// Everything becomes larger, per cent.
    Focal,
    /// Blur, σ in px.
    Blur,
    /// Opacity of a spot of dirt.
    Dirt,
    /// Fog, as the lost share of the contrast.
    Fog,
    /// Covered lens.
    Cover,
    /// Switch to infrared and own light in the dark; everything becomes larger, per cent.
    Infrared,
}

/// Change between two days.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planted {
    /// Changed quantity.
    pub what: What,
    /// Amount, in the unit of [`What`].
    pub amount: f64,
    /// First day, and day of the end.
    pub days: [f64; 2],
}

/// Error of a text that isn't a street.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is none of a seed, days=N, sway=N, presets=N, text, or a change such as pan=2px@5d, tilt, roll=0.1deg@5d, focal=0.3%@5d, blur=1px@5d, dirt=0.9@5d, fog=0.7@5d..6d, cover=1@5d, infrared=0.3%@0d"
)]
pub struct NoStreet(pub(super) String);

impl Planted {
    /// Parses `WHAT=AMOUNT@DAY` or `WHAT=AMOUNT@DAY..DAY`.
    ///
    /// # Errors
    ///
    /// [`NoStreet`].
    pub fn parse(text: &str) -> Result<Self, NoStreet> {
        let wrong = || NoStreet(text.into());
        let (what, rest) = text.split_once('=').ok_or_else(wrong)?;
        let (amount, days) = rest.split_once('@').ok_or_else(wrong)?;
        let what = match what {
            "pan" => What::Pan,
            "tilt" => What::Tilt,
            "roll" => What::Roll,
            "focal" => What::Focal,
            "blur" => What::Blur,
            "dirt" => What::Dirt,
            "fog" => What::Fog,
            "cover" => What::Cover,
            "infrared" => What::Infrared,
            _ => return Err(wrong()),
        };
        let number = |text: &str| {
            let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic() || c == '%');
            digits.parse::<f64>().ok().filter(|v| v.is_finite() && v.abs() < 1e4).ok_or_else(wrong)
        };
        let (from, to) = days.split_once("..").map_or((days, "9999d"), |(from, to)| (from, to));
        Ok(Self { what, amount: number(amount)?, days: [number(from)?, number(to)?] })
    }

    /// Amount on a day.
    pub(super) fn amount_at(&self, day: f64) -> f64 {
        if (self.days[0]..self.days[1]).contains(&day) { self.amount } else { 0.0 }
    }
}
