//! The corner table that many detectors write: `filename x y level`, one corner a line.

use std::{collections::BTreeMap, fmt::Write, path::Path};

use anyhow::{Context, bail};
use nalgebra::Point2;

use crate::{detection::Detection, geometry::Corner};

/// One picture's corners.
pub(super) struct TableView {
    pub(super) name: String,
    /// In the board's numbering order; `None` if the table has none for it.
    pub(super) corners: Option<Vec<Corner>>,
}

/// Error of a corner at level 0; a level is a halving of the picture on which it was found.
const LEVEL_0_SIGMA_PX: f64 = 0.1;

/// Reads a corner table, row-major over the board.
pub(super) fn read(path: &Path, corners_per_view: usize) -> anyhow::Result<Vec<TableView>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("could not read {path:?}"))?;
    let mut order = Vec::new();
    let mut views: BTreeMap<String, Vec<Corner>> = BTreeMap::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let fields: Vec<&str> = line.split_whitespace().collect();
        let at = || format!("line {} of {path:?}", index + 1);
        let [name, x, y, rest @ ..] = fields.as_slice() else {
            bail!("{}: wants `filename x y level`", at());
        };
        if !views.contains_key(*name) {
            order.push((*name).to_owned());
        }
        let corners = views.entry((*name).to_owned()).or_default();
        if *x == "-" || *y == "-" {
            continue;
        }
        let number = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
        let (Some(x), Some(y)) = (number(x), number(y)) else {
            bail!("{}: {x:?} {y:?} are no pixels", at());
        };
        let level = match rest.first() {
            None | Some(&"-") => 0.0,
            Some(text) => {
                number(text).with_context(|| format!("{}: {text:?} is no level", at()))?
            }
        };
        let sigma_px = LEVEL_0_SIGMA_PX * 2_f64.powf(level.clamp(0.0, 10.0));
        corners.push(Corner::isotropic(Point2::new(x, y), sigma_px));
    }
    let mut table = Vec::new();
    for name in order {
        let corners = views.remove(&name).unwrap_or_default();
        let corners = match corners.len() {
            0 => None,
            count if count == corners_per_view => Some(corners),
            count => bail!(
                "{name} has {count} corners in {path:?}, the board has {corners_per_view}: check --board"
            ),
        };
        table.push(TableView { name, corners });
    }
    if table.is_empty() {
        bail!("there is no corner in {path:?}");
    }
    Ok(table)
}

/// The table's lines for one picture. Fields are separated by spaces, so those of a name become `_`.
pub(super) fn lines(name: &str, found: Option<&Detection>) -> String {
    let mut lines = String::new();
    let name = name.replace(char::is_whitespace, "_");
    match found {
        None => {
            let _ = writeln!(lines, "{name} - - -");
        }
        Some(detection) => {
            for corner in &detection.corners {
                let _ = writeln!(lines, "{name} {:.4} {:.4} 0", corner.px.x, corner.px.y);
            }
        }
    }
    lines
}
