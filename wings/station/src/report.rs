//! A watched camera over time as one drawing: four curves with their daily pattern, and events, on
//! one axis.

use std::fmt::Write;

use boresight_present::chart::{COLOURS, escaped, short, ticks};

/// Width of the drawing, in drawing units.
const WIDTH: f64 = 900.0;
const STRIP: f64 = 105.0;
const GAP: f64 = 14.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 10.0;
const TOP: f64 = 22.0;
const BOTTOM: f64 = 36.0;
/// Maximum number of dots per curve: a drawing can't resolve more.
const MOST_DOTS: usize = 1500;
/// Curves and units.
const NAMES: [&str; 4] = ["pan, px", "tilt, px", "roll, °", "focal, %"];

/// Watched camera over time. Arrays of four numbers are pan and tilt (px), roll (degrees), and
/// focal length (per cent).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WatchedCurve {
    /// Name of the camera.
    pub name: String,
    /// Newest state in words.
    pub sentence: String,
    /// First day of watching, in words.
    pub began: String,
    /// Pictures with an answer, by time.
    pub points: Vec<WatchedPoint>,
    /// Events, by time.
    pub events: Vec<WatchedEvent>,
}

/// Single picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WatchedPoint {
    /// Days since the first picture.
    pub day: f64,
    /// Pointing of the camera.
    pub value: [f64; 4],
    /// Usual pointing at this hour, and the smallest visible change; `None` while learning.
    pub usual: Option<[[f64; 4]; 2]>,
}

/// Event of a camera.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WatchedEvent {
    /// Seconds since the first picture; negative before it.
    pub secs: i64,
    /// Time in words.
    pub when: String,
    /// Event in words.
    pub what: String,
}

impl WatchedEvent {
    fn day(&self) -> f64 {
        self.secs as f64 / 86_400.0
    }
}

/// SVG drawing.
pub fn watched_chart(curve: &WatchedCurve) -> String {
    let height = TOP + 4.0 * STRIP + 3.0 * GAP + BOTTOM;
    let last = curve.points.last().map_or(1.0, |point| point.day).max(0.1);
    let first = curve.events.iter().map(WatchedEvent::day).fold(0.0, f64::min);
    // An event from long before would leave the pictures no room; such an event is only listed.
    let first = if first < -0.1 * last { 0.0 } else { first };
    let x = |day: f64| LEFT + (WIDTH - LEFT - RIGHT) * (day - first) / (last - first);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"Liberation Sans,Arial,sans-serif\" font-size=\"12\" role=\"img\"><title>{}</title>\n<rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n",
        escaped(&curve.name)
    );
    for (i, name) in NAMES.into_iter().enumerate() {
        strip(&mut svg, curve, (i, name), TOP + i as f64 * (STRIP + GAP), &x);
    }
    let bottom = height - BOTTOM;
    for tick in ticks(first, last) {
        put(
            &mut svg,
            format_args!(
                "<line x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"{bottom}\" y2=\"{1}\" stroke=\"#888\"/><text x=\"{0:.1}\" y=\"{2}\" text-anchor=\"middle\">{3}</text>\n",
                x(tick),
                bottom + 4.0,
                bottom + 16.0,
                short(tick)
            ),
        );
    }
    put(
        &mut svg,
        format_args!(
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">days since {}</text>\n",
            0.5 * (WIDTH + LEFT),
            height - 6.0,
            escaped(&curve.began)
        ),
    );
    // A number that would overlap the previous one is placed beside it.
    let mut free = 0.0;
    for (n, event) in curve.events.iter().enumerate() {
        let at = x(event.day());
        if at < LEFT - 0.5 {
            continue;
        }
        let label = at.max(free);
        free = label + 15.0;
        put(
            &mut svg,
            format_args!(
                "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{TOP}\" y2=\"{bottom}\" stroke=\"#b00000\" stroke-width=\"0.9\" stroke-dasharray=\"5 3\"/><text x=\"{label:.1}\" y=\"15\" text-anchor=\"middle\" font-weight=\"bold\" fill=\"#b00000\">{}</text>\n",
                n + 1
            ),
        );
    }
    svg + "</svg>"
}

