//! The page's parts: sections with a heading, figures with a note.

use crate::text::report::Section;

/// A part of the page.
pub(super) fn section(section: Section, body: &str) -> String {
    section_with(section, "part", body)
}

/// Part of the page with a style class.
pub(super) fn section_with(section: Section, class: &str, body: &str) -> String {
    format!(
        "<section id=\"{}\" class=\"{class}\"><h2>{}</h2>\n{body}</section>\n",
        section.id(),
        section.heading()
    )
}

/// Drawing with heading and note.
pub(super) fn figure(section: Section, drawing: &str, note: &str) -> String {
    let note =
        if note.is_empty() { String::new() } else { format!("<p class=\"note\">{note}</p>") };
    format!(
        "<figure id=\"{}\"><h2>{}</h2>\n{drawing}{note}</figure>\n",
        section.id(),
        section.heading()
    )
}

/// Text in place of a drawing.
pub(super) fn missing(why: &str) -> String {
    format!("<p class=\"note\">{why}</p>")
}
