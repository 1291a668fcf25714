//! Drawings with two axes, as SVG text.

use std::fmt::Write;

use super::escaped;

/// Colours distinguishable in print and by most eyes (Okabe & Ito 2008).
pub const COLOURS: [&str; 7] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#444444"];

const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 46.0;
/// Maximum number of names placed among the curves.
const NAMES_INSIDE: usize = 5;

/// Curve or point cloud.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend.
    pub label: String,
    /// Points (x, y), in units of the axes.
    pub points: Vec<(f64, f64)>,
    /// True for a line through the points, false for marks.
    pub line: bool,
}

impl Series {
    /// Curve through `points`.
    pub fn line(label: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { label: label.into(), points, line: true }
    }

    /// Marks without a line.
    pub fn cloud(label: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { label: label.into(), points, line: false }
    }
}

/// Axes with curves and clouds.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Heading above the axes.
    pub title: String,
    /// Label of the horizontal axis.
    pub x: String,
    /// Label of the vertical axis.
    pub y: String,
    /// Curves and clouds, in the order of the colours.
    pub series: Vec<Series>,
    /// True for equal units on both axes and y pointing down, as in a picture.
    pub picture: bool,
    /// True for a logarithmic vertical axis.
    pub log_y: bool,
}

impl Plot {
    /// Plot with linear axes of independent scales.
    pub fn new(title: &str, x: &str, y: &str, series: Vec<Series>) -> Self {
        Self { title: title.into(), x: x.into(), y: y.into(), series, picture: false, log_y: false }
    }

    /// SVG drawing, 420 × 320 units; wider if there are too many names to place among the curves.
    pub fn svg(&self) -> String {
        let (inner_width, inner_height) = (420.0 - LEFT - RIGHT, 320.0 - TOP - BOTTOM);
        let beside = self.series.len() > NAMES_INSIDE;
        let (width, height) = (if beside { 540.0 } else { 420.0 }, 320.0);
        let value = |y: f64| if self.log_y { libm::log10(y.max(1e-9)) } else { y };
        let points = || self.series.iter().flat_map(|series| &series.points);
        let range = |values: Vec<f64>| {
            let finite = values.iter().copied().filter(|value| value.is_finite());
            let (low, high) =
                finite.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
            if low > high {
                return (0.0, 1.0);
            }
            let spare = 0.05 * (high - low).max(1e-9 * high.abs()).max(1e-12);
            (low - spare, high + spare)
        };
        let (mut x_low, mut x_high) = range(points().map(|point| point.0).collect());
        let (mut y_low, mut y_high) = range(points().map(|point| value(point.1)).collect());
        if self.picture {
            let per_unit = ((x_high - x_low) / inner_width).max((y_high - y_low) / inner_height);
            let (x_middle, y_middle) = (0.5 * (x_low + x_high), 0.5 * (y_low + y_high));
            let (half_x, half_y) = (0.5 * per_unit * inner_width, 0.5 * per_unit * inner_height);
            (x_low, x_high) = (x_middle - half_x, x_middle + half_x);
            // SVG's y axis points down.
            (y_low, y_high) = (y_middle + half_y, y_middle - half_y);
        }
        let across = |x: f64| LEFT + (x - x_low) / (x_high - x_low) * inner_width;
        let up = |y: f64| TOP + (y_high - y) / (y_high - y_low) * inner_height;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"11\" role=\"img\" aria-label=\"{title}\">\n<text x=\"{middle}\" y=\"16\" text-anchor=\"middle\" font-weight=\"bold\">{title}</text>\n<rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{inner_width}\" height=\"{inner_height}\" fill=\"none\" stroke=\"#888\"/>\n",
            title = escaped(&self.title),
            middle = LEFT + inner_width / 2.0,
        );
        for x in ticks(x_low, x_high) {
            let at = across(x);
            push(
                &mut svg,
                format_args!(
                    "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{TOP}\" y2=\"{:.1}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n",
                    TOP + inner_height,
                    TOP + inner_height + 14.0,
                    short(x)
                ),
            );
        }
        let (y_least, y_most) = (y_low.min(y_high), y_low.max(y_high));
        let y_ticks = if self.log_y { log_ticks(y_least, y_most) } else { ticks(y_least, y_most) };
        for y in y_ticks {
            let at = up(y);
            let label = if self.log_y { short(libm::pow(10.0, y)) } else { short(y) };
            push(
                &mut svg,
                format_args!(
                    "<line x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>\n",
                    LEFT + inner_width,
                    LEFT - 5.0,
                    at + 4.0
                ),
            );
        }
        push(
            &mut svg,
            format_args!(
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\n<text transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                LEFT + inner_width / 2.0,
                height - 10.0,
                escaped(&self.x),
                TOP + inner_height / 2.0,
                escaped(&self.y)
            ),
        );
        for (k, series) in self.series.iter().enumerate() {
            let colour = COLOURS[k % COLOURS.len()];
            let places: Vec<(f64, f64)> = series
                .points
                .iter()
                .filter(|point| point.0.is_finite() && point.1.is_finite())
                .map(|point| (across(point.0), up(value(point.1))))
                .collect();
            if series.line {
                let path: Vec<String> =
                    places.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
                push(
                    &mut svg,
                    format_args!(
                        "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"{}/>\n",
                        path.join(" "),
                        DASHES[k % DASHES.len()]
                    ),
                );
            }
            for (x, y) in &places {
                push(&mut svg, format_args!("{}\n", mark(k, *x, *y, colour)));
            }
            if !series.label.is_empty() {
                let x = if beside { LEFT + inner_width + 12.0 } else { LEFT + 8.0 };
                let y = TOP + 14.0 + 14.0 * k as f64;
                push(
                    &mut svg,
                    format_args!(
                        "{}<text x=\"{:.1}\" y=\"{y:.1}\" paint-order=\"stroke\" stroke=\"#fff\" stroke-width=\"3\">{}</text>\n",
                        mark(k, x, y - 4.0, colour),
                        x + 9.0,
                        escaped(&series.label)
                    ),
                );
            }
        }
        svg + "</svg>\n"
    }
}