fn strip(
    svg: &mut String,
    curve: &WatchedCurve,
    (i, name): (usize, &str),
    top: f64,
    x: &impl Fn(f64) -> f64,
) {
    let band = |point: &WatchedPoint| {
        point.usual.map(|[usual, visible]| [usual[i] - visible[i], usual[i] + visible[i]])
    };
    let all = curve.points.iter().flat_map(|p| {
        let [low, high] = band(p).unwrap_or([p.value[i]; 2]);
        [p.value[i], low, high]
    });
    let (low, high) =
        all.filter(|v| v.is_finite()).fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
    let (low, high) = if high > low { (low, high) } else { (-1.0, 1.0) };
    let room = 0.05 * (high - low);
    let (low, high) = (low - room, high + room);
    let y = |value: f64| top + STRIP * (high - value) / (high - low);
    let right = WIDTH - RIGHT;
    for tick in ticks(low, high).into_iter().filter(|tick| (low..=high).contains(tick)) {
        put(
            svg,
            format_args!(
                "<line x1=\"{LEFT}\" x2=\"{right}\" y1=\"{0:.1}\" y2=\"{0:.1}\" stroke=\"#e4e4e4\"/><text x=\"{1}\" y=\"{2:.1}\" text-anchor=\"end\">{3}</text>\n",
                y(tick),
                LEFT - 5.0,
                y(tick) + 4.0,
                short(tick)
            ),
        );
    }
    put(
        svg,
        format_args!(
            "<rect x=\"{LEFT}\" y=\"{top}\" width=\"{}\" height=\"{STRIP}\" fill=\"none\" stroke=\"#888\"/><text transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{name}</text>\n",
            right - LEFT,
            top + 0.5 * STRIP
        ),
    );
    let every = curve.points.len().div_ceil(MOST_DOTS).max(1);
    let drawn: Vec<&WatchedPoint> = curve.points.iter().step_by(every).collect();
    // When learning restarts, the band restarts.
    for known in drawn.split(|point| point.usual.is_none()).filter(|known| known.len() > 1) {
        let at = |end: usize, p: &WatchedPoint| {
            let value = band(p).map_or(f64::NAN, |band| band[end]);
            format!("{:.1},{:.1} ", x(p.day), y(value))
        };
        let lower = known.iter().map(|p| at(0, p));
        let edge: String = lower.chain(known.iter().rev().map(|p| at(1, p))).collect();
        let line: String = known
            .iter()
            .filter_map(|p| Some(format!("{:.1},{:.1} ", x(p.day), y(p.usual?[0][i]))))
            .collect();
        put(
            svg,
            format_args!(
                "<polygon points=\"{}\" fill=\"#cfe3f1\" fill-opacity=\"0.7\"/><polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.2\"/>\n",
                edge.trim_end(),
                line.trim_end(),
                COLOURS[0]
            ),
        );
    }
    let mut dots = String::new();
    for p in drawn {
        put(&mut dots, format_args!("M{:.1} {:.1}h0", x(p.day), y(p.value[i])));
    }
    put(
        svg,
        format_args!(
            "<path d=\"{dots}\" stroke=\"#222\" stroke-width=\"2\" stroke-linecap=\"round\"/>\n"
        ),
    );
}

fn put(text: &mut String, what: std::fmt::Arguments<'_>) {
    // Writing into a String can't fail.
    let _ = text.write_fmt(what);
}

/// Section of the camera on a page.
pub fn section(curve: &WatchedCurve) -> String {
    let mut html = format!(
        "<section><h3>{}</h3><p>{}</p>\n<figure>{}</figure>\n",
        escaped(&curve.name),
        escaped(&curve.sentence),
        watched_chart(curve)
    );
    if !curve.events.is_empty() {
        html += "<ol>";
        for event in &curve.events {
            html += &format!("<li>{}: {}</li>", escaped(&event.when), escaped(&event.what));
        }
        html += "</ol>\n";
    }
    html + "</section>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve() -> WatchedCurve {
        let points = (0..400).map(|n| {
            let day = f64::from(n) / 48.0;
            let value = [0.5 * libm::sin(day), 0.0, 0.01, f64::from(u8::from(day > 6.0))];
            let usual = (day > 1.0).then_some([[0.0; 4], [0.8, 0.8, 0.05, 0.1]]);
            WatchedPoint { day, value, usual }
        });
        let event =
            |secs, what: &str| WatchedEvent { secs, when: "noon".into(), what: what.into() };
        WatchedCurve {
            name: "<gate> & co".into(),
            points: points.collect(),
            events: vec![
                event(-900_000, "calibrated"),
                event(520_000, "ZOOM"),
                event(520_100, "OK"),
            ],
            ..WatchedCurve::default()
        }
    }

    #[test]
    fn four_curves_share_an_axis_with_what_happened() {
        let html = section(&curve());
        let tree = roxmltree::Document::parse(&html).expect("well-formed");
        let count = |name: &str| tree.descendants().filter(|n| n.has_tag_name(name)).count();
        let svg = |name: &'static str| ("http://www.w3.org/2000/svg", name);
        let of_svg = |name| tree.descendants().filter(|n| n.has_tag_name(svg(name))).count();
        assert_eq!((of_svg("polygon"), of_svg("polyline"), of_svg("path")), (4, 4, 4));
        // The calibration precedes the first picture by far, so it is only listed; labels don't
        // hide each other.
        assert_eq!((count("li"), html.matches("stroke-dasharray").count()), (3, 2));
        let labels: Vec<f64> = tree
            .descendants()
            .filter(|n| n.attribute("fill") == Some("#b00000"))
            .filter_map(|n| n.attribute("x")?.parse().ok())
            .collect();
        assert!(labels[1] - labels[0] > 12.0, "{labels:?}");
        assert!(!html.contains("NaN"));
    }

    #[test]
    fn a_camera_without_pictures_is_drawn_empty() {
        let html = section(&WatchedCurve::default());
        assert!(roxmltree::Document::parse(&html).is_ok() && !html.contains("NaN"), "{html}");
    }
}
