//! Metrics as a text file for Prometheus' node exporter, the reader of all `*.prom` files in a
//! folder.

use std::{fmt::Write, path::Path};

use boresight_files::{FileError, Overwrite, save};

/// A page of metrics. Each value has the label `file`, the page's own name, to keep pages of
/// several runs apart in a folder.
pub struct Page {
    text: String,
    file: String,
}

impl Page {
    /// Empty page to be stored at `path`.
    pub fn at(path: &Path) -> Self {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let file = name.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
        Self { text: String::new(), file }
    }

    /// Adds a metric with `values`, each with further labels of harmless text. A name ending in
    /// `_total` is a counter.
    pub fn add<'a>(
        &mut self,
        name: &str,
        help: &str,
        values: impl IntoIterator<Item = (&'a [(&'a str, &'a str)], f64)>,
    ) {
        let kind = if name.ends_with("_total") { "counter" } else { "gauge" };
        let _ = writeln!(self.text, "# HELP {name} {help}\n# TYPE {name} {kind}");
        for (labels, value) in values {
            let _ = write!(self.text, "{name}{{file=\"{}\"", self.file);
            for (label, of) in labels {
                let _ = write!(self.text, ",{label}=\"{of}\"");
            }
            let _ = writeln!(self.text, "}} {value}");
        }
    }

    /// Adds a metric with a single value.
    pub(super) fn add_one(&mut self, name: &str, help: &str, value: f64) {
        self.add(name, help, [(&[][..], value)]);
    }

    /// The page's text so far.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Stores the page at `path`, atomically.
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        save(path, self.text.as_bytes(), Overwrite::Allowed)
    }
}

/// Checks that every value in `text` has help and type.
#[cfg(test)]
pub(super) fn assert_whole(text: &str) {
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let (name, rest) = line.split_once('{').expect("labels");
        let (_, value) = rest.split_once("} ").expect("a value");
        assert!(value.parse::<f64>().is_ok(), "{line}");
        assert!(text.contains(&format!("# HELP {name} ")), "{name}");
        let kind = if name.ends_with("_total") { "counter" } else { "gauge" };
        assert_eq!(text.matches(&format!("# TYPE {name} {kind}\n")).count(), 1, "{name}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_stay_inside_their_quotes() {
        let mut page = Page::at(Path::new("/x/cell \"7\\.prom"));
        page.add_one("boresight_views", "Views.", 3.0);
        page.add("boresight_rows_total", "Rows.", [(&[("code", "OK")][..], 1.5)]);
        assert_whole(page.text());
        assert!(
            page.text().contains("boresight_views{file=\"cell \\\"7\\\\\"} 3\n"),
            "{}",
            page.text()
        );
        assert!(page.text().contains("\",code=\"OK\"} 1.5\n"));
    }
}
