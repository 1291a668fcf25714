use std::fmt::Write;

use super::number::number;
use crate::geometry::Corner;

/// The corners of all views as the table that mrcal and mrgingham read: `filename x y level`, row by row
/// over the board. A view without corners has one line of `-`.
///
/// Fields are separated by spaces, so those of a name become `_`. The level, a number of halvings of the
/// picture, is 0: what else is known of a corner's error the table cannot hold.
pub fn corner_table<'a>(
    views: impl IntoIterator<Item = (&'a str, Option<&'a [Corner]>)>,
) -> String {
    let mut table = String::from("# filename x y level\n");
    for (name, corners) in views {
        let name = name.replace(|c: char| c.is_whitespace() || c == '#', "_");
        // Writing to a string cannot fail.
        let _ = match corners {
            None => writeln!(table, "{name} - - -"),
            Some(corners) => corners.iter().try_for_each(|corner| {
                writeln!(table, "{name} {} {} 0", number(corner.px.x), number(corner.px.y))
            }),
        };
    }
    table
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    #[test]
    fn corners_keep_every_digit_and_names_stay_one_field() {
        let corners = [Corner::isotropic(Point2::new(100.0 / 3.0, 7.0), 0.1)];
        let table = corner_table([("my view.png", Some(&corners[..])), ("b.png", None)]);
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines[0], "# filename x y level");
        assert_eq!(lines[1], "my_view.png 3.3333333333333336e+1 7.0000000000000000e+0 0");
        assert_eq!(lines[2], "b.png - - -");
    }
}
