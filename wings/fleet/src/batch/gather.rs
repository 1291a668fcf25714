//! Rows of a batch, in order.

use super::{job::Id, row::Row, store::Store};

/// Maximum number of missing items named.
const NAMED: usize = 5;

/// Rows read at a time.
const CHUNK: usize = 1024;

/// Counts of gathered rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Gathered {
    /// Existing rows.
    pub rows: u64,
    /// Failed rows.
    pub failed: u64,
    /// Items without a row.
    pub missing: u64,
    /// Sessions of the first missing items.
    pub named: Vec<String>,
    /// Unreadable rows, in words; counted as missing.
    pub damaged: Vec<String>,
}

/// Hands the row of every item of the manifest in `store` to `each`, sorted by id. Keeps 16 bytes
/// an item in memory.
///
/// # Errors
///
/// If there is no batch, its manifest can't be read, an object store can't be used, or `each`
/// fails.
pub fn gather(
    store: &Store,
    each: &mut dyn FnMut(&str) -> anyhow::Result<()>,
) -> anyhow::Result<Gathered> {
    let job = store.job()?;
    let mut ids: Vec<Id> = Vec::new();
    let manifest = store.manifest()?;
    for item in manifest.items()? {
        ids.push(job.id_of(&item?));
    }
    ids.sort_unstable();
    ids.dedup();
    let mut gathered = Gathered::default();
    let mut missing = Vec::new();
    for ids in ids.chunks(CHUNK) {
        let names: Vec<String> = ids.iter().map(Id::to_string).collect();
        for (&id, row) in ids.iter().zip(store.rows(&names)?) {
            match row {
                Ok(Some(row)) => {
                    each(row.line())?;
                    gathered.rows += 1;
                    gathered.failed += u64::from(!row.is_ok());
                    continue;
                }
                Ok(None) => {}
                Err(err) if gathered.damaged.len() < NAMED => {
                    gathered.damaged.push(format!("{err:#}"));
                }
                Err(_) => {}
            }
            gathered.missing += 1;
            if missing.len() < NAMED {
                missing.push(id);
            }
        }
    }
    if !missing.is_empty() {
        for item in manifest.items()? {
            let item = item?;
            if missing.contains(&job.id_of(&item)) && !gathered.named.contains(&item.session) {
                gathered.named.push(item.session);
            }
        }
    }
    Ok(gathered)
}

/// Gathers as [`gather`], with parsed rows.
pub(super) fn gather_rows(store: &Store, each: &mut dyn FnMut(Row)) -> anyhow::Result<Gathered> {
    gather(store, &mut |line| {
        each(serde_json::from_str(line)?);
        Ok(())
    })
}
