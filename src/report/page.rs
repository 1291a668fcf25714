//! The page as a whole.

use super::{
    Report, drift, estimates, lens_curve, picture_maps, projection_map, skip, summary, views,
};
use crate::{chart::escaped, text::report as words};

/// Sizes are of paper: the page is read on a screen as it is printed.
const STYLE: &str = "\
@page{size:A4;margin:9mm 10mm}
*{box-sizing:border-box}
html{background:#e8e8e8}
body{font:9.5pt/1.32 'Liberation Sans',Arial,Helvetica,sans-serif;color:#111;background:#fff;width:210mm;max-width:100%;margin:1rem auto;padding:9mm 10mm;-webkit-print-color-adjust:exact;print-color-adjust:exact}
h1{font-size:13pt;margin:0 0 1.5mm;overflow-wrap:anywhere}
h2{font-size:9.5pt;margin:0 0 .8mm}
section{margin:0 0 2.4mm;break-inside:avoid}
p{margin:0 0 .8mm}
.box{border:.7mm solid #111;padding:2mm 3mm}
.box h2{display:none}
.lead{font-size:12pt}
.simulated{font-size:14pt;font-weight:bold;color:#b00000;border:.7mm solid #b00000;padding:1mm 3mm;text-align:center}
.sign{display:inline-block;min-width:1.5em;text-align:center;border:.5mm solid #111;border-radius:50%;font-weight:bold}
.two{display:grid;grid-template-columns:1fr 1fr;gap:0 5mm;align-items:start;margin-bottom:1.2mm}
.wide{grid-template-columns:1.22fr .78fr}
section.wide{display:grid}
.narrow{grid-template-columns:1.9fr 1fr}
.three{display:grid;grid-template-columns:repeat(3,1fr);gap:1mm 4mm;align-items:start;margin-bottom:2.4mm}
table{border-collapse:collapse;width:100%;font-size:8pt}
th,td{border-bottom:.2mm solid #ccc;padding:.25mm .8mm;text-align:left;vertical-align:top;font-weight:normal;overflow-wrap:break-word}
td{overflow-wrap:anywhere}
thead th{font-weight:bold;text-align:center}
caption{text-align:left;font-weight:bold;font-size:9.5pt;margin-bottom:.8mm}
th[scope=row]{color:#333;padding-left:0}
td.n{text-align:right;font-variant-numeric:tabular-nums;overflow-wrap:normal;white-space:nowrap}
#methods,#skip-table{font-size:7pt}
ul{margin:0;padding-left:4mm;font-size:8.2pt}
.columns{columns:2;column-gap:6mm}
li{break-inside:avoid;overflow-wrap:anywhere}
figure{margin:0;break-inside:avoid}
figure svg{display:block;width:100%;height:auto}
.note{font-size:7pt;line-height:1.25;color:#333}
.views{display:grid;grid-template-columns:repeat(var(--columns),1fr);gap:1mm 1.6mm}
.views p{font-size:6.6pt;line-height:1.2;margin:.3mm 0 0}
.paper{fill:#fff;stroke:#888;stroke-width:1;vector-effect:non-scaling-stroke}
.board{fill:none;stroke:#fff;stroke-width:1.4;stroke-dasharray:3 2;vector-effect:non-scaling-stroke;paint-order:stroke}
.paper+.board,circle+.board{stroke:#555}
.edge{stroke:#fff;stroke-width:3.4;vector-effect:non-scaling-stroke}
.pl{stroke:#d5121e;stroke-width:1.7;vector-effect:non-scaling-stroke}
.command{font-size:7.5pt;line-height:1.3}
code{font-size:1em;overflow-wrap:anywhere}
details{font-size:8pt}
@media screen and (max-width:800px){.two,.wide{grid-template-columns:1.22fr .78fr}
section.wide{display:grid}
.narrow{grid-template-columns:1.9fr 1fr}
.three{grid-template-columns:1fr}.columns{columns:1}}
@media print{html{background:#fff}body{margin:0;padding:0;width:auto}.screen{display:none}.command{max-height:9.1em;overflow:hidden}.dense{zoom:.84}.denser{zoom:.72}}
";

/// The page: one self-contained HTML file, and well-formed XML.
pub fn page(report: &Report) -> String {
    let calibration = &report.calibration;
    let title = words::title(&report.name);
    let title = escaped(&title);
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width\"/><title>{title}</title><style>\n{STYLE}</style></head><body class=\"{}\">\n<h1>{title}</h1>\n",
        density(report)
    );
    html += &summary::verdict(report);
    html += &two(
        &format!("{}<section>{}</section>", summary::camera(report), estimates::table(calibration)),
        &summary::numbers(calibration),
    );
    html += &summary::findings(calibration);
    html += &three(&[estimates::fan(calibration), estimates::drawings(calibration)]);
    html += &two(&projection_map::drawing(calibration), &lens_curve::drawing(calibration));
    let (cloud, skip_table, skip_note) = skip::section(report);
    html += &three(&[picture_maps::coverage(calibration), picture_maps::residuals(report), cloud]);
    html += &format!("<section class=\"two wide\">{skip_table}{skip_note}</section>\n");
    html += &views::views(report);
    if let Some(check) = &report.check {
        html += &drift::html(check);
    }
    html += &summary::refused(report);
    html += &summary::provenance(report);
    html + "</body></html>\n"
}

/// How small it must be to stand on two sheets, by what is to be said.
fn density(report: &Report) -> &'static str {
    // A drift section takes as much room as some findings.
    let findings = report.calibration.findings.len() + if report.check.is_some() { 4 } else { 0 };
    match findings {
        0..=5 => "",
        6..=14 => "dense",
        _ => "denser",
    }
}

fn two(left: &str, right: &str) -> String {
    format!("<div class=\"two\"><div>{left}</div><div>{right}</div></div>\n")
}

fn three(figures: &[String]) -> String {
    format!("<div class=\"three\">{}</div>\n", figures.concat())
}
