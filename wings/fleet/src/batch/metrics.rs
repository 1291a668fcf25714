//! Progress of a run, as a text file for Prometheus' node exporter.

use std::path::Path;

use super::{job::Action, run::Tally};
use boresight_app::prometheus::Page;
use boresight_files::FileError;

/// Writes the metrics of a run to `path`, atomically.
///
/// # Errors
///
/// [`FileError`].
pub fn write(path: &Path, action: Action, tally: &Tally) -> Result<(), FileError> {
    page(path, action, tally, jiff::Timestamp::now().as_second()).save(path)
}

fn page(path: &Path, action: Action, tally: &Tally, now_secs: i64) -> Page {
    let action = format!("{action:?}").to_lowercase();
    let own = [("action", action.as_str())];
    let mut page = Page::at(path);
    let mut one = |name: &str, help: &str, value: f64| page.add(name, help, [(&own[..], value)]);
    one("boresight_batch_items", "Items of the shard.", tally.items as f64);
    one(
        "boresight_batch_items_there",
        "Items that had a result before the run.",
        tally.there as f64,
    );
    one("boresight_batch_busy_seconds", "Time spent on items.", tally.busy.as_secs_f64());
    one(
        "boresight_batch_updated_timestamp_seconds",
        "When this file was written.",
        now_secs as f64,
    );
    let rows: Vec<_> = tally
        .rows
        .iter()
        .map(|(code, count)| ([own[0], ("code", code.as_str())], *count as f64))
        .collect();
    page.add(
        "boresight_batch_rows",
        "Results of the run by code.",
        rows.iter().map(|(labels, count)| (&labels[..], *count)),
    );
    page
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn every_value_has_its_help_and_type() {
        let rows = [("OK".to_owned(), 7), ("JOURNAL-DAMAGED".to_owned(), 1)].into();
        let busy = Duration::from_millis(1500);
        let tally = Tally { items: 10, there: 2, rows, busy, stopped: false };
        let page = page(Path::new("night.prom"), Action::Redetect, &tally, 1_700_000_000);
        let text = page.text();
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let (name, _) = line.split_once('{').expect("labels");
            assert!(text.contains(&format!("# HELP {name} ")), "{name}");
            assert_eq!(text.matches(&format!("# TYPE {name} ")).count(), 1, "{name}");
        }
        let own = "{file=\"night\",action=\"redetect\"";
        assert!(text.contains(&format!("boresight_batch_items{own}}} 10\n")), "{text}");
        let damaged = format!("boresight_batch_rows{own},code=\"JOURNAL-DAMAGED\"}} 1\n");
        assert!(text.contains(&damaged), "{text}");
        assert!(text.contains(&format!("boresight_batch_busy_seconds{own}}} 1.5\n")));
    }
}
