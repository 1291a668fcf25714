//! The corner table of mrcal and mrgingham: `filename x y level`, a corner per line, row by row
//! over the board. `-` marks a missing corner, `#` opens a comment.

use std::{collections::BTreeMap, fmt::Write};

use nalgebra::Point2;

use super::export::number::number;
use boresight_geometry::Corner;

/// First line of a table.
pub const HEADER: &str = "# filename x y level\n";
/// Standard deviation of a corner at level 0, per coordinate; doubles with each level, a halving of
/// the picture.
pub(crate) const LEVEL_0_SIGMA_PX: f64 = 0.1;
/// Largest level; larger ones count as equal.
const MAX_LEVEL: f64 = 10.0;

/// Corners of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct TableView {
    /// File name of the picture.
    pub name: String,
    /// Corners in the board's order, [unseen](Corner::unseen) if missing; `None` if the table has
    /// none for the picture.
    pub corners: Option<Vec<Corner>>,
}

/// Error of a text that is no corner table of a board.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CornerTableError {
    /// A line with fewer than three fields.
    #[error("line {line}: expected `filename x y level`")]
    Fields {
        /// Line, from 1.
        line: usize,
    },
    /// A position that is not two finite numbers.
    #[error("line {line}: {x:?} {y:?} is not a position in pixels")]
    Position {
        /// Line, from 1.
        line: usize,
        /// x in the table.
        x: String,
        /// y in the table.
        y: String,
    },
    /// A level that is not a finite number.
    #[error("line {line}: {level:?} is not a level")]
    Level {
        /// Line, from 1.
        line: usize,
        /// Level in the table.
        level: String,
    },
    /// A picture with another number of lines than the board's corners.
    #[error(
        "{name} has {got} corners, the board has {wanted}: check --board. A missing corner has a line, too, with `-`"
    )]
    Count {
        /// Name of the picture.
        name: String,
        /// Number of corners in the table.
        got: usize,
        /// Number of corners of the board.
        wanted: usize,
    },
    /// No picture at all.
    #[error("the table is empty")]
    Empty,
}

/// Reads a table of a board with `corner_count` corners; pictures come in the order of their first
/// lines.
///
/// A corner's standard deviation is 0.1 px at level 0, which is also assumed for a missing level,
/// and doubles with each level up to 10.
///
/// # Errors
///
/// [`CornerTableError`].
///
/// ```
/// # use boresight_formats::corner_table::{read, write};
/// # use boresight_geometry::Corner;
/// # use nalgebra::Point2;
/// let corners: Vec<Corner> =
///     (0..4).map(|i| Corner::isotropic(Point2::new(f64::from(i) * 10.0, 5.0), 0.1)).collect();
/// let table = write([("a.png", Some(&corners[..])), ("b.png", None)]);
/// let views = read(&table, 4)?;
/// assert_eq!((views.len(), views[0].name.as_str()), (2, "a.png"));
/// assert!(views[1].corners.is_none());
/// # Ok::<(), boresight_formats::corner_table::CornerTableError>(())
/// ```
pub fn read(text: &str, corner_count: usize) -> Result<Vec<TableView>, CornerTableError> {
    let mut order = Vec::new();
    let mut views: BTreeMap<&str, Vec<Corner>> = BTreeMap::new();
    for (index, line) in text.lines().enumerate() {
        let fields: Vec<&str> =
            line.split('#').next().unwrap_or_default().split_whitespace().collect();
        let line = index + 1;
        let [name, x, y, rest @ ..] = fields.as_slice() else {
            if fields.is_empty() {
                continue;
            }
            return Err(CornerTableError::Fields { line });
        };
        let corners = views.entry(name).or_insert_with(|| {
            order.push(*name);
            Vec::new()
        });
        corners.push(match (*x, *y) {
            ("-", _) | (_, "-") => Corner::unseen(Point2::new(f64::NAN, f64::NAN)),
            _ => corner(line, x, y, rest.first().copied())?,
        });
    }
    if order.is_empty() {
        return Err(CornerTableError::Empty);
    }
    let view = |name: &str| {
        let corners = views.remove(name).unwrap_or_default();
        let name = name.to_owned();
        match corners.len() {
            // A single line reports that nothing was found.
            _ if !corners.iter().any(Corner::is_seen) => Ok(TableView { name, corners: None }),
            got if got == corner_count => Ok(TableView { name, corners: Some(corners) }),
            got => Err(CornerTableError::Count { name, got, wanted: corner_count }),
        }
    };
    order.into_iter().map(view).collect()
}

fn corner(line: usize, x: &str, y: &str, level: Option<&str>) -> Result<Corner, CornerTableError> {
    let finite = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite());
    let (Some(x), Some(y)) = (finite(x), finite(y)) else {
        return Err(CornerTableError::Position { line, x: x.into(), y: y.into() });
    };
    let level = match level {
        None | Some("-") => 0.0,
        Some(text) => finite(text)
            .ok_or_else(|| CornerTableError::Level { line, level: text.into() })?
            .clamp(0.0, MAX_LEVEL),
    };
    Ok(Corner::isotropic(Point2::new(x, y), LEVEL_0_SIGMA_PX * libm::exp2(level)))
}

