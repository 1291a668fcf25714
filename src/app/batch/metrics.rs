//! How a run goes, as a text file for Prometheus' node exporter.

use std::{fmt::Write, path::Path};

use super::{job::Action, run::Tally};
use crate::files::{FileError, Overwrite, save};

/// Writes the metrics of a run to `path`, which is replaced as a whole.
///
/// # Errors
///
/// [`FileError`].
pub fn write(path: &Path, action: Action, tally: &Tally) -> Result<(), FileError> {
    save(
        path,
        page(action, tally, jiff::Timestamp::now().as_second()).as_bytes(),
        Overwrite::Allowed,
    )
}

fn page(action: Action, tally: &Tally, now_secs: i64) -> String {
    let action = format!("{action:?}").to_lowercase();
    let mut page = String::new();
    let mut add = |name: &str, kind: &str, help: &str, values: &[(String, String)]| {
        let _ = writeln!(page, "# HELP {name} {help}\n# TYPE {name} {kind}");
        for (labels, value) in values {
            let _ = writeln!(page, "{name}{{action=\"{action}\"{labels}}} {value}");
        }
    };
    let one = |value: String| vec![(String::new(), value)];
    add("boresight_batch_items", "gauge", "Items of the shard.", &one(tally.items.to_string()));
    add(
        "boresight_batch_items_there",
        "gauge",
        "Items that had a result before the run.",
        &one(tally.there.to_string()),
    );
    let rows = tally.rows.iter();
    let rows: Vec<_> =
        rows.map(|(code, count)| (format!(",code=\"{code}\""), count.to_string())).collect();
    add("boresight_batch_rows", "gauge", "Results of the run by code.", &rows);
    add(
        "boresight_batch_busy_seconds",
        "gauge",
        "Time spent on items.",
        &one(format!("{:.3}", tally.busy.as_secs_f64())),
    );
    add(
        "boresight_batch_updated_timestamp_seconds",
        "gauge",
        "When this file was written.",
        &one(now_secs.to_string()),
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
        let page = page(Action::Redetect, &tally, 1_700_000_000);
        assert!(page.contains("boresight_batch_items{action=\"redetect\"} 10\n"), "{page}");
        assert!(
            page.contains("boresight_batch_rows{action=\"redetect\",code=\"JOURNAL-DAMAGED\"} 1\n"),
            "{page}"
        );
        assert!(page.contains("boresight_batch_busy_seconds{action=\"redetect\"} 1.500\n"));
        let values = page.lines().filter(|line| !line.starts_with('#'));
        let names: std::collections::BTreeSet<_> =
            values.filter_map(|line| line.split('{').next()).collect();
        for name in names {
            assert!(page.contains(&format!("# TYPE {name} gauge\n")), "{name}");
            assert!(page.contains(&format!("# HELP {name} ")), "{name}");
        }
    }
}
