//! The board on paper or on a screen, in true size.
//!
//! ```text
//! paper: which page ─▶ plan: which square, how much white around it ─▶ printed: what is black
//!                                                                                 └─▶ pdf · svg · png
//! ```
//!
//! A page is measured in millimetres from its top-left corner, `y` down. A sheet has only black on
//! white: axis-aligned rectangles and words, the same in all three formats.

mod footer;
mod paper;
mod pdf;
mod plan;
mod png;
mod printed;
mod svg;

pub use footer::LINES;
pub use paper::{Page, Paper, Resolution};
pub use pdf::pdf;
pub use plan::{DoesNotFit, Plan, Square, plan, plan_of};
pub use png::{NotWritten, png};
pub use printed::{Disc, Rectangle, Sheet, Words, sheet};
pub use svg::svg;
