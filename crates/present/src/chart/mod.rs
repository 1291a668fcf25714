//! Drawings as SVG text, for pages without network and script.
//!
//! Everything can also be told apart without colour: by dashes, marks and labels.

mod canvas;
mod plot;

pub use canvas::{Axes, Canvas, Stroke};
pub use plot::{COLOURS, DASHES, Plot, Series, mark, push, short, ticks};

/// Escapes `text` for HTML, SVG and their quoted attributes. Characters not allowed in XML become
/// U+FFFD.
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\t' | '\n' | '\r' => safe.push(' '),
            '\0'..'\u{20}' | '\u{7f}'..='\u{9f}' | '\u{fffe}' | '\u{ffff}' => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_names_stay_text() {
        assert_eq!(
            escaped("<img src=x onerror='a&b'>\"\u{1b}[31m\n"),
            "&lt;img src=x onerror=&#39;a&amp;b&#39;&gt;&quot;\u{fffd}[31m "
        );
        assert_eq!(escaped("Übersicht → 3.png"), "Übersicht → 3.png");
    }
}