/// Dash patterns, to tell curves apart without colour.
pub const DASHES: [&str; 4] =
    ["", " stroke-dasharray=\"6 3\"", " stroke-dasharray=\"2 2\"", " stroke-dasharray=\"8 3 2 3\""];

/// The `k`-th kind of mark at (`x`, `y`), as SVG.
pub fn mark(k: usize, x: f64, y: f64, colour: &str) -> String {
    match k % 4 {
        0 => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.2\" fill=\"{colour}\"/>"),
        1 => format!(
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"4.4\" height=\"4.4\" fill=\"{colour}\"/>",
            x - 2.2,
            y - 2.2
        ),
        2 => format!("<path d=\"M{:.1} {:.1}l2.8 4.6h-5.6z\" fill=\"{colour}\"/>", x, y - 2.8),
        _ => format!(
            "<path d=\"M{:.1} {:.1}l4.4 4.4m0 -4.4l-4.4 4.4\" stroke=\"{colour}\" fill=\"none\"/>",
            x - 2.2,
            y - 2.2
        ),
    }
}

/// About five round numbers between `low` and `high`.
pub fn ticks(low: f64, high: f64) -> Vec<f64> {
    let rough = (high - low) / 5.0;
    if !(rough > 0.0 && rough.is_finite()) {
        return Vec::new();
    }
    let power = libm::pow(10.0, libm::log10(rough).floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].into_iter().find(|s| s * power >= rough).unwrap_or(10.0) * power;
    let first = (low / step).ceil() as i64;
    (first..=(high / step).floor() as i64).map(|k| k as f64 * step).collect()
}

/// Logarithms of 1, 2 and 5 times powers of ten between two logarithms.
fn log_ticks(low: f64, high: f64) -> Vec<f64> {
    if !((high - low) < 12.0) {
        return Vec::new();
    }
    let digits: &[f64] = match high - low {
        span if span > 2.0 => &[1.0],
        span if span > 0.8 => &[1.0, 2.0, 5.0],
        _ => &[1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0],
    };
    (low.floor() as i32..=high.ceil() as i32)
        .flat_map(|power| digits.iter().map(move |digit| libm::log10(*digit) + f64::from(power)))
        .filter(|tick| (low..=high).contains(tick))
        .collect()
}

/// Short text of `value`, for axis labels.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else if value.abs() >= 1e5 || value.abs() < 1e-3 {
        format!("{value:.0e}")
    } else {
        let text = format!("{value:.3}");
        text.trim_end_matches('0').trim_end_matches('.').into()
    }
}

/// Appends to `svg`; cannot fail.
pub fn push(svg: &mut String, part: std::fmt::Arguments<'_>) {
    svg.write_fmt(part).ok();
}
