//! Sentences of the gauges beside the picture.

use super::{deg, percent};

/// Gauge beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gauge {
    /// Angle between board and image plane.
    Tilt,
    /// Direction of the tilt.
    Direction,
    /// Share of the picture spanned by the board.
    Size,
    /// Offset across the wanted principal line.
    Across,
    /// Motion of the board.
    Still,
    /// Blur of the board's edges.
    Sharp,
}

impl Gauge {
    /// All gauges, in display order.
    pub const ALL: [Self; 6] =
        [Self::Tilt, Self::Direction, Self::Size, Self::Across, Self::Still, Self::Sharp];

    /// Name of the gauge.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tilt => "Tilt",
            Self::Direction => "Direction",
            Self::Size => "Size",
            Self::Across => "Sideways",
            Self::Still => "Motion",
            Self::Sharp => "Blur",
        }
    }

    /// Explanation of the measured quantity.
    pub fn tip(self) -> &'static str {
        match self {
            Self::Tilt => "How far the board is tipped away from the camera.",
            Self::Direction => "How far the tilt's direction is from the one asked for.",
            Self::Size => "How much of the picture's width or height the corners span.",
            Self::Across => {
                "How far the board's middle is from the outline's, across its principal line. Only this bends the line."
            }
            Self::Still => "How fast the corners move in the picture.",
            Self::Sharp => "Width of the blur of the board's edges.",
        }
    }

    /// Measured value, and requested value or limit, in words; a dash for `None`.
    pub fn words(self, value: Option<f64>, aim: f64) -> String {
        let measured = |unit: &dyn Fn(f64) -> String| value.map_or("–".into(), unit);
        match self {
            Self::Tilt => {
                format!("{} (aim for {}°)", measured(&|v| format!("{}°", deg(v))), deg(aim))
            }
            Self::Direction => {
                format!("{} (up to {}°)", measured(&|v| format!("{}° off", deg(v.abs()))), deg(aim))
            }
            Self::Size => format!("{} (aim for {})", measured(&|v| percent(v)), percent(aim)),
            Self::Across => {
                format!("{} (up to {aim:.0})", measured(&|v| format!("{:.0} px", v.abs())))
            }
            Self::Still => {
                format!("{} (calm: {aim:.0} px/s)", measured(&|v| format!("{v:.0} px/s")))
            }
            Self::Sharp => format!("{} (up to {aim:.1})", measured(&|v| format!("{v:.1} px"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauges_give_the_value_and_what_is_asked_for() {
        let tilt_rad = |degrees: f64| degrees.to_radians();
        assert_eq!(Gauge::Tilt.words(Some(tilt_rad(22.0)), tilt_rad(40.0)), "22° (aim for 40°)");
        assert_eq!(Gauge::Size.words(Some(0.6), 0.74), "60 % (aim for 74 %)");
        assert_eq!(Gauge::Still.words(None, 38.0), "– (calm: 38 px/s)");
    }
}
