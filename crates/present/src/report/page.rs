//! The page as a whole.

use super::{
    Report, certificate, drift, estimates, fit, lens_curve, picture_maps, projection_map, skip,
    summary, unknown_sd, views,
};
use crate::{
    chart::escaped,
    text::{certificate as certificate_words, report as words},
};

/// Style sheet in paper sizes: the page looks the same on screen and in print.
pub(super) const STYLE: &str = "\
@page{margin:9mm 10mm}
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
.certificate{position:relative;break-after:page;border-bottom:.3mm solid #888;padding-bottom:6mm;margin-bottom:6mm}
.certificate>h2{display:none}
.certificate>*{position:relative}
.masthead{display:flex;justify-content:space-between;align-items:flex-start;gap:8mm;border-bottom:.5mm solid #111;margin-bottom:3mm;padding-bottom:2mm}
.masthead h1{font-size:19pt;margin:0}
.title{text-align:right}
.logo{display:block;height:16mm;max-width:60mm}
.company{white-space:pre-line;margin-top:1mm}
.certificate table{font-size:9pt;margin-bottom:3mm}
.certificate td,.certificate th{padding-top:.9mm;padding-bottom:.9mm}
.certificate .two th{width:38%}
.results td.met{text-align:center;font-weight:bold}
.results thead th:nth-child(n+2){text-align:right}
.results thead th:last-child{text-align:center}
.blank{display:block;border-bottom:.2mm dotted #555;height:1.2em}
pre{font:8.5pt/1.35 'Liberation Mono',monospace;margin:0 0 3mm;padding:1.5mm 2mm;background:#f2f2f2;white-space:pre-wrap;overflow-wrap:anywhere}
.identity{font-size:11pt;color:#4a5661;margin-bottom:3mm}
.hero{margin:0 0 4mm}.hero svg{max-height:100mm;width:auto;max-width:100%;border-radius:2.5mm}
figcaption{font-size:10pt;color:#4a5661;margin-top:1.5mm}
figcaption i{display:inline-block;width:6mm;height:3.6mm;vertical-align:-.4mm;border-radius:.6mm;background:#999}
figcaption .met{border:.4mm solid #00704a}figcaption .unseen{margin-left:8mm;background:repeating-linear-gradient(135deg,#333 0 .7mm,#999 .7mm 1mm)}
.grade{display:flex;justify-content:space-between;align-items:center;border-bottom:.3mm solid #d3d9de;margin-bottom:3mm;padding-bottom:2mm}
.grade strong{font-size:26pt;vertical-align:middle}.grade .sign{font-size:20pt;vertical-align:middle;margin-right:3mm}
.number{text-align:right}.number b{font-size:26pt}.number small{font-size:10pt;color:#4a5661}
.limit{font-size:12pt}
.certificate .answers{font-size:12pt}.certificate .answers th{width:26%;font-weight:bold}.certificate .answers td,.certificate .answers th{border:0;padding:1.2mm 0}
.checksum{display:flex;gap:6mm;align-items:center;font-size:10pt;overflow-wrap:anywhere;border-top:.3mm solid #d3d9de;padding-top:3mm}
.checksum .qr{width:26mm;flex:none}
.numbers{break-before:page;padding-top:6mm}
.signatures{display:grid;grid-template-columns:1fr 1fr;gap:10mm;margin-top:7mm}
.sign-here{border-top:.2mm solid #111;margin-top:14mm;font-size:7.5pt;color:#333}
.certificate>.watermark{position:absolute;inset:30% 0 auto;text-align:center;font-size:72pt;font-weight:bold;color:#b00000;opacity:.13;transform:rotate(-28deg);pointer-events:none}
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
#numbers th{width:45%}#numbers td.n{white-space:normal}
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
@media screen and (max-width:800px){.three{grid-template-columns:1fr}.columns{columns:1}}
@media screen and (max-width:600px){body{padding:3mm;font-size:11pt}.two,.wide,section.wide,.narrow,.signatures{display:block}
table,.certificate table{font-size:9.5pt}ul{font-size:10pt}.note{font-size:9pt}#methods,#skip-table{font-size:8pt}.views{grid-template-columns:repeat(2,1fr)}.views p{font-size:8pt}
section,figure,.two>table{margin-bottom:4mm}.masthead{display:block}.title{text-align:left;margin-top:2mm}.masthead h1{font-size:16pt}#methods td.n{white-space:normal}.results{letter-spacing:-.01em}.results td,.results th{padding-left:.5mm;padding-right:.5mm}.results [colspan]{white-space:normal}.certificate>.watermark{font-size:40pt}details{overflow-x:auto}}
@media print and (max-height:270mm){body>*:not(.certificate){zoom:.95}}
@media print{.certificate{border:0;margin:0;padding:0}html{background:#fff}body{margin:0;padding:0;width:auto}.screen{display:none}.command{max-height:9.1em;overflow:hidden}.dense{zoom:.84}.denser{zoom:.72}}
";

/// Report page: one self-contained HTML file, and well-formed XML.
pub fn page(report: &Report) -> String {
    let report = &*unknown_sd::shown(report);
    let calibration = &report.calibration;
    let first_sheet = certificate::sheet(report);
    let title = words::title(&report.name);
    let title = escaped(&title);
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/><title>{title}</title><style>\n{STYLE}{}</style></head><body class=\"{}\">\n{first_sheet}<h1>{title}</h1>\n",
        running_lines(report),
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
    html += &fit::section(report);
    if let Some(check) = &report.check {
        html += &drift::html(check);
    }
    html += &summary::refused(report);
    html += &summary::provenance(report);
    html + "</body></html>\n"
}

/// Running lines: certificate number and sheet number on every printed sheet.
fn running_lines(report: &Report) -> String {
    let line = |place: &str, content: &str| {
        format!("@{place}{{content:{content};font:7.5pt Arial,sans-serif}}")
    };
    let number = report.certificate.as_ref().map_or("", |certificate| &certificate.number);
    let number = if number.is_empty() { "" } else { &certificate_words::number(number) };
    let left = line("bottom-left", &format!("\"{}\"", certificate::css_string(number)));
    let right = line("bottom-right", "counter(page) \" of \" counter(pages)");
    let above = if report.camera.simulated {
        line("top-center", &format!("\"{}\"", certificate_words::SIMULATED))
    } else {
        String::new()
    };
    format!("@page{{{above}{left}{right}}}\n")
}

/// CSS class of the density needed to fit on two sheets, by the number of findings.
fn density(report: &Report) -> &'static str {
    // A drift section takes as much room as four findings.
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
