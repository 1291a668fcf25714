//! All outcomes on a page: claim, measurement, verdict.

use super::outcome::{Check, Outcome, Within};
use boresight_present::chart::escaped;

const STYLE: &str = "body{font:15px/1.45 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#111;background:#fff}
h1{font-size:1.6rem}h2{margin-top:2.2rem;border-top:1px solid #ccc;padding-top:1rem}
table{border-collapse:collapse;margin:.8rem 0;width:100%}td,th{border:1px solid #ccc;padding:.3rem .5rem;text-align:left;vertical-align:top}
td.n{text-align:right;font-variant-numeric:tabular-nums}.v{white-space:nowrap;font-weight:bold}
figure{display:inline-block;width:28rem;max-width:100%;margin:.5rem .8rem .5rem 0;vertical-align:top}figcaption{font-size:.85rem;color:#444}
details{margin:.6rem 0}summary{cursor:pointer}.off{background:#fdecea}.w{overflow-x:auto}.w table{font-size:.85rem}
@media print{body{max-width:none;margin:0}h2{break-after:avoid}figure,tr{break-inside:avoid}}";

/// Self-contained HTML page.
pub fn page(outcomes: &[Outcome], seed: u64) -> String {
    let (passed, total) = tally(outcomes);
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\"><title>boresight study</title><style>{STYLE}</style></head><body>\n<h1>Principal lines: what holds, and what guidance is worth</h1>\n<p>The experiments of Chuang and Chen, “Visualizing and alleviating the effect of radial distortion on camera calibration using principal lines”, repeated against known truth, and strategies of guidance compared under equal conditions. boresight {}, seed {seed}. {passed} of {total} known numbers reproduced.</p>\n",
        env!("CARGO_PKG_VERSION")
    );
    html +=
        "<table><thead><tr><th>Experiment</th><th>Claim</th><th>Verdict</th></tr></thead><tbody>\n";
    for outcome in outcomes {
        for claim in &outcome.claims {
            html += &format!(
                "<tr><td><a href=\"#{}\">{}</a></td><td>{}</td><td class=\"v\">{}</td></tr>\n",
                escaped(&outcome.name),
                escaped(&outcome.title),
                escaped(&claim.claim),
                claim.verdict.word()
            );
        }
    }
    html += "</tbody></table>\n";
    for outcome in outcomes {
        html += &section(outcome);
    }
    html + "</body></html>\n"
}

/// Number of reproduced known numbers, and number of all.
pub fn tally(outcomes: &[Outcome]) -> (usize, usize) {
    let checks = || outcomes.iter().flat_map(|outcome| &outcome.checks);
    (checks().filter(|check| check.passes()).count(), checks().count())
}

fn section(outcome: &Outcome) -> String {
    let mut html = format!(
        "<h2 id=\"{}\">{}</h2>\n<p>{}</p>\n<table><thead><tr><th>Claim</th><th>Measured</th><th>Verdict</th></tr></thead><tbody>\n",
        escaped(&outcome.name),
        escaped(&outcome.title),
        escaped(&outcome.method)
    );
    for claim in &outcome.claims {
        html += &format!(
            "<tr><td>{}</td><td>{}</td><td class=\"v\">{}</td></tr>\n",
            escaped(&claim.claim),
            escaped(&claim.measured),
            claim.verdict.word()
        );
    }
    html += "</tbody></table>\n";
    for figure in &outcome.figures {
        html += &format!(
            "<figure>{}<figcaption>{}</figcaption></figure>\n",
            figure.svg,
            escaped(&figure.caption)
        );
    }
    for table in outcome.tables.iter().filter(|table| table.rows.len() <= 40) {
        html += &format!(
            "<details{}><summary>{}.csv</summary><div class=\"w\"><table><thead><tr>",
            if table.name == "guidance" { " open" } else { "" },
            escaped(&table.name)
        );
        for column in &table.columns {
            html += &format!("<th>{}</th>", escaped(column));
        }
        html += "</tr></thead><tbody>\n";
        for row in &table.rows {
            html += "<tr>";
            for cell in row {
                html += &match cell.parse::<f64>() {
                    Ok(number) => format!("<td class=\"n\">{}</td>", brief(number)),
                    Err(_) => format!("<td>{}</td>", escaped(cell)),
                };
            }
            html += "</tr>\n";
        }
        html += "</tbody></table></div></details>\n";
    }
    if !outcome.checks.is_empty() {
        let passed = outcome.checks.iter().filter(|check| check.passes()).count();
        html += &format!(
            "<details{}><summary>{passed} of {} known numbers reproduced</summary><table><thead><tr><th>Number</th><th>Known</th><th>Measured</th><th>Tolerance</th><th></th></tr></thead><tbody>\n",
            if passed < outcome.checks.len() { " open" } else { "" },
            outcome.checks.len()
        );
        for check in &outcome.checks {
            html += &row(check);
        }
        html += "</tbody></table></details>\n";
    }
    html
}

fn row(check: &Check) -> String {
    let wanted = match check.within {
        Within::Share(share, rounding) => {
            format!("within {} % and {}", brief(100.0 * share), brief(rounding))
        }
        Within::AtMost => "at most that".into(),
        Within::Interval(low, high) => format!("in {} to {}", brief(low), brief(high)),
    };
    let (class, word) =
        if check.passes() { ("", "reproduced") } else { (" class=\"off\"", "differs") };
    format!(
        "<tr{class}><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td>{wanted}</td><td>{word}</td></tr>\n",
        escaped(&check.what),
        brief(check.reference),
        brief(check.measured)
    )
}

/// Text with four significant digits.
fn brief(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    if (-3..=6).contains(&digits) {
        let text = format!("{value:.*}", digits.max(0) as usize);
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').into()
        } else {
            text
        }
    } else {
        format!("{value:.2e}")
    }
}