/// Precision of written coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Digits {
    /// All 17 significant digits, to read back bit for bit.
    All,
    /// Four digits after the point: finer than any detector, and easy to read.
    FourDecimals,
}

/// A table of `views`: pictures with their corners in the board's order, `None` for a picture
/// without.
///
/// Whitespace, control characters and `#` in names become `_`. Coordinates read back bit for bit;
/// the level is 0, because the table has no place for a covariance.
///
/// ```
/// # use boresight_formats::corner_table;
/// # use boresight_geometry::Corner;
/// # use nalgebra::Point2;
/// let corners = [Corner::isotropic(Point2::new(0.1, 20.5), 0.05)];
/// let table = corner_table::write([("a.png", Some(&corners[..])), ("b.png", None)]);
/// let read = corner_table::read(&table, 1)?;
/// assert_eq!((read.len(), &*read[1].name), (2, "b.png"));
/// # Ok::<(), corner_table::CornerTableError>(())
/// ```
pub fn write<'a>(views: impl IntoIterator<Item = (&'a str, Option<&'a [Corner]>)>) -> String {
    let mut table = String::from(HEADER);
    for (name, corners) in views {
        table += &lines(name, corners, Digits::All);
    }
    table
}

/// Lines of a picture, each with a line break; names as in [`write()`].
pub fn lines(name: &str, corners: Option<&[Corner]>, digits: Digits) -> String {
    let name = name.replace(|c: char| c.is_whitespace() || c.is_control() || c == '#', "_");
    let Some(corners) = corners else {
        return format!("{name} - - -\n");
    };
    let coordinate = |value: f64| match digits {
        Digits::All => number(value),
        Digits::FourDecimals => format!("{value:.4}"),
    };
    let mut lines = String::new();
    for corner in corners {
        if !corner.is_seen() {
            lines += &format!("{name} - - -\n");
            continue;
        }
        let (x, y) = (coordinate(corner.px.x), coordinate(corner.px.y));
        // Writing to a string cannot fail.
        let _ = writeln!(lines, "{name} {x} {y} 0");
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_keep_every_digit_and_names_stay_one_field() {
        let corners = [Corner::isotropic(Point2::new(100.0 / 3.0, 7.0), 0.1)];
        let table = write([("my view.png", Some(&corners[..])), ("b.png", None)]);
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines[0], "# filename x y level");
        assert_eq!(lines[1], "my_view.png 3.3333333333333336e+1 7.0000000000000000e+0 0");
        assert_eq!(lines[2], "b.png - - -");
        let views = read(&table, 1).expect("a table");
        assert_eq!(
            views[0],
            TableView { name: "my_view.png".into(), corners: Some(corners.into()) }
        );
        assert_eq!(views[1], TableView { name: "b.png".into(), corners: None });
        assert_eq!(super::lines("a", Some(&corners), Digits::FourDecimals), "a 33.3333 7.0000 0\n");
    }

    #[test]
    fn a_missing_corner_keeps_its_place() {
        let text = "a 1.0000 2.0000 0\na - - -\na 3.0000 4.0000 0\nb - - -\n";
        let views = read(text, 3).expect("a table");
        let corners = views[0].corners.as_deref().expect("some corners");
        assert_eq!(corners.iter().map(Corner::is_seen).collect::<Vec<_>>(), [true, false, true]);
        assert_eq!(views[1].corners, None);
        let again = lines("a", Some(corners), Digits::FourDecimals)
            + &lines("b", views[1].corners.as_deref(), Digits::FourDecimals);
        assert_eq!(again, text);
    }

    #[test]
    fn a_level_doubles_the_standard_deviation() {
        let views = read("# c\n\nb 1 2 1 # fine\nb 1 2\na 3 4 -\na 3 4 99\n", 2).expect("a table");
        let sigmas: Vec<f64> = views
            .iter()
            .flat_map(|view| view.corners.iter().flatten())
            .map(Corner::sigma_px)
            .collect();
        // Pictures come in the order of their first lines.
        assert_eq!(views[0].name, "b");
        for (sigma, wanted) in sigmas.iter().zip([0.2, 0.1, 0.1, 102.4]) {
            assert!((sigma - wanted).abs() < 1e-12, "{sigma} {wanted}");
        }
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let refused = |text: &str| read(text, 2).expect_err("refused").to_string();
        assert_eq!(refused("# none\n\n"), "the table is empty");
        assert_eq!(refused("a 1 2 0\na 1\n"), "line 2: expected `filename x y level`");
        assert_eq!(refused("a 1 nan 0"), "line 1: \"1\" \"nan\" is not a position in pixels");
        assert_eq!(refused("a 1 1e999 0"), "line 1: \"1\" \"1e999\" is not a position in pixels");
        assert_eq!(refused("\na 1 2 high"), "line 2: \"high\" is not a level");
        assert_eq!(
            refused("a 1 2 0\nb - - -\n"),
            "a has 1 corners, the board has 2: check --board. A missing corner has a line, too, with `-`"
        );
    }
}
