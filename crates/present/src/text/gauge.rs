//! Sentences of the gauges beside the picture.

use super::{deg, percent};

/// A gauge's name and explanation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gauge {
    /// Angle between board and image plane.
    Tilt,
    /// Direction in which the board is tipped.
    Direction,
    /// Share of the picture that the board spans.
    Size,
    /// Offset across the wanted principal line.
    Across,
    /// Motion of the board.
    Still,
    /// Blur of the board's edges.
    Sharp,
}

impl Gauge {
    /// All, in the order in which they are shown.
    pub const ALL: [Self; 6] =
        [Self::Tilt, Self::Direction, Self::Size, Self::Across, Self::Still, Self::Sharp];

    /// Name of the gauge.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tilt => "Tilt",
            Self::Direction => "Direction",
            Self::Size => "Size",
            Self::Across => "Off the line",
            Self::Still => "Motion",
            Self::Sharp => "Blur",
        }
    }

    /// Explanation of the measured quantity.
    pub fn tip(self) -> &'static str {
        match self {
            Self::Tilt => "How far the board is tipped away from the camera.",
            Self::Direction => "How far the tilt direction is from the target.",
            Self::Size => "How much of the picture's width or height the corners span.",
            Self::Across => {
                "How far the board's middle is from the target, across its principal line. Only this bends the line."
            }
            Self::Still => "How fast the corners move in the picture.",
            Self::Sharp => "Width of the blur of the board's edges.",
        }
    }

    /// The measured value and its limits, in words; a dash for `None`.
    pub fn words(self, value: Option<f64>, wanted: (f64, f64)) -> String {
        let (low, high) = wanted;
        let measured = |unit: &dyn Fn(f64) -> String| value.map_or("–".into(), unit);
        match self {
            Self::Tilt => {
                format!("{} ({}–{}°)", measured(&|v| format!("{}°", deg(v))), deg(low), deg(high))
            }
            Self::Direction => format!(
                "{} (within {}°)",
                measured(&|v| format!("{}° off", deg(v.abs()))),
                deg(high)
            ),
            Self::Size => {
                format!("{} (at least {})", measured(&|v| percent(v)), percent(low))
            }
            Self::Across => {
                format!("{} (within {high:.0} px)", measured(&|v| format!("{:.0} px", v.abs())))
            }
            Self::Still => {
                format!("{} (calm: {high:.0} px/s)", measured(&|v| format!("{v:.0} px/s")))
            }
            Self::Sharp => {
                format!("{} (at most {high:.1} px)", measured(&|v| format!("{v:.1} px")))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauges_give_the_value_and_its_limits() {
        let limits = (30_f64.to_radians(), 55_f64.to_radians());
        assert_eq!(Gauge::Tilt.words(Some(22_f64.to_radians()), limits), "22° (30–55°)");
        assert_eq!(Gauge::Still.words(None, (0.0, 38.0)), "– (calm: 38 px/s)");
    }
}
