//! Every camera over time as one HTML page.

use nalgebra::Point2;

use boresight_present::chart::{Axes, COLOURS, Canvas, Stroke, escaped};
use boresight_station::report::{self as watched, WatchedCurve};

const STYLE: &str = "\
body{font:11pt/1.4 'Liberation Sans',Arial,Helvetica,sans-serif;color:#111;max-width:1100px;margin:1rem auto;padding:0 1rem}
h1{font-size:18pt}h2{font-size:13pt;margin:1.6em 0 .3em}h3{font-size:11pt;margin:1.2em 0 .2em;overflow-wrap:anywhere}
table{border-collapse:collapse;width:100%}th,td{border-bottom:1px solid #ccc;padding:.15em .5em;text-align:left;overflow-wrap:anywhere}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(260px,1fr));gap:.5rem}
.charts svg,section>figure svg{width:100%;height:auto}figure{margin:0}
.drifts{border-left:4px solid #b00000;padding-left:.6rem}
p{margin:.2em 0}
";

/// Standard deviations of the drawn intervals.
const SDS: f64 = 1.96;

/// Contents of the page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HistoryPage {
    /// Time of reading the index, in words.
    pub made: String,
    /// Age from which a camera is due, in words.
    pub due_after: String,
    /// Line per model.
    pub models: Vec<ModelLine>,
    /// All cameras, drifting ones first.
    pub cameras: Vec<CameraCurve>,
    /// Watched cameras.
    pub watched: Vec<WatchedCurve>,
}

/// Cameras of a model.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelLine {
    /// Name of the model.
    pub model: String,
    /// Number of cameras.
    pub cameras: usize,
    /// Number of calibrations.
    pub calibrations: usize,
    /// Drifting cameras.
    pub drifting: usize,
    /// Cameras due for calibration.
    pub due: usize,
}

/// Camera with calibrations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraCurve {
    /// Name of the camera and size of its pictures.
    pub name: String,
    /// Trend in words.
    pub trend: String,
    /// True if the calibrations drift by more than chance.
    pub drifts: bool,
    /// Reason for the next calibration being due, in words; empty if not due.
    pub due: String,
    /// Usable calibrations of the camera, by time.
    pub points: Vec<CurvePoint>,
}

/// Calibration of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurvePoint {
    /// Days since the camera's first calibration.
    pub day: f64,
    /// Focal length, principal point x and y, px.
    pub f_pp_px: [f64; 3],
    /// Standard deviations of `f_pp_px`, px.
    pub sd_px: [f64; 3],
}

/// History page: one self-contained HTML file, and well-formed XML.
pub fn history_page(page: &HistoryPage) -> String {
    let HistoryPage { made, due_after, models, cameras, watched } = page;
    let drifting = cameras.iter().filter(|camera| camera.drifts).count();
    let due = cameras.iter().filter(|camera| !camera.due.is_empty()).count();
    let mut said = String::new();
    if !cameras.is_empty() || watched.is_empty() {
        said += &format!(
            "Cameras: {}; changed: {drifting}; due (older than {}): {due}. ",
            cameras.len(),
            escaped(due_after)
        );
    }
    if !watched.is_empty() {
        said += &format!("Watched cameras: {}. ", watched.len());
    }
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/><title>Cameras over time</title><style>\n{STYLE}</style></head><body>\n<h1>Cameras over time</h1>\n<p>{said}Made {}.</p>\n",
        escaped(made),
    );
    if !watched.is_empty() {
        html += "<h2>Watched</h2>\n<p>Dots are pictures: above 0 the camera points to the left or down, is turned anticlockwise, or shows everything larger. The line is what repeats daily, the band the smallest change that's found within two days; both are known after three days. Broken lines are what happened, listed below each drawing.</p>\n";
        html.extend(watched.iter().map(watched::section));
    }
    if models.is_empty() {
        return html + "</body></html>\n";
    }
    html += "<h2>By model</h2>\n<table><thead><tr><th>Model</th><th class=\"n\">Cameras</th><th class=\"n\">Calibrations</th><th class=\"n\">Changed</th><th class=\"n\">Due</th></tr></thead><tbody>\n";
    for ModelLine { model, cameras, calibrations, drifting, due } in models {
        let model = if model.is_empty() { "(no name)" } else { model };
        html += &format!(
            "<tr><td>{}</td><td class=\"n\">{cameras}</td><td class=\"n\">{calibrations}</td><td class=\"n\">{drifting}</td><td class=\"n\">{due}</td></tr>\n",
            escaped(model)
        );
    }
    html += "</tbody></table>\n<h2>By camera</h2>\n<p>Bars are 95 % intervals. A change is judged as <code>boresight check</code> judges it: against the uncertainty of both sides, at 1 %. The oldest quarter of a camera's calibrations is compared with the newest quarter and with the newest.</p>\n";
    for camera in cameras {
        html += &section(camera);
    }
    html + "</body></html>\n"
}

fn section(camera: &CameraCurve) -> String {
    let class = if camera.drifts { " class=\"drifts\"" } else { "" };
    let mut html = format!(
        "<section{class}><h3>{}</h3><p>{}</p>\n",
        escaped(&camera.name),
        escaped(&camera.trend)
    );
    if !camera.due.is_empty() {
        html += &format!("<p>{}</p>\n", escaped(&camera.due));
    }
    if camera.points.len() > 1 {
        let names = ["focal length, px", "principal point x, px", "principal point y, px"];
        html += "<div class=\"charts\">";
        for (i, name) in names.into_iter().enumerate() {
            html += &format!("<figure>{}</figure>", curve(&camera.points, i, name));
        }
        html += "</div>\n";
    }
    html + "</section>\n"
}

/// Curve of a parameter over time with intervals.
fn curve(points: &[CurvePoint], parameter: usize, name: &str) -> String {
    let at = |point: &CurvePoint, sds: f64| {
        Point2::new(point.day, point.f_pp_px[parameter] + sds * point.sd_px[parameter])
    };
    let ends: Vec<Point2<f64>> =
        points.iter().flat_map(|point| [at(point, -SDS), at(point, SDS)]).collect();
    let axes = Axes { x: "days", y: name, pixels: false };
    let mut canvas = Canvas::chart(&ends, axes, name);
    let values: Vec<Point2<f64>> = points.iter().map(|point| at(point, 0.0)).collect();
    canvas.curve(&values, Stroke { colour: "#999", width: 0.8, dash: 1 });
    for (point, value) in points.iter().zip(values) {
        canvas.curve(&[at(point, -SDS), at(point, SDS)], Stroke::thin(COLOURS[0]));
        canvas.dot(value, 2.4);
    }
    canvas.svg()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_whole_whatever_a_camera_calls_itself() {
        let point = |day| CurvePoint { day, f_pp_px: [900.0 + day, 320.0, 240.0], sd_px: [0.1; 3] };
        let camera = CameraCurve {
            name: "<b>&\"'\u{1b}".into(),
            trend: "The focal length has changed".into(),
            drifts: true,
            points: vec![point(0.0), point(30.0)],
            ..CameraCurve::default()
        };
        let models = vec![ModelLine { model: "<i>".into(), cameras: 1, ..ModelLine::default() }];
        let page = HistoryPage { models, cameras: vec![camera], ..HistoryPage::default() };
        let html = history_page(&page);
        let xml = html.replacen("<!DOCTYPE html>", "", 1);
        let tree = roxmltree::Document::parse(&xml).expect("well-formed");
        assert_eq!(tree.descendants().filter(|node| node.has_tag_name("figure")).count(), 3);
        assert!(html.contains("&lt;b&gt;"));
    }
}
