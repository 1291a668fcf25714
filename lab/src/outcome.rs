//! Outcome of an experiment: words, comparisons with known numbers, tables, figures.

use serde::{Deserialize, Serialize};

use boresight_formats::export::csv_field;

/// Result of an experiment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Stable name, also used for files.
    pub name: String,
    /// Heading of the experiment.
    pub title: String,
    /// The method, in a sentence or two.
    pub method: String,
    /// Claims, each with a finding.
    pub claims: Vec<Claim>,
    /// Comparisons with numbers known from elsewhere.
    pub checks: Vec<Check>,
    /// All measurements.
    pub tables: Vec<Table>,
    /// Drawings of the experiment.
    pub figures: Vec<Figure>,
}

/// Statement with a verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// Claim of the source.
    pub claim: String,
    /// Measured result, in words.
    pub measured: String,
    /// See [`Verdict`].
    pub verdict: Verdict,
}

/// Verdict on a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The measurement supports the claim as stated.
    Holds,
    /// The measurement supports the claim with stated limits.
    Partly,
    /// The measurement contradicts the claim.
    Fails,
}

impl Verdict {
    /// [`Self::Holds`] if `holds`, else [`Self::Fails`].
    pub fn of(holds: bool) -> Self {
        if holds { Self::Holds } else { Self::Fails }
    }

    /// Verdict as a word or phrase.
    pub fn word(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Partly => "holds in part",
            Self::Fails => "does not hold",
        }
    }
}

/// Number with a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Measured quantity, with unit.
    pub what: String,
    /// Known number.
    pub reference: f64,
    /// Measured number.
    pub measured: f64,
    /// Tolerance about the reference.
    pub within: Within,
}

/// Tolerance of a number about the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Within {
    /// Share of the reference, and absolute tolerance: half of the reference's last digit.
    Share(f64, f64),
    /// Upper bound: the reference.
    AtMost,
    /// 95 % interval of the measured number, widened by its rounding, that must contain the
    /// reference.
    Interval(f64, f64),
}

impl Check {
    /// True if the number is reproduced.
    pub fn passes(&self) -> bool {
        match self.within {
            Within::Share(share, rounding) => {
                (self.measured - self.reference).abs() <= share * self.reference.abs() + rounding
            }
            Within::AtMost => self.measured.abs() <= self.reference,
            Within::Interval(low, high) => (low..=high).contains(&self.reference),
        }
    }
}

/// Tidy data: a row per observation, a column per variable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Stable name, also used for the file.
    pub name: String,
    /// Names of the columns, with units.
    pub columns: Vec<String>,
    /// Cells as text.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Table without rows.
    pub fn new(name: &str, columns: &[&str]) -> Self {
        let columns = columns.iter().map(ToString::to_string).collect();
        Self { name: name.into(), columns, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn push(&mut self, cells: &[&dyn std::fmt::Display]) {
        self.rows.push(cells.iter().map(ToString::to_string).collect());
    }

    /// Comma-separated text, quoted where needed (RFC 4180).
    pub fn csv(&self) -> String {
        std::iter::once(&self.columns)
            .chain(&self.rows)
            .map(|row| row.iter().map(|cell| csv_field(cell)).collect::<Vec<_>>().join(",") + "\n")
            .collect()
    }
}

/// Drawing with a caption.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Stable name, also used for the file.
    pub name: String,
    /// Caption below the drawing.
    pub caption: String,
    /// Drawing as SVG.
    pub svg: String,
}
