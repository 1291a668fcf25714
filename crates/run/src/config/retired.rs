//! Settings that aren't used any more: they're still read, and ignored with one sentence.

use toml::{Table, Value};

/// A setting that isn't used any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Retired {
    /// Its dotted key, such as `guidance.margin_px`; that of a table stands for all of its keys.
    pub(crate) key: &'static str,
    /// Since which version, and what replaces it: the rest of the sentence, without a full stop.
    pub(crate) instead: &'static str,
}

/// Every setting that isn't used any more. Entries stay for good: old settings files and sessions name them.
pub(crate) const RETIRED: &[Retired] = &[
    price("guidance.min_tilt_deg"),
    price("guidance.max_tilt_deg"),
    price("guidance.max_direction_sigma_deg"),
    price("guidance.min_fill"),
    price("guidance.margin_px"),
    price("guidance.max_blur_px"),
    price("guidance.max_smear_px"),
    price("guidance.still_widths_per_sec"),
    price("guidance.partner_offset_px"),
    Retired {
        key: "guidance.max_slot_error_deg",
        instead: "the directions asked for keep clear of accepted ones",
    },
    Retired {
        key: "guidance.independent_deg",
        instead: "the angle between principal lines must be significant: see independent_sigmas",
    },
];

/// A limit of what a frame must show, which is now a part of what the frame tells.
const fn price(key: &'static str) -> Retired {
    Retired { key, instead: "a frame is judged by what it tells, so the limit has become a price" }
}

/// Takes each of the `retired` settings out of `table`, whatever its value; adds one sentence for each to `notes`, unless it's
/// there.
pub(crate) fn ignore(table: &mut Table, retired: &[Retired], notes: &mut Vec<String>) {
    for Retired { key, instead } in retired {
        if take(table, key).is_some() {
            let note = format!("The setting {key} isn't used any more: {instead}.");
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
}

/// Removes the value of the dotted `key`; `None` if there is none.
fn take(table: &mut Table, key: &str) -> Option<Value> {
    match key.split_once('.') {
        None => table.remove(key),
        Some((first, rest)) => take(table.get_mut(first)?.as_table_mut()?, rest),
    }
}
