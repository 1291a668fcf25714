use std::fmt::Write;

use super::{Disc, Rectangle, Sheet};

/// The sheet as an SVG file whose units are millimetres.
pub fn svg(sheet: &Sheet) -> String {
    let (width, height) = (short(sheet.width_mm), short(sheet.height_mm));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" viewBox=\"0 0 {width} {height}\">\n\
         <title>{}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n",
        escaped(&sheet.title)
    );
    for (id, rectangles) in [
        ("board", &sheet.squares),
        ("markers", &sheet.markers),
        ("code", &sheet.code),
        ("ruler", &sheet.ruler),
    ] {
        // Writing to a string cannot fail.
        let _ = writeln!(svg, "<g id=\"{id}\" fill=\"black\">");
        for Rectangle { left_mm, top_mm, width_mm, height_mm } in rectangles {
            let [x, y, width, height] = [left_mm, top_mm, width_mm, height_mm].map(|mm| short(*mm));
            let _ =
                writeln!(svg, "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/>");
        }
        for Disc { centre_mm: [x, y], radius_mm } in sheet.discs.iter().filter(|_| id == "board") {
            let [x, y, radius] = [x, y, radius_mm].map(|mm| short(*mm));
            let _ = writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"/>");
        }
        svg.push_str("</g>\n");
    }
    svg.push_str("<g font-family=\"Helvetica, Arial, sans-serif\" fill=\"black\">\n");
    for words in &sheet.words {
        let weight = if words.bold { " font-weight=\"bold\"" } else { "" };
        let anchor = if words.centred { " text-anchor=\"middle\"" } else { "" };
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\" font-size=\"{}\"{weight}{anchor}>{}</text>",
            short(words.x_mm),
            short(words.baseline_mm),
            short(words.size_mm),
            escaped(&words.text)
        );
    }
    svg.push_str("</g>\n</svg>\n");
    svg
}

/// Length to a nanometre, without trailing zeros.
fn short(mm: f64) -> String {
    let text = format!("{mm:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
